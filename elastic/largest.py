"""Largest magnitude over the positions, and the position at which it occurs."""

from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Integers, Numbers, Reals

# two positions that are closer in time than this are the two sides of a jump, relative to the duration of the run; the
# sides of the breaks of a scene are at distances of 1e-8 from the break
JUMP_WIDTH = 4e-8


class Largest(Struct, frozen=True, eq=False):
    """Largest magnitude over the positions.

    Attributes
    ----------
    value
        Value with the largest magnitude, including its sign if known, shape (...); nan if there is no value.
    position
        Index of the position; -1 if there is no value.
    xi
        Station on the beam; nan if it does not apply or was not requested.
    row
        Index of the row with the largest magnitude, set by `largest_row`.
    gain
        Estimated amount by which a peak between the positions exceeds the value; zero if not computed.
    """

    value: Reals
    position: Any
    xi: Any = np.nan
    row: Any = 0
    gain: Any = 0.0


def largest(values: Any, counted: Any = None, xi: Any = None) -> Largest:
    """Find the largest magnitude over the last axis (positions), ignoring nan and infinite values.

    Parameters
    ----------
    values
        Values of shape (..., positions). Complex values are replaced by their magnitudes.
    counted
        Boolean mask of the positions to include, shape (..., positions), by default all.
    xi
        Station of each value, same shape as `values`.

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
    """Return the entry with the largest magnitude over the first axis (rows).

    If `least` is True, return the entry with the smallest value instead.
    """
    value = np.asarray(rows.value)
    row = value.argmin(axis=0) if least else np.where(np.isnan(value), -1.0, np.abs(value)).argmax(axis=0)
    known = (rows.value, rows.position, rows.xi, rows.gain)
    value, position, xi, gain = (
        np.take_along_axis(np.broadcast_to(each, value.shape), row[None], 0)[0] if np.ndim(each) else each
        for each in known
    )
    return Largest(value, position, xi, row, gain)


def peak_gain(size: Reals, position: Any, time: Reals, period: float = np.nan) -> Reals:
    """Estimate by how much a peak between the positions exceeds the largest value at a position.

    The peak is the vertex of the parabola through the largest value and its two neighbours in time. The result is zero
    at the ends of a run and at a jump.

    Parameters
    ----------
    size
        Magnitudes, shape (..., positions).
    position
        Index of the position with the largest value, shape (...); -1 if there is none.
    time, period
        Times of the positions [s], shape (positions,), and the period [s] if the positions form a cycle.

    Examples
    --------
    >>> time = np.arange(4.0)
    >>> peak_gain(10 - (time - 1.5) ** 2, np.array(1), time)
    array(0.25)
    """
    count, at = len(time), np.maximum(position, 0)
    places = (at - 1) % count, at, (at + 1) % count
    before, here, after = (taken(size, np.broadcast_to(place, size.shape[:-1])) for place in places)
    left, right = time[places[1]] - time[places[0]], time[places[2]] - time[places[1]]
    left, right = (np.where(step < 0.0, step + period, step) for step in (left, right))
    more = vertex_gain(before, here, after, left, right)
    with np.errstate(invalid="ignore"):
        # limit for unequal time steps; with equal steps, the vertex exceeds the value by at most half of this limit
        limited = np.minimum(more, np.maximum(here - before, here - after) / 4)
    near = np.minimum(left, right) <= JUMP_WIDTH * np.ptp(time)
    return np.where((more != 0.0) & ~near & (np.asarray(position) >= 0), limited, 0.0)


def vertex_gain(before: Reals, here: Reals, after: Reals, left: Reals, right: Reals) -> Reals:
    """Return by how much the vertex of a parabola exceeds the largest of the three values that determine it.

    `here` is the largest value. `before` and `after` are its neighbours, at the distances `left` and `right` in time.
    The result is zero if `here` is not a maximum.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        rise, fall = (here - before) / left, (here - after) / right
        bend = rise + fall
        more = (rise * right - fall * left) ** 2 / (4.0 * bend * (left + right))
    return np.where((rise >= 0.0) & (fall >= 0.0) & (bend > 0.0), more, 0.0)


def taken(values: Numbers, at: Integers) -> Numbers:
    """Return one value per row: the value with the index `at` on the last axis. Faster than `take_along_axis`."""
    flat = values.reshape(-1, values.shape[-1])
    return flat[np.arange(len(flat)), at.ravel()].reshape(at.shape)
