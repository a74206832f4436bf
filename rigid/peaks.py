"""Peak speed, acceleration and jerk of motion laws, and jumps of the acceleration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi

import numpy as np

from rigid.arrays import Reals
from rigid.laws import INNER_JUMPS, ConstantSpeed, MotionLaw, SegmentedLaw, quintic, scca_peaks
from rigid.table_laws import RepeatedLaw, TableLaw

MIN_JUMP = 1e-9  # largest change of acceleration due to round-off, relative to its peak
Sizes = tuple[float, float, float]


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


def polynomial_peaks(powers: Reals) -> Sizes:
    """Largest magnitudes of three derivatives of a polynomial on [0, 1], increasing powers.

    Examples
    --------
    >>> polynomial_peaks(np.array([0, 0, 0, 10.0, -15, 6]))  # the 3-4-5 polynomial: 15/8, 10/sqrt(3), 60
    (1.875, 5.7735..., 60.0)
    """
    first, second, third, fourth = (np.asarray(np.polyder(powers[::-1], order), float) for order in (1, 2, 3, 4))

    def greatest(polynomial: Reals, slope: Reals) -> float:
        turns = np.roots(slope)
        inside = turns.real[(abs(turns.imag) < 1e-9) & (turns.real > 0) & (turns.real < 1)]
        return float(np.abs(np.polyval(polynomial, [0.0, 1.0, *inside])).max())

    return greatest(first, second), greatest(second, third), greatest(third, fourth)


PEAKS: dict[str, Sizes] = {
    "dwell": (0.0, 0.0, 0.0),
    "constant-speed": (1.0, 0.0, 0.0),
    "harmonic": (pi / 2, pi**2 / 2, pi**3 / 2),
    "cycloidal": (2.0, 2 * pi, 4 * pi**2),
    "polynomial-345": polynomial_peaks(np.array([0, 0, 0, 10.0, -15, 6])),
    "polynomial-4567": polynomial_peaks(np.array([0, 0, 0, 0, 35.0, -84, 70, -20])),
    "trapezoidal-velocity": (1.5, 4.5, 0.0),
    "constant-acceleration": scca_peaks(0.0, 0.0),
    "modified-trapezoid": scca_peaks(0.25, 0.25),
    "modified-sine": scca_peaks(0.25, 0.75),
}
"""Peaks of `CURVES` for a rise of 1 in a time of 1, without acceleration jumps."""


def law_peaks(law: MotionLaw) -> LawPeaks | None:
    """Peaks of a motion law in closed form, or None for other kinds of law.

    A law of segments begins and ends at constant speed, so an acceleration at its ends is a jump. If repeated, its end
    connects to its start. The motion outside a table is unknown.

    Examples
    --------
    A harmonic rise of 1 in 1 s starts abruptly with an acceleration of pi^2/2; repeated up and down it is a cosine:

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
