"""Types of arrays.

The order of the axes is: components or coefficients; links (or beams, joints, drives); designs (if there are several);
positions, which are contiguous. In docstrings, `...` in a shape is the optional axis of designs.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy import typing
    from numpy.typing import NDArray

    ArrayLike = typing.ArrayLike
    """Values that numpy converts to an array."""

    Reals = NDArray[np.float64]
    """Real numbers."""

    Complexes = NDArray[np.complex128]
    """Complex numbers, which represent plane vectors."""

    Flags = NDArray[np.bool_]
    """Truth values."""

    Integers = NDArray[np.int64]
    """Integers, such as indices of links, joints or positions."""

    Numbers = NDArray[Any]
    """Real or complex numbers, of the same type as the argument."""
else:  # importing numpy.typing takes as long as ten modules of this package
    ArrayLike = Any
    Reals = Complexes = Flags = Integers = Numbers = np.ndarray

Real = float | Reals
"""A real number, or an array with one number for each design."""

Complex = complex | Complexes
"""A plane vector, or an array with one vector for each design."""

Columns = Any
"""Real or complex values at the positions: an array (..., positions), or a scalar or ZERO if constant.

The type is `Any`, because no type fits numpy's operators for arrays, numbers and ZERO.
"""


def of_designs(value: Any) -> Any:
    """Return a parameter without the axis of positions: shape () or (designs,)."""
    return np.asarray(value)[..., 0] if np.ndim(value) else value


def distinct(values: Any) -> Numbers:
    """Return the distinct values in ascending order, like `np.unique`, but without the slow import of numpy.ma."""
    ordered = np.sort(np.ravel(values))
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]


def without(values: Any, others: Any) -> Numbers:
    """Return the distinct values that are not in `others`, like `np.setdiff1d`, but without importing numpy.ma."""
    kept, left_out = distinct(values), {*np.ravel(others).tolist()}
    return kept[[value not in left_out for value in kept.tolist()]]
