"""Peak speed, acceleration and jerk of motion laws, and acceleration jumps."""

from collections.abc import Iterator
from itertools import pairwise
from math import inf

import numpy as np
from msgspec import Struct

from rigid.arrays import Reals
from rigid.laws import INNER_JUMPS, PEAKS, ConstantSpeed, MotionLaw, SegmentedLaw, polynomial_peaks, quintic
from rigid.table_laws import RepeatedLaw, TableLaw

MIN_JUMP = 1e-9  # smallest acceleration jump that is not round-off, relative to the peak acceleration


class LawPeaks(Struct, frozen=True):
    """Peaks of a motion law.

    Attributes
    ----------
    speed, acceleration, jerk
        Largest magnitudes of the first three derivatives of the coordinate [rad/s, rad/s^2, rad/s^3; for a slide, m
        instead of rad]. The jerk is infinite if the acceleration jumps.
    jumps
        Times of acceleration jumps [s].
    """

    speed: float
    acceleration: float
    jerk: float
    jumps: tuple[float, ...] = ()


def law_peaks(law: MotionLaw) -> LawPeaks | None:
    """Return the peaks of a motion law in closed form, or None if no closed form is known.

    The speed is constant before and after a law of segments, so an acceleration at either end is a jump. If the law is
    repeated, its start follows its end. The motion outside a table is unknown, so the ends of a table are not jumps.

    Examples
    --------
    A harmonic rise of 1 in 1 s starts with an acceleration jump of pi^2/2. Repeated up and down, it is a cosine:

    >>> from rigid.laws import Segment
    >>> up, down = Segment("harmonic", 1.0, 1.0), Segment("harmonic", 1.0, -1.0)
    >>> law_peaks(SegmentedLaw(0.0, (up,))).jumps
    (0.0, 1.0)
    >>> law_peaks(RepeatedLaw(SegmentedLaw(0.0, (up, down)))).jerk  # pi^3/2
    15.5031...
    """
    if isinstance(law, ConstantSpeed):
        return LawPeaks(float(np.abs(law.speed).max()), 0.0, 0.0)
    if isinstance(law, RepeatedLaw):
        return _segments(law.law, True) if isinstance(law.law, SegmentedLaw) else law_peaks(law.law)
    if isinstance(law, SegmentedLaw):
        return _segments(law, False)
    return _table(law) if isinstance(law, TableLaw) else None


def _segments(law: SegmentedLaw, repeated: bool) -> LawPeaks:
    sizes, ends, steps, begin = [], [], [], 0.0
    for number, segment in enumerate(law.segments):
        speeds, duration, rise = law.speeds[number], segment.duration, abs(segment.rise)
        run_up = segment.curve == "polynomial-345" and any(speeds)
        within = (
            polynomial_peaks(quintic(segment, speeds)) if run_up else [rise * size for size in PEAKS[segment.curve]]
        )
        sizes.append([size / duration**order for order, size in enumerate(within, 1)])
        ends.append([float(each) / duration**2 for each in law.stretched(number, np.array([0.0, 1.0]))[2]])
        steps += [begin + duration * share for share in INNER_JUMPS.get(segment.curve, ()) if segment.rise]
        begin += duration
    speed, acceleration, jerk = (float(each) for each in np.max(sizes, axis=0))
    around = [ends[-1][1] if repeated else 0.0, *np.ravel(ends).tolist(), ends[0][0] if repeated else 0.0]
    meet = [0.0, *np.cumsum([segment.duration for segment in law.segments]).tolist()]
    steps += [
        time for time, before, after in zip(meet, around[::2], around[1::2], strict=True)
        if abs(after - before) > MIN_JUMP * acceleration
    ]  # fmt: skip
    return LawPeaks(speed, acceleration, inf if steps else jerk, tuple(sorted(steps)))


def _table(law: TableLaw) -> LawPeaks:
    """Return the peaks of a cubic spline, from its knots and the zeros of its acceleration."""
    knots = np.array(law.times)
    _, rate, acceleration = law(knots)
    jerks = np.diff(acceleration) / np.diff(knots)
    passes = [*_zeros(knots, acceleration)]
    rates = np.append(rate, law(np.array(passes))[1] if passes else ())
    speed, greatest, jerk = (float(np.abs(each).max()) for each in (rates, acceleration, jerks))
    return LawPeaks(speed, greatest, jerk)


def _zeros(knots: Reals, acceleration: Reals) -> Iterator[float]:
    """Yield the zeros of an acceleration that is linear between the knots."""
    pairs = zip(pairwise(knots.tolist()), pairwise(acceleration.tolist()), strict=True)
    for (start, end), (before, after) in pairs:
        if before * after < 0.0:
            yield start + (end - start) * before / (before - after)
