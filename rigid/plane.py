"""Operations on plane vectors as complex numbers, and a constant zero that costs no computing time."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Reals

ROUND_OFF = 4 * np.finfo(float).eps  # relative error after a few operations


class Zero:
    """A constant zero. Sums and products of arrays with it are not computed.

    Arrays delegate operations with this constant to the methods of this class. `number` converts the constant to 0.0.
    """

    __array_ufunc__ = None
    ndim = 0
    shape = ()

    def __add__(self, other: Columns) -> Columns:
        return other

    def __sub__(self, other: Columns) -> Columns:
        return -other

    def __rsub__(self, other: Columns) -> Columns:
        return other

    def __mul__(self, other: Columns) -> Zero:
        return self

    def __neg__(self) -> Zero:
        return self

    def __abs__(self) -> Zero:
        return self

    def conjugate(self) -> Zero:
        """Return itself."""
        return self

    @property
    def real(self) -> Zero:
        """Return itself."""
        return self

    @property
    def imag(self) -> Zero:
        """Return itself."""
        return self

    def __array__(self, dtype: Any = None, copy: Any = None) -> Reals:
        return np.zeros((), dtype)

    def __float__(self) -> float:
        return 0.0

    def __repr__(self) -> str:
        return "ZERO"

    def __reduce__(self) -> str:
        return "ZERO"

    __radd__ = __add__
    __rmul__ = __truediv__ = __mul__


ZERO: Any = Zero()


def dot(a: Columns, b: Columns) -> Columns:
    """Return the scalar product Re(conj(a) b), elementwise."""
    return (a.conjugate() * b).real


def cross(a: Columns, b: Columns) -> Columns:
    """Return the cross product Im(conj(a) b), elementwise."""
    return (a.conjugate() * b).imag


def imaginary(a: Any) -> Columns:
    """Return i a for a real array, without a complex product."""
    if not np.ndim(a):
        return 1j * a
    result = np.zeros(np.shape(a), complex)
    result.imag = a
    return result


def unit(angle: Any) -> Complexes:
    """Return the unit vectors exp(i angle), at half the cost of numpy's complex exponential."""
    result = np.empty(np.shape(angle), complex)
    result.real, result.imag = np.cos(angle), np.sin(angle)
    return result


def number(value: Columns) -> Columns:
    """Return a value, or 0.0 if it is ZERO."""
    return 0.0 if value is ZERO else value
