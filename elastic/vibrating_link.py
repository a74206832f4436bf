"""Stiffness and mass of one link in its own axes, which do not change with the position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.section import Section
from elastic.vibrating_beam import ENDS, VibratingBeam, vibrating_beam
from rigid import Link

RANK = 1e-9


@dataclass(frozen=True, eq=False)
class VibratingLink:
    """One moving link; one design; lengths in units of a common one.

    Attributes
    ----------
    stiffness, mass
        Of its n coordinates, shape (n, n).
    places
        Displacement x, y and rotation of every point with a beam, or of the origin of a link without, per coordinate,
        shape (3, n), in the link's axes.
    beams
        Per beam its unit vector in the link's axes, itself, and its coordinates per coordinate of the link.
    points
        Of a link without beams, in its axes.
    """

    stiffness: Any
    mass: Any
    places: dict[str, Any]
    beams: list[tuple[complex, VibratingBeam, Any]]
    points: dict[str, complex]

    def point(self, name: str) -> tuple[Any, Any]:
        """Displacement, complex, and rotation of a point per coordinate, shape (n,), in the link's axes."""
        if self.beams:
            x, y, turned = self.places[name]
            return x + 1j * y, turned
        return self.spot(self.points[name])

    def spot(self, local: Any) -> tuple[Any, Any]:
        """The same of any place of a link without beams, shape (..., n)."""
        x, y, turned = self.places[""]
        return x + 1j * y + 1j * np.multiply.outer(local, turned), turned

    def station(self, beam: int, xi: Any) -> tuple[Any, Any]:
        """The same of stations along one of its beams, shape (..., n)."""
        unit, own, coordinates = self.beams[beam]
        u, w, phi = own.at(xi) @ coordinates
        return unit * (u + 1j * w), phi


def vibrating_link(link: Link, sections: list[Section], scale: float, inner: int, design: int = 0) -> VibratingLink:
    """A link with `inner` polynomials along every beam.

    Parameters
    ----------
    sections
        One per beam.
    scale
        Unit of length [m]: rotations times this are displacements, so that both are of one size.
    design
        Which of the designs.
    """
    points = {name: complex(one_of(place, design)) / scale for name, place in link.points.items()}
    names = list(dict.fromkeys(name for beam in link.beams for name in (beam.start, beam.end))) or [""]
    beams, size = [], 3 * len(names)
    for beam, section in zip(link.beams, sections, strict=True):
        way = points[beam.end] - points[beam.start]
        mass_per_length = float(one_of(beam.mass_per_length, design)) * scale
        own = vibrating_beam(abs(way), _scaled(section, scale, design), mass_per_length, beam.mass_taper, inner)
        beams.append((way / abs(way), own, size))
        size += len(own.along) - ENDS
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    maps, rigid = [], [np.zeros((0, size))]
    for beam, (unit, own, first) in zip(link.beams, beams, strict=True):
        ends = [names.index(name) for name in (beam.start, beam.end)]
        coordinates = _coordinates(unit, own, ends, first, size)
        stiffness += coordinates.T @ own.stiffness @ coordinates
        mass += coordinates.T @ own.mass @ coordinates
        rigid.append(own.rigid @ coordinates[:ENDS])
        maps.append(coordinates)
    unit_rows = np.eye(size)
    for lump in link.lumps:
        node = 3 * names.index(lump.point) if link.beams else 0
        local = complex(one_of(lump.offset, design)) / scale + (0.0 if link.beams else points[lump.point])
        x, y, turned = unit_rows[node : node + 3]
        x, y = x - local.imag * turned, y + local.real * turned
        inertia = float(one_of(lump.inertia, design)) / scale**2
        mass += float(one_of(lump.mass, design)) * (np.outer(x, x) + np.outer(y, y)) + inertia * np.outer(
            turned, turned
        )
    free = null_space(np.vstack(rigid))
    return VibratingLink(
        free.T @ stiffness @ free,
        free.T @ mass @ free,
        {name: free[3 * k : 3 * k + 3] for k, name in enumerate(names)},
        [(unit, own, coordinates @ free) for (unit, own, _), coordinates in zip(beams, maps, strict=True)],
        points,
    )


def _coordinates(unit: complex, own: VibratingBeam, ends: list[int], first: int, size: int) -> Any:
    """Coordinates of a beam per coordinate of its link."""
    rows = np.zeros((len(own.along), size))
    turn = np.array([[unit.real, unit.imag, 0.0], [-unit.imag, unit.real, 0.0], [0.0, 0.0, 1.0]])
    for which, node in enumerate(ends):
        rows[3 * which : 3 * which + 3, 3 * node : 3 * node + 3] = turn
    inner = len(rows) - ENDS
    rows[ENDS:, first : first + inner] = np.eye(inner)
    return rows


def _scaled(section: Section, scale: float, design: int) -> Section:
    """A section of one design in units of length."""
    EA, EI, kGA, area, inertia = (
        float(one_of(value, design)) for value in (section.EA, section.EI, section.kGA, section.area, section.inertia)
    )
    return Section(
        EA / scale, EI / scale**3, kGA / scale, taper=section.taper, area=area / scale**2, inertia=inertia / scale**4
    )


def one_of(value: Any, design: int) -> Any:
    """A design's value of a quantity that is a scalar or of shape (designs, 1)."""
    flat = np.ravel(value)
    return flat[design if len(flat) > 1 else 0]


def null_space(rows: Any) -> Any:
    """Orthonormal columns that span what rows make zero, shape (n, n - rank)."""
    if not len(rows):
        return np.eye(rows.shape[-1])
    _, values, basis = np.linalg.svd(rows)
    rank = int((values > RANK * values[0]).sum())
    return basis[rank:].T
