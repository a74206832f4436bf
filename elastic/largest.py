"""The value of largest magnitude over the positions, and its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Integers, Numbers, Reals


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
    """

    value: Reals
    position: Any
    xi: Any = np.nan
    row: Any = 0


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
    Largest(value=array([-3.]), position=array([1]), xi=nan, row=0)
    """
    values = np.asarray(values)
    values = np.abs(values) if np.iscomplexobj(values) else values
    size = np.abs(values)
    at = size.argmax(axis=-1)
    most = _taken(size, at)
    if counted is not None or not np.isfinite(most).all():
        good = np.isfinite(size) if counted is None else np.isfinite(size) & counted
        size = np.where(good, size, -1.0)
        at = size.argmax(axis=-1)
        most = _taken(size, at)
    known = most >= 0.0
    value = np.where(known, _taken(values, at), np.nan)[()]
    place = np.nan if xi is None else np.where(known, _taken(xi, at), np.nan)[()]
    return Largest(value, np.where(known, at, -1)[()], place)


def largest_row(rows: Largest, least: bool = False) -> Largest:
    """The largest magnitude of several rows, shape (rows, ...), of those that are known; or the least where all are."""
    value = np.asarray(rows.value)
    row = value.argmin(axis=0) if least else np.where(np.isnan(value), -1.0, np.abs(value)).argmax(axis=0)
    wide = (np.broadcast_to(each, value.shape) for each in (rows.value, rows.position, rows.xi))
    value, position, xi = (np.take_along_axis(each, row[None], 0)[0] for each in wide)
    return Largest(value, position, xi, row)


def _taken(values: Any, at: Integers) -> Numbers:
    taken: Numbers = np.take_along_axis(values, at[..., None], -1)[..., 0]
    return taken
