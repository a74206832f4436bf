"""Constants of all links and beams, stacked as arrays for vectorised operations."""

from collections.abc import Iterable, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Complex, Complexes, Numbers, Real, Reals
from rigid.mechanism import Mechanism
from rigid.parts import Beam, Link
from rigid.plane import dot


class BeamConstants(Struct, frozen=True, eq=False, dict=True):
    """Constants of all beams of a mechanism, as arrays (beams, ..., 1) that broadcast to (beams, ..., positions).

    Attributes
    ----------
    link
        Link index of each beam.
    start
        Start of the beam in the link's axes (complex) [m].
    unit
        Unit vector along the beam in the link's axes (complex).
    length, mass_per_length
        Length [m], and mass per length at the start [kg/m].
    mass_taper
        Polynomial coefficients of the mass per length, relative to the start, shape (n, beams, ..., 1).
    rotary
        Polynomial coefficients of the rotary inertia per length [kg m], shape (n, beams, ..., 1); None if all are zero.
    """

    link: slice | list[int]
    start: Complexes
    unit: Complexes
    length: Reals
    mass_per_length: Reals
    mass_taper: Reals
    rotary: Reals | None

    @cached_property
    def aligned(self) -> bool:
        """Whether all beams lie along the x' axes of their links."""
        return bool(np.all(self.unit == 1.0))

    @cached_property
    def offset(self) -> bool:
        """Whether any beam does not start at the origin of its link."""
        return bool(self.start.any())

    @cached_property
    def resistance(self) -> tuple[Reals, Reals]:
        """Inertia load per length as polynomials in xi: per acceleration of the start, and per i eps - w^2."""
        mass = -self.mass_per_length * self.mass_taper
        return mass, mass * self.length


@lru_cache(maxsize=64)
def beam_constants(mechanism: Mechanism, ndim: int) -> BeamConstants:
    """Return the constants of `Mechanism.beams`, for columns of `ndim` axes."""
    links = [at for at, _ in mechanism.beams]
    starts, vectors, masses = [], [], []
    for at, beam in mechanism.beams:
        points = mechanism.links[at].points
        starts.append(points[beam.start])
        vectors.append(points[beam.end] - points[beam.start])
        masses.append(beam.mass_per_length)
    vector: Any = per_row(vectors, ndim, complex)
    length = np.abs(vector)
    first = links[0] if links else 0
    row = slice(first, first + len(links)) if links == list(range(first, first + len(links))) else links
    mass = per_row(masses, ndim, float)
    tapers = _tapers([beam.mass_taper for _, beam in mechanism.beams], ndim)
    rotary: Any = None
    if any(np.any(beam.rotary_inertia) for _, beam in mechanism.beams):
        rotary = per_row([beam.rotary_inertia for _, beam in mechanism.beams], ndim, float)
        rotary = rotary * _tapers([beam.rotary_taper for _, beam in mechanism.beams], ndim)
    return BeamConstants(row, per_row(starts, ndim, complex), vector / length, length, mass, tapers, rotary)


def _tapers(tapers: Sequence[tuple[float, ...]], ndim: int) -> Reals:
    """Return the polynomials along the beams, padded with zeros to a common degree."""
    table = np.zeros((max(map(len, tapers), default=1), len(tapers), *(1,) * ndim))
    for number, taper in enumerate(tapers):
        table[: len(taper), number] = np.reshape(taper, (-1, *(1,) * ndim))
    return table


@lru_cache(maxsize=64)
def mass_constants(mechanism: Mechanism, ndim: int) -> tuple[Complexes, Complexes, Reals]:
    """Return the mass, first moment (complex) and moment of inertia of each link about its origin."""
    moments = [mass_moments(link) for link in mechanism.links]
    mass, first, second = zip(*moments, strict=True)
    return per_row(mass, ndim, complex), per_row(first, ndim, complex), per_row(second, ndim, float)


def mass_moments(link: Link) -> tuple[Real, Complex, Real]:
    """Return the mass [kg], first moment [kg m] and moment of inertia [kg m^2] of a link about its origin."""
    mass: Any = 0.0
    first: Any = 0.0
    second: Any = 0.0
    for beam in link.beams:
        parts = _beam_moments(beam, link.points[beam.start], link.points[beam.end])
        mass, first, second = (total + part for total, part in zip((mass, first, second), parts, strict=True))
    for lump in link.lumps:
        center = link.points[lump.point] + lump.offset
        mass = mass + lump.mass
        first = first + lump.mass * center
        second = second + lump.inertia + lump.mass * np.abs(center) ** 2
    return mass, first, second


def _beam_moments(beam: Beam, start: Complex, end: Complex) -> tuple[Real, Complex, Real]:
    """Return the mass, first moment and second moment of a beam about the link's origin."""
    vector = end - start
    mass, once, twice = (
        beam.mass_per_length * np.abs(vector) * sum(part / (k + more) for k, part in enumerate(beam.mass_taper))
        for more in (1, 2, 3)
    )
    second = mass * np.abs(start) ** 2 + 2 * once * dot(start, vector) + twice * np.abs(vector) ** 2
    turned = sum(part / (k + 1) for k, part in enumerate(beam.rotary_taper))
    second = second + beam.rotary_inertia * np.abs(vector) * turned
    return mass, mass * start + once * vector, second


def per_row(values: Iterable[Any], ndim: int, kind: type) -> Numbers:
    """Stack values of shape () or (designs, 1) as rows of an array (rows, ..., 1), with `ndim` axes per row."""
    values = list(values)
    if values and all(isinstance(value, float | int | complex) for value in values):
        return np.array(values, kind).reshape(-1, *(1,) * ndim)
    wide = [np.reshape(value, (1,) * (ndim - np.ndim(value)) + np.shape(value)) for value in values]
    return np.array(np.broadcast_arrays(*wide), kind) if wide else np.zeros((0,) + (1,) * ndim, kind)
