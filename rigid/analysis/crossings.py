"""Zeros of a quantity between the positions of a motion."""

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.analysis.coordinates import Rated
from rigid.arrays import Integers, Reals
from rigid.kinematics import Motion
from rigid.kinematics import motion as compute_motion
from rigid.parts import MechanismError
from rigid.postures import Posture

CLOSING_TOLERANCE = 1e-6  # largest closing error of a cycle, relative to the range of each drive
MAX_STEPS = 60  # maximum number of iterations for a zero
FINAL_STEP = 1e-10  # [intervals] stop after a step this small: the remaining error is below 1e-16


class Intervals(Struct, frozen=True, eq=False):
    """Intervals between neighbouring positions. The drive coordinates are linear in each interval.

    If the motion is a closed cycle, the last interval leads back to the first position.

    Attributes
    ----------
    motion
        Motion of a single design.
    left, right
        Indices of the positions at the ends of each interval, shape (intervals,).
    low, change
        Drive coordinates at the left end of each interval, and change over the interval, shape (drives, intervals)
        each.
    """

    motion: Motion
    left: Integers
    right: Integers
    low: Reals
    change: Reals

    def at(self, number: Integers, part: Reals) -> Motion:
        """Return the motion at fractions `part` (0 to 1) of the intervals `number`, both of shape (n,).

        The time unit is one interval, so rates are per interval.
        """
        near = self.left[number]
        here = Posture(self.motion.mechanism, self.motion.origin[:, near], self.motion.direction[:, near])
        change = self.change[:, number]
        return compute_motion(self.motion.mechanism, self.low[:, number] + part * change, change, 0.0, part, here)

    def rates(self, coordinate: Rated) -> tuple[Reals, Reals]:
        """Return the rates of a coordinate at both ends of each interval; the time unit is one interval."""
        influence = np.array([coordinate.rate(unit) for unit in self.motion.units])
        low, high = ((influence[:, at] * self.change).sum(axis=0) for at in (self.left, self.right))
        return low, high


def intervals(motion: Motion) -> Intervals:
    """Return the intervals between the positions of a motion.

    Raises
    ------
    MechanismError
        If there are several designs, or fewer than two positions.
    """
    if len(motion.columns) != 1 or motion.columns[0] < 2:
        raise MechanismError(f"columns of shape {motion.columns}: expected one design and at least two positions")
    count = motion.columns[0]
    left = np.arange(count if turn_closes(motion) else count - 1)
    right = (left + 1) % count
    change = motion.drive[:, right] - motion.drive[:, left]
    if len(left) == count:
        change[:, -1] = motion.drive[:, -1] - motion.drive[:, -2]
    return Intervals(motion, left, right, motion.drive[:, left], change)


def turn_closes(motion: Motion) -> bool:
    """Return whether one more step, equal to the last, would return all drives to the start (modulo full turns)."""
    drive = motion.drive
    if drive.shape[-1] < 3:
        return False
    step = drive[:, -1] - drive[:, -2]
    beyond = drive[:, -1] + step - drive[:, 0]
    turns = np.array([each.turns for each in motion.mechanism.drives])
    rest = np.where(turns, beyond - 2 * np.pi * np.round(beyond / (2 * np.pi)), beyond)
    extent = np.ptp(drive, axis=-1)
    return bool(
        (np.abs(rest) <= CLOSING_TOLERANCE * np.maximum(extent, 1e-300)).all() and (np.abs(beyond) > extent / 2).any()
    )


def positions(motion: Motion, at: Integers) -> Motion:
    """Select positions of a motion by index."""
    here = Posture(motion.mechanism, motion.origin[:, at], motion.direction[:, at])
    return compute_motion(
        motion.mechanism,
        motion.drive[:, at],
        motion.drive_rate[:, at],
        motion.drive_acceleration[:, at],
        motion.time[at],
        here,
    )


def zeros(function: Callable[[Any], Any], first: Reals, last: Reals) -> Reals:
    """Find zeros of functions in the interval 0 to 1 by Chandrupatla's method, starting with a secant step.

    Parameters
    ----------
    function
        Function from arguments of shape (n,) to values of shape (n,).
    first, last
        Function values at 0 and at 1, which have opposite signs, shape (n,).

    References
    ----------
    T. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without
    using derivatives, Advances in Engineering Software 28 (1997) 145-149.
    """
    a, b, fa, fb = np.ones(len(first)), np.zeros(len(first)), last.copy(), first.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        part = fa / (fa - fb)
        for _ in range(MAX_STEPS):
            step = part * (b - a)
            if not (np.abs(step) > FINAL_STEP).any():
                break
            x = a + step
            fx = function(x)
            same = np.sign(fx) == np.sign(fa)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = x, fx
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            monotonic = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            part = np.where(fa == 0, 0.0, np.where(monotonic, np.clip(quadratic, 0.0, 1.0), 0.5))
    return a + part * (b - a)
