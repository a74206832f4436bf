"""Peak speed, acceleration and jerk of motion laws, and jumps of the acceleration."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf

import numpy as np

from rigid.arrays import Reals
from rigid.laws import INNER_JUMPS, PEAKS, ConstantSpeed, MotionLaw, SegmentedLaw, polynomial_peaks, quintic
from rigid.table_laws import RepeatedLaw, TableLaw

MIN_JUMP = 1e-9  # largest change of acceleration due to round-off, relative to its peak


@dataclass(frozen=True)
class LawPeaks:
    """Peaks of a motion law.

    Attributes
    ----------
    speed, acceleration, jerk
        Largest magnitudes of the three derivatives of the coordinate [rad/s, rad/s^2, rad/s^3; or of m]; the jerk is
        infinite if the acceleration jumps.
    jumps
        Times of acceleration jumps [s].
    """

    speed: float
    acceleration: float
    jerk: float
    jumps: tuple[float, ...] = ()


def law_peaks(law: MotionLaw) -> LawPeaks | None:
    """Peaks of a motion law in closed form, or None for other kinds of law.

    A law of segments begins and ends at constant speed, so an acceleration at its ends is a jump. If it is repeated,
    its end connects to its start. The motion outside a table is unknown.

    Examples
    --------
    A harmonic rise of 1 in 1 s starts abruptly with an acceleration of pi^2/2; repeated up and down, it is a cosine:

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
        speeds, lasts, rise = law.speeds[number], segment.duration, abs(segment.rise)
        run_up = segment.curve == "polynomial-345" and any(speeds)
        within = (
            polynomial_peaks(quintic(segment, speeds)) if run_up else [rise * size for size in PEAKS[segment.curve]]
        )
        sizes.append([size / lasts**order for order, size in enumerate(within, 1)])
        ends.append([float(each) / lasts**2 for each in law.stretched(number, np.array([0.0, 1.0]))[2]])
        steps += [begin + lasts * share for share in INNER_JUMPS.get(segment.curve, ()) if segment.rise]
        begin += lasts
    speed, acceleration, jerk = (float(each) for each in np.max(sizes, axis=0))
    around = [ends[-1][1] if repeated else 0.0, *np.ravel(ends).tolist(), ends[0][0] if repeated else 0.0]
    meet = [0.0, *np.cumsum([segment.duration for segment in law.segments]).tolist()]
    steps += [
        time for time, before, after in zip(meet, around[::2], around[1::2], strict=True)
        if abs(after - before) > MIN_JUMP * acceleration
    ]  # fmt: skip
    return LawPeaks(speed, acceleration, inf if steps else jerk, tuple(sorted(steps)))


def _table(law: TableLaw) -> LawPeaks:
    """Peaks of a cubic spline, from its knots and the zeros of the acceleration."""
    knots = np.array(law.times)
    _, rate, acceleration = law(knots)
    jerks = np.diff(acceleration) / np.diff(knots)
    passes = [*_zeros(knots, acceleration)]
    rates = np.append(rate, law(np.array(passes))[1] if passes else ())
    speed, greatest, jerk = (float(np.abs(each).max()) for each in (rates, acceleration, jerks))
    return LawPeaks(speed, greatest, jerk)


def _zeros(knots: Reals, acceleration: Reals) -> Iterator[float]:
    """Yield the zeros of an acceleration that is linear between knots."""
    pairs = zip(pairwise(knots.tolist()), pairwise(acceleration.tolist()), strict=True)
    for (start, end), (before, after) in pairs:
        if before * after < 0.0:
            yield start + (end - start) * before / (before - after)
