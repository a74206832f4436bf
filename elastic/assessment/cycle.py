"""Largest and rms values over all positions, and the period of a cycle."""

import numpy as np

from elastic.extreme_values import Extreme
from elastic.largest import Largest, largest
from rigid import Motion, Reals
from rigid.arrays import ArrayLike

STEP_TOLERANCE = 1e-9  # steps and speeds with a smaller relative difference count as equal


def over_cycle(values: Extreme | ArrayLike) -> Largest:
    """Return the largest magnitude over the last axis (positions), ignoring singular positions.

    Parameters
    ----------
    values
        Array of shape (..., positions), or an `Extreme` of this shape.

    Examples
    --------
    >>> float(over_cycle([1.0, -3.0, 2.0]).value)
    -3.0
    """
    return largest(values.value, xi=values.xi) if isinstance(values, Extreme) else largest(values)


def rms(values: ArrayLike) -> Reals:
    """Return the root mean square over the last axis (positions), ignoring singular positions."""
    square = np.square(np.abs(np.asarray(values)))
    known = ~np.isnan(square)
    count = known.sum(axis=-1)
    mean = np.where(known, square, 0.0).sum(axis=-1) / np.maximum(count, 1)
    return np.where(count > 0, np.sqrt(mean), np.nan)


def period_of(motion: Motion) -> float:
    """Return the duration of a motion that is one revolution at constant speed in equal steps [s].

    The positions must not include the end point. The result is nan for any other motion.
    """
    rate = motion.drive_rate
    if not len(rate) or rate.shape[-1] < 3 or not all(drive.turns for drive in motion.mechanism.drives):
        return float("nan")
    step = np.diff(motion.drive, axis=-1)
    travel = step[:, :1] * motion.drive.shape[-1]
    turns = np.round(travel / (2 * np.pi))
    even = np.ptp(step, axis=-1) <= STEP_TOLERANCE * np.abs(travel[:, 0])
    steady = np.ptp(rate, axis=-1) <= STEP_TOLERANCE * np.abs(rate[:, 0])
    once = np.abs(turns).min() == 1 and (np.abs(travel - 2 * np.pi * turns) <= STEP_TOLERANCE * np.abs(travel)).all()
    if not (even.all() and steady.all() and once and rate.any()):
        return float("nan")
    periods = travel[:, 0] / rate[:, 0]
    if np.ptp(periods) > STEP_TOLERANCE * abs(periods[0]):
        return float("nan")
    return float(abs(periods[0]))
