"""Measures: named numbers such as the largest deflection of one link, or of all links.

A measure reduces the values of a figure for one or several items to one number.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import Largest, largest_row
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import Scene
from kinelast.scene.parts.fatigue import FATIGUED
from kinelast.values.error import fault, likely
from kinelast.values.figure import BEAM, DRIVE, LARGEST, LEAST, Figure, Limit, items_of
from rigid.arrays import Integers, Reals


class Measure(Struct, frozen=True):
    """A figure of one, several or all items, reduced to a single number for each design or speed.

    `items` is None for all items.
    """

    name: str
    unit: str
    figure: Figure
    items: tuple[int, ...] | None = None

    def among(self, values: Any) -> Reals:
        """Reduce the magnitudes of all items, shape (items, ...), to the extreme value among `self.items`."""
        rows = values if self.items is None else values[[*self.items]]
        return largest_row(Largest(rows, -1), self.figure.over == LEAST).value

    def of(self, cycle: Cycle) -> tuple[Reals, Integers]:
        """Return the values, shape (...), and a number for each value.

        The number identifies the item and the position of the value, and is -1 if it has no position.
        """
        known = cycle.of(self.figure)
        count, items = len(known.value), self.items or range(len(known.value))
        rows = known if len(items) == count else picked(known, items)
        best = largest_row(rows, self.figure.over == LEAST)
        inner = np.take_along_axis(np.broadcast_to(rows.row, np.shape(rows.value)), best.row[None], 0)[0]
        place = (inner * count + np.array(items)[best.row]) * cycle.columns[-1] + best.position
        value = np.abs(best.value) if self.figure.over == LARGEST else best.value
        shape = cycle.columns[:-1]
        return np.broadcast_to(value, shape), np.broadcast_to(np.where(best.position < 0, -1, place), shape)


def picked(known: Largest, items: Sequence[int]) -> Largest:
    """Return the largest values of some items."""
    shape, at = np.shape(known.value), [*items]
    parts = (known.value, known.position, known.xi, known.row, known.gain)
    return Largest(*(np.broadcast_to(part, shape)[at] for part in parts))


def magnitudes(cycle: Cycle, figures: Iterable[Figure]) -> dict[str, Any]:
    """Return the magnitudes of figures for all items, by key. They include the gain of peaks between positions."""
    figures = [*figures]
    cycle.search(figures)
    return {figure.key: cycle.once(_magnitude, figure, cycle.sampled) for figure in figures}


def _magnitude(cycle: Cycle, figure: Figure, _sampled: bool) -> Any:
    found = cycle.of(figure)
    size = np.abs(found.value) if figure.over == LARGEST else found.value
    return size - found.gain if figure.over == LEAST else size + found.gain


def bounded_items(scene: Scene, limit: Limit) -> list[int]:
    """Return the numbers of the items to which a limit applies. A limit on a link applies to all beams of the link."""
    mechanism = scene.mechanism
    of_links = limit.of in (BEAM, FATIGUED) and not limit.named
    names = [mechanism.links[at].name for at, _ in mechanism.beams] if of_links else items_of(scene, limit.of)
    return [number for number, name in enumerate(names) if limit.item in ("", name)]


def measures_of(scene: Scene, figures: Iterable[Figure]) -> dict[str, Measure]:
    """Return the measures of figures by name.

    A figure has a measure for each item and, if its items have the same unit, one for all items.
    """
    return {measure.name: measure for figure in figures for measure in _measures(scene, figure)}


def _measures(scene: Scene, figure: Figure) -> Iterator[Measure]:
    names, units = items_of(scene, figure.of), figure.units(scene)
    if not names:
        return
    if len(set(units)) == 1 and (figure.of != DRIVE or len(names) == 1):
        yield Measure(figure.key, units[0], figure)
    for name in dict.fromkeys(name for name in names if name):
        rows = tuple(number for number, each in enumerate(names) if each == name)
        yield Measure(f"{figure.key}.{name}", units[rows[0]], figure, rows)


def chosen(table: Mapping[str, Measure], names: Iterable[str | Figure]) -> list[Measure]:
    """Return the measures for `names`. A name is looked up in `table`, and a `Figure` gives a new measure.

    Raises
    ------
    SceneError
        No measure has this name.
    """
    for name in names:
        if isinstance(name, str) and name not in table:
            raise fault("", "figures", f'there is no figure "{name}"{likely(name, table)}')
    return [table[name] if isinstance(name, str) else Measure(name.key, str(name.unit), name) for name in names]
