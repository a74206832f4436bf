"""Array types, by contents and axes.

Axes are components or coefficients first, then links, beams, joints or drives, then designs if there are several, and
positions last, contiguous; `...` denotes the optional designs. If the type does not define the shape, the function's
docstring does.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy import typing
    from numpy.typing import NDArray

    ArrayLike = typing.ArrayLike
    """Numbers convertible to an array."""

    Reals = NDArray[np.float64]
    """Real numbers."""

    Complexes = NDArray[np.complex128]
    """Complex numbers: vectors of the plane."""

    Flags = NDArray[np.bool_]
    """Truth values."""

    Integers = NDArray[np.int64]
    """Numbers of links, joints, positions, ..."""

    Numbers = NDArray[Any]
    """Real or complex numbers, like the argument."""
else:  # importing numpy's types takes as long as ten files of this package
    ArrayLike = Any
    Reals = Complexes = Flags = Integers = Numbers = np.ndarray

Real = float | Reals
"""A real number, or one for each of many designs."""

Complex = complex | Complexes
"""A vector of the plane, or one for each of many designs."""

Columns = Any
"""Real or complex number at each position: shape (..., positions), or a scalar or ZERO if constant.

A stricter type is not possible: numpy's operators have none that accepts arrays, numbers and ZERO.
"""


def of_designs(value: Any) -> Any:
    """Number of a mechanism or its parts, without the axis of positions."""
    return np.asarray(value)[..., 0] if np.ndim(value) else value


def distinct(values: Any) -> Numbers:
    """Return the distinct values in ascending order, like `np.unique` but without its slow import of numpy.ma."""
    ordered = np.sort(np.ravel(values))
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]
