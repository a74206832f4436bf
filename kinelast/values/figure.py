"""Figures of a machine, i.e. results such as the largest deflection of each link.

Also limits on figures, and functions that find the value of a figure over a cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

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
NOISE = 1e-12  # largest round-off error in a result, relative to the largest force or displacement
ROUND_OFF = 1e-12  # a limit counts as met if it is exceeded by less than this fraction, which may be round-off


@dataclass(frozen=True)
class Kind:
    """A kind of item, such as beams or joints, for each of which a figure (result) has a value.

    `names` is a function that returns the names of the items in a scene. `noun` is the word before the name of an item
    in reports. By default it is `name`.
    """

    name: str
    names: Callable[[Scene], Iterable[str]] = field(compare=False, repr=False)
    noun: str = ""

    def __str__(self) -> str:
        return self.name


def items_of(scene: Scene, kind: Kind) -> list[str]:
    """Return the names of all items of a kind, such as joints, in a scene."""
    return _listed(scene, kind.names)


def _lists(_: Scene) -> dict[Callable[[Scene], Iterable[str]], list[str]]:
    """Return a new cache for `_listed`."""
    return {}


def _listed(scene: Scene, function: Callable[[Scene], Iterable[str]]) -> list[str]:
    """Return the names or units that a function lists for a scene. The function is called only once for each scene."""
    known = scene.once(_lists)
    if function not in known:
        known[function] = [*function(scene)]
    return known[function]


def _rubbing(scene: Scene) -> list[str]:
    names = joint_words(scene.mechanism)
    return [names[number][0] for number, _ in friction_joints(scene.mechanism)]


MACHINE = "machine"
SCENE = Kind("scene", lambda _: ("",), MACHINE)
STOPPING = Kind("scene in which the drives stop", lambda scene: [""] * scene.course.stops, MACHINE)
FRICTION = Kind("scene with friction", lambda scene: [""] * bool(friction_joints(scene.mechanism)), MACHINE)
BEAM = Kind("beam", lambda scene: scene.labels, "link")
LINK = Kind("link", lambda scene: (link.name for link in scene.mechanism.links[1:]))
POINT = Kind("point", lambda scene: (name for name, _ in points_of(scene.mechanism)))
JOINT = Kind("joint", lambda scene: (name for name, _ in joint_words(scene.mechanism)))
RUBBING = Kind("joint with friction", _rubbing, "joint")
DRIVE = Kind("drive", lambda scene: drive_names(scene.mechanism))


class Figure(Struct, frozen=True):
    """A figure of a machine: a result such as the largest deflection, with a value for each item, such as each beam.

    Attributes
    ----------
    key
        Name of the figure in files, such as in `[optimize]`. An item of the figure is named `KEY.ITEM`.
    name
        Name of the figure in words.
    unit
        SI unit, or a function that returns the unit of each item.
    of
        Kind of the items, such as beams or joints.
    find
        Function that finds the value of each item over a cycle, shape (items, ...).
    over
        How values at all positions, and values of all items, are reduced to one value: `LARGEST`, `LEAST`, `MOST`,
        `FIXED` or `AVERAGE`.
    fields
        Keys of the quantities along the beams, such as the stress, from which the figure is computed.
    everywhere
        Whether ill-conditioned positions are included.
    listed
        Whether tables with a row for each design contain the figure by default.
    asked
        Whether the figure is computed only on request.
    limit
        Key of the limit on the figure, under `[limits]` or in the table of a part; empty if there is no such key.
    rigid
        Whether the figure depends only on the rigid motion, which is the same in all theories.
    exact
        Whether the figure is independent of the number of positions.
    here
        Whether the figure refers to the given positions only, so that times may not be added between them.
    whole
        Whether the figure has to be computed from the whole run at once, and not from chunks of the run. This is always
        true for an `AVERAGE`.
    power
        Exponent n of a figure that is proportional to load^n. If items have different exponents, this is the largest.
        Relative errors are multiplied by n.
    exponents
        Function that returns the exponent of each item. None if all items have the exponent `power`.
    remains_of
        Key of a larger figure. If it is given, the convergence tolerance is relative to this larger figure.
    follows
        Key of another figure. If it is given, the error in this figure is estimated from the change in the other
        figure. Both figures change roughly in proportion between theories and between times.
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
    exponents: Callable[[Scene], Sequence[float]] | None = None
    remains_of: Figure | None = None
    follows: Figure | None = None

    def __hash__(self) -> int:
        return hash(self.key)

    def of_motion(self, scene: Scene) -> bool:
        """Return True if the figure follows from the rigid motion alone and is also searched between the positions."""
        return (self.rigid or not scene.labels) and not self.here

    def load_exponent(self, scene: Scene, item: int) -> float:
        """Return the exponent n if the figure of an item is proportional to load^n.

        The exponent is 1 if the figure is independent of the loads.
        """
        return float(self.exponents(scene)[item]) if self.exponents else self.power or 1.0

    def units(self, scene: Scene) -> list[str]:
        """Return the unit of each item."""
        if not isinstance(self.unit, str):
            return _listed(scene, self.unit)
        return [self.unit] * len(items_of(scene, self.of))


class RangeCheck(Struct, frozen=True):
    """Check that a quantity is in the range of validity of a formula.

    Attributes
    ----------
    range
        The range of validity.
    of
        Kind of the items, see `items_of`.
    by
        Key of the figure (a result such as the axial force) from which the checked quantity is computed. Its items are
        of the kind `of`.
    refuses
        Keys of the figures that the formula gives. Their items are of the kind `of`. If the quantity is outside the
        range, a limit on such a figure cannot be judged.
    quantity
        Function that computes the checked quantity from the scene and the values of the figure, shape (items, ...).
    """

    range: Range
    of: Kind
    by: str
    refuses: tuple[str, ...]
    quantity: Callable[[Scene, Any], Any] = lambda _, values: values


class Limit(Struct, frozen=True):
    """An upper or lower limit on a figure, i.e. on a result such as the largest deflection.

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
        SI unit of the bound. It is empty if the limited output may be a length or an angle.
    of
        Kind of the items of the figure.
    named
        Whether the file gives the limit under the name of the figure. Otherwise the limit has a key of its own, under
        `[limits]` or in the table of a part.
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
        """Key of the limit under `[limits]`.

        If the file gives the limit under the name of the figure, it is the key of the figure.
        """
        return "output" if self.figure == OUTPUT_ERROR and not self.named else self.figure

    def kept(self, value: Any) -> Flags:
        """Return whether values meet the limit to within `ROUND_OFF`. An unknown value does not meet it."""
        spare = ROUND_OFF * np.where(np.isfinite(self.bound), np.abs(self.bound), 0.0)
        return np.asarray(value >= self.bound - spare if self.least else value <= self.bound + spare)

    def used(self, value: Any) -> Reals:
        """Return the utilisation of the limit: a number that is above 1 if the limit is violated.

        If the bound is positive, this is the value divided by an upper bound, or a lower bound divided by the value.
        """
        size = np.maximum(value, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = self.bound / size if self.least else size / self.bound
        return np.where(self.bound > 0.0, share, 1.0 - self.margin(value))

    def margin(self, value: Any) -> Reals:
        """Return the distance of values from the bound, divided by the magnitude of the bound.

        It is negative if the limit is violated, and 1 if the distance is infinite.
        """
        size = np.where(self.bound == 0.0, 1.0, np.abs(self.bound))
        left = (value - self.bound if self.least else self.bound - value) / size
        return np.where(np.isposinf(left), 1.0, left)


def sole(found: Largest) -> Largest:
    """Return the largest values of a result that has a single item, with a first axis for this item."""
    return Largest(*(np.asarray(each)[None] for each in astuple(found)))


class RowSearch:
    """Function that finds the largest magnitude in each row of values over a cycle.

    `Cycle.search` evaluates several such functions at once.
    """

    def rows(self, cycle: Cycle) -> Numbers | None:
        """Return values of shape (items, ..., positions), or None if the function has to be called separately."""
        raise NotImplementedError

    def __call__(self, cycle: Cycle) -> Largest:
        """Return the largest values of the items."""
        rows = self.rows(cycle)
        assert rows is not None
        return cycle.largest(rows)


class ValueSearch(RowSearch, Struct, frozen=True):
    """Function that finds the largest magnitude of each item over a cycle, from its values at every position."""

    values: Callable[[Cycle], Any]

    def rows(self, cycle: Cycle) -> Numbers:
        """Return the values of the items."""
        return cycle.rows(self.values(cycle))


def whole(values: Callable[[Cycle], Any]) -> ValueSearch:
    """Return a function that finds the largest magnitude of a result with one value at every position of the scene."""
    return ValueSearch(lambda cycle: [values(cycle)])


def each(values: Callable[[Cycle], Any]) -> ValueSearch:
    """Return a function that finds the largest magnitude of each item, from its values at every position."""
    return ValueSearch(values)


def least(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return a function that finds the smallest value of each item over the positions in `Cycle.counted`."""

    def find(cycle: Cycle) -> Largest:
        rows = [np.where(cycle.counted, row, np.inf) for row in values(cycle)]
        return cycle.least(np.array(rows).reshape(-1, *cycle.columns))

    return find


def largest_of(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return a function that finds the largest magnitude in several rows of values, as one result."""
    return lambda cycle: sole(largest_row(cycle.largest(cycle.rows(values(cycle)))))


def fixed(value: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return a function that returns one value of the whole scene, without a position at which it occurs."""
    return lambda cycle: sole(
        Largest(np.broadcast_to(value(cycle), cycle.columns[:-1]), np.full(cycle.columns[:-1], -1))
    )


def averaged(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return a function that returns one value per item for the whole cycle, such as an average, shape (items, ...)."""

    def find(cycle: Cycle) -> Largest:
        found = [np.broadcast_to(each, cycle.columns[:-1]) for each in values(cycle)]
        rows = np.array(found) if found else np.zeros((0, *cycle.columns[:-1]))
        return Largest(rows, np.full(rows.shape, -1))

    return find


def drive_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the drives.

    If several drives have the same name, all drives get a number after their name.
    """
    names = [drive.name for drive in mechanism.drives]
    if len(set(names)) < len(names):
        return [f"{name}.{number}" for number, name in enumerate(names, 1)]
    return names


def drive_words(mechanism: Mechanism) -> list[tuple[str, str, str, str]]:
    """Return, for each drive, its name, the word for its coordinate, and the units of its coordinate and effort."""
    kinds = {True: ("angle", "rad", "N m"), False: ("slide", "m", "N")}
    return [(name, *kinds[drive.turns]) for name, drive in zip(drive_names(mechanism), mechanism.drives, strict=True)]


def joint_words(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Return, for each joint, its name and the link on which the stated force and moment act.

    The opposite force and moment act on the other link.
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
