"""Error of the output of a machine due to elastic links, and its settling time after a stop."""

from dataclasses import dataclass

import numpy as np

from elastic.derived import coefficients
from elastic.sampling import displacement_of
from elastic.solution import Deflection
from rigid import Reals, velocity_of
from rigid.arrays import Complexes, Flags

REST_SPEED = 1e-12  # a point slower than this is at rest; relative to its largest speed
REST_RATE = 1e-9  # drive rates smaller than this are round-off; relative to the largest


@dataclass(frozen=True, eq=False)
class PathDeviation:
    """Displacement of a point, resolved along and normal to its path, shape (..., positions).

    Attributes
    ----------
    along
        Component along the path [m], positive if the point is ahead.
    normal
        Component normal to the path [m], positive to the left.
    displacement
        Displacement in ground axes [m], complex.
    """

    along: Reals
    normal: Reals
    displacement: Complexes


def path_deviation(deflection: Deflection, link: str, point: str) -> PathDeviation:
    """Return the deviation of a point of a link from its path in the rigid mechanism.

    `along` and `normal` are nan while the point is at rest, because its path then has no direction.
    """
    moved = displacement_of(deflection, link, point)
    velocity = velocity_of(deflection.motion, link, point)
    speed = np.abs(velocity)
    fastest = np.nanmax(speed, axis=-1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = moved * np.conj(np.where(speed > REST_SPEED * fastest, velocity / speed, np.nan))
    return PathDeviation(seen.real, seen.imag, moved)


def angle_error(deflection: Deflection, link: str, point: str | None = None) -> Reals:
    """Return the rotation of a link at a point relative to the rigid link [rad], shape (..., positions).

    A bent link rotates differently at different points. The default point is the origin of the link axes. A point that
    is not on a beam rotates with the link axes.
    """
    mechanism = deflection.motion.mechanism
    at = mechanism.index[link]
    name = point or next(iter(mechanism.links[at].points))
    for number, (owner, beam) in enumerate(mechanism.beams):
        if owner == at and name in (beam.start, beam.end):
            turned, pieces = coefficients(deflection, "phi"), deflection.division.of_beam(number)
            return turned[0, pieces[0]] if name == beam.start else turned[:, pieces[-1]].sum(0)
    return deflection.angle[at]


def rest_from(rates: Reals) -> Flags:
    """Return whether all drives have stopped for the rest of the run, shape (..., positions).

    Parameters
    ----------
    rates
        Drive rates, shape (drives, ..., positions).
    """
    greatest = np.abs(rates).max(axis=-1, keepdims=True, initial=0.0)
    moving = (np.abs(rates) > REST_RATE * greatest).any(axis=0)
    later = np.logical_or.accumulate(moving[..., ::-1], axis=-1)[..., ::-1]
    return np.logical_not(later)


def settling_time(time: Reals, apart: Reals, rests: Flags, tolerance: Reals | float) -> Reals:
    """Return the time from the first instant of rest until a distance stays within a tolerance [s], shape (...).

    Parameters
    ----------
    time
        Times [s], shape (..., positions) or (positions,).
    apart
        Distance from the rest position, shape (..., positions).
    rests
        Mask of the positions at rest, see `rest_from`.
    tolerance
        Tolerance in the unit of the distance, scalar or of shape (...).

    Returns
    -------
    Settling time, interpolated linearly between the given times. It is inf if the distance at the end exceeds the
    tolerance, and nan if there is no rest.

    Examples
    --------
    A distance of 1 that halves every second is below 0.1 after log2(10) = 3.32 s:

    >>> time = np.linspace(0.0, 6.0, 601)
    >>> settling_time(time, 0.5**time, time >= 0.0, 0.1).round(3)
    np.float64(3.322)
    """
    time = np.broadcast_to(time, apart.shape)
    beyond = rests & (apart > np.asarray(tolerance)[..., None])
    count = apart.shape[-1]
    last = count - 1 - beyond[..., ::-1].argmax(axis=-1)
    first = rests.argmax(axis=-1)
    at, after, start = last[..., None], np.minimum(last + 1, count - 1)[..., None], first[..., None]
    (here, there), (now, then) = (
        tuple(np.take_along_axis(values, where, -1)[..., 0] for where in (at, after)) for values in (apart, time)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = now + (here - tolerance) / (here - there) * (then - now)
    waited = crossed - np.take_along_axis(time, start, -1)[..., 0]
    settled = np.where(beyond.any(axis=-1), np.where(last == count - 1, np.inf, waited), 0.0)
    return np.where(rests.any(axis=-1), settled, np.nan)
