"""A mechanism's motion at many positions at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.closure import Closure, Columns, displacements, swing
from rigid.mechanism import Complex, Complexes, Mechanism, MechanismError, Reals
from rigid.plane import dot
from rigid.positions import place
from rigid.structure import Structure, structure

SINGULAR = 1e12


@dataclass(frozen=True, eq=False)
class Motion:
    """Where every link is, how it moves and accelerates.

    Columns, the last axes of every array, are (positions,) or (designs, positions); links are in the order of
    `mechanism.links`, the ground first.

    Attributes
    ----------
    time
        Time of every position [s], shape (positions,).
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their derivatives in time, shape (drives, positions).
    origin, velocity, acceleration
        Of the origin of every link's axes [m, m/s, m/s^2], complex, shape (links, ..., positions).
    direction
        Unit vector of every link's x' axis, complex, shape (links, ..., positions).
    angular_velocity, angular_acceleration
        [rad/s, rad/s^2], shape (links, ..., positions).
    condition
        Greatest 1/s^2 of the groups, s the sine at which a dyad meets: 1 at best, infinite at a singular position,
        nan where the mechanism does not close, shape (..., positions).
    closures
        Per group, what answers for any small displacement or force.
    """

    mechanism: Mechanism
    structure: Structure
    time: Reals
    drive: Reals
    drive_rate: Reals
    drive_acceleration: Reals
    origin: Complexes
    direction: Complexes
    velocity: Complexes
    acceleration: Complexes
    angular_velocity: Reals
    angular_acceleration: Reals
    condition: Reals
    closures: tuple[Closure, ...]

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the columns: (positions,) or (designs, positions)."""
        return self.condition.shape


def motion(
    mechanism: Mechanism,
    drive: Any,
    drive_rate: Any = 0.0,
    drive_acceleration: Any = 0.0,
    time: Any = None,
    order: Structure | None = None,
) -> Motion:
    """Positions, velocities and accelerations of a mechanism.

    Parameters
    ----------
    mechanism
        Its lengths may have shape (designs, 1).
    drive, drive_rate, drive_acceleration
        Coordinates of the drives [rad or m] and their derivatives in time, shapes that broadcast to
        (drives, positions); for a single drive (positions,) will do.
    time
        Time of every position [s], shape (positions,); the numbers of the positions where it is left out.
    order
        The mechanism's structure where it is known already.

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
    order = order or structure(mechanism)
    count = len(mechanism.drives)
    coordinates = np.atleast_1d(np.asarray(drive, float))
    coordinates = coordinates.reshape(count, -1) if coordinates.ndim == 1 else coordinates
    if len(coordinates) != count:
        raise MechanismError(f"{len(coordinates)} drive coordinates were given for {count} drive(s)")
    rate, rate2 = (
        np.broadcast_to(np.reshape(value, (count, -1)) if np.ndim(value) == 1 else value, coordinates.shape)
        for value in (drive_rate, drive_acceleration)
    )
    instants = np.arange(coordinates.shape[-1], dtype=float) if time is None else np.asarray(time, float)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        placed, closures = place(mechanism, order, coordinates)
        velocity, angular_velocity = _rates(mechanism, closures, rate)
        acceleration, angular_acceleration = _accelerations(mechanism, closures, velocity, angular_velocity, rate2)
        smallest = np.minimum.reduce([np.abs(sine) for sine in placed.sine]) if placed.sine else 1.0
        condition = 1.0 / np.square(smallest)
    shape = np.broadcast_shapes(coordinates.shape[1:], *(np.shape(value) for value in placed.origin))
    return Motion(
        mechanism,
        order,
        instants,
        coordinates,
        rate,
        rate2,
        stacked(placed.origin, shape, complex),
        stacked(placed.direction, shape, complex),
        stacked(velocity, shape, complex),
        stacked(acceleration, shape, complex),
        stacked(angular_velocity, shape, float),
        stacked(angular_acceleration, shape, float),
        np.broadcast_to(condition, shape),
        closures,
    )


def stacked(values: Sequence[Columns], shape: tuple[int, ...], kind: type) -> Any:
    """One array of shape (len(values), *shape) from columns that may be scalars."""
    result = np.empty((len(values), *shape), kind)
    for number, value in enumerate(values):
        result[number] = value
    return result


def _rates(mechanism: Mechanism, closures: tuple[Closure, ...], rate: Any) -> tuple[list[Columns], list[Columns]]:
    """Velocities of the links' origins and angular velocities."""
    gaps: list[Columns] = []
    turns: list[Columns] = []
    for hinge in (hinge for closed in closures for hinge in closed.joints):
        value = hinge.joint.sense * rate[hinge.joint.drive] if hinge.joint.drive is not None else 0.0
        gaps.append(0.0 if hinge.along is None or hinge.joint.drive is None else value * hinge.along)
        turns.append(value if hinge.along is None else 0.0)
    return displacements(closures, len(mechanism.links), gaps, turns)


def _accelerations(
    mechanism: Mechanism, closures: tuple[Closure, ...], velocity: Any, angular_velocity: Any, rate2: Any
) -> tuple[list[Columns], list[Columns]]:
    """Accelerations of the links' origins and angular accelerations.

    The parts of the accelerations that the velocities fix (towards the centre, and of Coriolis) are gaps that the
    others must close.
    """
    square = [0.0 if isinstance(value, float) else np.square(value).astype(complex) for value in angular_velocity]
    gaps: list[Columns] = []
    turns: list[Columns] = []
    for hinge in (hinge for closed in closures for hinge in closed.joints):
        joint = hinge.joint
        parent, child = joint.parent, joint.child
        gap = _product(square[child], hinge.arm_child) - _product(square[parent], hinge.arm_parent)
        value = joint.sense * rate2[joint.drive] if joint.drive is not None else 0.0
        if hinge.along is not None:
            turning = angular_velocity[child]
            if not isinstance(turning, float):
                opened = velocity[child] + swing(turning, hinge.arm_child)
                opened = opened - velocity[parent] - swing(angular_velocity[parent], hinge.arm_parent)
                gap = gap + 2j * turning * (dot(hinge.along, opened) * hinge.along)
            gap = gap + value * hinge.along
        gaps.append(gap)
        turns.append(value if hinge.along is None else 0.0)
    return displacements(closures, len(mechanism.links), gaps, turns)


def _product(rate: Columns, arm: Columns) -> Columns:
    return 0.0 if isinstance(rate, float) or (np.ndim(arm) == 0 and arm == 0) else rate * arm


def _at(motion: Motion, link: str | int, point: str | Complex) -> tuple[int, Complexes]:
    """A link's number and the arm from its origin to one of its points, in the ground's axes."""
    number = motion.mechanism.index[link] if isinstance(link, str) else link
    local = motion.mechanism.links[number].points[point] if isinstance(point, str) else point
    return number, motion.direction[number] * local


def position_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Place of a link's point [m], complex, shape (..., positions); `point` is a name or a place in the link's axes."""
    number, arm = _at(motion, link, point)
    return motion.origin[number] + arm


def velocity_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Velocity of a link's point [m/s], complex, shape (..., positions)."""
    number, arm = _at(motion, link, point)
    return motion.velocity[number] + 1j * motion.angular_velocity[number] * arm


def acceleration_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Acceleration of a link's point [m/s^2], complex, shape (..., positions)."""
    number, arm = _at(motion, link, point)
    spin = motion.angular_velocity[number]
    return motion.acceleration[number] + (1j * motion.angular_acceleration[number] - spin**2) * arm
