"""Figures of a machine and their limits: their items, and how the largest or smallest values are found in a cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import Largest, largest_row
from machine import Range
from rigid import Mechanism, structure
from rigid.arrays import Flags, Numbers, Reals
from rigid.kinetostatics import friction_joints

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene

LARGEST, LEAST, MOST, FIXED = "largest magnitude", "least", "most", "the same at all positions"
AVERAGE = "over the time of the cycle"
OUTPUT_ERROR = "output_error"  # key of a figure
NOISE = 1e-12  # largest round-off of a figure, relative to the forces or displacements of the scene
ROUND_OFF = 1e-12  # a limit is met if the figure exceeds it by a smaller fraction, which may be round-off


@dataclass(frozen=True)
class Kind:
    """A kind of item for which a figure has values, such as beams. `names` lists the items of a scene."""

    name: str
    names: Callable[[Scene], Iterable[str]] = field(compare=False, repr=False)

    def __str__(self) -> str:
        return self.name


def items_of(scene: Scene, kind: Kind) -> list[str]:
    """Return the names of the items of a kind in a scene."""
    return _listed(scene, kind.names)


def _lists(_: Scene) -> dict[Callable[[Scene], Iterable[str]], list[str]]:
    """Return a new cache for `_listed`."""
    return {}


def _listed(scene: Scene, function: Callable[[Scene], Iterable[str]]) -> list[str]:
    """Return the names or units of a scene from a function, which is called only once."""
    known = scene.once(_lists)
    if function not in known:
        known[function] = [*function(scene)]
    return known[function]


def _rubbing(scene: Scene) -> list[str]:
    names = joint_words(scene.mechanism)
    return [names[number][0] for number, _ in friction_joints(scene.mechanism)]


SCENE = Kind("scene", lambda _: ("",))
STOPPING = Kind("scene that stops", lambda scene: [""] * scene.course.stops)
FRICTION = Kind("scene with friction", lambda scene: [""] * bool(friction_joints(scene.mechanism)))
BEAM = Kind("beam", lambda scene: scene.labels)
LINK = Kind("link", lambda scene: (link.name for link in scene.mechanism.links[1:]))
POINT = Kind("point", lambda scene: (name for name, _ in points_of(scene.mechanism)))
JOINT = Kind("joint", lambda scene: (name for name, _ in joint_words(scene.mechanism)))
RUBBING = Kind("joint with friction", _rubbing)
DRIVE = Kind("drive", lambda scene: drive_names(scene.mechanism))


@dataclass(frozen=True)
class Figure:
    """A figure of a machine.

    Attributes
    ----------
    key
        Name of the figure in files, such as in `[optimize]`. An item of the figure is named `KEY.ITEM`.
    name
        Description of the figure.
    unit
        SI unit, or a function that returns the unit of each item.
    of
        Kind of the items.
    find
        Function that finds the largest values of the items in a cycle, shape (items, ...).
    over
        Reduction over positions and items: `LARGEST`, `LEAST`, `MOST`, `FIXED` or `AVERAGE`.
    fields
        Keys of the fields along the beams from which the figure is computed.
    everywhere
        Whether ill-conditioned positions are included.
    listed
        Whether the figure is in the rows of designs by default.
    asked
        Whether the figure is computed only on request.
    limit
        Key of the figure's limit, under `[limits]` or in the table of a part; empty if there is no such key.
    rigid
        Whether the figure depends only on the rigid motion, which is the same in all theories.
    exact
        Whether the figure is independent of the number of positions.
    here
        Whether the figure describes the given positions, so that no other times may be added.
    whole
        Whether the figure belongs to the whole run, so that it cannot be merged from chunks. This is always true for an
        `AVERAGE`.
    power
        Largest exponent with which the figure grows with the loads. Relative errors are multiplied by it.
    remains_of
        Larger figure to which the convergence tolerance of this figure is relative.
    follows
        Figure in proportion to which this figure changes between theories and times; its change gives the error.
    """

    key: str
    name: str
    unit: str | Callable[[Scene], Sequence[str]]
    of: Kind
    find: Callable[[Cycle], Largest]
    over: str = LARGEST
    fields: tuple[str, ...] = ()
    everywhere: bool = False
    asked: bool = False
    listed: bool = False
    limit: str = ""
    rigid: bool = False
    exact: bool = False
    here: bool = False
    whole: bool = False
    power: float = 1.0
    remains_of: Figure | None = None
    follows: Figure | None = None

    def __hash__(self) -> int:
        return hash(self.key)

    def of_motion(self, scene: Scene) -> bool:
        """Return True if the figure is found from the rigid motion, also at times between the positions."""
        return (self.rigid or not scene.labels) and not self.here

    def units(self, scene: Scene) -> list[str]:
        """Return the unit of each item."""
        if not isinstance(self.unit, str):
            return _listed(scene, self.unit)
        return [self.unit] * len(items_of(scene, self.of))


@dataclass(frozen=True)
class RangeCheck:
    """Check that a quantity is in the range of validity of a formula.

    Attributes
    ----------
    range
        The range of validity.
    of
        Kind of the items, see `items_of`.
    by
        Key of the figure that is checked. It has the same items.
    refuses
        Keys of the figures of the formula, which have the same items. Outside the range, their limits cannot be judged.
    quantity
        Function that computes the checked quantity from the scene and the values of the figure, shape (items, ...).
    """

    range: Range
    of: Kind
    by: str
    refuses: tuple[str, ...]
    quantity: Callable[[Scene, Any], Any] = lambda _, values: values


@dataclass(frozen=True)
class Limit:
    """A bound of a figure.

    Attributes
    ----------
    figure
        Key of the figure.
    bound
        Bound in the SI unit of the figure; an array for many designs.
    least
        Whether it is a lower bound.
    item
        Name of the item, or of the link for a figure of beams; empty for all items.
    unit
        SI unit of the bound; empty if the output may be a length or an angle.
    of
        Kind of the figure's items.
    named
        Whether the limit names its figure, instead of being given by a key under `[limits]` or in the table of a part.
    """

    figure: str
    bound: Any
    least: bool = False
    item: str = ""
    unit: str = ""
    of: Kind = BEAM
    named: bool = False

    @property
    def kind(self) -> str:
        """Key of the limit under [limits]. If the limit names its figure, the key of the figure."""
        return "output" if self.figure == OUTPUT_ERROR and not self.named else self.figure

    def kept(self, value: Any) -> Flags:
        """Return whether values meet the limit, within `ROUND_OFF`. An unknown value does not."""
        spare = ROUND_OFF * np.where(np.isfinite(self.bound), np.abs(self.bound), 0.0)
        return np.asarray(value >= self.bound - spare if self.least else value <= self.bound + spare)

    def used(self, value: Any) -> Reals:
        """Return the utilisation of the limit, above 1 if it is violated. For a positive bound it is a quotient."""
        size = np.maximum(value, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = self.bound / size if self.least else size / self.bound
        return np.where(self.bound > 0.0, share, 1.0 - self.margin(value))

    def margin(self, value: Any) -> Reals:
        """Return distance from the bound / bound, negative if the limit is violated, and 1 for an infinite figure."""
        size = np.where(self.bound == 0.0, 1.0, np.abs(self.bound))
        left = (value - self.bound if self.least else self.bound - value) / size
        return np.where(np.isposinf(left), 1.0, left)


def sole(found: Largest) -> Largest:
    """Add an axis for the only item to the largest values of a scene."""
    return Largest(*(np.asarray(each)[None] for each in vars(found).values()))


class RowSearch:
    """Search for the largest magnitude in each row of values. `Cycle.search` combines several such searches."""

    def rows(self, cycle: Cycle) -> Numbers | None:
        """Return values, shape (items, ..., positions), or None if they need a separate search."""
        raise NotImplementedError

    def __call__(self, cycle: Cycle) -> Largest:
        """Return the largest values of the items."""
        rows = self.rows(cycle)
        assert rows is not None
        return cycle.largest(rows)


@dataclass(frozen=True)
class ValueSearch(RowSearch):
    """Search for the largest magnitude of each item, given its values at every position."""

    values: Callable[[Cycle], Any]

    def rows(self, cycle: Cycle) -> Numbers:
        """Return the values of the items."""
        return cycle.rows(self.values(cycle))


def whole(values: Callable[[Cycle], Any]) -> ValueSearch:
    """Return the search for a figure of the scene, given its values at every position."""
    return ValueSearch(lambda cycle: [values(cycle)])


def each(values: Callable[[Cycle], Any]) -> ValueSearch:
    """Return the search for a figure of items, given their values at every position."""
    return ValueSearch(values)


def least(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return the search for the smallest values of items over the included positions."""

    def find(cycle: Cycle) -> Largest:
        rows = [np.where(cycle.counted, row, np.inf) for row in values(cycle)]
        return cycle.least(np.array(rows).reshape(-1, *cycle.columns))

    return find


def largest_of(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return the search for a figure of the scene that is the largest of several rows of values."""
    return lambda cycle: sole(largest_row(cycle.largest(cycle.rows(values(cycle)))))


def fixed(value: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return the search for a figure of the scene that does not belong to any position."""
    return lambda cycle: sole(
        Largest(np.broadcast_to(value(cycle), cycle.columns[:-1]), np.full(cycle.columns[:-1], -1))
    )


def averaged(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return the search for a figure of items that is one value for the whole cycle, shape (items, ...)."""

    def find(cycle: Cycle) -> Largest:
        found = [np.broadcast_to(each, cycle.columns[:-1]) for each in values(cycle)]
        rows = np.array(found) if found else np.zeros((0, *cycle.columns[:-1]))
        return Largest(rows, np.full(rows.shape, -1))

    return find


def drive_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the drives. If several drives have the same name, all names are numbered."""
    names = [drive.name for drive in mechanism.drives]
    if len(set(names)) < len(names):
        return [f"{name}.{number}" for number, name in enumerate(names, 1)]
    return names


def drive_words(mechanism: Mechanism) -> list[tuple[str, str, str, str]]:
    """Return, for each drive, its name, the word for its coordinate, and the units of its coordinate and effort."""
    kinds = {True: ("angle", "rad", "N m"), False: ("slide", "m", "N")}
    return [(name, *kinds[drive.turns]) for name, drive in zip(drive_names(mechanism), mechanism.drives, strict=True)]


def joint_words(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Return, for each joint, its name and the link on which its stated load acts.

    The opposite load acts on the other link.
    """
    return [(joint.name, mechanism.links[joint.child].name) for joint in structure(mechanism).joints]


def points_of(mechanism: Mechanism) -> Iterator[tuple[str, int]]:
    """Yield every moving point, with the number of a link that contains it."""
    seen = set(mechanism.links[0].points)
    for number, link in enumerate(mechanism.links[1:], 1):
        for point in link.points:
            if point not in seen:
                seen.add(point)
                yield point, number
