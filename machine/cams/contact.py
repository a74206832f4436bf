"""Hertz's pressure between cylinders that touch along a line."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.arrays import Real, Reals


def contact_modulus(first: Real, first_poisson: Real, second: Real, second_poisson: Real) -> Real:
    """Modulus of the contact of two materials in plane strain, E* [Pa].

    1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2, of Young's moduli [Pa] and Poisson's ratios.
    """
    modulus: Real = 1.0 / ((1.0 - first_poisson**2) / first + (1.0 - second_poisson**2) / second)
    return modulus


def line_pressure(force: Any, width: Any, curvature: Any, modulus: Any) -> Reals:
    """Greatest pressure between two cylinders [Pa], shape of the force; nan where they pull or do not touch.

    Parameters
    ----------
    force
        That presses them together [N].
    width
        Along which they touch [m].
    curvature
        The sum of their curvatures [1/m], that of a hollow one negative.
    modulus
        E* [Pa], as of `contact_modulus`.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, equation (4.45).

    Examples
    --------
    Roark's coefficient 0.591 for a cylinder on a plane, both of one material with 0.3 as Poisson's ratio:

    >>> modulus = contact_modulus(1.0, 0.3, 1.0, 0.3)
    >>> round(float(line_pressure(1.0, 1.0, 2.0, modulus)), 3)
    0.591
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = np.asarray(force) / width * modulus * curvature / np.pi
        return np.where(inside >= 0.0, np.sqrt(np.maximum(inside, 0.0)), np.nan)
