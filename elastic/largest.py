"""Value of the largest magnitude over the positions, and its position."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Integers, Numbers, Reals

JUMP_WIDTH = 1e-8  # largest distance between both sides of a jump, relative to the run


@dataclass(frozen=True, eq=False)
class Largest:
    """Values of the largest magnitude over the positions.

    Attributes
    ----------
    value
        Value, with its sign if known, shape (...); nan if no value is known.
    position
        Index of the position; -1 if no value is known.
    xi
        Station on the beam; nan if there is none or it was not requested.
    row
        Index of the row with the largest value, after `largest_row`.
    gain
        Increase of the value at the peak between the positions; zero if not computed.
    """

    value: Reals
    position: Any
    xi: Any = np.nan
    row: Any = 0
    gain: Any = 0.0


def largest(values: Any, counted: Any = None, xi: Any = None) -> Largest:
    """Find the largest magnitude over the last axis (positions), ignoring nan and inf.

    Parameters
    ----------
    values
        Shape (..., positions). Complex values are replaced by their magnitude.
    counted
        Positions to include, bool, shape (..., positions); all by default.
    xi
        Station of each value, shape of `values`.

    Examples
    --------
    >>> largest([[1.0, -3.0, 2.0]])
    Largest(value=array([-3.]), position=array([1]), xi=nan, row=0, gain=0.0)
    """
    values = np.asarray(values)
    values = np.abs(values) if np.iscomplexobj(values) else values
    size = np.abs(values)
    at = size.argmax(axis=-1)
    most = taken(size, at)
    if counted is None and np.isfinite(most).all():
        return Largest(taken(values, at)[()], at, np.nan if xi is None else taken(xi, at)[()])
    good = np.isfinite(size) if counted is None else np.isfinite(size) & counted
    size = np.where(good, size, -1.0)
    at = size.argmax(axis=-1)
    most = taken(size, at)
    known = most >= 0.0
    value = np.where(known, taken(values, at), np.nan)[()]
    place = np.nan if xi is None else np.where(known, taken(xi, at), np.nan)[()]
    return Largest(value, np.where(known, at, -1)[()], place)


def largest_row(rows: Largest, least: bool = False) -> Largest:
    """Combine several rows, shape (rows, ...), to the largest known magnitude, or to the smallest value (`least`)."""
    value = np.asarray(rows.value)
    row = value.argmin(axis=0) if least else np.where(np.isnan(value), -1.0, np.abs(value)).argmax(axis=0)
    wide = (np.broadcast_to(each, value.shape) for each in (rows.value, rows.position, rows.xi, rows.gain))
    value, position, xi, gain = (np.take_along_axis(each, row[None], 0)[0] for each in wide)
    return Largest(value, position, xi, row, gain)


def peak_gain(size: Reals, position: Any, time: Reals, period: float = np.nan) -> Reals:
    """Height above a maximum of the parabola through it and its two neighbours in time.

    It is zero at the ends of a run and at a jump.

    Parameters
    ----------
    size
        Shape (..., positions).
    position
        Index of the maximum, shape (...); -1 if unknown.
    time, period
        Times of the positions, shape (positions,), and period of the cycle if they form one [s].

    Examples
    --------
    >>> time = np.arange(4.0)
    >>> peak_gain(10 - (time - 1.5) ** 2, np.array(1), time)
    array(0.25)
    """
    count, at = len(time), np.maximum(position, 0)
    places = (at - 1) % count, at, (at + 1) % count
    before, here, after = (taken(size, np.broadcast_to(place, size.shape[:-1])) for place in places)
    with np.errstate(invalid="ignore", divide="ignore"):
        left, right = time[places[1]] - time[places[0]], time[places[2]] - time[places[1]]
        left, right = (np.where(step < 0.0, step + period, step) for step in (left, right))
        rise, fall = (here - before) / left, (here - after) / right
        bend = rise + fall
        more = (rise * right - fall * left) ** 2 / (4.0 * bend * (left + right))
        near = np.minimum(left, right) <= JUMP_WIDTH * np.ptp(time)
        limited = np.minimum(more, np.maximum(here - before, here - after) / 4)  # twice the largest gain for even steps
        known = (rise >= 0.0) & (fall >= 0.0) & (bend > 0.0) & ~near & (np.asarray(position) >= 0)
    return np.where(known, limited, 0.0)


def taken(values: Numbers, at: Integers) -> Numbers:
    """Take one value of the last axis per row, faster than `take_along_axis`."""
    flat = values.reshape(-1, values.shape[-1])
    return flat[np.arange(len(flat)), at.ravel()].reshape(at.shape)
