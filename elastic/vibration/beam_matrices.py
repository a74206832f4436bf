"""Stiffness and mass matrices of one beam, from shapes for its ends and hierarchical inner polynomials.

Inner polynomials vanish at the ends. The error falls exponentially with the number of polynomials in a finite element,
but only as a fixed power of the number of elements (Bardell, Free vibration analysis of a flat plate using the
hierarchical finite element method, Journal of Sound and Vibration 151 (1991) 263-289). Even with `inner` = 0, the
stiffness of a prismatic beam is exact for loads at its ends.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.arrays import Matrices
from elastic.beams.polynomials import gauss_points
from elastic.beams.section import Section
from rigid import Beam
from rigid.arrays import Integers, Reals

END_COORDINATES = 6  # u, w, phi at both ends
EXTRA_POINTS = 20  # number of integration points minus number of inner polynomials; enough for tapers of high degree
MANY_BEAMS, FEWER_POLYNOMIALS = 16, 4  # see `polynomials_along`


class VibratingBeam(Struct, frozen=True, eq=False):
    """Matrices of one beam in beam axes.

    The n coordinates are u, w, phi at the start, u, w, phi at the end, and the amplitudes of the inner polynomials.

    Attributes
    ----------
    stiffness, mass
        Matrices of shape (n, n).
    rigid
        Constraints of a beam that cannot stretch, cannot bend, or both: (rigid @ end coordinates) must be zero, shape
        (rows, 6).
    level
        Level of each coordinate, shape (n,). A coordinate of level k is used if there are at least k inner polynomials.
        End coordinates have the level 0.
    """

    stiffness: Matrices
    mass: Matrices
    rigid: Matrices
    level: Integers


class BeamShapes(Struct, frozen=True, eq=False):
    """Displacements and strains of one beam at Gauss points, per unit of each of its n coordinates.

    Attributes
    ----------
    xi, weights
        Gauss points and their weights on [0, 1], shape (points,).
    u, w, phi
        Displacements [m] and rotation of the section [rad], each of shape (points, n).
    stretch, slope, curvature
        du/dx, dw/dx and dphi/dx, each of shape (points, n).
    """

    xi: Reals
    weights: Reals
    u: Reals
    w: Reals
    phi: Reals
    stretch: Reals
    slope: Reals
    curvature: Reals


def beam_shapes(length: float, section: Section, inner: int, points: int) -> BeamShapes:
    """Compute the shapes of a beam with `inner` inner polynomials for each of u, w and phi, for one design."""
    kind = tuple(bool(np.isfinite(np.ravel(value)[0])) for value in (section.EA, section.EI, section.kGA))
    xi, weights, (u, w, phi), (stretch, slope, curvature) = _unit_shapes(inner, *kind, points)
    # a unit rotation of an end corresponds to the slope `length` on the scaled beam of length 1
    per = np.ones(u.shape[1])
    per[[2, 5]] = length
    inverse = per / length
    return BeamShapes(
        xi, weights, u, w * per, phi * inverse, stretch / length, slope * inverse, curvature * inverse / length
    )


@lru_cache(maxsize=64)
def _unit_shapes(
    inner: int, stretches: bool, bends: bool, slides: bool, points: int
) -> tuple[Reals, Reals, tuple[Matrices, ...], tuple[Matrices, ...]]:
    """Return Gauss points, weights, (u, w, phi), and their derivatives, for a beam of length 1."""
    xi, weights = gauss_points(points)
    rows = _polynomials(inner, stretches, bends, slides)
    evaluate: Any = np.polynomial.polynomial.polyval
    values = tuple(evaluate(xi, row.T).T for row in rows)
    slopes = tuple(evaluate(xi, _derivative(row).T).T for row in rows)
    return xi, weights, values, slopes


def rigidity(section: Section, name: str, xi: Reals) -> Reals:
    """Evaluate the rigidity EA, EI or kGA (`name`) of a section at stations xi, for one design."""
    taper = getattr(section.taper, name) if section.taper else (1.0,)
    along: Any = np.polynomial.polynomial.polyval(xi, taper)
    return float(np.ravel(getattr(section, name))[0]) * along


def stiffness_of(shapes: BeamShapes, length: float, section: Section) -> Matrices:
    """Compute the stiffness matrix of a beam from its shapes, shape (n, n)."""
    stiffness = np.zeros((shapes.u.shape[1],) * 2)
    for name, strain in (("EA", shapes.stretch), ("EI", shapes.curvature), ("kGA", shapes.slope - shapes.phi)):
        if np.isfinite(np.ravel(getattr(section, name))[0]):
            rows = np.ascontiguousarray(strain.T)
            stiffness += (rows * (length * shapes.weights * rigidity(section, name, shapes.xi))) @ rows.T
    return stiffness


def masses_along(beam: Beam, xi: Reals) -> tuple[Reals, Reals]:
    """Evaluate the mass [kg/m] and the rotary inertia [kg m] per unit length at stations of a beam, for one design."""
    mass, rotary = (
        np.asarray(float(np.ravel(start)[0]) * np.polynomial.polynomial.polyval(xi, taper), float)
        for start, taper in ((beam.mass_per_length, beam.mass_taper), (beam.rotary_inertia, beam.rotary_taper))
    )
    return mass, rotary


def vibrating_beam(length: float, section: Section, beam: Beam, inner: int) -> VibratingBeam:
    """Compute the matrices of a beam with `inner` inner polynomials for each of u, w and phi, for one design.

    The beam is a Timoshenko beam if kGA is finite, and otherwise an Euler-Bernoulli beam. In both cases, the mass
    matrix includes the rotary inertia of `beam`.
    """
    shapes = beam_shapes(length, section, inner, inner + EXTRA_POINTS)
    mass_there, rotary = masses_along(beam, shapes.xi)
    mass: Matrices = sum(
        shape.T @ ((length * shapes.weights * weight)[:, None] * shape)
        for shape, weight in ((shapes.u, mass_there), (shapes.w, mass_there), (shapes.phi, rotary))
    )  # type: ignore[assignment]
    stiffness = stiffness_of(shapes, length, section)
    return VibratingBeam(stiffness, mass, rigid_rows(length, section), _levels(section, inner))


def polynomials_along(lengths: Sequence[float], inner: int) -> list[int]:
    """Return the number of inner polynomials of each beam of a link; short beams get fewer.

    In a link with more than `MANY_BEAMS` beams, a beam shorter than (total length of the beams / `MANY_BEAMS`) bends
    almost as under static loads at its ends. Such a beam gets `FEWER_POLYNOMIALS` fewer polynomials than `inner`. In a
    four-bar with 63 beams, a reduction from four polynomials to zero causes a relative change in the results of 1e-6.
    """
    whole = sum(lengths)
    short = [len(lengths) > MANY_BEAMS and MANY_BEAMS * length < whole for length in lengths]
    return [max(0, inner - FEWER_POLYNOMIALS) if few else inner for few in short]


def _levels(section: Section, inner: int) -> Integers:
    """Return the level of each coordinate of `_polynomials`, shape (n,); see `VibratingBeam.level`."""
    stretches, bends, slides = (bool(np.isfinite(value)) for value in (section.EA, section.EI, section.kGA))
    steps = np.arange(1, inner + 1)
    levels = [np.zeros(END_COORDINATES, int), steps[: inner if stretches else 0]]
    if slides:  # w has `inner` + 2 and phi has `inner` + 1 inner coordinates
        levels += [np.concatenate([[1, 1], steps]), np.concatenate([[1], steps])[: inner + 1 if bends else 0]]
    else:
        levels += [steps[: inner if bends else 0]]
    return np.concatenate(levels)


def rigid_rows(length: float, section: Section) -> Matrices:
    """Return the constraints of a beam that cannot stretch, cannot bend, or both, shape (rows, 6).

    The product of these rows with the end coordinates must be zero.
    """
    stretches, bends, slides = (bool(np.isfinite(value)) for value in (section.EA, section.EI, section.kGA))
    rows = np.zeros((0, END_COORDINATES))
    if not stretches:
        rows = np.vstack([rows, [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    if not bends:
        rows = np.vstack([rows, [0.0, 0.0, -1.0, 0.0, 0.0, 1.0]])
        if not slides:
            rows = np.vstack([rows, [0.0, -1.0, -length, 0.0, 1.0, 0.0]])
    return rows


def _polynomials(inner: int, stretches: bool, bends: bool, slides: bool) -> tuple[Matrices, Matrices, Matrices]:
    """Return the polynomials u, w, phi for a unit value of each coordinate, on a beam of length 1.

    A polynomial is a row of coefficients in ascending order; each array has the shape (n, coefficients). Objects of
    `numpy.polynomial.Polynomial` would take seven times as long.

    In Timoshenko's beam, the degree of w is higher by one than the degree of phi, so that phi can equal w'. This
    prevents shear locking.
    """
    nothing, linear = np.zeros(1), [np.array([1.0, -1.0]), np.array([0.0, 1.0])]
    bulges = _bulges(inner + 2, 1)
    u_inner = bulges[: inner if stretches else 0]
    if slides:
        w_inner, phi_inner = bulges, bulges[: inner + 1 if bends else 0]
        w_ends, phi_ends = [linear[0], nothing, linear[1], nothing], [nothing, linear[0], nothing, linear[1]]
    else:
        w_ends = [np.array(row, float) for row in ([1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1])]
        w_inner, phi_inner = _bulges(inner if bends else 0, 2), ()
        phi_ends = [_derivative(polynomial) for polynomial in w_ends]
    empty = [nothing] * len(u_inner)
    u_row = [linear[0], nothing, nothing, linear[1], nothing, nothing, *u_inner]
    w_row = [nothing, *w_ends[:2], nothing, *w_ends[2:], *empty, *w_inner]
    slopes = [nothing if slides else _derivative(polynomial) for polynomial in w_inner]
    phi_row = [nothing, *phi_ends[:2], nothing, *phi_ends[2:], *empty, *slopes, *phi_inner]
    rows = np.zeros((3, len(phi_row), inner + 4))
    for polynomials, row in zip((u_row, w_row, phi_row), rows, strict=True):
        for number, polynomial in enumerate(polynomials):
            row[number, : len(polynomial)] = polynomial
    return rows[0], rows[1], rows[2]


def _derivative(polynomial: Matrices) -> Matrices:
    """Return the coefficients of the derivative of polynomials, shape (..., coefficients)."""
    return polynomial[..., 1:] * np.arange(1, polynomial.shape[-1])


@lru_cache(maxsize=64)
def _bulges(count: int, order: int) -> tuple[Reals, ...]:
    """Return the coefficients of `count` polynomials with zeros of a given order at both ends of [0, 1].

    They are Legendre polynomials times (4 xi (1 - xi))^order.
    """
    bump = np.ones(1)
    for _ in range(order):
        bump = np.convolve(bump, [0.0, 4.0, -4.0])
    return tuple(np.convolve(bump, _legendre(degree)) for degree in range(count))


def _legendre(degree: int) -> Reals:
    """Return the coefficients, in powers of xi, of a Legendre polynomial of 2 xi - 1, by Clenshaw's algorithm."""
    lower, upper = np.zeros(degree + 1), np.zeros(degree + 1)
    upper[0] = 1.0
    for n in range(degree, 0, -1):
        product = 2.0 * np.append(0.0, upper[:-1]) - upper  # upper * (2 xi - 1)
        lower, upper = -upper * ((n - 1) / n), lower + product * ((2 * n - 1) / n)
    return upper
