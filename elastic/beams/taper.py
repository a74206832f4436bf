"""Functions that replace powers of xi on tapered beams, and pieces on which these functions are polynomials."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.polynomial.polynomial import polyroots, polyval

from elastic.arrays import Coefficients
from elastic.beams.polynomials import gauss_points
from elastic.beams.section import Section, Taper
from rigid.arrays import Reals

DEGREE = 14  # degree of the polynomials on a piece; increased if the bending moment has a degree above 3
MAX_DEGREE = 20  # upper limit of this degree, because conversion to powers amplifies round-off by 6^degree
MIN_AXES_SUM = 16.0  # smallest sum of half axes, see `piece_ends`; degree 14 then has the error 16^-15, i.e. round-off
MIN_PIECE = 2.0**-40  # length of the shortest piece in xi; limits the division if a rigidity almost vanishes at an end
LOG_ACCURACY = 50.0  # -ln of the quadrature error; e^-50 leaves a margin below round-off for poles of high order
PRISMATIC = Taper()


def taper_functions(
    section: Section, stations: Sequence[float] | Reals, powers: int
) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Evaluate the functions that replace the powers of xi in the fields of a tapered beam.

    For k = 0, 1, ..., with f = 1/(rigidity relative to the start) and integrals from 0 to xi, these functions are

    - u: `(k+1) int s^k f_EA ds`
    - phi: `(k+1) int s^k f_EI ds`
    - w due to bending: `(k+1)(k+2) int (xi-s) s^k f_EI ds`
    - w due to shear: `(k+1) int s^k f_kGA ds`

    The integrals are computed by Gauss quadrature to round-off.

    Returns
    -------
    Four arrays of shape (powers, stations). For a prismatic beam they are xi^(k+1), xi^(k+1), xi^(k+2) and xi^(k+1).
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
    """Return enough Gauss-Legendre points on [0, 1], with weights, to integrate 1/polynomial to round-off."""
    nearest = _axes_sum(polynomial, 0.0, 1.0)
    count = powers + (0 if np.isinf(nearest) else int(np.ceil(LOG_ACCURACY / 2 / np.log(nearest))))
    return gauss_points(count)


def _axes_sum(polynomial: tuple[float, ...], low: float, high: float) -> float:
    """Return the sum of the half axes of the largest ellipse without zeros. Its foci are the ends of the interval."""
    roots = (2 * polyroots(polynomial).astype(complex) - low - high) / (high - low)
    return float(np.abs(roots + np.sqrt(roots - 1) * np.sqrt(roots + 1)).min(initial=np.inf))


@lru_cache(maxsize=256)
def piece_ends(section: Section) -> tuple[float, ...]:
    """Return the ends of the pieces of a beam in xi, starting with 0.

    Pieces are halved until the flexibility on each piece is a polynomial to round-off. Scale a piece to [-1, 1], and
    let r be the sum of the half axes of the ellipse with the foci -1 and 1 through the nearest pole. Interpolation of
    degree n then has an error of r^-(n+1) (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2).
    """
    taper = section.taper or PRISMATIC

    def cut(low: float, high: float) -> list[float]:
        near = min(_axes_sum(polynomial, low, high) for polynomial in (taper.EA, taper.EI, taper.kGA))
        if near >= MIN_AXES_SUM or high - low <= MIN_PIECE:
            return [high]
        middle = (low + high) / 2
        return cut(low, middle) + cut(middle, high)

    return (0.0, *cut(0.0, 1.0))


@lru_cache(maxsize=256)
def piece_functions(section: Section, powers: int) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Return `taper_functions` as polynomials on each piece: four arrays of shape (coefficients, pieces, powers)."""
    stations = _stations(section, min(DEGREE + max(0, powers - 4), MAX_DEGREE))
    functions = [
        interpolated(values.reshape(powers, *stations.shape).transpose(2, 1, 0))
        for values in taper_functions(section, stations.ravel(), powers)
    ]
    return functions[0], functions[1], functions[2], functions[3]


@lru_cache(maxsize=256)
def piece_quotient(section: Section, over: str, under: str) -> Coefficients:
    """Return the quotient of two taper polynomials on each piece, shape (coefficients, pieces)."""
    taper, xi = section.taper or PRISMATIC, _stations(section, DEGREE)
    values = polyval(xi, getattr(taper, over) if over else (1.0,)) / polyval(xi, getattr(taper, under))
    return interpolated(values.T)


def _stations(section: Section, degree: int) -> Reals:
    """Return the values of xi at the `nodes` of each piece, shape (pieces, degree + 1)."""
    ends = np.array(piece_ends(section))
    return ends[:-1, None] + np.diff(ends)[:, None] * nodes(degree)


def _angles(degree: int) -> Reals:
    return np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)


def nodes(degree: int) -> Reals:
    """Return the Chebyshev points on [0, 1], shape (degree + 1,)."""
    return 0.5 - 0.5 * np.cos(_angles(degree))


def interpolated(values: Reals) -> Coefficients:
    """Return the polynomials in powers of t with given values at the `nodes`, shape (degree + 1, ...).

    The values are converted to a Chebyshev series first, and then to powers. If a single matrix did both steps,
    cancellation would amplify round-off by 6^degree.
    """
    spectrum, powers = _chebyshev(len(values) - 1)
    return np.tensordot(powers, np.tensordot(spectrum, values, 1), 1)


def lowered(values: Coefficients, degree: int) -> Coefficients:
    """Lower the degree of polynomials on a piece by interpolation at the `nodes`; the error is round-off."""
    if len(values) <= degree + 1:
        return values
    powers = np.power.outer(nodes(degree), np.arange(len(values)))
    return interpolated(np.tensordot(powers, values, 1))


@lru_cache(maxsize=16)
def _chebyshev(degree: int) -> tuple[Reals, Reals]:
    """Return the matrices that convert nodal values to a Chebyshev series, and this series to powers of t."""
    orders = np.arange(degree + 1)
    spectrum = np.cos(np.multiply.outer(orders, np.pi - _angles(degree))) * (2.0 / (degree + 1))
    spectrum[0] /= 2
    powers = np.zeros((degree + 1, degree + 1))
    for order in orders:
        series = Chebyshev.basis(order, domain=[0.0, 1.0]).convert(kind=Polynomial, domain=[-1.0, 1.0])
        powers[: order + 1, order] = series.coef
    return spectrum, powers
