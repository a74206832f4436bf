"""Types of arrays, by their contents and their axes.

Axes are components or coefficients first, then links, beams, joints or drives, then designs where there are several,
and positions last, contiguous; `...` stands for the designs, where there are any. A shape that the type leaves open is
in the docstring of the function.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy import typing
    from numpy.typing import NDArray

    ArrayLike = typing.ArrayLike
    """Numbers that make an array."""

    Reals = NDArray[np.float64]
    """Real numbers."""

    Complexes = NDArray[np.complex128]
    """Complex numbers: vectors of the plane."""

    Flags = NDArray[np.bool_]
    """Truth values."""

    Integers = NDArray[np.int64]
    """Numbers of links, joints, positions, ..."""

    Numbers = NDArray[Any]
    """Real or complex numbers, as the function is asked with."""
else:  # numpy's types take as long to load as ten files of ours
    ArrayLike = Any
    Reals = Complexes = Flags = Integers = Numbers = np.ndarray

Real = float | Reals
"""A real number, or one for each of many designs."""

Complex = complex | Complexes
"""A vector of the plane, or one for each of many designs."""

Columns = Any
"""A real or complex number at every position: shape (..., positions), or a scalar or ZERO where it is the same at all.

No closer type, for numpy's own operators have none that takes arrays, numbers and ZERO alike.
"""

ColumnShape = tuple[int, ...]
"""Shape of the columns: (positions,) or (designs, positions)."""


def of_designs(value: Any) -> Any:
    """A number of a mechanism or its parts without the axis of positions, which it has where designs differ in it."""
    return np.asarray(value)[..., 0] if np.ndim(value) else value
