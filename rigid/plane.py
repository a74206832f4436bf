"""Vectors of the plane as complex numbers: the two products that numpy does not name."""

from __future__ import annotations

from typing import Any

import numpy as np


def dot(a: Any, b: Any) -> Any:
    """Scalar product Re(conj(a) b) of two vectors, elementwise."""
    return np.real(a) * np.real(b) + np.imag(a) * np.imag(b)


def cross(a: Any, b: Any) -> Any:
    """Vector product Im(conj(a) b) of two vectors, elementwise."""
    return np.real(a) * np.imag(b) - np.imag(a) * np.real(b)
