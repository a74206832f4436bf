"""Tapered beams: functions in place of the powers of xi, and pieces on which they are polynomials to round-off."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.polynomial.polynomial import polyroots, polyval

from elastic.arrays import Coefficients
from elastic.beams.section import Section, Taper
from rigid.arrays import Reals

DEGREE = 14  # of the polynomials on a piece, more for bending moments beyond the third degree
HIGHEST = 20  # which it comes to: powers make a value's round-off 6^degree times as large
ELLIPSE = 16.0  # sum of half axes, the piece's ends as foci, that no pole may lie within: 16^-15 is below round-off
SHORTEST = 2.0**-40  # of a piece: a rigidity that all but vanishes at a beam's end
SETTLED = 50.0  # natural logarithm of what Gauss' quadrature leaves: below round-off, poles of high order counted
PRISMATIC = Taper()


def taper_functions(
    section: Section, stations: Sequence[float] | Reals, powers: int
) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Functions that stand in place of the powers of xi in the fields of a tapered beam.

    With f = 1/(rigidity relative to the start), for k = 0, 1, ...: in u `(k+1) int s^k f_EA ds`, in phi the same with
    EI, in w by bending `(k+1)(k+2) int (xi-s) s^k f_EI ds`, in w by shear `(k+1) int s^k f_kGA ds`, from 0 to xi, by
    Gauss' quadrature with as many points as bring it to round-off.

    Returns
    -------
    Four arrays of shape (powers, stations); xi^(k+1), xi^(k+1), xi^(k+2), xi^(k+1) for a prismatic beam.
    """
    xi = np.asarray(stations, float)
    taper = section.taper or PRISMATIC
    k = np.arange(powers)[:, None, None]
    results = []
    for polynomial, twice in ((taper.EA, False), (taper.EI, False), (taper.EI, True), (taper.kGA, False)):
        nodes, weights = _gauss(polynomial, powers)
        t = nodes[None, None, :]
        softness = 1.0 / polyval(xi[:, None] * nodes, polynomial)
        if twice:
            integrand = (k + 1) * (k + 2) * t**k * (1 - t)
            results.append((integrand * softness * weights).sum(-1) * xi ** (k[..., 0] + 2))
        else:
            results.append(((k + 1) * t**k * softness * weights).sum(-1) * xi ** (k[..., 0] + 1))
    return results[0], results[1], results[2], results[3]


def _gauss(polynomial: tuple[float, ...], powers: int) -> tuple[Reals, Reals]:
    """Gauss-Legendre points on [0, 1] that integrate 1/polynomial to round-off: more, the nearer its zeros are."""
    nearest = _ellipse(polynomial, 0.0, 1.0)
    count = powers + (0 if np.isinf(nearest) else int(np.ceil(SETTLED / 2 / np.log(nearest))))
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


def _ellipse(polynomial: tuple[float, ...], low: float, high: float) -> float:
    """Sum of the half axes of the ellipse about an interval on which the polynomial's nearest zero lies."""
    roots = (2 * polyroots(polynomial).astype(complex) - low - high) / (high - low)
    return float(np.abs(roots + np.sqrt(roots - 1) * np.sqrt(roots + 1)).min(initial=np.inf))


@lru_cache(maxsize=256)
def piece_ends(section: Section) -> tuple[float, ...]:
    """Where the pieces of a beam end in xi, 0 the first: halved until its compliance is a polynomial on each.

    A function whose nearest pole lies on an ellipse with half axes of sum r is interpolated by a polynomial of degree n
    to r^-(n+1) (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2).
    """
    taper = section.taper or PRISMATIC

    def cut(low: float, high: float) -> list[float]:
        near = min(_ellipse(polynomial, low, high) for polynomial in (taper.EA, taper.EI, taper.kGA))
        if near >= ELLIPSE or high - low <= SHORTEST:
            return [high]
        middle = (low + high) / 2
        return cut(low, middle) + cut(middle, high)

    return (0.0, *cut(0.0, 1.0))


@lru_cache(maxsize=256)
def piece_functions(section: Section, powers: int) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """`taper_functions` as polynomials in the way along every piece, each of shape (coefficients, pieces, powers)."""
    stations = _stations(section, min(DEGREE + max(0, powers - 4), HIGHEST))
    functions = [
        interpolated(values.reshape(powers, *stations.shape).transpose(2, 1, 0))
        for values in taper_functions(section, stations.ravel(), powers)
    ]
    return functions[0], functions[1], functions[2], functions[3]


@lru_cache(maxsize=256)
def piece_quotient(section: Section, over: str, under: str) -> Coefficients:
    """Quotient of two polynomials of a taper in the way along every piece, shape (coefficients, pieces)."""
    taper, xi = section.taper or PRISMATIC, _stations(section, DEGREE)
    values = polyval(xi, getattr(taper, over) if over else (1.0,)) / polyval(xi, getattr(taper, under))
    return interpolated(values.T)


def _stations(section: Section, degree: int) -> Reals:
    """Where `interpolated` takes values on every piece, shape (pieces, degree + 1)."""
    ends = np.array(piece_ends(section))
    return ends[:-1, None] + np.diff(ends)[:, None] * nodes(degree)


def _angles(degree: int) -> Reals:
    return np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)


def nodes(degree: int) -> Reals:
    """Chebyshev's points on [0, 1], shape (degree + 1,)."""
    return 0.5 - 0.5 * np.cos(_angles(degree))


def interpolated(values: Reals) -> Coefficients:
    """Coefficients in powers of t of polynomials with values of shape (degree + 1, ...) at the `nodes`.

    By way of Chebyshev's series, in two steps: their product would cancel by 6^degree.
    """
    spectrum, powers = _chebyshev(len(values) - 1)
    return np.tensordot(powers, np.tensordot(spectrum, values, 1), 1)


def lowered(values: Coefficients, degree: int) -> Coefficients:
    """Polynomials of no more than a degree that agree with others at the `nodes`: to round-off on a piece."""
    if len(values) <= degree + 1:
        return values
    powers = np.power.outer(nodes(degree), np.arange(len(values)))
    return interpolated(np.tensordot(powers, values, 1))


@lru_cache(maxsize=16)
def _chebyshev(degree: int) -> tuple[Reals, Reals]:
    """From values at the nodes to Chebyshev's series of 2 t - 1, and from that to powers of t."""
    orders = np.arange(degree + 1)
    spectrum = np.cos(np.multiply.outer(orders, np.pi - _angles(degree))) * (2.0 / (degree + 1))
    spectrum[0] /= 2
    powers = np.zeros((degree + 1, degree + 1))
    for order in orders:
        series = Chebyshev.basis(order, domain=[0.0, 1.0]).convert(kind=Polynomial, domain=[-1.0, 1.0])
        powers[: order + 1, order] = series.coef
    return spectrum, powers
