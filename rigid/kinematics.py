"""Motion of a mechanism at many positions at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from rigid.arrays import ArrayLike, Columns, Complex, Complexes, Numbers, Reals
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
    """Positions, velocities and accelerations of all links.

    The last axes of each array, the columns, are (positions,) or (designs, positions). Links are in the order of
    `mechanism.links`, the ground first.

    Attributes
    ----------
    time
        Time of each position [s], shape (positions,), or (designs, positions) if it differs by design.
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their time derivatives, shape (drives, positions), or
        (drives, designs, positions) if they differ by design.
    origin, velocity, acceleration
        Origin of each link's axes and its derivatives [m, m/s, m/s^2], complex, shape (links, ..., positions).
    direction
        Unit vector of each link's x' axis, complex, shape (links, ..., positions).
    angular_velocity
        [rad/s], shape (links, ..., positions).
    turning
        i eps - w^2 of each link [1/s^2], complex, shape (links, ..., positions). Times an arm, it gives the
        acceleration of the arm's end relative to its root.
    closures
        Linearised closure of each group, for small displacements and forces.
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
        """Amplification of round-off: relative errors are about this times eps, (..., positions).

        At least 1. It is infinite beyond SINGULAR, where the velocities and accelerations of the dependent links are
        nan; it is nan if the mechanism does not close.
        """
        with np.errstate(all="ignore"):
            worst = reduce(np.maximum, condition_numbers(self, _openings(self)), np.ones(self.columns))
        return np.where(np.isnan(worst) & ~np.isnan(self.sine), np.inf, worst)

    @cached_property
    def may_be_singular(self) -> bool:
        """Whether a position may be singular."""
        return may_be_singular(self.mechanism, self.closures)

    @cached_property
    def units(self) -> tuple["Motion", ...]:
        """Motions with one drive at rate 1 and the others at rest; they give influence coefficients."""
        return tuple(with_rates(self, rates[:, None]) for rates in np.eye(len(self.mechanism.drives)))

    @property
    def sine(self) -> Reals:
        """Smallest sine of the angle between links of a group, (..., positions): 0 if singular.

        For links that slide on each other, the distance of their pins relative to the links' size replaces the sine.
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
        Lengths may have shape (designs, 1).
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their time derivatives, in shapes that broadcast to (drives,
        positions); (positions,) is sufficient for a single drive. If they differ between designs, the shapes broadcast
        to (drives, designs, positions), and the coordinates are those of a single drive.
    time
        Time of each position [s], shape (positions,) or (designs, positions); by default the position numbers.
    near
        Approximate posture at each position, or one for all. It selects the branch instead of the drawing, so that the
        positions need not be neighbours.
    lead
        Drive coordinates between the drawing and the first position, shape (drives, n), for a path that is not
        straight.

    Raises
    ------
    MechanismError
        The drives do not determine the mechanism, or the drawing does not determine its branch.

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
    """Positions of all links without their velocities; see `motion`."""
    return _placed(mechanism, drive_arrays(mechanism, drive, 0.0, 0.0, None)[:1], None, None)[0]


def _placed(
    mechanism: Mechanism, drives: Sequence[Reals], near: Posture | None, lead: Reals | None
) -> tuple[Posture, tuple[Closure, ...]]:
    """Place all links; `drives`: coordinates of the drives, and rates that may differ by design."""
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
    """Same positions with other drive rates; see `motion` for the arguments."""
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
    """Add velocities and accelerations to placed links; nan at singular positions."""
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
    """Velocities and accelerations of the free joints of every group."""
    velocity, rotation, first = _velocities(motion.mechanism, motion.closures, motion.drive_rate)
    return first, _accelerations(motion.closures, velocity, rotation, motion.drive_acceleration)[2]


def repeated(motion: Motion, columns: tuple[int, ...]) -> Motion:
    """Repeat a motion for several designs that share it; `columns`: new shape."""

    def wide(value: Any) -> Numbers:
        links = value.shape[:1] if value.ndim > len(motion.columns) else ()
        more = (1,) * (len(columns) - len(motion.columns))
        return np.broadcast_to(value.reshape(*links, *more, *motion.columns), (*links, *columns))

    names = ("origin", "direction", "velocity", "acceleration", "angular_velocity", "turning")
    repeated_arrays: dict[str, Any] = {name: wide(getattr(motion, name)) for name in names}
    return replace(motion, **repeated_arrays)


def stacked(values: Sequence[Columns], shape: tuple[int, ...], kind: type) -> Numbers:
    """Stack columns that may be scalars to an array of shape (len(values), *shape)."""
    result: Numbers = np.empty((len(values), *shape), kind)
    for at, value in enumerate(values):
        result[at] = 0.0 if value is ZERO else value
    return result


def _velocities(
    mechanism: Mechanism, closures: tuple[Closure, ...], rate: Reals
) -> tuple[list[Columns], list[Columns], Openings]:
    """Velocities of the origins, i times angular velocities, and rates of free joints."""
    return displacements(closures, *_driven(closures, rate), [ZERO] * len(mechanism.links))


def _driven(closures: tuple[Closure, ...], rate: Reals) -> tuple[list[Columns], list[Columns]]:
    """Prescribed displacement and rotation of each joint's child from its parent."""
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
    """Accelerations of the origins, i eps - w^2, and second rates of free joints.

    The Coriolis acceleration enters as a gap that the other joints close.
    """
    gaps, turns = _driven(closures, rate2)
    for number, hinge in enumerate(hinge for closed in closures for hinge in closed.joints):
        gaps[number] = gaps[number] + hinge.coriolis(velocity, rotation)
    return displacements(closures, gaps, turns, [value * value for value in rotation])


def by_laws(laws: Sequence[MotionLaw], times: Reals) -> tuple[Reals, Reals, Reals]:
    """Evaluate drive laws: coordinates, rates, accelerations, each (drives, ..., positions)."""
    coordinates, rates, accelerations = (np.array(part) for part in zip(*(law(times) for law in laws), strict=True))
    return coordinates, rates, accelerations


def _at(motion: Motion, link: str | int, point: str | Complex) -> tuple[int, Complexes]:
    """Link number, and the arm from its origin to a point, in ground axes."""
    at = motion.mechanism.index[link] if isinstance(link, str) else link
    local = motion.mechanism.links[at].points[point] if isinstance(point, str) else point
    return at, motion.direction[at] * local


def position_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Position of a link's point, by name or in link axes [m], complex, (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.origin[at] + arm


def velocity_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Velocity of a link's point [m/s], complex, shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.velocity[at] + 1j * motion.angular_velocity[at] * arm


def acceleration_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Acceleration of a link's point [m/s^2], complex, shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.acceleration[at] + motion.turning[at] * arm
