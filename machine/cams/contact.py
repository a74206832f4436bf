"""Hertzian pressure of a line contact between cylinders."""

from typing import Any

import numpy as np

from machine.ranges import Range
from rigid.arrays import Real, Reals

HERTZ_RANGE = Range(
    "pressure of a cam", "pressure over yield stress", "Johnson, Contact Mechanics 1985, equation (6.4)", most=1.67,
    outside="the softer body yields below its surface: use a harder material or a wider contact",
)  # fmt: skip
"""Hertz pressure for which elastic contact holds."""


def contact_modulus(first: Real, first_poisson: Real, second: Real, second_poisson: Real) -> Real:
    """Return the contact modulus E* of two materials in plane strain [Pa].

    1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2, with Young's moduli [Pa] and Poisson's ratios.
    """
    return 1.0 / ((1.0 - first_poisson**2) / first + (1.0 - second_poisson**2) / second)


def line_pressure(force: Any, width: Any, curvature: Any, modulus: Any) -> Reals:
    """Return the largest pressure between two cylinders [Pa], shape of the force; nan without compression.

    Parameters
    ----------
    force
        Compressive force [N].
    width
        Length of the line of contact [m].
    curvature
        Sum of both curvatures [1/m], negative for a concave surface.
    modulus
        E* [Pa], see `contact_modulus`.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, equation (4.45). Range: `HERTZ_RANGE`.

    Examples
    --------
    Roark's coefficient is 0.591 for a cylinder on a plane of the same material, with Poisson's ratio 0.3:

    >>> modulus = contact_modulus(1.0, 0.3, 1.0, 0.3)
    >>> round(float(line_pressure(1.0, 1.0, 2.0, modulus)), 3)
    0.591
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = np.asarray(force) / width * modulus * curvature / np.pi
        return np.where(inside >= 0.0, np.sqrt(np.maximum(inside, 0.0)), np.nan)
