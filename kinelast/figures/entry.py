"""Entry of a figure: its items, how it is found and reduced, and how it is asked for by name."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from elastic import Largest, largest_row
from kinelast.figures.cycle import Cycle, joint_words, points_of
from kinelast.scene.data import Scene
from kinelast.scene.drives import drive_names
from kinelast.scene.error import fault, likely
from kinelast.scene.limits import Limit
from machine.cams import BOTH, Cam
from rigid.arrays import Integers, Reals
from rigid.kinetostatics import rubbing_joints

SCENE, BEAM, LINK, POINT, JOINT, DRIVE = "scene", "beam", "link", "point", "joint", "drive"
RUBBING, FRICTION = "joint with friction", "scene with friction"
MOTOR, CYLINDER, UNEVEN = "motor", "cylinder", "uneven drive"
BEARING, ROLLING, PLAIN, PIN, EYE = "bearing", "rolling", "plain", "pin", "eye"
CLEARANCE, CLEARANCES = "clearance", "scene with clearance"
CAM, ROLLED, FACED, HELD, PRESSED = "cam", "cam with a roller", "cam with a face", "open cam", "pressed cam"
FATIGUED = "fatigued beam"
STOPPING = "scene that stops"
LARGEST, LEAST, MOST, FIXED = "largest magnitude", "least", "most", "the same at all positions"
AVERAGE = "over the time of the cycle"


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
        How it is reduced over positions and items: `LARGEST`, `LEAST`, `MOST`, `FIXED` or `AVERAGE`.
    fields
        Keys of the fields that it takes.
    everywhere
        Whether ill-conditioned positions count too.
    told
        Whether it stands in a design's row where none is asked for by name.
    asked
        Whether it is computed only where it is asked for by name.
    limit
        Key under `[limits]` that bounds it; empty where none does.
    rigid
        Whether it is of the rigid motion alone, which no theory of the links changes.
    exact
        Whether no number of positions changes it.
    here
        Whether it tells of the positions themselves, so that no other instants belong to it.
    whole
        Whether it is of the whole run, so that those of its parts do not tell it; an `AVERAGE` is.
    power
        Of the loads that it goes with at most, by magnitude: errors that are known as a share count so many times.
    remains_of
        Of what is small beside it, the figure to a share of which the answer is settled.
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
    told: bool = False
    limit: str = ""
    rigid: bool = False
    exact: bool = False
    here: bool = False
    whole: bool = False
    power: float = 1.0
    remains_of: Figure | None = None

    def of_motion(self, scene: Scene) -> bool:
        """Whether it is found in the rigid motion, at instants between the positions too."""
        return (self.rigid or not scene.labels) and not self.here

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

    def among(self, values: Any) -> Reals:
        """Its values among magnitudes of all items, shape (items, ...)."""
        rows = values if self.items is None else values[[*self.items]]
        return largest_row(Largest(rows, -1), self.figure.over == LEAST).value

    def of(self, cycle: Cycle) -> tuple[Reals, Integers]:
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
    parts = (known.value, known.position, known.xi, known.row, known.gain)
    return Largest(*(np.broadcast_to(part, shape)[at] for part in parts))


def magnitudes(cycle: Cycle, figures: Iterable[Figure]) -> dict[str, Any]:
    """Magnitudes of all items of figures by key, with the gain of their peaks between the positions."""
    return {figure.key: _magnitude(cycle.of(figure), figure.over) for figure in figures}


def _magnitude(found: Largest, over: str) -> Any:
    size = np.abs(found.value) if over == LARGEST else found.value
    return size - found.gain if over == LEAST else size + found.gain


def items_of(scene: Scene, of: str) -> list[str]:
    """Names of the items that a figure is of."""
    return [*ITEMS[of](scene)]


def _drives_with(scene: Scene, numbers: Container[int]) -> list[str]:
    return [name for number, name in enumerate(drive_names(scene.mechanism)) if number in numbers]


def _rubbing(scene: Scene) -> list[str]:
    names = joint_words(scene.mechanism)
    return [names[number][0] for number, _ in rubbing_joints(scene.mechanism)]


CAMS: Mapping[str, Callable[[Cam], bool]] = {  # by kind, whether a cam is of it
    CAM: lambda _: True,
    ROLLED: lambda cam: cam.roller is not None,
    FACED: lambda cam: cam.face is not None,
    HELD: lambda cam: cam.flank != BOTH,
    PRESSED: lambda cam: (
        not (
            np.isnan(cam.width).any()
            or np.isnan(cam.modulus).any()
            or (cam.roller is not None and np.equal(cam.radius, 0.0).all())
        )
    ),
}


def cams_with(scene: Scene, kind: str) -> list[str]:
    """Names of the cams of a kind: all, with a roller or a face, no grooves, or with a known pressure of the contact.

    A knife edge has none.
    """
    return [name for name, cam in scene.cams.items() if CAMS[kind](cam)]


def joints_with(scene: Scene, part: str) -> list[str]:
    """Names of the joints that have a part, or are under [bearings] at all."""
    return [name for name, _ in joint_words(scene.mechanism) if has_part(scene, name, part)]


def has_part(scene: Scene, joint: str, part: str) -> bool:
    """Whether a joint by its name has a part, or is a pin under [bearings] at all."""
    parts = scene.bearings.get(joint)
    if parts is None:
        return False
    if part == BEARING:
        return joint not in scene.mechanism.slider_points
    return getattr(parts, part) is not None


ITEMS: Mapping[str, Callable[[Scene], Iterable[str]]] = {
    SCENE: lambda _: ("",),
    STOPPING: lambda scene: [""] * scene.course.stops,
    FRICTION: lambda scene: [""] * bool(rubbing_joints(scene.mechanism)),
    BEAM: lambda scene: scene.labels,
    LINK: lambda scene: (link.name for link in scene.mechanism.links[1:]),
    POINT: lambda scene: (name for name, _ in points_of(scene.mechanism)),
    JOINT: lambda scene: (name for name, _ in joint_words(scene.mechanism)),
    RUBBING: _rubbing,
    DRIVE: lambda scene: drive_names(scene.mechanism),
    MOTOR: lambda scene: _drives_with(scene, scene.motors),
    CYLINDER: lambda scene: _drives_with(scene, scene.cylinders),
    UNEVEN: lambda scene: _drives_with(scene, scene.unevenness),
    **{part: partial(joints_with, part=part) for part in (BEARING, ROLLING, PLAIN, PIN, EYE, CLEARANCE)},
    **{kind: partial(cams_with, kind=kind) for kind in CAMS},
    CLEARANCES: lambda scene: [""] * bool(joints_with(scene, CLEARANCE)),
    FATIGUED: lambda scene: scene.labels if scene.fatigue else (),
}
"""By kind of item, the names of those of a scene."""


def bounded_items(scene: Scene, limit: Limit) -> list[int]:
    """Numbers of the items that a limit holds for: of beams, those of its link where it does not name the figure."""
    mechanism = scene.mechanism
    of_links = limit.of in (BEAM, FATIGUED) and not limit.named
    names = [mechanism.links[at].name for at, _ in mechanism.beams] if of_links else items_of(scene, limit.of)
    return [number for number, name in enumerate(names) if limit.item in ("", name)]


def sole(found: Largest) -> Largest:
    """The largest of the one scene, as that of its only item."""
    return Largest(*(np.asarray(each)[None] for each in vars(found).values()))


def whole(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Figures of the scene from its values at every position."""
    return lambda cycle: sole(cycle.largest(values(cycle)))


def each(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Figures of items from their values at every position."""
    return lambda cycle: cycle.largest(cycle.rows(values(cycle)))


def largest_of(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """The figure of the scene that is the largest of several rows of values at every position."""
    return lambda cycle: sole(largest_row(cycle.largest(cycle.rows(values(cycle)))))


def fixed(value: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """A figure of the scene that belongs to no position."""
    return lambda cycle: sole(
        Largest(np.broadcast_to(value(cycle), cycle.columns[:-1]), np.full(cycle.columns[:-1], -1))
    )


def averaged(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Figures of items that are of the whole cycle, from their values, shape (items, ...)."""

    def find(cycle: Cycle) -> Largest:
        found = [np.broadcast_to(each, cycle.columns[:-1]) for each in values(cycle)]
        rows = np.array(found) if found else np.zeros((0, *cycle.columns[:-1]))
        return Largest(rows, np.full(rows.shape, -1))

    return find


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
