"""Moving masses as point masses: positions, velocities, elastic displacements, and rates by finite differences."""

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import Deflection, displacement_of, rotation_of, sample
from rigid import Mechanism, Motion, Posture, posture
from rigid.arrays import Complexes, Integers, Reals

GAUSS_POINTS = 8  # number of Gauss points along a beam
TOLERANCE = 1e-6
"""Default of the largest accepted residual, see `balance`."""
STEP = 0.01
"""Time step of the differences, relative to `_pace`."""
EIGHTH = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SIXTH = (3 / 4, -3 / 20, 1 / 60, 0.0)
"""Weights of central differences of orders eight and six for first derivatives.

Entry k is the weight of the value k + 1 steps after the middle point minus the value k + 1 steps before it. The
difference between both orders is an estimate of the error.
"""

MotionNear = Callable[[Reals, Posture], Motion]
"""Function that returns the motion at given times [s], on the branch of a nearby posture."""


class Masses(Struct, frozen=True, eq=False):
    """All moving masses as point masses, in arrays of shape (masses, 1) except `link`.

    Attributes
    ----------
    link
        Index of the link, shape (masses,).
    place
        Position in the axes of the link (complex) [m].
    mass
        Mass [kg].
    inertia
        Moment of inertia about the point [kg m^2]; for a beam, the rotary inertia of its sections.
    """

    link: Integers
    place: Complexes
    mass: Reals
    inertia: Reals


def masses_of(mechanism: Mechanism) -> Masses:
    """Return the point masses: Gauss points of all beams, then the lumps (masses attached to links)."""
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
    """Return Gauss points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return (points + 1) / 2, weights / 2


def places(motion: Motion, masses: Masses) -> Complexes:
    """Return the positions of the masses (complex) [m], shape (masses, positions)."""
    return motion.origin[masses.link] + motion.direction[masses.link] * masses.place


def velocities(motion: Motion, masses: Masses) -> Complexes:
    """Return the velocities of the masses in the rigid motion (complex) [m/s], shape (masses, positions)."""
    turning = 1j * motion.angular_velocity[masses.link] * motion.direction[masses.link]
    return motion.velocity[masses.link] + turning * masses.place


def displacements(deflection: Deflection) -> tuple[Complexes, Reals]:
    """Return the displacements (complex) [m] and rotations [rad] of the masses, each of shape (masses, positions)."""
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
            displacement = displacement_of(deflection, at, lump.point) + 1j * angle * motion.direction[at] * lump.offset
            moved.append(np.broadcast_to(displacement, motion.columns))
            turned.append(angle)
    return np.array(moved), np.array(turned)


class Rates(Struct, frozen=True, eq=False):
    """Rates of the masses by finite differences, in arrays of shape (masses, positions).

    Attributes
    ----------
    velocity
        Velocities, differentiated from positions (complex) [m/s].
    acceleration
        Accelerations, differentiated from velocities (complex) [m/s^2].
    rotation
        Angular accelerations, differentiated from angular velocities [rad/s^2].
    known
        True at the positions at which the differences are accurate, shape (positions,).
    """

    velocity: Any
    acceleration: Any
    rotation: Any
    known: Any


def rates_of(motion: Motion, masses: Masses, motion_near: MotionNear, span: tuple[float, float]) -> Rates:
    """Differentiate positions and velocities of the masses, with a few short steps before and after each position."""
    step = STEP * _pace(motion)
    far = len(EIGHTH) * step
    inside = (motion.time - far >= span[0]) & (motion.time + far <= span[1])
    if not inside.any():  # the run is too short for the steps
        unknown = np.full((len(masses.mass), *motion.columns), np.nan)
        return Rates(unknown + 0j, unknown + 0j, unknown, inside)
    time, here = motion.time[inside], posture(motion, inside)
    steps = np.array([
        _carried(motion_near(time + k * step, here), masses) - _carried(motion_near(time - k * step, here), masses)
        for k in range(1, len(EIGHTH) + 1)
    ])  # fmt: skip
    good, rough = (np.tensordot(weights, steps, 1) / step for weights in (EIGHTH, SIXTH))
    largest = np.abs(good).max(axis=(1, 2), initial=0.0, where=np.isfinite(good), keepdims=True)
    known = inside.copy()
    known[inside] = (np.abs(good - rough) <= TOLERANCE / 10 * largest).all(axis=(0, 1))
    rates = np.full((*good.shape[:2], *motion.columns), np.nan, complex)
    rates[..., inside] = good
    return Rates(rates[0], rates[1], rates[2].real, known)


def _carried(motion: Motion, masses: Masses) -> Complexes:
    """Return positions, velocities and angular velocities of the masses, shape (3, masses, positions)."""
    return np.array([places(motion, masses), velocities(motion, masses), motion.angular_velocity[masses.link]])


def _pace(motion: Motion) -> float:
    """Return the shortest time in which a link rotates by 1 rad or moves by the size of the mechanism [s]."""
    known = np.isfinite(motion.velocity)
    turns = np.abs(motion.angular_velocity).max(initial=0.0, where=known)
    goes = np.abs(motion.velocity).max(initial=0.0, where=known)
    size = size_of(motion, np.isfinite(motion.origin).all(axis=0))
    fastest = max(float(turns), float(goes) / size if size else 0.0)
    return 1.0 / fastest if fastest else 1.0


def size_of(motion: Motion, known: Any) -> float:
    """Return the larger of the width and height of the area that the points of the links sweep [m]."""
    points = [motion.origin[at] + motion.direction[at] * point
              for at, link in enumerate(motion.mechanism.links) for point in link.points.values()]  # fmt: skip
    reached = np.array(points)[:, known]
    return float(max(np.ptp(reached.real), np.ptp(reached.imag))) if reached.size else 0.0
