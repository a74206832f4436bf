"""Cross-sections of beams: area, second moments and shear coefficients from dimensions, and tapers between two."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elastic.beams.section import Section, Taper

POISSON = 0.3  # of metals, where none is known
FITTED = 12  # degree of the polynomials that stand for what is none along a taper
ROUND_OFF = 1e-14  # share of the greatest below which a coefficient of a taper is none


@dataclass(frozen=True)
class Shape:
    """Properties of a symmetric cross-section.

    Attributes
    ----------
    area, inertia
        [m^2]; second moment of area about the axis of bending [m^4].
    fibre
        Distance of the outermost fibre from the axis [m].
    peak_shear
        Largest shear stress over the mean one, V/A: at the axis, by V Q/(I b).
    cowper
        a, b, c of the shear coefficient a (1 + nu)/(b + c nu).
    width, round
        Across the plane of motion [m]; whether the outline is an ellipse of that width and the depth, not a rectangle.
    """

    area: float
    inertia: float
    fibre: float
    peak_shear: float = math.nan
    cowper: tuple[float, float, float] = (math.nan, 1.0, 0.0)
    width: float = math.nan
    round: bool = False

    @property
    def gyration(self) -> float:
        """Radius of gyration [m]."""
        return math.sqrt(self.inertia / self.area)

    def shear_coefficient(self, poisson: float) -> float:
        """k in the shear rigidity k G A of Timoshenko's beam, for Poisson's ratio.

        References
        ----------
        Cowper, The shear coefficient in Timoshenko's beam theory, Journal of Applied Mechanics 33 (1966) 335-340.
        """
        a, b, c = self.cowper
        return a * (1 + poisson) / (b + c * poisson)


def rectangle(depth: float, width: float) -> Shape:
    """A rectangle; the depth [m] lies in the plane of motion.

    Examples
    --------
    >>> rectangle(0.006, 0.01).shear_coefficient(0.0)
    0.8333333333333334
    """
    return Shape(width * depth, width * depth**3 / 12, depth / 2, 1.5, (10.0, 12.0, 11.0), width)


def circle(diameter: float) -> Shape:
    """A full circle [m]."""
    return tube(diameter, 0.0)


def tube(outer: float, inner: float) -> Shape:
    """A round tube between two diameters [m], of any thickness.

    Raises
    ------
    ValueError
        The inner diameter is not below the outer one.
    """
    if not np.all((inner >= 0.0) & (inner < outer)):
        raise ValueError(f"a tube's inner diameter of {inner} m is not between 0 and the outer one of {outer} m")
    area = math.pi * (outer**2 - inner**2) / 4
    square = (inner / outer) ** 2
    both = (1 + square) ** 2
    return Shape(
        area,
        area * (outer**2 + inner**2) / 16,
        outer / 2,
        4 / 3 * (outer**2 + outer * inner + inner**2) / (outer**2 + inner**2),
        (6 * both, 7 * both + 20 * square, 6 * both + 12 * square),
        width=outer,
        round=True,
    )


SHAPES: Mapping[str, Callable[..., Shape]] = {"rectangle": rectangle, "circle": circle, "tube": tube}
"""Shapes by their names, each a function of its dimensions."""


def section_of(
    shape: Shape,
    E: float,
    poisson: float | None = None,
    yield_stress: float = math.nan,
    taper: Taper | None = None,
    shear: bool = True,
) -> Section:
    """Section of a beam of one shape and material.

    Parameters
    ----------
    E
        Young's modulus [Pa].
    poisson
        Poisson's ratio where it is known: Timoshenko's beam with Cowper's coefficient.
    yield_stress
        [Pa], for the safety factor.
    taper
        From `tapered`.
    shear
        Whether shear counts; where it does not, what it would change can still be told.
    """
    kGA = math.nan
    if poisson is not None:
        kGA = shape.shear_coefficient(poisson) * E / (2 * (1 + poisson)) * shape.area
    return Section(
        EA=E * shape.area,
        EI=E * shape.inertia,
        kGA=kGA if shear and poisson is not None else math.inf,
        taper=taper,
        area=shape.area,
        inertia=shape.inertia,
        fibre=shape.fibre,
        peak_shear=shape.peak_shear,
        yield_stress=yield_stress,
        shear_rigidity=kGA,
        width=shape.width,
        round=shape.round,
    )


def tapered(
    shape: Callable[..., Shape], start: Sequence[float], end: Sequence[float], poisson: float = 0.0
) -> tuple[Taper, tuple[float, ...]]:
    """Taper of a beam with dimensions that change linearly from one end to the other.

    Area and second moment are polynomials of the second and fourth degree then; the coefficients of shear of a tube
    are none, and interpolated to round-off.

    Parameters
    ----------
    shape
        Gives the shape of dimensions: `rectangle`, `circle`, `tube` or one's own.
    start, end
        Its dimensions at the two ends.
    poisson
        Poisson's ratio, for the shear coefficient.

    Returns
    -------
    The taper, and the polynomial for `Beam.mass_taper`.

    Examples
    --------
    A rectangle that loses half its depth:

    >>> taper, mass = tapered(rectangle, (0.02, 0.01), (0.01, 0.01))
    >>> [round(value, 12) for value in mass], [round(value, 12) for value in taper.EI]
    ([1.0, -0.5], [1.0, -1.5, 0.75, -0.125])
    """
    angles = math.pi * (np.arange(FITTED + 1) + 0.5) / (FITTED + 1)
    stations = (1 - np.cos(angles)) / 2
    first, last = np.asarray(start, float), np.asarray(end, float)
    shapes = [shape(*((1 - xi) * first + xi * last)) for xi in stations]
    whole = shape(*first)

    def along(degree: int, values: Sequence[float], at_start: float) -> tuple[float, ...]:
        if not np.isfinite(values).all():
            return (1.0,)
        found = np.polynomial.Chebyshev.fit(stations, np.asarray(values) / at_start, degree, domain=[0.0, 1.0])
        series = found.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
        series = np.where(np.abs(series) > ROUND_OFF * np.abs(series).max(), series, 0.0)
        top = int(np.flatnonzero(series)[-1])
        return tuple(float(value) for value in series[: top + 1] / series[0])

    area = along(2, [each.area for each in shapes], whole.area)
    factors = [each.area * each.shear_coefficient(poisson) for each in shapes]
    taper = Taper(
        EA=area,
        EI=along(4, [each.inertia for each in shapes], whole.inertia),
        kGA=along(FITTED, factors, whole.area * whole.shear_coefficient(poisson)),
        fibre=along(1, [each.fibre for each in shapes], whole.fibre),
        peak_shear=along(FITTED, [each.peak_shear for each in shapes], whole.peak_shear),
        width=along(1, [each.width for each in shapes], whole.width),
    )
    return taper, area
