"""Peaks of motion laws: greatest speed, acceleration and jerk, and where the acceleration jumps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi

import numpy as np

from rigid.arrays import Reals
from rigid.laws import STEPS, ConstantSpeed, MotionLaw, SegmentedLaw, quintic, scca_peaks
from rigid.table_laws import RepeatedLaw, TableLaw

JUMP = 1e-9  # of the greatest acceleration, below which a change of it is round-off
Sizes = tuple[float, float, float]


@dataclass(frozen=True)
class LawPeaks:
    """Peaks of a motion law.

    Attributes
    ----------
    speed, acceleration, jerk
        Greatest magnitudes of the three derivatives of the coordinate [rad/s, rad/s^2, rad/s^3; or of m]; the jerk is
        infinite where the acceleration jumps.
    jumps
        Times at which it jumps [s].
    """

    speed: float
    acceleration: float
    jerk: float
    jumps: tuple[float, ...] = ()


def polynomial_peaks(powers: Reals) -> Sizes:
    """Greatest magnitudes of the three derivatives of a polynomial on [0, 1], by its coefficients of rising powers.

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
"""Peaks of `CURVES` within a rise of 1 in a time of 1, without the jumps of their acceleration."""


def law_peaks(law: MotionLaw) -> LawPeaks | None:
    """Peaks of a motion law, in closed form; None of a law of another kind.

    A law of segments begins and ends at constant speed: an acceleration at its ends is a jump; repeated, its end meets
    its start. What is before a table and behind it nobody knows.

    Examples
    --------
    A harmonic rise of 1 in 1 s begins with an acceleration of pi^2/2, in no time; up and down over and over it is a
    cosine:

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
        steps += [begin + lasts * share for share in STEPS.get(segment.curve, ()) if segment.rise]
        begin += lasts
    speed, acceleration, jerk = (float(each) for each in np.max(sizes, axis=0))
    around = [ends[-1][1] if repeated else 0.0, *np.ravel(ends).tolist(), ends[0][0] if repeated else 0.0]
    meet = [0.0, *np.cumsum([segment.duration for segment in law.segments]).tolist()]
    steps += [
        time for time, before, after in zip(meet, around[::2], around[1::2], strict=True)
        if abs(after - before) > JUMP * acceleration
    ]  # fmt: skip
    return LawPeaks(speed, acceleration, inf if steps else jerk, tuple(sorted(steps)))


def _table(law: TableLaw) -> LawPeaks:
    """Of a cubic spline: its speed is greatest at a knot, or where the acceleration passes zero."""
    knots = np.array(law.times)
    _, rate, acceleration = law(knots)
    jerks = np.diff(acceleration) / np.diff(knots)
    passes = [*_zeros(knots, acceleration)]
    rates = np.append(rate, law(np.array(passes))[1] if passes else ())
    speed, greatest, jerk = (float(np.abs(each).max()) for each in (rates, acceleration, jerks))
    return LawPeaks(speed, greatest, jerk)


def _zeros(knots: Reals, acceleration: Reals) -> Iterator[float]:
    """Where an acceleration that is linear between knots passes zero."""
    pairs = zip(pairwise(knots.tolist()), pairwise(acceleration.tolist()), strict=True)
    for (start, end), (before, after) in pairs:
        if before * after < 0.0:
            yield start + (end - start) * before / (before - after)
