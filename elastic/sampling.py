"""Evaluation of fields at stations, and displacements and rotations of points."""

from collections.abc import Sequence
from functools import reduce

import numpy as np

from elastic.arrays import AtStations, PerBeam
from elastic.beams.division import at_station, evaluated
from elastic.derived import STRESSES, coefficients, stress_factors
from elastic.fields import Field, field_named
from elastic.links.beam_trees import in_line
from elastic.solution import Deflection
from rigid import Beam
from rigid.arrays import ArrayLike, Complexes, Reals

STATIONS = 101
MIN_DEFLECTION_SHARE = 0.01  # smallest reference deflection of a beam, relative to the largest deflection of all beams


def sample(
    deflection: Deflection, field: str, stations: int | ArrayLike = STATIONS, known: dict[str, AtStations] | None = None
) -> AtStations:
    """Evaluate a field at stations along every beam.

    Parameters
    ----------
    field
        Name on the command line ("deflection", "bending-moment"), or key of `FIELDS`: "N", "V", "M", "u", "w", "phi",
        "chord", "q_x", "q_y", or one of the following stresses. "axial" is N/A. "left" and "right" are the normal
        stresses in the outermost fibres, N/A - M c/I and N/A + M c/I. "normal" is the one with the larger magnitude.
        "shear" is the largest shear stress in the section, f V/A. "axis" is sqrt((N/A)^2 + 3 (f V/A)^2). "mises" is the
        largest von Mises stress of the outermost fibres and the axis.
    stations
        Values of xi = x'/l between 0 and 1, shape (stations,), or a number of evenly spaced stations.
    known
        Cache of values of this deflection at these stations, by key. Values in it are reused and new ones are added,
        because stresses share components.

    Raises
    ------
    ValueError
        If the field does not exist, or a station is not between 0 and 1.

    Returns
    -------
    Array of shape (beams, ..., positions, stations) in the unit of the field. At a sliding block the value is the one
    before the block. Stresses are nan if the dimensions of the section are unknown.

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
    entry = field_named(field)
    if known is None:
        return _sampled(deflection, entry, xi, {})
    if entry.key not in known:
        known[entry.key] = _sampled(deflection, entry, xi, known)
    return known[entry.key]


def _sampled(deflection: Deflection, entry: Field, xi: Reals, known: dict[str, AtStations]) -> AtStations:
    if entry.root_of:
        return np.sqrt(sum(weight * sample(deflection, part, xi, known) ** 2 for weight, part in entry.root_of))
    if entry.greatest_of:
        values = reduce(larger_magnitude, (sample(deflection, part, xi, known) for part in entry.greatest_of))
        return values if entry.signed else np.abs(values)
    if entry.key in STRESSES and deflection.division.whole:
        first, *others = (
            factor[0, ..., None] * sample(deflection, force, xi, known)
            for force, factor in stress_factors(deflection, entry.key)
        )
        return sum(others, start=first)
    return evaluated(coefficients(deflection, entry.key), deflection.division, xi)


def larger_magnitude(one: AtStations, other: AtStations) -> AtStations:
    """Return, element by element, the value with the larger magnitude."""
    larger = one.copy(order="K")  # unlike `where`, this keeps the memory order, which is faster
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

    It is the rotation of the section if the point is on a beam, and otherwise that of the link's axes.
    """
    index = deflection.motion.mechanism.index
    at = index[link] if isinstance(link, str) else link
    turned = _fields_at_point(deflection, at, point, ("phi",))
    return deflection.angle[at] if turned is None else turned[1][0]


def _fields_at_point(
    deflection: Deflection, at: int, point: str, fields: Sequence[str]
) -> tuple[Beam, list[Reals]] | None:
    """Return the first beam that ends at a point, or else passes through it, with its fields there.

    Return None if no beam reaches the point.
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
    """Return the reference deflection of each beam for relative errors, shape (beams, ...).

    It is the largest deflection of the beam, or `MIN_DEFLECTION_SHARE` times the largest of all beams if that is more.
    """
    return np.maximum(largest, MIN_DEFLECTION_SHARE * largest.max(axis=0, initial=0.0))
