"""Evaluation of fields at stations, and displacements and rotations of points."""

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from elastic.arrays import AtStations, PerBeam
from elastic.beams.division import at_station, evaluated
from elastic.beams.polynomials import evaluate, gauss_points
from elastic.derived import STRESSES, coefficients, stress_factors
from elastic.fields import Field, field_named
from elastic.links.beam_trees import in_line
from elastic.solution import Deflection
from rigid import Beam
from rigid.arrays import ArrayLike, Complexes, Reals

STATIONS = 101
# the reference deflection of a beam is at least this, relative to the largest deflection of all beams
MIN_DEFLECTION_SHARE = 0.01


def sample(
    deflection: Deflection, field: str, stations: int | ArrayLike = STATIONS, known: dict[str, AtStations] | None = None
) -> AtStations:
    """Evaluate a field at stations along every beam.

    Parameters
    ----------
    field
        Name on the command line ("deflection", "bending-moment"), or key of `FIELDS`: "N", "V", "M", "u", "w", "phi",
        "chord", "q_x", "q_y", or one of the following stresses. "axial" is N/A. "left" and "right" are the normal
        stresses in the outermost fibres, N/A - M c/I and N/A + M c/I. "normal" equals "left" or "right", whichever has
        the larger magnitude. "shear" is the largest shear stress in the section, f V/A. "axis" is sqrt((N/A)^2 + 3 (f
        V/A)^2). "mises" is the largest von Mises stress of the outermost fibres and the axis.
    stations
        Values of xi = x'/l between 0 and 1, shape (stations,), or a number of evenly spaced stations.
    known
        Cache of values of this deflection at these stations, by key. Values in the cache are reused, and new values are
        added to it. This saves time because several stresses depend on the same fields.

    Raises
    ------
    ValueError
        If the field does not exist, or a station is not between 0 and 1.

    Returns
    -------
    Array of shape (beams, ..., positions, stations) in the unit of the field. If a field jumps at a sliding block, the
    value at the block is the value just before the block. Stresses are nan if the dimensions of the section are
    unknown.

    Examples
    --------
    A cantilever of 1 m with a square section of 10 mm carries 100 N, so the stress at its root is 600 MPa.

    >>> from elastic import deflection, rectangle, section_of
    >>> from rigid import Beam, Link, Mechanism, PinDrive, PointLoad, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),))
    >>> held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1},
    ...                  loads=(PointLoad("arm", "A", -100j),))
    >>> bent = deflection(motion(held, [0.0]), [section_of(rectangle(0.01, 0.01), 210e9)])
    >>> sample(bent, "left", [0.0, 0.5]).round()
    array([[[6.e+08, 3.e+08]]])
    """
    xi = np.linspace(0.0, 1.0, stations) if isinstance(stations, int) else np.asarray(stations, float)
    if xi.size and not (xi.min() >= 0.0 and xi.max() <= 1.0):
        raise ValueError(
            f"stations range from {xi.min():g} to {xi.max():g}, expected from 0 to 1 (fractions of the length)"
        )
    return _sampled(deflection, field_named(field), xi, {} if known is None else known)


def _sampled(deflection: Deflection, entry: Field, xi: Reals, known: dict[str, AtStations]) -> AtStations:
    if entry.key not in known:
        known[entry.key] = _evaluated(deflection, entry, xi, known)
    return known[entry.key]


def _evaluated(deflection: Deflection, entry: Field, xi: Reals, known: dict[str, AtStations]) -> AtStations:
    def part(key: str) -> AtStations:
        return _sampled(deflection, field_named(key), xi, known)

    if entry.root_of:
        return np.sqrt(sum(weight * part(key) ** 2 for weight, key in entry.root_of))
    if entry.greatest_of:
        values = reduce(larger_magnitude, map(part, entry.greatest_of))
        return values if entry.signed else np.abs(values)
    if entry.key in STRESSES and deflection.division.whole:
        factors = stress_factors(deflection, entry.key)
        first, *others = (factor[0, ..., None] * part(force) for force, factor in factors)
        return sum(others, start=first)
    return evaluated(coefficients(deflection, entry.key), deflection.division, xi)


def larger_magnitude(one: AtStations, other: AtStations) -> AtStations:
    """Return, element by element, the value with the larger magnitude."""
    larger = one.copy(order="K")  # keeps the memory order, unlike `where`, and is therefore faster
    np.copyto(larger, other, where=np.abs(other) > np.abs(one))
    return larger


def displacement_of(deflection: Deflection, link: str | int, point: str) -> Complexes:
    """Return the displacement of a point of a link from its rigid position [m], complex, shape (..., positions).

    A point that is not on a beam moves with the axes of its link.
    """
    motion = deflection.motion
    at = motion.mechanism.index[link] if isinstance(link, str) else link
    body, moved = motion.mechanism.links[at], _fields_at_point(deflection, at, point, ("u", "w"))
    if moved is None:
        return deflection.shift[at] + 1j * deflection.angle[at] * motion.direction[at] * body.points[point]
    beam, (u, w) = moved
    way = body.points[beam.end] - body.points[beam.start]
    return motion.direction[at] * (way / np.abs(way)) * (u + 1j * w)


def rotation_of(deflection: Deflection, link: str | int, point: str) -> Reals:
    """Return the rotation of a link at a point [rad], shape (..., positions).

    If the point is on a beam, this is the rotation of the section there. Otherwise it is the rotation of the link axes.
    """
    index = deflection.motion.mechanism.index
    at = index[link] if isinstance(link, str) else link
    turned = _fields_at_point(deflection, at, point, ("phi",))
    return deflection.angle[at] if turned is None else turned[1][0]


def _fields_at_point(
    deflection: Deflection, at: int, point: str, fields: Sequence[str]
) -> tuple[Beam, list[Reals]] | None:
    """Return a beam that reaches a point, and its fields at the point.

    The first beam that starts or ends at the point is chosen, or else the first that passes through it. If no beam
    reaches the point, return None.
    """
    beams = [(number, beam) for number, (owner, beam) in enumerate(deflection.motion.mechanism.beams) if owner == at]
    for number, beam in beams:
        pieces = deflection.division.of_beam(number)
        if point == beam.start:
            return beam, [getattr(deflection, field)[0, pieces[0]] for field in fields]
        if point == beam.end:
            return beam, [getattr(deflection, field)[:, pieces[-1]].sum(0) for field in fields]
    points = deflection.motion.mechanism.links[at].points
    for number, beam in beams:
        start, end = points[beam.start], points[beam.end]
        if in_line(points[point] - start, end - points[point]):
            xi = np.abs(points[point] - start) / np.abs(end - start)
            return beam, [at_station(getattr(deflection, field), deflection.division, number, xi) for field in fields]
    return None


def reference_deflection(largest: PerBeam) -> PerBeam:
    """Return the reference value for relative errors in the deflection of each beam, shape (beams, ...).

    The reference value is the largest deflection of the beam, but at least `MIN_DEFLECTION_SHARE` times the largest
    deflection of all beams.
    """
    return np.maximum(largest, MIN_DEFLECTION_SHARE * largest.max(axis=0, initial=0.0))


def along_beams(bent: Deflection, field: str, xi: Reals) -> Reals:
    """Evaluate a field at Gauss points, shape (..., positions, beams, points).

    Under a sliding block, a field has a kink or a jump. The values at a Gauss point would therefore change abruptly
    when the block passes this point. To avoid this, the values on a beam with a block are taken from a smooth
    polynomial: the best least-squares approximation to the field. The integral of this polynomial times a shape of the
    beam equals the integral of the field times this shape.
    """
    values = np.moveaxis(sample(bent, field, xi), 0, -2)
    division = bent.division
    for beam in {block.beam for block in bent.blocks}:
        rows = division.of_beam(beam)
        parts = getattr(bent, field)[:, rows]
        values[..., beam, :] = _nearest(parts, division.start[rows], division.width[rows], xi)
    return values


def _nearest(parts: Reals, start: Reals, width: Any, xi: Any) -> Reals:
    """Evaluate the best least-squares approximation to a piecewise polynomial at xi, shape (..., positions, points)."""
    order = len(xi) - 1
    points = gauss_points((len(parts) + order) // 2 + 1)
    nodes, weights = (part.reshape(-1, *(1,) * np.ndim(width)) for part in points)
    places = start + width * nodes
    heights = evaluate(parts, np.broadcast_to(nodes, places.shape)) if len(parts) > 1 else parts[0] + 0 * places
    basis = legendre.legvander(2 * places - 1, order)
    series = np.einsum("gr...,gr...k->...k", heights * weights * width, basis) * (2 * np.arange(order + 1) + 1)
    return series @ legendre.legvander(2 * np.asarray(xi) - 1, order).T
