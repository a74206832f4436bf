"""Parsed tables whose numbers stand for many designs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinelast.designs.base import Base
from kinelast.scene.format import SceneTable
from kinelast.scene.quantities import Direction, Size
from kinelast.scene.shapes import Sizes
from kinelast.scene.units import Quantity
from kinelast.scene.variables import Place, replaced, within_bounds
from rigid.plane import unit


@dataclass(frozen=True, eq=False)
class Rows:
    """Some of the designs: their rows among all, and their values, shape (designs, paths)."""

    rows: Any
    values: Any

    def without(self, rows: Any) -> Rows:
        """The others."""
        kept = ~np.isin(self.rows, rows)
        return Rows(self.rows[kept], self.values[kept])


def table_with(base: Base, group: Rows) -> SceneTable:
    """Tables of designs that agree in the numbers that cannot be arrays; their first row is the scene as it stands.

    Where no number is an array, all the designs are one, and the tables those of a single scene.

    Raises
    ------
    SceneError
        A number that they agree in cannot stand there.
    """
    apart = {place.variable.path: group.values[0, k] for k, place in enumerate(base.places) if not base.on_axis[k]}
    table = base.document.with_values(apart).table
    for k, place in enumerate(base.places):
        if base.on_axis[k]:
            each = np.concatenate([[place.variable.base], group.values[:, k]])[:, None]
            table = replaced(table, place.keys, _many(place, each))
    return table


def _many(place: Place, each: Any) -> Any:
    """What stands in a place, for many designs."""
    leaf, own = place.leaf, "" if place.variable.unit == "1" else place.variable.unit
    if isinstance(leaf, Sizes):
        both = Size.many(each, own)
        return Sizes((both, both))
    if isinstance(leaf, Direction):
        way = Direction(complex(np.nan, np.nan))
        way.each = unit(each)
        way.each[0] = complex(leaf)
        return way
    return (type(leaf) if isinstance(leaf, Quantity) else Quantity).many(each, own)


def numbers_at_fault(base: Base, group: Rows) -> Iterator[tuple[Any, Any]]:
    """Rows of designs with a number that cannot stand where it is, and what is wrong with each."""
    fine = np.ones(len(group.rows), bool)
    for k, place in enumerate(base.places):
        if not base.on_axis[k]:
            continue
        values, shown = group.values[:, k], place.variable
        leaf = Size if isinstance(place.leaf, Sizes) else type(place.leaf)
        known = issubclass(leaf, Quantity)
        wrong = fine & ~(leaf.holds(values) if known else within_bounds(base.table, place, values))
        fine &= ~wrong
        at = np.flatnonzero(wrong)
        if len(at):
            expected = leaf.expected if known else "a number"
            said = [
                f"{shown.path}: expected {expected}, {leaf.bound(value) if known else 'within its bounds'}, "
                f"got {value:g}{'' if shown.unit == '1' else ' ' + shown.unit}"
                for value in values[at]
            ]
            yield group.rows[at], np.array(said, object)
