"""Stiffness and mass matrices of one link in link axes. They are the same at all positions."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.polynomial import Polynomial

from elastic.arrays import Matrices
from elastic.beams.section import Section, Taper
from elastic.vibration.beam_matrices import END_COORDINATES, polynomials_along, rigid_rows, vibrating_beam
from rigid import Beam, Link
from rigid.arrays import Columns, Complexes, Integers, Reals

RANK_TOLERANCE = 1e-9  # smaller singular values count as zero; relative to the largest one
ORIGIN = ""  # point name that stands for the origin of a link without beams


class VibratingLink(Struct, frozen=True, eq=False):
    """Matrices of one moving link for one design. Lengths are divided by a reference length, see `of_design`.

    Attributes
    ----------
    stiffness, mass
        Matrices for n coordinates, shape (n, n).
    places
        Displacement x, y in link axes and rotation per unit of each coordinate, shape (3, n), by name of the point. The
        points are those that a beam reaches, or the origin of a link without beams.
    level
        Level of each coordinate, shape (n,), see `VibratingBeam.level`.
    """

    stiffness: Matrices
    mass: Matrices
    places: dict[str, Reals]
    level: Integers

    def place(self, name: str, local: Columns) -> tuple[Complexes, Reals]:
        """Return displacement (complex, link axes) and rotation of a point per unit of each coordinate, (n,) each.

        A point of a link with beams is identified by `name`. A point of a link without beams is identified by its
        position `local` in link axes.
        """
        if name in self.places:
            x, y, turned = self.places[name]
            return x + 1j * y, turned
        x, y, turned = self.places[ORIGIN]
        return x + 1j * y + 1j * local * turned, turned


class LinkCoordinates(Struct, frozen=True, eq=False):
    """Coordinates of a link: displacements of its points, followed by the inner coordinates of its beams.

    Attributes
    ----------
    names
        Points that a beam reaches, or the origin of a link without beams.
    beams
        Matrix of each beam that converts link coordinates to beam coordinates, shape (n of the beam, n).
    free
        Orthonormal basis of the coordinates that meet the constraints of rigid beams, shape (n, free coordinates).
    """

    names: list[str]
    beams: tuple[Matrices, ...]
    free: Matrices

    def place(self, name: str) -> Reals:
        """Return the displacement x, y and rotation of a point per unit of each free coordinate, shape (3, free)."""
        at = 3 * self.names.index(name)
        return self.free[at : at + 3]


def link_coordinates(link: Link, sections: Sequence[Section], counts: Sequence[int]) -> LinkCoordinates:
    """Set up the coordinates of a link from the number of coordinates of each beam."""
    names = list(dict.fromkeys(name for beam in link.beams for name in (beam.start, beam.end))) or [ORIGIN]
    size = first = 3 * len(names)
    size += sum(count - END_COORDINATES for count in counts)
    beams, rigid = [], [np.zeros((0, size))]
    for beam, section, count in zip(link.beams, sections, counts, strict=True):
        vector: Any = link.points[beam.end] - link.points[beam.start]
        ends = [names.index(name) for name in (beam.start, beam.end)]
        beams.append(_coordinates(vector / abs(vector), count, ends, first, size))
        rigid.append(rigid_rows(abs(vector), section) @ beams[-1][:END_COORDINATES])
        first += count - END_COORDINATES
    return LinkCoordinates(names, tuple(beams), _unconstrained_basis(np.vstack(rigid)))


def elastic_coordinates(link: Link, inner: int) -> int:
    """Return the number of coordinates of all beams of a link, if they have shear and `inner` inner polynomials."""
    lengths = [float(np.abs(np.ravel(link.points[beam.end] - link.points[beam.start])[0])) for beam in link.beams]
    return sum(END_COORDINATES + 3 * count for count in polynomials_along(lengths, inner))


def vibrating_link(link: Link, sections: Sequence[Section], inner: int) -> VibratingLink:
    """Assemble the matrices of a link from one section per beam; `of_design` must have scaled the lengths."""
    lengths = [abs(complex(link.points[beam.end] - link.points[beam.start])) for beam in link.beams]
    counts = polynomials_along(lengths, inner)
    parts = [vibrating_beam(*each) for each in zip(lengths, sections, link.beams, counts, strict=True)]
    coordinates = link_coordinates(link, sections, [len(part.mass) for part in parts])
    stiffness, mass = (np.zeros((len(coordinates.free),) * 2) for _ in range(2))
    for part, rows in zip(parts, coordinates.beams, strict=True):
        stiffness += rows.T @ part.stiffness @ rows
        mass += rows.T @ part.mass @ rows
    _add_lumps(link, coordinates.names, mass)
    free = coordinates.free
    places = {name: coordinates.place(name) for name in coordinates.names}
    level = np.concatenate(
        [np.zeros(3 * len(coordinates.names), int), *(part.level[END_COORDINATES:] for part in parts)]
    )
    level = np.where(free != 0, level[:, None], 0).max(axis=0, initial=0)
    return VibratingLink(free.T @ stiffness @ free, free.T @ mass @ free, places, level)


def uncoupled(stiffness: Matrices, mass: Matrices, level: Integers) -> tuple[Matrices, Matrices]:
    """Transform stiffness and mass matrices, shape (..., n, n), to Craig-Bampton coordinates.

    The new coordinates are static shapes for the ends of the beams, and inner shapes. Inner shapes have unit stiffness
    and no stiffness coupling. Each inner shape combines only coordinates of the same level and of lower levels. The
    shapes up to any level therefore span the same space as before.

    References
    ----------
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
    """
    ends, within = np.flatnonzero(level == 0), np.flatnonzero(level)
    within = within[np.argsort(level[within], kind="stable")]
    if not len(within):
        return stiffness, mass
    rows = within[:, None]
    own = stiffness[..., rows, within]
    scale = 1.0 / np.sqrt(np.diagonal(own, axis1=-2, axis2=-1))[..., None]
    factor = np.linalg.inv(np.linalg.cholesky(own * scale * scale.swapaxes(-1, -2))) * scale.swapaxes(-1, -2)
    back = factor.swapaxes(-1, -2)
    transformation = np.broadcast_to(np.eye(len(level)), stiffness.shape).copy()
    transformation[..., rows, within] = back
    transformation[..., rows, ends] = -back @ (factor @ stiffness[..., rows, ends])
    moved = transformation[..., ends]
    uncoupled_stiffness = np.zeros_like(stiffness)
    uncoupled_stiffness[..., within, within] = 1.0
    uncoupled_stiffness[..., ends[:, None], ends] = moved.swapaxes(-1, -2) @ stiffness @ moved
    return uncoupled_stiffness, transformation.swapaxes(-1, -2) @ mass @ transformation


def _coordinates(unit: complex, count: int, ends: list[int], first: int, size: int) -> Matrices:
    """Return the matrix that converts link coordinates to the coordinates of a beam, shape (`count`, `size`).

    `unit` is the direction of the beam. `first` is the index of the first inner coordinate of the beam in the link.
    `ends` are the indices of the end points of the beam in `LinkCoordinates.names`.
    """
    rows = np.zeros((count, size))
    turn = np.array([[unit.real, unit.imag, 0.0], [-unit.imag, unit.real, 0.0], [0.0, 0.0, 1.0]])
    for which, node in enumerate(ends):
        rows[3 * which : 3 * which + 3, 3 * node : 3 * node + 3] = turn
    inner = len(rows) - END_COORDINATES
    rows[END_COORDINATES:, first : first + inner] = np.eye(inner)
    return rows


def _add_lumps(link: Link, names: list[str], mass: Matrices) -> None:
    unit_rows = np.eye(len(mass))
    for lump in link.lumps:
        node = 3 * names.index(lump.point) if link.beams else 0
        local: Any = lump.offset if link.beams else link.points[lump.point] + lump.offset
        x, y, turned = unit_rows[node : node + 3]
        x, y = x - local.imag * turned, y + local.real * turned
        mass += lump.mass * (np.outer(x, x) + np.outer(y, y)) + lump.inertia * np.outer(turned, turned)


def of_design(link: Link, sections: Sequence[Section], scale: float, design: int) -> tuple[Link, list[Section]]:
    """Return one design of a link and its sections, with lengths divided by `scale` [m].

    This scaling gives displacements and rotations similar magnitudes.
    """
    points = {name: complex(one_of(place, design)) / scale for name, place in link.points.items()}
    beams = tuple(
        replace(
            beam,
            mass_per_length=float(one_of(beam.mass_per_length, design)) * scale,
            rotary_inertia=float(one_of(beam.rotary_inertia, design)) / scale,
        )
        for beam in link.beams
    )
    lumps = tuple(
        replace(
            lump,
            mass=float(one_of(lump.mass, design)),
            inertia=float(one_of(lump.inertia, design)) / scale**2,
            offset=complex(one_of(lump.offset, design)) / scale,
        )
        for lump in link.lumps
    )
    powers = {"EA": 1, "EI": 3, "kGA": 1, "area": 2, "inertia": 4}

    def resized(section: Section) -> Section:
        sizes: dict[str, Any] = {
            name: float(one_of(getattr(section, name), design)) / scale**power for name, power in powers.items()
        }
        return Section(taper=section.taper, **sizes)

    return Link(link.name, points, beams, lumps), [resized(section) for section in sections]


def divided(
    link: Link, sections: Sequence[Section], marks: Mapping[int, Sequence[tuple[float, str]]]
) -> tuple[Link, list[Section]]:
    """Divide beams of a link at new points.

    `marks` lists the new points on each beam as (xi, name) in any order, by index of the beam in the link.
    """
    points, beams, parts = dict(link.points), [], []
    for number, (beam, section) in enumerate(zip(link.beams, sections, strict=True)):
        start, vector = link.points[beam.start], link.points[beam.end] - link.points[beam.start]
        stops = [(0.0, beam.start), *sorted(marks.get(number, ())), (1.0, beam.end)]
        for (low, near), (high, far) in pairwise(stops):
            points[near], points[far] = start + low * vector, start + high * vector
            first, taper = _polynomial_part(beam.mass_taper, low, high)
            turned, rotary_taper = _polynomial_part(beam.rotary_taper, low, high)
            of_part = beam.mass_per_length * first, taper, beam.rotary_inertia * turned, rotary_taper
            beams.append(Beam(near, far, *of_part))
            parts.append(section if section.taper is None else _section_part(section, section.taper, low, high))
    return Link(link.name, points, tuple(beams), link.lumps), parts


def _section_part(section: Section, taper: Taper, low: float, high: float) -> Section:
    """Return the section for the part of a tapered beam between two stations xi."""
    EA, EI, kGA = (_polynomial_part(values, low, high) for values in (taper.EA, taper.EI, taper.kGA))
    return replace(
        section,
        EA=section.EA * EA[0],
        EI=section.EI * EI[0],
        kGA=section.kGA * kGA[0],
        area=section.area * EA[0],
        inertia=section.inertia * EI[0],
        taper=Taper(EA[1], EI[1], kGA[1]),
    )


def _polynomial_part(taper: Sequence[float], low: float, high: float) -> tuple[float, tuple[float, ...]]:
    """Return the value of a taper at `low`, and the taper of the part from `low` to `high` divided by this value."""
    moved = Polynomial(taper)(Polynomial([low, high - low])).coef
    return float(moved[0]), tuple(float(value) for value in moved / moved[0])


def one_of(value: Any, design: int) -> Any:
    """Return the value for one design of a scalar or an array of shape (designs, 1)."""
    flat = np.ravel(value)
    return flat[design if len(flat) > 1 else 0]


def _unconstrained_basis(rows: Matrices) -> Matrices:
    """Return an orthonormal basis of the null space, with a unit vector for each coordinate without a constraint."""
    touched = rows.any(axis=0)
    basis, others = null_space(rows[:, touched]), np.flatnonzero(~touched)
    first = basis.shape[1]
    free = np.zeros((rows.shape[1], first + len(others)))
    free[touched, :first] = basis
    free[others, first + np.arange(len(others))] = 1.0
    return free


def null_space(rows: Matrices) -> Matrices:
    """Return an orthonormal basis of the null space of `rows`, shape (n, n - rank)."""
    if not len(rows):
        return np.eye(rows.shape[-1])
    _, values, basis = np.linalg.svd(rows)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    return basis[rank:].T
