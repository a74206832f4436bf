"""The registry of figures: each once, for reports, designs, speeds and limits alike."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any

import numpy as np

from elastic import FIELDS, Section
from elastic.assessment import angle_error
from elastic.largest import Largest, largest_row
from elastic.sampling import displacement_of
from kinelast.figures.cycle import EXTREME_FIELDS, Cycle, drive_words, joint_words, points_of
from kinelast.scene.data import Scene
from kinelast.scene.error import fault, likely
from kinelast.scene.limits import OUTPUT_ERROR, Output
from rigid import transmission_angles
from rigid.constants import mass_moments
from rigid.friction import friction_power, rubbing_joints

SCENE, BEAM, LINK, POINT, JOINT, DRIVE = "scene", "beam", "link", "point", "joint", "drive"
RUBBING, FRICTION = "joint with friction", "scene with friction"
LARGEST, LEAST, MOST, FIXED = "largest magnitude", "least", "most", "the same at all positions"
NAMES = {"w": "deflection", "mises": "stress"}  # of figures that are fields, where not the field's key
HARMONICS = 6  # of the fastest drive, that natural frequencies are held against


@dataclass(frozen=True)
class Figure:
    """A figure of a machine.

    Attributes
    ----------
    key
        By which files name it, as in `[optimize]`; of an item `KEY.ITEM`.
    name
        What it is, in words.
    unit
        SI unit; of every item one where they differ.
    of
        Of which items there is one: the scene, or every beam, link, point, joint, drive; see `items_of`.
    find
        From a cycle to the largest values of the items over the positions, shape (items, ...).
    over
        How it is reduced over positions and items: `LARGEST`, `LEAST`, `MOST` or `FIXED`.
    fields
        Keys of the fields that it takes.
    everywhere
        Whether ill-conditioned positions count too.
    asked
        Whether it is computed only where it is asked for by name.
    error
        From a cycle to how far the items' values may be off, in the figure's unit, shape (items, ...); None where that
        is not known.
    """

    key: str
    name: str
    unit: str | Callable[[Scene], Sequence[str]]
    of: str
    find: Callable[[Cycle], Largest]
    over: str = LARGEST
    fields: tuple[str, ...] = ()
    everywhere: bool = False
    asked: bool = False
    error: Callable[[Cycle], Any] | None = None

    def units(self, scene: Scene) -> list[str]:
        """Of every item."""
        if not isinstance(self.unit, str):
            return [*self.unit(scene)]
        return [self.unit] * len(items_of(scene, self.of))


@dataclass(frozen=True)
class Measure:
    """A figure of some items of a scene, or of all: a number for a design or a speed."""

    name: str
    unit: str
    figure: Figure
    items: tuple[int, ...] | None = None

    def among(self, values: Any) -> Any:
        """Its values among magnitudes of all items, shape (items, ...)."""
        rows = values if self.items is None else values[[*self.items]]
        return largest_row(Largest(rows, -1), self.figure.over == LEAST).value

    def of(self, cycle: Cycle) -> tuple[Any, Any]:
        """Value, and a number that is the same for the same item and position, -1 of no position; shape (...)."""
        known = cycle.of(self.figure)
        count, items = len(known.value), self.items or range(len(known.value))
        rows = known if len(items) == count else _picked(known, items)
        best = largest_row(rows, self.figure.over == LEAST)
        inner = np.take_along_axis(np.broadcast_to(rows.row, np.shape(rows.value)), best.row[None], 0)[0]
        place = (inner * count + np.array(items)[best.row]) * cycle.columns[-1] + best.position
        value = np.abs(best.value) if self.figure.over == LARGEST else best.value
        shape = cycle.columns[:-1]
        return np.broadcast_to(value, shape), np.broadcast_to(np.where(best.position < 0, -1, place), shape)


def _picked(known: Largest, items: Sequence[int]) -> Largest:
    shape, at = np.shape(known.value), [*items]
    parts = (known.value, known.position, known.xi, known.row)
    return Largest(*(np.broadcast_to(part, shape)[at] for part in parts))


def items_of(scene: Scene, of: str) -> list[str]:
    """Names of the items that a figure is of."""
    mechanism = scene.mechanism
    names: dict[str, Callable[[], Iterable[str]]] = {
        SCENE: lambda: [""],
        FRICTION: lambda: [""] * bool(rubbing_joints(mechanism)),
        BEAM: lambda: scene.labels,
        LINK: lambda: [link.name for link in mechanism.links[1:]],
        POINT: lambda: [name for name, _ in points_of(mechanism)],
        JOINT: lambda: [name for name, _ in joint_words(mechanism)],
        RUBBING: lambda: [joint_words(mechanism)[number][0] for number, _ in rubbing_joints(mechanism)],
        DRIVE: lambda: [name for name, *_ in drive_words(mechanism)],
    }
    return [*names[of]()]


def _sole(found: Largest) -> Largest:
    """The largest of the one scene, as that of its only item."""
    return Largest(*(np.asarray(each)[None] for each in (found.value, found.position, found.xi, found.row)))


def whole(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Figures of the scene from its values at every position."""
    return lambda cycle: _sole(cycle.largest(values(cycle)))


def each(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Figures of items from their values at every position."""
    return lambda cycle: cycle.largest(cycle.rows(values(cycle)))


def largest_of(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """The figure of the scene that is the largest of several rows of values at every position."""
    return lambda cycle: _sole(largest_row(cycle.largest(cycle.rows(values(cycle)))))


def fixed(value: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """A figure of the scene that belongs to no position."""
    return lambda cycle: _sole(
        Largest(np.broadcast_to(value(cycle), cycle.columns[:-1]), np.full(cycle.columns[:-1], -1))
    )


def least(values: Any) -> Largest:
    """Least over the positions, the last axis; nan where none is known."""
    known = np.where(np.isnan(values), np.inf, values)
    at = known.argmin(axis=-1)
    value = np.take_along_axis(np.asarray(values), at[..., None], -1)[..., 0]
    return Largest(value, np.where(np.isnan(value), -1, at)[()])


def _along(cycle: Cycle, key: str) -> Largest:
    return cycle.along(key)


def safety_factor(sections: Sequence[Section], stress: Any) -> Any:
    """Yield stress over the largest von Mises stress, shape (beams, ...): infinite without stress, nan if not known."""
    size = np.abs(stress)
    limits = [np.broadcast_to(np.ravel(section.yield_stress), size.shape[1:] or 1) for section in sections]
    limit = np.array(limits, float).reshape(size.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(size > 0.0, limit / size, np.where(np.isnan(size + limit), np.nan, np.inf))


def _safety(cycle: Cycle) -> Largest:
    stress = cycle.along("mises")
    return replace(stress, value=safety_factor(cycle.deflection.sections, stress.value))


def _angle_errors(cycle: Cycle) -> Largest:
    """Of every moving link, at that of its points where it is largest."""
    links = cycle.scene.mechanism.links[1:]
    best = [_angle_error(cycle, link.name) for link in links]
    return Largest(*(np.array([getattr(one, part) for one in best]) for part in ("value", "position", "xi", "row")))


def _angle_error(cycle: Cycle, link: str) -> Largest:
    mechanism = cycle.scene.mechanism
    points = mechanism.links[mechanism.index[link]].points
    return largest_row(cycle.largest(cycle.rows([angle_error(cycle.deflection, link, point) for point in points])))


def _mass(cycle: Cycle) -> Any:
    total: Any = sum(np.real(mass_moments(link)[0]) for link in cycle.scene.mechanism.links[1:])
    return np.ravel(total) if cycle.columns[:-1] else total


def _condition(cycle: Cycle) -> Largest:
    """Of all positions that could be computed, also those that do not count."""
    condition = np.where(cycle.singular, -1.0, cycle.condition)
    at = condition.argmax(axis=-1)
    most = np.take_along_axis(condition, at[..., None], -1)[..., 0]
    return _sole(Largest(np.where(most < 0.0, np.nan, most), np.where(most < 0.0, -1, at)))


def _transmission(cycle: Cycle) -> Largest:
    """Least transmission angle of any dyad; nan where there is none."""
    angles = [one.angle for one in transmission_angles(cycle.motion)]
    if not angles:
        return fixed(lambda _: np.nan)(cycle)
    return _sole(least(np.broadcast_to(reduce(np.minimum, angles), cycle.columns)))


def _fastest(cycle: Cycle) -> Any:
    """Greatest speed of any drive that turns [rad/s], shape (..., 1); 0 where none does."""
    pairs = zip(cycle.motion.mechanism.drives, cycle.motion.drive_rate, strict=True)
    rates = [np.abs(np.broadcast_to(rate, cycle.columns)) for drive, rate in pairs if drive.turns]
    return np.max([np.nanmax(rate, axis=-1, keepdims=True) for rate in rates], axis=0) if rates else np.zeros(1)


def _resonance(cycle: Cycle) -> Any:
    lowest, fastest = cycle.lowest_frequency, _fastest(cycle)
    return np.min([abs(1 - number * fastest / lowest) for number in range(1, HARMONICS + 1)], axis=0)


def _rubbing_units(scene: Scene) -> list[str]:
    return ["N" if name in scene.mechanism.slider_points else "N m" for name in items_of(scene, RUBBING)]


def _feedback(cycle: Cycle) -> Any:
    forces = cycle.deflection.forces
    return np.where(forces.locked, np.nan, np.broadcast_to(forces.feedback, cycle.columns))


def _rubbing(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """A figure of the scene where a joint has friction."""
    return each(lambda cycle: [values(cycle)] if rubbing_joints(cycle.scene.mechanism) else [])


FIGURES: tuple[Figure, ...] = (
    *(
        Figure(NAMES.get(key, key), FIELDS[key].name, FIELDS[key].unit, BEAM, partial(_along, key=key), fields=(key,))
        for key in EXTREME_FIELDS
    ),
    Figure("safety", "yield stress over the largest stress", "1", BEAM, _safety, LEAST, ("mises",)),
    Figure("buckling", "compression over Euler's load", "1", BEAM, each(lambda cycle: cycle.euler_ratio)),
    Figure("displacement", "displacement of a point", "m", POINT,
           each(lambda cycle: [np.abs(one.displacement) for one in cycle.deviations.values()])),
    Figure("along_path", "displacement along the path", "m", POINT,
           each(lambda cycle: [one.along for one in cycle.deviations.values()])),
    Figure("off_path", "displacement off the path", "m", POINT,
           each(lambda cycle: [one.normal for one in cycle.deviations.values()])),
    Figure("angle_error", "error of a link's angle", "rad", LINK, _angle_errors),
    Figure("joint_force", "force in a joint", "N", JOINT,
           each(lambda cycle: [np.abs(force) for force in cycle.deflection.forces.force])),
    Figure("drive_effort", "effort of a drive", lambda scene: [unit for *_, unit in drive_words(scene.mechanism)],
           DRIVE, each(lambda cycle: cycle.efforts)),
    Figure("friction_effort", "effort of friction in a joint", _rubbing_units, RUBBING,
           each(lambda cycle: [*cycle.deflection.forces.friction.values()])),
    Figure("friction_power", "power that friction takes", "W", FRICTION,
           _rubbing(lambda cycle: friction_power(cycle.motion, cycle.deflection.forces))),
    Figure("friction_feedback", "what friction adds to itself", "1", FRICTION, _rubbing(_feedback), everywhere=True),
    Figure("shaking_force", "force on the ground", "N", SCENE,
           whole(lambda cycle: np.abs(cycle.deflection.forces.ground_force))),
    Figure("shaking_moment", "moment on the ground", "N m", SCENE,
           whole(lambda cycle: cycle.deflection.forces.ground_moment)),
    Figure("mass", "mass of the moving links", "kg", SCENE, fixed(_mass), FIXED),
    Figure("condition", "condition number", "1", SCENE, _condition, everywhere=True),
    Figure("transmission_angle", "transmission angle", "rad", SCENE, _transmission, LEAST),
    Figure("reach", "share of the positions that are reached", "1", SCENE,
           fixed(lambda cycle: cycle.reached.mean(axis=-1)), FIXED, asked=True),
    Figure("frequency", "lowest natural frequency", "rad/s", SCENE,
           lambda cycle: _sole(least(cycle.lowest_frequency)), LEAST, asked=True),
    Figure("frequency_ratio", "lowest natural frequency over the speed of the fastest drive", "1", SCENE,
           lambda cycle: _sole(least(cycle.lowest_frequency / _fastest(cycle))), LEAST, asked=True),
    Figure("resonance_distance", "distance of the lowest natural frequency from harmonics of the drive", "1", SCENE,
           lambda cycle: _sole(least(_resonance(cycle))), LEAST, asked=True),
)  # fmt: skip
"""The figures of every scene; those of its output besides, see `output_figures`."""


def output_figures(output: Output | None) -> tuple[Figure, ...]:
    """Figures of the output: its error, and of a link the angles between which it swings [rad], see `_swing`."""
    if output is None:
        return ()
    if output.point:

        def moved(cycle: Cycle) -> Any:
            return displacement_of(cycle.deflection, output.link, output.point)

        return (Figure(OUTPUT_ERROR, "error of the output", "m", SCENE, whole(moved)),)
    swing = partial(_swing, link=output.link)
    return (
        Figure(OUTPUT_ERROR, "error of the output", "rad", SCENE,
               lambda cycle: _sole(_angle_error(cycle, output.link))),
        Figure("output_least", "least angle of the output", "rad", SCENE, lambda cycle: _sole(swing(cycle)[0]), LEAST,
               asked=True),
        Figure("output_most", "greatest angle of the output", "rad", SCENE, lambda cycle: _sole(swing(cycle)[1]), MOST,
               asked=True),
        Figure("output_travel", "travel of the output", "rad", SCENE, fixed(lambda cycle: _travel(*swing(cycle))),
               FIXED, asked=True),
    )  # fmt: skip


def _swing(cycle: Cycle, link: str) -> tuple[Largest, Largest]:
    """Least and greatest angle of a link over the run [rad], counted on from its start.

    Between positions they are those of parabolas through three of them.
    """
    way = np.broadcast_to(cycle.motion.direction[cycle.scene.mechanism.index[link]], cycle.columns)
    turned = np.unwrap(np.angle(np.where(np.isfinite(way), way, 1.0)), axis=-1)
    closed = cycle.scene.run.turn and abs(turned[..., -1:] - turned[..., :1]).max(initial=0.0) < np.pi
    lowest = _top(-turned, closed)
    return replace(lowest, value=-lowest.value), _top(turned, closed)


def _travel(lowest: Largest, highest: Largest) -> Any:
    return highest.value - lowest.value


def _top(values: Any, closed: bool) -> Largest:
    """Greatest value, of the parabola through the greatest and its neighbours, and the position."""
    count = values.shape[-1]
    at = values.argmax(axis=-1)
    sides = [(at + step) % count if closed else np.clip(at + step, 0, count - 1) for step in (-1, 0, 1)]
    before, here, after = (np.take_along_axis(values, side[..., None], -1)[..., 0] for side in sides)
    bend = 2 * here - before - after
    inside = (bend > 0) & (closed | ((at > 0) & (at < count - 1)))
    rise = np.where(inside, (after - before) ** 2 / (8 * np.where(inside, bend, 1.0)), 0.0)
    return Largest(here + rise, at)


def figures_of(output: Output | None) -> tuple[Figure, ...]:
    """All figures of a scene with this output."""
    return (*FIGURES, *output_figures(output))


def measures_of(scene: Scene, figures: Iterable[Figure]) -> dict[str, Measure]:
    """Figures by name: of all items together, where these have one unit, and of every item."""
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
    """Figures by name; one that is none of the table stands for itself.

    Raises
    ------
    SceneError
        There is none of a name.
    """
    for name in names:
        if isinstance(name, str) and name not in table:
            raise fault("", "figures", f'there is no figure "{name}"{likely(name, table)}')
    return [table[name] if isinstance(name, str) else Measure(name.key, str(name.unit), name) for name in names]
