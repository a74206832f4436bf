"""Residual vibration after a stop: start of the rest, and settling time."""

import numpy as np

from rigid import Reals
from rigid.arrays import Flags

REST_RATE = 1e-9  # smaller drive rates are round-off, relative to the largest


def rest_from(rates: Reals) -> Flags:
    """True once all drives have stopped for good, shape (..., positions).

    Parameters
    ----------
    rates
        Drive rates, shape (drives, ..., positions).
    """
    greatest = np.abs(rates).max(axis=-1, keepdims=True, initial=0.0)
    moving = (np.abs(rates) > REST_RATE * greatest).any(axis=0)
    later = np.logical_or.accumulate(moving[..., ::-1], axis=-1)[..., ::-1]
    return np.logical_not(later)


def settling_time(time: Reals, apart: Reals, rests: Flags, tolerance: Reals | float) -> Reals:
    """Time from the first instant of rest until a distance stays within a tolerance [s], shape (...).

    Parameters
    ----------
    time
        Instants [s], shape (..., positions) or (positions,).
    apart
        Distance from the rest position, shape (..., positions).
    rests
        See `rest_from`.
    tolerance
        Tolerance in the unit of the distance, scalar or shape (...).

    Returns
    -------
    Time by linear interpolation between instants; inf if the last instant exceeds the tolerance, nan if there is no
    rest.

    Examples
    --------
    A distance that halves every second is within a tenth after log2(10) = 3.32 s:

    >>> time = np.linspace(0.0, 6.0, 601)
    >>> settling_time(time, 0.5**time, time >= 0.0, 0.1).round(3)
    np.float64(3.322)
    """
    time = np.broadcast_to(time, apart.shape)
    beyond = rests & (apart > np.asarray(tolerance)[..., None])
    count = apart.shape[-1]
    last = count - 1 - beyond[..., ::-1].argmax(axis=-1)
    first = rests.argmax(axis=-1)
    at, after, start = last[..., None], np.minimum(last + 1, count - 1)[..., None], first[..., None]
    (here, there), (now, then) = (
        tuple(np.take_along_axis(values, where, -1)[..., 0] for where in (at, after)) for values in (apart, time)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = now + (here - tolerance) / (here - there) * (then - now)
    waited = crossed - np.take_along_axis(time, start, -1)[..., 0]
    settled = np.where(beyond.any(axis=-1), np.where(last == count - 1, np.inf, waited), 0.0)
    return np.where(rests.any(axis=-1), settled, np.nan)
