"""Averages over the time of a run: mean, root mean square, and the energy that is taken and given back."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.arrays import Reals

ALIKE = 1e-6  # share of a step by which steps of time that are alike differ


def mean(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted mean over the last axis.

    Parameters
    ----------
    values
        Shape (..., positions).
    weight
        Time that each stands for, in any unit, shape (positions,) or (..., positions).
    """
    weight = np.broadcast_to(weight, np.shape(values))
    whole: Reals = np.sum(weight * values, axis=-1) / np.sum(weight, axis=-1)
    return whole


def root_mean_square(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted root mean square over the last axis, as of `mean`.

    >>> float(root_mean_square([3.0, 0.0, -3.0]))  # a trapezoidal profile in thirds: peak times the root of 2/3
    2.449...
    """
    square: Reals = np.sqrt(mean(np.abs(values) ** 2, weight))
    return square


def mean_positive(values: Any, weight: Any = 1.0) -> Reals:
    """Weighted mean of the positive part: of a power, times the duration, the energy that is taken."""
    return mean(np.where(np.isnan(values), np.nan, np.maximum(values, 0.0)), weight)


def time_weights(time: Any, period: Any = np.nan) -> Reals:
    """Time that instants stand for [s], shape of the instants: by the trapezoidal rule.

    Parameters
    ----------
    time
        Instants [s], shape (..., positions).
    period
        After which the motion repeats [s]; where the instants are one period whose end, its start, is not repeated,
        it counts between the last and the first of them.
    """
    time = np.asarray(time, float)
    if time.shape[-1] < 2:
        return np.ones_like(time)
    steps = np.diff(time, axis=-1)
    left = period - (time[..., -1:] - time[..., :1])
    around = np.where(np.abs(left - steps[..., -1:]) < ALIKE * steps[..., -1:], left, 0.0)
    steps = np.concatenate([around, steps, around], axis=-1)
    weights: Reals = (steps[..., 1:] + steps[..., :-1]) / 2
    return weights
