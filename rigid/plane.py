"""Vectors of the plane as complex numbers: the products that numpy does not name.

Quantities that are zero at every position are the float 0.0 and cost nothing: `plus`, `minus` and `times` skip them.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def dot(a: Any, b: Any) -> Any:
    """Scalar product Re(conj(a) b) of two vectors, elementwise."""
    return (np.conj(a) * b).real


def cross(a: Any, b: Any) -> Any:
    """Vector product Im(conj(a) b) of two vectors, elementwise."""
    return (np.conj(a) * b).imag


def is_zero(a: Any) -> bool:
    """Whether a quantity is zero at every position by construction."""
    return type(a) is float and a == 0.0


def plus(a: Any, b: Any) -> Any:
    """a + b."""
    if type(a) is float and a == 0.0:
        return b
    return a if type(b) is float and b == 0.0 else a + b


def minus(a: Any, b: Any) -> Any:
    """a - b."""
    if type(b) is float and b == 0.0:
        return a
    return -b if type(a) is float and a == 0.0 else a - b


def product(a: Any, b: Any) -> Any:
    """a b, both complex; 0.0 where either is."""
    if (type(a) is float and a == 0.0) or (type(b) is float and b == 0.0):
        return 0.0
    return a * b


def times(scale: Any, vector: Any) -> Any:
    """A vector scaled by a real quantity; 0.0 where either is."""
    return 0.0 if is_zero(scale) or is_zero(vector) else scale * vector


def imaginary(a: Any) -> Any:
    """The vector i a of a real array; 0.0 stays."""
    if is_zero(a):
        return 0.0
    if not np.ndim(a):
        return 1j * a
    result = np.zeros(np.shape(a), complex)
    result.imag = a
    return result


def unit(angle: Any) -> Any:
    """Unit vectors exp(i angle), at half the cost of numpy's complex exponential."""
    result = np.empty(np.shape(angle), complex)
    result.real, result.imag = np.cos(angle), np.sin(angle)
    return result
