"""Error of the output of a machine due to elastic links, and settling time of the output after a stop."""

from typing import Any

import numpy as np
from msgspec import Struct

from elastic.derived import coefficients
from elastic.sampling import displacement_of
from elastic.solution import Deflection
from rigid import Reals, velocity_of
from rigid.arrays import Complex, Complexes, Flags, Numbers

REST_SPEED = 1e-12  # a point counts as at rest up to this speed, relative to its largest speed
MIN_PERIODS = 3  # of an oscillation whose mean is computed
MIN_POSITIONS_PER_PERIOD = 8
MAX_DRIFT = 0.1  # a displacement that changes by less, relative to its mean, is nearly constant
REST_RATE = 1e-9  # a drive counts as at rest up to this rate, relative to its largest rate


class PathDeviation(Struct, frozen=True, eq=False):
    """Displacement of a point, and its components along and normal to the path of the point in the rigid mechanism.

    Attributes
    ----------
    along
        Component along the path [m], positive in the direction of motion, shape (..., positions).
    normal
        Component normal to the path [m], positive to the left of the direction of motion, shape (..., positions).
    displacement
        Displacement in ground axes [m], complex, shape (..., positions).
    """

    along: Reals
    normal: Reals
    displacement: Complexes


def path_deviation(deflection: Deflection, link: str, point: str) -> PathDeviation:
    """Return the deviation of a point of a link from its position and path in the rigid mechanism.

    `along` and `normal` are nan at positions where the point is at rest, because its path has no direction there.
    """
    moved = displacement_of(deflection, link, point)
    velocity = velocity_of(deflection.motion, link, point)
    speed = np.abs(velocity)
    fastest = np.nanmax(speed, axis=-1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = moved * np.conj(np.where(speed > REST_SPEED * fastest, velocity / speed, np.nan))
    return PathDeviation(seen.real, seen.imag, moved)


def angle_error(deflection: Deflection, link: str, point: str | None = None) -> Reals:
    """Return the rotation of a link at a point, relative to the rigid link [rad], shape (..., positions).

    The result depends on the point, because the sections of a bent link rotate by different angles. The default point
    is the first point of the link. For a point at which no beam begins or ends, the rotation of the link axes is
    returned.
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
    """Return for each position whether all drives are at rest from this position on, shape (..., positions).

    Parameters
    ----------
    rates
        Drive rates, shape (drives, ..., positions).
    """
    greatest = np.abs(rates).max(axis=-1, keepdims=True, initial=0.0)
    moving = (np.abs(rates) > REST_RATE * greatest).any(axis=0)
    later = np.logical_or.accumulate(moving[..., ::-1], axis=-1)[..., ::-1]
    return np.logical_not(later)


def offset_at_rest(time: Reals, apart: Numbers, rests: Flags) -> Complex:
    """Return the mean of a displacement from a static position that it oscillates about at the end of the rest.

    The mean differs from 0 if axial forces or large displacement change the static position. Hann's window over the
    last half of the rest suppresses the oscillation. The result is 0 if it has fewer than `MIN_PERIODS` periods there,
    unless the displacement is nearly constant.

    Parameters
    ----------
    time
        Times [s], shape (positions,).
    apart
        Displacement from the static position, real or complex, shape (positions,).
    rests
        Result of `rest_from`, shape (positions,).
    """
    if not rests.any():
        return 0.0
    begin = (time[rests][0] + time[-1]) / 2.0
    late = rests & (time >= begin) & np.isfinite(apart)
    if late.sum() < MIN_PERIODS * MIN_POSITIONS_PER_PERIOD:
        return 0.0
    times, values = time[late], apart[late]
    weights = np.sin(np.pi * (times - begin) / (time[-1] - begin)) ** 2 * np.gradient(times)
    mean: Any = np.average(values, weights=weights)
    swing = values - mean
    largest = swing[np.abs(swing).argmax()]
    oscillates = np.count_nonzero(np.diff(np.real(swing * np.conj(largest)) > 0.0)) >= 2 * MIN_PERIODS
    return mean if oscillates or abs(largest) < MAX_DRIFT * abs(mean) else 0.0


def settling_time(time: Reals, apart: Reals, rests: Flags, tolerance: Reals | float) -> Reals:
    """Return the time from the stop of the drives until a distance stays within a tolerance [s], shape (...).

    Parameters
    ----------
    time
        Times [s], shape (..., positions) or (positions,).
    apart
        Distance of a point from its rest position, shape (..., positions).
    rests
        Result of `rest_from`, shape (..., positions).
    tolerance
        Tolerance in the unit of the distance, scalar or of shape (...).

    Returns
    -------
    Settling time, interpolated linearly between the given times. It is inf if the distance at the last position exceeds
    the tolerance, and nan if the drives never stop.

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
