"""The value of largest magnitude over the positions, and its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Integers, Numbers, Reals

SAME = 1e-8  # distance of the two sides of a jump, at most, relative to the run


@dataclass(frozen=True, eq=False)
class Largest:
    """Values of largest magnitude over the positions.

    Attributes
    ----------
    value
        With their signs where they are told, shape (...); nan where none is known.
    position
        Numbers of the positions; -1 where none is known.
    xi
        Where along the beam; nan of values that belong to no place, or whose place was not looked for.
    row
        Which of several rows has it, where these were put together.
    gain
        How much larger, or less, the peak between the positions is; zero if it was not looked for.
    """

    value: Reals
    position: Any
    xi: Any = np.nan
    row: Any = 0
    gain: Any = 0.0


def largest(values: Any, counted: Any = None, xi: Any = None) -> Largest:
    """Largest magnitude over the positions, the last axis, of values that are numbers.

    Parameters
    ----------
    values
        Shape (..., positions). Of complex ones the magnitude is given.
    counted
        Which positions count, bool, shape (..., positions); all where left out.
    xi
        Where along the beam they are, shape of `values`.

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
    """The largest magnitude of several rows, shape (rows, ...), of those that are known; or the least where all are."""
    value = np.asarray(rows.value)
    row = value.argmin(axis=0) if least else np.where(np.isnan(value), -1.0, np.abs(value)).argmax(axis=0)
    wide = (np.broadcast_to(each, value.shape) for each in (rows.value, rows.position, rows.xi, rows.gain))
    value, position, xi, gain = (np.take_along_axis(each, row[None], 0)[0] for each in wide)
    return Largest(value, position, xi, row, gain)


def peak_gain(size: Reals, position: Any, time: Reals, period: float = np.nan) -> Reals:
    """How much higher the parabola through the greatest of some sizes and its neighbours in time is.

    Zero at the ends of a run, and next to an instant as near as the two sides of a jump.

    Parameters
    ----------
    size
        Shape (..., positions).
    position
        Of the greatest, shape (...); -1 if none is known.
    time, period
        Of the positions, shape (positions,), and of the cycle that they close [s].

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
        near = np.minimum(left, right) <= SAME * np.ptp(time)
        limited = np.minimum(more, np.maximum(here - before, here - after) / 4)  # twice the most of even instants
        known = (rise >= 0.0) & (fall >= 0.0) & (bend > 0.0) & ~near & (np.asarray(position) >= 0)
    return np.where(known, limited, 0.0)


def taken(values: Numbers, at: Integers) -> Numbers:
    """Values at one place of the last axis for every row, faster than `take_along_axis`."""
    flat = values.reshape(-1, values.shape[-1])
    picked: Numbers = flat[np.arange(len(flat)), at.ravel()].reshape(at.shape)
    return picked
