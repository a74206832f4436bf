"""Moving masses as points: positions, velocities and elastic displacements."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Deflection, displacement_of, rotation_of, sample
from rigid import Mechanism, Motion
from rigid.arrays import Complexes, Integers, Reals

GAUSS_POINTS = 8  # Gauss points along a beam


@dataclass(frozen=True, eq=False)
class Masses:
    """All moving masses as points; arrays of shape (masses, 1) except `link`.

    Attributes
    ----------
    link
        Number of the link, shape (masses,).
    place
        Position in the link's axes [m], complex.
    mass, inertia
        Mass [kg] and rotary inertia about the point [kg m^2]; for beams, the sections' rotary inertia.
    """

    link: Integers
    place: Complexes
    mass: Reals
    inertia: Reals


def masses_of(mechanism: Mechanism) -> Masses:
    """Gauss points of the beams, beam by beam, then the centres of the lumps."""
    rows: list[tuple[int, Any, Any, Any]] = []
    for at, beam in mechanism.beams:
        points = mechanism.links[at].points
        vector = points[beam.end] - points[beam.start]
        for xi, weight in zip(*gauss(), strict=True):
            mass, rotary = (
                start * np.polynomial.polynomial.polyval(xi, taper) * np.abs(vector) * weight
                for start, taper in ((beam.mass_per_length, beam.mass_taper), (beam.rotary_inertia, beam.rotary_taper))
            )
            rows.append((at, points[beam.start] + xi * vector, mass, rotary))
    rows += [
        (at, link.points[lump.point] + lump.offset, lump.mass, lump.inertia)
        for at, link in enumerate(mechanism.links)
        for lump in (link.lumps if at else ())
    ]
    columns = list(zip(*rows, strict=True)) or [()] * 4
    link, place, *amounts = (np.array(column) for column in columns)
    return Masses(link.astype(int), place.astype(complex)[:, None], *(amount[:, None] for amount in amounts))


def gauss() -> tuple[Reals, Reals]:
    """Gauss points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return (points + 1) / 2, weights / 2


def places(motion: Motion, masses: Masses) -> Complexes:
    """Positions of the masses [m], complex, shape (masses, positions)."""
    return motion.origin[masses.link] + motion.direction[masses.link] * masses.place


def velocities(motion: Motion, masses: Masses) -> Complexes:
    """Velocities of the masses from the motion [m/s], complex, shape (masses, positions)."""
    turning = 1j * motion.angular_velocity[masses.link] * motion.direction[masses.link]
    return motion.velocity[masses.link] + turning * masses.place


def displacements(deflection: Deflection) -> tuple[Complexes, Reals]:
    """Displacements [m], complex, and rotations [rad], shape (masses, positions)."""
    motion = deflection.motion
    mechanism = motion.mechanism
    u, w, phi = (sample(deflection, field, gauss()[0]) for field in ("u", "w", "phi"))
    moved, turned = [], []
    for number, (at, beam) in enumerate(mechanism.beams):
        way = mechanism.links[at].points[beam.end] - mechanism.links[at].points[beam.start]
        axis = motion.direction[at] * way / np.abs(way)
        moved += list(axis * (u[number] + 1j * w[number]).T)
        turned += list(phi[number].T)
    for at, link in enumerate(mechanism.links):
        for lump in link.lumps if at else ():
            angle = np.broadcast_to(rotation_of(deflection, at, lump.point), motion.columns)
            held = displacement_of(deflection, at, lump.point) + 1j * angle * motion.direction[at] * lump.offset
            moved.append(np.broadcast_to(held, motion.columns))
            turned.append(angle)
    return np.array(moved), np.array(turned)
