"""Error of the machine's output relative to rigid links."""

from dataclasses import dataclass

import numpy as np

from elastic.derived import coefficients
from elastic.sampling import displacement_of
from elastic.solution import Deflection
from rigid import Reals, velocity_of
from rigid.arrays import Complexes

REST_SPEED = 1e-12  # relative to its largest speed, a slower point is at rest


@dataclass(frozen=True, eq=False)
class PathDeviation:
    """Displacement of a point along and normal to its path, shape (..., positions).

    Attributes
    ----------
    along
        Distance along the path [m], positive if the point is early.
    normal
        Distance from the path [m], positive to the left.
    displacement
        Displacement in ground axes [m], complex.
    """

    along: Reals
    normal: Reals
    displacement: Complexes


def path_deviation(deflection: Deflection, link: str, point: str) -> PathDeviation:
    """Deviation of a link's point from its path in the rigid mechanism.

    `along` and `normal` are nan if the point is at rest, because its path has no direction.
    """
    moved = displacement_of(deflection, link, point)
    velocity = velocity_of(deflection.motion, link, point)
    speed = np.abs(velocity)
    fastest = np.nanmax(speed, axis=-1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = moved * np.conj(np.where(speed > REST_SPEED * fastest, velocity / speed, np.nan))
    return PathDeviation(seen.real, seen.imag, moved)


def angle_error(deflection: Deflection, link: str, point: str | None = None) -> Reals:
    """Rotation of a link at a point, relative to the rigid link [rad], shape (..., positions).

    A bent link has different rotations at different points. The default point is the origin of the link axes. A point
    away from the beams rotates with the link axes.
    """
    mechanism = deflection.motion.mechanism
    at = mechanism.index[link]
    name = point or next(iter(mechanism.links[at].points))
    for number, (owner, beam) in enumerate(mechanism.beams):
        if owner == at and name in (beam.start, beam.end):
            turned, pieces = coefficients(deflection, "phi"), deflection.division.of_beam(number)
            return turned[0, pieces[0]] if name == beam.start else turned[:, pieces[-1]].sum(0)
    return deflection.angle[at]
