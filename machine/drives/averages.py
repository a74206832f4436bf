"""Averages over the time of a run: mean, root mean square, mean positive part."""

from typing import Any

import numpy as np

from rigid.arrays import Reals

MAX_DIFFERENCE = 1e-6  # tolerance of equal time steps, relative to a step


def mean(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted mean over the last axis.

    Parameters
    ----------
    values
        Shape (..., positions).
    weight
        Time weight of each position in any unit, shape (positions,) or (..., positions).
    """
    weight = np.broadcast_to(weight, np.shape(values))
    return np.sum(weight * values, axis=-1) / np.sum(weight, axis=-1)


def root_mean_square(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted root mean square over the last axis, see `mean`.

    >>> float(root_mean_square([3.0, 0.0, -3.0]))  # a trapezoidal profile in thirds: peak times the root of 2/3
    2.449...
    """
    return np.sqrt(mean(np.abs(values) ** 2, weight))


def mean_positive(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted mean of the positive part. For a power, this mean times the duration is the consumed energy."""
    return mean(np.where(np.isnan(values), np.nan, np.maximum(values, 0.0)), weight)


def time_weights(time: Any, period: Any = np.nan) -> Reals:
    """Trapezoidal weights of instants [s], shape of the instants.

    Parameters
    ----------
    time
        Instants [s], shape (..., positions).
    period
        Period of the motion [s]. If the instants cover one period without repeating its start, the interval from the
        last to the first is included.
    """
    time = np.asarray(time, float)
    if time.shape[-1] < 2:
        return np.ones_like(time)
    steps = np.diff(time, axis=-1)
    left = period - (time[..., -1:] - time[..., :1])
    around = np.where(np.abs(left - steps[..., -1:]) < MAX_DIFFERENCE * steps[..., -1:], left, 0.0)
    steps = np.concatenate([around, steps, around], axis=-1)
    return (steps[..., 1:] + steps[..., :-1]) / 2
