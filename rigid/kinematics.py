"""A mechanism's motion at many positions at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from rigid.arrays import ArrayLike, Columns, Complexes, Numbers, Reals
from rigid.closures.closure import Closure
from rigid.closures.conditioning import closure_sine, condition_numbers, marked, may_be_singular
from rigid.closures.displacements import Openings, displacements
from rigid.decomposition.groups import Structure
from rigid.decomposition.order import structure
from rigid.drive_arrays import drive_arrays, per_position, rate_of
from rigid.joints import JointPlace
from rigid.laws import MotionLaw
from rigid.mechanism import Mechanism
from rigid.plane import ZERO
from rigid.positions.link_positions import place
from rigid.postures import Posture


@dataclass(frozen=True, eq=False)
class Motion:
    """Where every link is, how it moves and accelerates.

    Columns, the last axes of every array, are (positions,) or (designs, positions); links are in the order of
    `mechanism.links`, the ground first.

    Attributes
    ----------
    time
        Time of every position [s], shape (positions,), or (designs, positions) where that differs.
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their derivatives in time, shape (drives, positions), or
        (drives, designs, positions) where designs pass others.
    origin, velocity, acceleration
        Of the origin of every link's axes [m, m/s, m/s^2], complex, shape (links, ..., positions).
    direction
        Unit vector of every link's x' axis, complex, shape (links, ..., positions).
    angular_velocity
        [rad/s], shape (links, ..., positions).
    turning
        i eps - w^2 of every link [1/s^2], complex, shape (links, ..., positions): what multiplies an arm to give the
        acceleration of its end from its root.
    closures
        Per group, what answers for any small displacement or force.
    """

    mechanism: Mechanism
    time: Reals
    drive: Reals
    drive_rate: Reals
    drive_acceleration: Reals
    origin: Complexes
    direction: Complexes
    velocity: Complexes
    acceleration: Complexes
    angular_velocity: Reals
    turning: Complexes
    closures: tuple[Closure, ...]

    def __repr__(self) -> str:
        return f"Motion({self.mechanism!r}, columns {self.columns})"

    @property
    def structure(self) -> Structure:
        """The joints and groups, in the order of solution."""
        return structure(self.mechanism)

    @cached_property
    def places(self) -> tuple[JointPlace, ...]:
        """All joints, placed, in the order of `Structure.joints`."""
        return tuple(place for closed in self.closures for place in closed.joints)

    @property
    def angular_acceleration(self) -> Reals:
        """Of every link [rad/s^2], shape (links, ..., positions)."""
        return self.turning.imag

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the columns: (positions,) or (designs, positions)."""
        return self.turning.shape[1:]

    @cached_property
    def condition(self) -> Reals:
        """By how much round-off grows at a position: errors are of this many eps, shape (..., positions).

        1 at best, infinite where beyond SINGULAR, so that velocities and accelerations of the links behind are nan, and
        nan where the mechanism does not close.
        """
        with np.errstate(all="ignore"):
            worst = reduce(np.maximum, condition_numbers(self, _openings(self)), np.ones(self.columns))
        return np.where(np.isnan(worst) & ~np.isnan(self.sine), np.inf, worst)

    @cached_property
    def may_be_singular(self) -> bool:
        """Whether a position may be singular."""
        return may_be_singular(self.mechanism, self.closures)

    @property
    def sine(self) -> Reals:
        """Least sine at which the links of a group meet, shape (..., positions): 0 where the mechanism is singular.

        Where links slide on each other the distance of their pins over the links' size counts as one.
        """
        free = (closed for closed in self.closures if closed.group.free)
        return reduce(np.minimum, (closure_sine(self.mechanism, closed) for closed in free), np.ones(self.columns))


def motion(
    mechanism: Mechanism,
    drive: ArrayLike,
    drive_rate: ArrayLike = 0.0,
    drive_acceleration: ArrayLike = 0.0,
    time: ArrayLike | None = None,
    near: Posture | None = None,
    lead: Reals | None = None,
) -> Motion:
    """Positions, velocities and accelerations of a mechanism.

    Parameters
    ----------
    mechanism
        Its lengths may have shape (designs, 1).
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their derivatives in time, shapes that broadcast to
        (drives, positions); for a single drive (positions,) will do. Where designs pass other coordinates, or at other
        rates, shapes that broadcast to (drives, designs, positions); coordinates of a single drive.
    time
        Time of every position [s], shape (positions,) or (designs, positions); the numbers of the positions where it is
        left out.
    near
        Where the links nearly are at every position, or at a single one for all: picks the branch in place of the
        drawing, so that the positions need not be neighbours.
    lead
        Coordinates of the drives that are passed between the drawing and the first position, shape (drives, n), where
        the straight way is not meant.

    Raises
    ------
    MechanismError
        The mechanism is not determined by its drives, or the drawing does not tell its branch.

    Examples
    --------
    A crank of 1 m that turns at 2 rad/s: its end moves at 2 m/s.

    >>> from rigid import Link, Mechanism, PinDrive, motion, velocity_of
    >>> links = (Link("ground", {"O": 0}), Link("crank", {"O": 0, "A": 1.0}))
    >>> turning = motion(Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 1}), [0.0, 0.5], 2.0)
    >>> abs(velocity_of(turning, "crank", "A"))
    array([2., 2.])
    """
    order = structure(mechanism)
    if order.surplus:
        from rigid.topology.redundancy import require_fit

        require_fit(mechanism)
    coordinates, rate, rate2, instants = drive_arrays(mechanism, drive, drive_rate, drive_acceleration, time)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        placed, closures = place(mechanism, order, coordinates, near, lead)
        if coordinates.ndim == 2:
            shape = (*mechanism.designs[:-1], coordinates.shape[-1])
        else:
            shape = np.broadcast_shapes(*(value.shape[1:] for value in (coordinates, rate, rate2)), mechanism.designs)
        origin, direction = stacked(placed.origin, shape, complex), stacked(placed.direction, shape, complex)
        return _with_velocities(mechanism, instants, coordinates, rate, rate2, origin, direction, closures)


def with_rates(motion: Motion, drive_rate: ArrayLike, drive_acceleration: ArrayLike = 0.0) -> Motion:
    """The same positions passed at other rates of the drives; arguments as for `motion`."""
    rate, rate2 = (per_position(value, motion.drive) for value in (drive_rate, drive_acceleration))
    here = motion.origin, motion.direction, tuple(closed.whole or closed for closed in motion.closures)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return _with_velocities(motion.mechanism, motion.time, motion.drive, rate, rate2, *here)


def unit_motion(motion: Motion, drive: int) -> Motion:
    """The same positions with one drive moving at rate 1 and no others, so that velocities are influences."""
    return with_rates(motion, np.eye(len(motion.mechanism.drives))[:, drive : drive + 1])


def unit_motions(motion: Motion) -> list[Motion]:
    """As of `unit_motion`, of every drive."""
    return [unit_motion(motion, drive) for drive in range(len(motion.mechanism.drives))]


def _with_velocities(
    mechanism: Mechanism,
    time: Reals,
    drive: Reals,
    rate: Reals,
    rate2: Reals,
    origin: Complexes,
    direction: Complexes,
    closures: tuple[Closure, ...],
    final: bool = False,
) -> Motion:
    """Placed links with their velocities and accelerations; nan at singular positions, once these are marked."""
    velocity, rotation, _ = _velocities(mechanism, closures, rate)
    acceleration, turning, _ = _accelerations(closures, velocity, rotation, rate2)
    shape = direction.shape[1:]
    moving = Motion(
        mechanism,
        time,
        drive,
        rate,
        rate2,
        origin,
        direction,
        stacked(velocity, shape, complex),
        stacked(acceleration, shape, complex),
        stacked([value.imag for value in rotation], shape, float),
        stacked(turning, shape, complex),
        closures,
    )
    if final or not moving.may_be_singular:
        return moving
    with np.errstate(all="ignore"):
        regular = marked(moving, _openings(moving))
    return _with_velocities(mechanism, time, drive, rate, rate2, origin, direction, regular, final=True)


def _openings(motion: Motion) -> tuple[Openings, Openings]:
    """Openings that velocities and accelerations leave to the free joints of every group."""
    velocity, rotation, first = _velocities(motion.mechanism, motion.closures, motion.drive_rate)
    return first, _accelerations(motion.closures, velocity, rotation, motion.drive_acceleration)[2]


def repeated(motion: Motion, columns: tuple[int, ...]) -> Motion:
    """The same motion for each of several designs that move alike; `columns` is its new shape."""

    def wide(value: Any) -> Numbers:
        links = value.shape[:1] if value.ndim > len(motion.columns) else ()
        more = (1,) * (len(columns) - len(motion.columns))
        return np.broadcast_to(value.reshape(*links, *more, *motion.columns), (*links, *columns))

    names = ("origin", "direction", "velocity", "acceleration", "angular_velocity", "turning")
    repeated_arrays: dict[str, Any] = {name: wide(getattr(motion, name)) for name in names}
    return replace(motion, **repeated_arrays)


def stacked(values: Sequence[Columns], shape: tuple[int, ...], kind: type) -> Numbers:
    """One array of shape (len(values), *shape) from columns that may be scalars."""
    result: Numbers = np.empty((len(values), *shape), kind)
    for at, value in enumerate(values):
        result[at] = 0.0 if value is ZERO else value
    return result


def _velocities(
    mechanism: Mechanism, closures: tuple[Closure, ...], rate: Reals
) -> tuple[list[Columns], list[Columns], Openings]:
    """Velocities of the links' origins, i times their angular velocities, and the openings behind these."""
    return displacements(closures, *_driven(closures, rate), [ZERO] * len(mechanism.links))


def _driven(closures: tuple[Closure, ...], rate: Reals) -> tuple[list[Columns], list[Columns]]:
    """Displacement and rotation of every joint's child from its parent that the drives ask for."""
    gaps, turns = [], []
    for hinge in (hinge for closed in closures for hinge in closed.joints):
        asked = hinge.joint.drive is not None
        gap, turn = hinge.driven(hinge.joint.sense * rate_of(rate, hinge.joint.drive)) if asked else (ZERO, ZERO)
        gaps.append(gap)
        turns.append(turn)
    return gaps, turns


def _accelerations(
    closures: tuple[Closure, ...], velocity: list[Columns], rotation: list[Columns], rate2: Reals
) -> tuple[list[Columns], list[Columns], Openings]:
    """Accelerations of the links' origins, i eps - w^2, and the openings behind these.

    Coriolis' acceleration is a gap that the others must close.
    """
    gaps, turns = _driven(closures, rate2)
    for number, hinge in enumerate(hinge for closed in closures for hinge in closed.joints):
        gaps[number] = gaps[number] + hinge.coriolis(velocity, rotation)
    return displacements(closures, gaps, turns, [value * value for value in rotation])


def by_laws(laws: Sequence[MotionLaw], times: Reals) -> tuple[Reals, Reals, Reals]:
    """Coordinates, rates and accelerations of drives that follow laws, each of shape (drives, ..., positions)."""
    coordinates, rates, accelerations = (np.array(part) for part in zip(*(law(times) for law in laws), strict=True))
    return coordinates, rates, accelerations
