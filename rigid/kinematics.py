"""Motion of a mechanism, computed for many positions at once."""

from collections.abc import Sequence
from functools import cached_property, reduce
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import ArrayLike, Columns, Complex, Complexes, Flags, Numbers, Reals
from rigid.closures.closure import Closure
from rigid.closures.conditioning import SINGULAR, closure_sine, condition_numbers, may_be_singular, without_singular
from rigid.closures.displacements import Openings, displacements
from rigid.decomposition.groups import Structure
from rigid.decomposition.order import structure
from rigid.joints import JointPlace
from rigid.laws import MotionLaw
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.plane import ZERO
from rigid.positions.link_positions import place
from rigid.postures import Posture


class Motion(Struct, frozen=True, eq=False, dict=True):
    """Positions, velocities and accelerations of all links of a mechanism.

    The last axes of each array, (positions,) or (designs, positions), are together called its columns. The links are
    in the order of `mechanism.links`, which starts with the ground.

    Attributes
    ----------
    time
        Time of each position [s], shape (positions,), or (designs, positions) if the times differ
        between designs.
    drive, drive_rate, drive_acceleration
        Drive coordinates [rad or m] and their time derivatives, shape (drives, positions), or (drives, designs,
        positions) if the values differ between designs.
    origin, velocity, acceleration
        Origin of each link's axes and its time derivatives (complex) [m, m/s, m/s^2], shape (links, ..., positions).
    direction
        Unit vector of each link's x axis (complex), shape (links, ..., positions).
    angular_velocity
        Angular velocity of each link [rad/s], shape (links, ..., positions).
    turning
        i eps - w^2 of each link (complex) [1/s^2], with the angular acceleration eps and the angular velocity w, shape
        (links, ..., positions). This factor times a vector on the link is the acceleration of the end of the vector
        relative to its start.
    closures
        Factorised linear equations of each group of links (see `rigid.decomposition`). Velocities, accelerations,
        elastic displacements and joint forces follow from them.
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
        """Joints and groups, in the order of solution."""
        return structure(self.mechanism)

    @cached_property
    def places(self) -> tuple[JointPlace, ...]:
        """All placed joints, in the order of `Structure.joints`."""
        return tuple(place for closed in self.closures for place in closed.joints)

    @property
    def angular_acceleration(self) -> Reals:
        """Angular acceleration of each link [rad/s^2], shape (links, ..., positions)."""
        return self.turning.imag

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the columns: (positions,) or (designs, positions)."""
        return self.turning.shape[1:]

    @cached_property
    def condition(self) -> Reals:
        """Amplification of round-off, at least 1, shape (..., positions).

        This is the largest condition number of all groups of links. Relative errors are at most about 50 times this
        number times the machine precision (2e-16), and usually much smaller. If the condition number of a group exceeds
        `rigid.SINGULAR`, `condition` is infinite, and the velocities and accelerations of the links of this group, and
        of links that depend on them, are nan. `condition` is nan if the mechanism does not close.
        """
        with np.errstate(all="ignore"):
            worst = reduce(np.maximum, condition_numbers(self, _openings(self)), np.ones(self.columns))
        return np.where(np.isnan(worst) & ~np.isnan(self.sine), np.inf, worst)

    @property
    def singular(self) -> Flags:
        """Whether each position is singular or out of reach: `condition` exceeds `rigid.SINGULAR` or is nan."""
        return np.logical_not(self.condition <= SINGULAR)

    @cached_property
    def may_be_singular(self) -> bool:
        """Whether any position may be singular."""
        return may_be_singular(self.mechanism, self.closures)

    @cached_property
    def units(self) -> tuple["Motion", ...]:
        """For each drive, the motion with this drive at unit rate and all others at rest (influence coefficients)."""
        return tuple(with_rates(self, rates[:, None]) for rates in np.eye(len(self.mechanism.drives)))

    @property
    def sine(self) -> Reals:
        """Distance from a singular position, from 0 (singular) to 1, shape (..., positions).

        It is the smallest of the values of all groups of links. The value of two links on pins is the sine of the
        transmission angle. A loop with a slider is cut at the slider: its value is at most (small gap at the cut) /
        (displacement that this gap causes at the ends of the links).
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
    """Compute the positions, velocities and accelerations of a mechanism.

    Parameters
    ----------
    mechanism
        Mechanism. Its lengths may have shape (designs, 1).
    drive, drive_rate, drive_acceleration
        Drive coordinates [rad or m] and their time derivatives, which broadcast to (drives, positions). For a single
        drive, (positions,) is sufficient. Values that differ between designs broadcast to (drives, designs, positions);
        coordinates may differ only if there is a single drive.
    time
        Time of each position [s], shape (positions,) or (designs, positions) (default: 0, 1, 2, ...).
    near
        Approximate posture at each position, or one posture for all positions. If given, it selects the branch
        at each position, and successive positions may be far apart. By default, the branch is followed from
        `mechanism.drawing`, the approximate positions of the points at the start.
    lead
        Drive coordinates along the path from `mechanism.drawing` to the first position, shape (drives, n) (default: a
        straight path).

    Raises
    ------
    MechanismError
        If the drives do not determine the motion, or `mechanism.drawing` does not determine the branch.

    Examples
    --------
    The end of a 1 m crank that turns at 2 rad/s moves at 2 m/s:

    >>> from rigid import Link, Mechanism, PinDrive, motion, velocity_of
    >>> links = (Link("ground", {"O": 0}), Link("crank", {"O": 0, "A": 1.0}))
    >>> turning = motion(Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 1}), [0.0, 0.5], 2.0)
    >>> abs(velocity_of(turning, "crank", "A"))
    array([2., 2.])
    """
    coordinates, rate, rate2, instants = drive_arrays(mechanism, drive, drive_rate, drive_acceleration, time)
    posture, closures = _placed(mechanism, (coordinates, rate, rate2), near, lead)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        here = posture.origin, posture.direction, closures
        return _with_velocities(mechanism, instants, coordinates, rate, rate2, *here)


def postures(mechanism: Mechanism, drive: ArrayLike) -> Posture:
    """Compute the positions of all links, without velocities (see `motion` for those)."""
    return _placed(mechanism, drive_arrays(mechanism, drive, 0.0, 0.0, None)[:1], None, None)[0]


def _placed(
    mechanism: Mechanism, drives: Sequence[Reals], near: Posture | None, lead: Reals | None
) -> tuple[Posture, tuple[Closure, ...]]:
    """Place all links at the drive coordinates `drives[0]`.

    The other entries (rates, accelerations) only determine the number of designs by their shapes.
    """
    order, coordinates = structure(mechanism), drives[0]
    if order.surplus:
        from rigid.topology.planar import require_fit

        require_fit(mechanism)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        placed, closures = place(mechanism, order, coordinates, near, lead)
    if coordinates.ndim == 2:
        shape = (*mechanism.designs[:-1], coordinates.shape[-1])
    else:
        shape = np.broadcast_shapes(*(value.shape[1:] for value in drives), mechanism.designs)
    return Posture(mechanism, *(stacked(part, shape, complex) for part in (placed.origin, placed.direction))), closures


def with_rates(motion: Motion, drive_rate: ArrayLike, drive_acceleration: ArrayLike = 0.0) -> Motion:
    """Return a motion with the same positions and other drive rates (see `motion` for the arguments)."""
    rate, rate2 = (per_position(value, motion.drive) for value in (drive_rate, drive_acceleration))
    here = motion.origin, motion.direction, tuple(closed.whole or closed for closed in motion.closures)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return _with_velocities(motion.mechanism, motion.time, motion.drive, rate, rate2, *here)


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
    """Add velocities and accelerations to placed links, with nan at singular positions."""
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
        regular = without_singular(moving, _openings(moving))
    return _with_velocities(mechanism, time, drive, rate, rate2, origin, direction, regular, final=True)


def _openings(motion: Motion) -> tuple[Openings, Openings]:
    """Return the openings of each group's cut joints, for velocities and for accelerations (see `Openings`)."""
    velocity, rotation, first = _velocities(motion.mechanism, motion.closures, motion.drive_rate)
    return first, _accelerations(motion.closures, velocity, rotation, motion.drive_acceleration)[2]


def repeated(motion: Motion, columns: tuple[int, ...]) -> Motion:
    """Broadcast a motion to several designs. `columns` is the new shape of the columns."""

    def wide(value: Any) -> Numbers:
        links = value.shape[:1] if value.ndim > len(motion.columns) else ()
        more = (1,) * (len(columns) - len(motion.columns))
        return np.broadcast_to(value.reshape(*links, *more, *motion.columns), (*links, *columns))

    names = ("origin", "direction", "velocity", "acceleration", "angular_velocity", "turning")
    repeated_arrays: dict[str, Any] = {name: wide(getattr(motion, name)) for name in names}
    return replace(motion, **repeated_arrays)


def stacked(values: Sequence[Columns], shape: tuple[int, ...], kind: type) -> Numbers:
    """Stack columns or scalars as an array of shape (len(values), *shape)."""
    result: Numbers = np.empty((len(values), *shape), kind)
    for at, value in enumerate(values):
        result[at] = 0.0 if value is ZERO else value
    return result


def _velocities(
    mechanism: Mechanism, closures: tuple[Closure, ...], rate: Reals
) -> tuple[list[Columns], list[Columns], Openings]:
    """Return the velocities of the origins, i times the angular velocities, and the openings of the cut joints."""
    return displacements(closures, *_driven(closures, rate), [ZERO] * len(mechanism.links))


def _driven(closures: tuple[Closure, ...], rate: Reals) -> tuple[list[Columns], list[Columns]]:
    """Return the displacement and rotation of each joint due to rates (or accelerations) `rate` of the drives."""
    gaps, turns = [], []
    for hinge in (hinge for closed in closures for hinge in closed.joints):
        driven = hinge.joint.drive is not None
        gap, turn = hinge.driven(hinge.joint.sense * rate_of(rate, hinge.joint.drive)) if driven else (ZERO, ZERO)
        gaps.append(gap)
        turns.append(turn)
    return gaps, turns


def _accelerations(
    closures: tuple[Closure, ...], velocity: list[Columns], rotation: list[Columns], rate2: Reals
) -> tuple[list[Columns], list[Columns], Openings]:
    """Return the accelerations of the origins, `Motion.turning` of the links, and the openings of the cut joints.

    Coriolis accelerations enter as prescribed gaps.
    """
    gaps, turns = _driven(closures, rate2)
    for number, hinge in enumerate(hinge for closed in closures for hinge in closed.joints):
        gaps[number] = gaps[number] + hinge.coriolis(velocity, rotation)
    return displacements(closures, gaps, turns, [value * value for value in rotation])


def by_laws(laws: Sequence[MotionLaw], times: Reals) -> tuple[Reals, Reals, Reals]:
    """Evaluate drive laws: coordinates, rates and accelerations, each of shape (drives, ..., positions)."""
    coordinates, rates, accelerations = (np.array(part) for part in zip(*(law(times) for law in laws), strict=True))
    return coordinates, rates, accelerations


def _at(motion: Motion, link: str | int, point: str | Complex) -> tuple[int, Complexes]:
    """Return the index of a link, and the vector, in ground axes, from its origin to a point."""
    at = motion.mechanism.index[link] if isinstance(link, str) else link
    local = motion.mechanism.links[at].points[point] if isinstance(point, str) else point
    return at, motion.direction[at] * local


def position_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Return the position of a link's point (complex) [m], shape (..., positions).

    `point` is a name, or coordinates in link axes [m].
    """
    at, arm = _at(motion, link, point)
    return motion.origin[at] + arm


def velocity_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Return the velocity of a link's point (complex) [m/s], shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.velocity[at] + 1j * motion.angular_velocity[at] * arm


def acceleration_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Return the acceleration of a link's point (complex) [m/s^2], shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.acceleration[at] + motion.turning[at] * arm


def drive_arrays(
    mechanism: Mechanism, drive: ArrayLike, rate: ArrayLike, rate2: ArrayLike, time: ArrayLike | None
) -> tuple[Reals, Reals, Reals, Reals]:
    """Convert the arguments of `motion` to arrays (drives, ..., positions), and time to (..., positions)."""
    count = len(mechanism.drives)
    coordinates = np.atleast_1d(np.asarray(drive, float))
    if coordinates.ndim == 1:
        coordinates = coordinates[None] if count == 1 else coordinates[:, None]
    if len(coordinates) != count:
        raise MechanismError(f"{len(coordinates)} drive coordinates were given for {counted(count, 'drive')}")
    if coordinates.ndim == 2 and max(np.ndim(rate), np.ndim(rate2)) > 2:
        coordinates = coordinates[:, None]  # add an axis for designs, because the rates differ
    instants = np.arange(coordinates.shape[-1], dtype=float) if time is None else np.asarray(time, float)
    if instants.shape[-1:] != coordinates.shape[-1:] or instants.ndim >= max(coordinates.ndim, 2):
        raise MechanismError(f"{instants.size} instants were given for {counted(coordinates.shape[-1], 'position')}")
    return coordinates, per_position(rate, coordinates), per_position(rate2, coordinates), instants


def per_position(value: ArrayLike, coordinates: Reals) -> Reals:
    """Broadcast a rate given per drive, position or design to the coordinates' shape."""
    if isinstance(value, float | int) or np.ndim(value) == 0:  # equals np.broadcast_to, but is five times as fast
        return np.ndarray(coordinates.shape, float, np.array(value, float), 0, (0,) * coordinates.ndim)
    if np.ndim(value) == 1:
        value = np.reshape(value, (len(coordinates), -1))
    if coordinates.ndim > np.ndim(value):
        value = np.expand_dims(value, 1)
    return np.broadcast_to(value, np.broadcast_shapes(np.shape(value), coordinates.shape))


def rate_of(rate: Reals, drive: int | None) -> Columns:
    """Return the rate of a drive: a scalar if it is constant, or ZERO if it is zero or there is no drive."""
    if drive is None:
        return ZERO
    row = rate[drive]
    if row.strides[-1] or not row.size:
        return row
    if row.ndim > 1:
        return row[:, :1]
    return float(row.flat[0]) or ZERO
