"""Condition of a position: by how much it multiplies round-off; and the marking of singular ones.

Derivation: docs/theory.md, "Accuracy".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, reduce
from typing import Protocol

import numpy as np

from rigid.arrays import Columns, Complexes, Flags, Numbers, Reals
from rigid.closures.closure import Closure
from rigid.closures.displacements import Openings
from rigid.mechanism import Mechanism
from rigid.plane import ZERO, number

SINGULAR = 1e12
"""Condition number beyond which a position is marked, and its velocities and forces are nan."""
REGULAR = 1e-2  # sine from which on no position comes to that
MILD = 4.0  # by how much larger than their sum parts may be without counting
TINY = np.finfo(float).tiny  # instead of a zero to divide by


class MotionState(Protocol):
    """The part of a `Motion` that its condition depends on."""

    @property
    def mechanism(self) -> Mechanism:
        """The moving mechanism."""

    @property
    def closures(self) -> tuple[Closure, ...]:
        """Its groups, placed."""

    @property
    def angular_velocity(self) -> Reals:
        """Of every link [rad/s]."""

    @property
    def turning(self) -> Complexes:
        """i eps - w^2 of every link [1/s^2]."""

    @property
    def sine(self) -> Reals:
        """Least sine at which the links of a group meet."""


def greatest_rotation(closed: Closure, openings: Sequence[tuple[Columns, Columns]]) -> Columns:
    """Greatest rotation of a free pin that openings of the sizes of these could ask for, shape (..., positions).

    Parameters
    ----------
    openings
        Of the cut joints: displacement, complex, and rotation, also those that a slider leaves free.
    """
    total: Columns = ZERO
    for c, (displacement, rotation) in enumerate(openings):
        per_displacement, per_rotation = _leverage(closed, c)
        total = total + (abs(displacement) * per_displacement + abs(rotation) * per_rotation)
    return number(total)


def greatest_force(closed: Closure, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Greatest force at a cut joint [N] that loads of such sizes on the links could ask for, shape (..., positions)."""
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
    """Greatest rotations of free pins per displacement [rad/m], and per rotation, that opens a cut joint."""
    duals = closed.duals[_pins(closed), c]
    if closed.cut[c].turns:
        return np.abs(duals).max(axis=0, initial=0.0), ZERO
    return np.abs(duals.real).max(axis=0, initial=0.0), np.abs(duals.imag).max(axis=0, initial=0.0)


def _multiple(mechanism: Mechanism, closed: Closure, c: int) -> Columns:
    """How many times the displacement that opens a cut joint the ends of the links move that it turns, 1 at least."""
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
    """Sine at which a group meets; where it closes at sliders, also how short the levers of these are for its links."""
    least = np.abs(closed.sine)
    for c, closing in enumerate(closed.cut):
        if not closing.turns:
            least = np.minimum(least, 1.0 / _multiple(mechanism, closed, c))
    return least


def _links(closed: Closure) -> list[int]:
    """The moving links that the joints of a group join."""
    return sorted({link for place in closed.joints for link in (place.joint.parent, place.joint.child) if link})


def _greatest(values: Numbers, closed: Closure) -> Reals:
    greatest: Reals = np.abs(values[_links(closed)]).max(axis=0)
    return greatest


@lru_cache(maxsize=64)
def extents(mechanism: Mechanism) -> list[Columns]:
    """Greatest distance of a link's first point from its others [m]."""
    distances = []
    for link in mechanism.links:
        places = list(link.points.values())
        distances.append(np.max(np.broadcast_arrays(0.0, *(np.abs(place - places[0]) for place in places)), axis=0))
    return distances


def may_be_singular(mechanism: Mechanism, closures: Sequence[Closure]) -> bool:
    """Whether a position may be singular."""
    free = (closed for closed in closures if closed.group.free)
    return any(not closure_sine(mechanism, closed).min() >= REGULAR for closed in free)


def condition_numbers(motion: MotionState, openings: tuple[Openings, Openings]) -> list[Columns]:
    """By how much every group multiplies round-off when it moves: errors are of this many eps, (..., positions).

    1/s^2 where the links come to a stop, more behind another group that is singular. Where they pass smoothly what is
    singular: how much faster they would turn if their openings were not nearly those that need no turning; squared, and
    the same of accelerations.

    Parameters
    ----------
    openings
        Of the velocities and of the accelerations, as from `displacements`.
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
            most = reduce(np.maximum, (_multiple(motion.mechanism, closed, c) for c in cuts))
            faster = np.minimum(speed / np.maximum(omega, TINY), most)
            more = np.minimum((growth + most * np.square(omega)) / np.maximum(turning, TINY), most)
            worst = np.maximum(worst, np.square(faster) * more)
        before = np.minimum(before, narrow)
        conditions.append(worst)
    return conditions


def cancellation_factor(bound: Columns, done: Columns) -> Columns:
    """Growth of the relative round-off of a figure by cancellation: its bound over its size, 1 at least."""
    return np.maximum(1.0, bound / (MILD * np.maximum(done, TINY)))


def ill_conditioned(motion: MotionState, condition: Columns) -> Flags:
    """Whether figures of a condition beyond SINGULAR are next to a singular position, bool, shape (..., positions)."""
    near: Flags = (motion.sine < REGULAR) & np.logical_not(condition <= SINGULAR)
    return near


def marked(motion: MotionState, openings: tuple[Openings, Openings]) -> tuple[Closure, ...]:
    """The groups of a motion, without their figures where the condition is beyond SINGULAR; as they are where none."""
    groups = []
    for closed, condition in zip(motion.closures, condition_numbers(motion, openings), strict=True):
        singular = np.logical_not(condition <= SINGULAR)
        if np.any(singular) and closed.group.free:
            groups.append(replace(closed, duals=np.where(singular, np.nan, closed.duals), whole=closed))
        else:
            groups.append(closed)
    return tuple(groups)
