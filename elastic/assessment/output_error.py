"""How far the machine's output is from where rigid links would have it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic.derived import coefficients
from elastic.sampling import displacement_of
from elastic.solution import Deflection
from rigid import Reals, velocity_of
from rigid.arrays import Complexes

AT_REST = 1e-12  # of its greatest speed below which a point rests


@dataclass(frozen=True, eq=False)
class PathDeviation:
    """Displacement of a point as seen on its path, shape (..., positions).

    Attributes
    ----------
    along
        How far it is ahead [m]: on the path, early or late.
    normal
        How far it is to the left of the path [m]: off the path.
    displacement
        In the ground's axes [m], complex.
    """

    along: Reals
    normal: Reals
    displacement: Complexes


def path_deviation(deflection: Deflection, link: str, point: str) -> PathDeviation:
    """Deviation of a link's point from the path that rigid links give it.

    `along` and `normal` are nan where the point rests, so that its path has no direction there.
    """
    moved = displacement_of(deflection, link, point)
    velocity = velocity_of(deflection.motion, link, point)
    speed = np.abs(velocity)
    fastest = np.nanmax(speed, axis=-1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = moved * np.conj(np.where(speed > AT_REST * fastest, velocity / speed, np.nan))
    return PathDeviation(seen.real, seen.imag, moved)


def angle_error(deflection: Deflection, link: str, point: str | None = None) -> Reals:
    """Rotation of a link at one of its points from its rigid angle [rad], shape (..., positions).

    A bent link is turned differently at every point; without one, at the origin of its axes. A point on no beam turns
    with the axes of its link.
    """
    mechanism = deflection.motion.mechanism
    at = mechanism.index[link]
    name = point or next(iter(mechanism.links[at].points))
    for number, (owner, beam) in enumerate(mechanism.beams):
        if owner == at and name in (beam.start, beam.end):
            turned, pieces = coefficients(deflection, "phi"), deflection.division.of_beam(number)
            at_end: Reals = turned[0, pieces[0]] if name == beam.start else turned[:, pieces[-1]].sum(0)
            return at_end
    axes: Reals = deflection.angle[at]
    return axes


def point_displacements(deflection: Deflection) -> dict[tuple[str, str], Complexes]:
    """Displacement [m], complex, shape (..., positions), of every point of every moving link by their names.

    Joints are points of the links that they join; where a joint gives way these differ.
    """
    return {
        (link.name, point): displacement_of(deflection, link.name, point)
        for link in deflection.motion.mechanism.links[1:]
        for point in link.points
    }
