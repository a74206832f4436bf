"""Condition number of a position (amplification of round-off), and marking of singular positions.

Derivation: docs/theory.md, "Accuracy".
"""

from collections.abc import Sequence
from functools import lru_cache, reduce
from typing import Protocol

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Columns, Complexes, Flags, Numbers, Reals
from rigid.closures.closure import Closure
from rigid.closures.displacements import Openings
from rigid.mechanism import Mechanism
from rigid.plane import ZERO, number

SINGULAR = 1e12
"""Condition number above which the velocities and forces of a position are set to nan."""
MIN_REGULAR_SINE = 1e-2  # positions with a larger sine are never singular
MIN_CANCELLATION = 4.0  # cancellation is ignored if the terms are at most this many times larger than the sum
TINY = np.finfo(float).tiny  # replaces a zero divisor


class MotionState(Protocol):
    """The part of a `Motion` that determines the condition number."""

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism."""

    @property
    def closures(self) -> tuple[Closure, ...]:
        """Placed groups."""

    @property
    def angular_velocity(self) -> Reals:
        """Angular velocity of each link [rad/s]."""

    @property
    def turning(self) -> Complexes:
        """i eps - w^2 of each link [1/s^2]."""

    @property
    def sine(self) -> Reals:
        """Smallest sine over all groups."""


def greatest_rotation(closed: Closure, openings: Sequence[tuple[Columns, Columns]]) -> Columns:
    """Return an upper bound on the rotation of a free pin for given openings, shape (..., positions).

    Parameters
    ----------
    openings
        Displacement (complex) and rotation of each cut joint, including the free component of a slider.
    """
    total: Columns = ZERO
    for c, (displacement, rotation) in enumerate(openings):
        per_displacement, per_rotation = _leverage(closed, c)
        total = total + (abs(displacement) * per_displacement + abs(rotation) * per_rotation)
    return number(total)


def greatest_force(closed: Closure, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Return an upper bound on the force at a cut joint for given magnitudes of loads [N], shape (..., positions)."""
    total: Columns = 0.0
    for c, closing in enumerate(closed.cut):
        needed: Columns = 0.0
        for k in range(len(closed.group.free)):
            dual = closing.per_displacement(closed.duals[k, c])
            loads = moment if closed.group.angles[k] else force
            needed = needed + np.abs(dual) * sum(loads[link] for link, _ in closed.group.carried[k])
        total = np.maximum(total, needed)
    return total


def _leverage(closed: Closure, c: int) -> tuple[Columns, Columns]:
    """Return the largest rotation of a free pin per displacement [rad/m], and per rotation, of cut joint c."""
    duals = closed.duals[_pins(closed), c]
    if closed.cut[c].turns:
        return np.abs(duals).max(axis=0, initial=0.0), ZERO
    return np.abs(duals.real).max(axis=0, initial=0.0), np.abs(duals.imag).max(axis=0, initial=0.0)


def _displacement_ratio(mechanism: Mechanism, closed: Closure, c: int) -> Columns:
    """Return the largest displacement of a link end / opening of cut joint c that causes it; at least 1."""
    sizes = extents(mechanism)
    all_duals = (closed.whole or closed).duals
    greatest: Columns = 1.0
    for k in _pins(closed):
        dual = closed.cut[c].per_displacement(all_duals[k, c])
        turned = [sizes[link] for link, _ in closed.group.carried[k]]
        size = reduce(np.maximum, turned)
        if not np.all(size):
            size = reduce(np.maximum, (sizes[link] for link in _links(closed)))
        greatest = np.maximum(greatest, np.abs(dual) * size)
    return greatest


def _pins(closed: Closure) -> list[int]:
    return [k for k, angle in enumerate(closed.group.angles) if angle]


def closure_sine(mechanism: Mechanism, closed: Closure) -> Columns:
    """Return the sine of a group. At a cut slider, a short lever arm also reduces the sine."""
    least = np.abs(closed.sine)
    for c, closing in enumerate(closed.cut):
        if not closing.turns:
            least = np.minimum(least, 1.0 / _displacement_ratio(mechanism, closed, c))
    return least


def _links(closed: Closure) -> list[int]:
    """Return the moving links of a group's joints."""
    return sorted({link for place in closed.joints for link in (place.joint.parent, place.joint.child) if link})


def _greatest(values: Numbers, closed: Closure) -> Reals:
    return np.abs(values[_links(closed)]).max(axis=0)


@lru_cache(maxsize=64)
def extents(mechanism: Mechanism) -> list[Columns]:
    """Return for each link the largest distance of a point from the link's first point [m]."""
    distances = []
    for link in mechanism.links:
        places = list(link.points.values())
        distances.append(np.max(np.broadcast_arrays(0.0, *(np.abs(place - places[0]) for place in places)), axis=0))
    return distances


def may_be_singular(mechanism: Mechanism, closures: Sequence[Closure]) -> bool:
    """Return whether any position may be singular."""
    free = (closed for closed in closures if closed.group.free)
    return any(not closure_sine(mechanism, closed).min() >= MIN_REGULAR_SINE for closed in free)


def condition_numbers(motion: MotionState, openings: tuple[Openings, Openings]) -> list[Columns]:
    """Return the condition number of each group, shape (..., positions). Relative errors are eps times this number.

    At rest, the number is 1/s^2 for the sine s of the group, and larger if an earlier group is nearly singular. At a
    smooth passage through a singular position, the number is r^2 R. Here r is the largest angular velocity that the
    openings allow / the actual angular velocity, and R is the corresponding ratio for `Motion.turning`.

    Parameters
    ----------
    openings
        Openings of the cut joints that `displacements` returns for the velocities, and for the accelerations.
    """
    conditions: list[Columns] = []
    before: Columns = 1.0
    for closed, *lacking in zip(motion.closures, *openings, strict=True):
        if not closed.group.free:
            conditions.append(1.0)
            continue
        narrow = closure_sine(motion.mechanism, closed)
        worst = 1.0 / (before * np.square(narrow))
        if _pins(closed):
            speed, growth = (greatest_rotation(closed, part) for part in lacking)
            omega, turning = (_greatest(values, closed) for values in (motion.angular_velocity, motion.turning))
            cuts = range(len(closed.cut))
            most = reduce(np.maximum, (_displacement_ratio(motion.mechanism, closed, c) for c in cuts))
            faster = np.minimum(speed / np.maximum(omega, TINY), most)
            more = np.minimum((growth + most * np.square(omega)) / np.maximum(turning, TINY), most)
            worst = np.maximum(worst, np.square(faster) * more)
        before = np.minimum(before, narrow)
        conditions.append(worst)
    return conditions


def cancellation_factor(bound: Columns, done: Columns) -> Columns:
    """Return the growth of relative round-off by cancellation: bound / (`MIN_CANCELLATION` done), at least 1.

    `bound` is an upper bound of the magnitude of a result, and `done` is the magnitude itself.
    """
    return np.maximum(1.0, bound / (MIN_CANCELLATION * np.maximum(done, TINY)))


def has_no_result(motion: MotionState, condition: Columns) -> Flags:
    """Return whether each position is near singular, with a condition above SINGULAR, shape (..., positions).

    Forces and deflections at such a position would be mere round-off.
    """
    return (motion.sine < MIN_REGULAR_SINE) & np.logical_not(condition <= SINGULAR)


def without_singular(motion: MotionState, openings: tuple[Openings, Openings]) -> tuple[Closure, ...]:
    """Return the groups with solutions set to nan at positions with a condition number above SINGULAR."""
    groups = []
    for closed, condition in zip(motion.closures, condition_numbers(motion, openings), strict=True):
        singular = np.logical_not(condition <= SINGULAR)
        if np.any(singular) and closed.group.free:
            groups.append(replace(closed, duals=np.where(singular, np.nan, closed.duals), whole=closed))
        else:
            groups.append(closed)
    return tuple(groups)
