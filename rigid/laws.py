"""Motion laws of drives: coordinate, rate and acceleration as closed forms of time.

The curves are those of cam practice, normalised to a rise of 1 in a time of 1: R. L. Norton, Cam Design and
Manufacturing Handbook, 2nd ed., Industrial Press 2009, chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from rigid.arrays import ArrayLike, Real, Reals

Triple = tuple[Reals, Reals, Reals]
MotionLaw = Callable[[Any], Triple]
"""From times [s] to coordinate, rate and acceleration of a drive, each of their shape."""
JUMP = 1e-9  # of the speeds before and after, above which a change of speed is an impact
SAME = 1e-12  # of its duration, by which an instant may miss the end of a segment


class LawError(ValueError):
    """A motion law that cannot be followed; `segment` is the number of the segment at fault, from 1."""

    def __init__(self, segment: int, problem: str) -> None:
        super().__init__(f"segment {segment}: {problem}")
        self.segment = segment
        self.problem = problem


class TableError(ValueError):
    """A table that cannot be, or that does not reach as far as it is asked.

    `place` is where it was asked, `ends` where it begins and ends; None where it cannot be at all.
    """

    def __init__(self, message: str, place: float | None = None, ends: tuple[float, float] | None = None) -> None:
        super().__init__(message)
        self.place, self.ends = place, ends


def _value(powers: Reals, z: Reals) -> Reals:
    """Value of a polynomial by its coefficients, of rising powers; numpy's own is in a module that is long to load."""
    value: Reals = powers[-1] + 0.0 * z
    for power in powers[-2::-1]:
        value = power + value * z
    return value


def _polynomial(*coefficients: float) -> Callable[[Reals], Triple]:
    powers = [np.array(coefficients, float)]
    for _ in range(2):
        powers.append(powers[-1][1:] * np.arange(1, len(powers[-1])) if len(powers[-1]) > 1 else np.zeros(1))

    def curve(z: Reals) -> Triple:
        value, rate, acceleration = (_value(power, z) for power in powers)
        return value, rate, acceleration

    return curve


def _cycloidal(z: Reals) -> Triple:
    turn = 2 * pi * z
    return z - np.sin(turn) / (2 * pi), 1 - np.cos(turn), 2 * pi * np.sin(turn)


def _harmonic(z: Reals) -> Triple:
    turn = pi * z
    return (1 - np.cos(turn)) / 2, pi / 2 * np.sin(turn), pi**2 / 2 * np.cos(turn)


def _trapezoidal(z: Reals) -> Triple:
    """A third at constant acceleration, a third at constant speed, a third at constant deceleration."""
    early, late = z < 1 / 3, z >= 2 / 3
    value = np.select([early, late], [2.25 * z**2, 1 - 2.25 * (1 - z) ** 2], 1.5 * z - 0.25)
    rate = np.select([early, late], [4.5 * z, 4.5 * (1 - z)], 1.5)
    return value, rate, np.select([early, late], [4.5, -4.5], 0.0)


def _scca_meets(sine: float, cosine: float) -> tuple[float, float, float, float, float]:
    """Speed and coordinate where the pieces of such a curve meet, at an acceleration of 1, and its true one at last."""
    ends, flat = sine / 2, (1 - cosine) / 2
    speed = 2 * ends / pi
    travel = ends**2 * (2 / pi) * (1 - 2 / pi)
    lasts = flat - ends
    later_way, later = travel + speed * lasts + lasts**2 / 2, speed + lasts
    peak = 1 / (2 * (later_way + later * cosine / 2 + (cosine / pi) ** 2))  # half of the rise is 1/2
    return speed, travel, later, later_way, peak


def scca_peaks(sine: float, cosine: float) -> tuple[float, float, float]:
    """Greatest speed, acceleration and jerk within a curve of Norton's SCCA family; shares as in that."""
    *_, later, _, peak = _scca_meets(sine, cosine)
    swings = [share for share in (sine, cosine) if share]
    return peak * (later + cosine / pi), peak, peak * pi / min(swings) if swings else 0.0


def _sine_constant_cosine(sine: float, cosine: float) -> Callable[[Reals], Triple]:
    """Curves with an acceleration that grows and falls like a sine, is constant, and passes zero like a cosine.

    Norton's SCCA family. `sine` is the share of the time for both ends together, `cosine` that in the middle.
    """
    b, d = sine, cosine
    ends, flat = b / 2, (1 - d) / 2
    speed, travel, later, later_way, peak = _scca_meets(sine, cosine)

    def half(z: Reals) -> Triple:
        """The first half of the rise."""
        first, third = z < ends, z > flat
        turn = pi * z / b if b else np.zeros(np.shape(z))
        swing = pi * (z - flat) / d if d else np.zeros(np.shape(z))
        on, rest = z - ends, z - flat
        value = np.select(
            [first, third],
            [b / pi * (z - b / pi * np.sin(turn)), later_way + later * rest + (d / pi) ** 2 * (1 - np.cos(swing))],
            travel + speed * on + on**2 / 2,
        )
        rate = np.select([first, third], [b / pi * (1 - np.cos(turn)), later + d / pi * np.sin(swing)], speed + on)
        return peak * value, peak * rate, peak * np.select([first, third], [np.sin(turn), np.cos(swing)], 1.0)

    def curve(z: Reals) -> Triple:
        back = z >= 0.5
        value, rate, acceleration = half(np.where(back, 1 - z, z))
        return np.where(back, 1 - value, value), rate, np.where(back, -acceleration, acceleration)

    return curve


CURVES: Mapping[str, Callable[[Reals], Triple]] = {
    "dwell": _polynomial(0.0),
    "constant-speed": _polynomial(0.0, 1.0),
    "harmonic": _harmonic,
    "cycloidal": _cycloidal,
    "polynomial-345": _polynomial(0, 0, 0, 10, -15, 6),
    "polynomial-4567": _polynomial(0, 0, 0, 0, 35, -84, 70, -20),
    "trapezoidal-velocity": _trapezoidal,
    "constant-acceleration": _sine_constant_cosine(0.0, 0.0),
    "modified-trapezoid": _sine_constant_cosine(0.25, 0.25),
    "modified-sine": _sine_constant_cosine(0.25, 0.75),
}
"""Curves by name: z in 0..1, any shape, to s, ds/dz and d2s/dz2 of the same shape."""
STEPS = {"trapezoidal-velocity": (1 / 3, 2 / 3), "constant-acceleration": (0.5,)}
"""Shares of the time at which the acceleration of a curve jumps, besides its ends."""


@dataclass(frozen=True)
class Segment:
    """A piece of a motion law.

    Attributes
    ----------
    curve
        Name of one of `CURVES`.
    duration
        How long it lasts [s].
    rise
        By how much the coordinate changes [rad or m]; 0 for a dwell.
    """

    curve: str
    duration: float
    rise: float = 0.0


@dataclass(frozen=True)
class ConstantSpeed:
    """The coordinate grows at one rate from its start.

    `start` [rad or m] and `speed` [rad/s or m/s], or arrays of shape (designs, 1). Called with times [s] of any shape,
    it returns coordinate, rate and acceleration of the same shape, or (designs, positions).
    """

    start: Real
    speed: Real

    def __call__(self, time: ArrayLike) -> Triple:
        """Coordinate, rate and acceleration at given times [s]."""
        time = np.asarray(time, float)
        coordinate = self.start + self.speed * time
        return coordinate, np.full(coordinate.shape, self.speed), np.zeros(coordinate.shape)


@dataclass(frozen=True)
class SegmentedLaw:
    """Segments one after the other from `start` [rad or m]; after the last one the coordinate stays.

    `start` may have shape (designs, 1); coordinates are of shape (designs, positions) then.

    A 3-4-5 polynomial next to a constant speed takes over its speed (and stays free of jumps in acceleration); next to
    anything else it starts and ends at rest, as all other curves do.

    Raises
    ------
    LawError
        A segment lasts no time, its curve is unknown, a dwell rises, or the speed jumps between two segments, which no
        finite force can follow.

    Examples
    --------
    A cycloidal rise of 1 in 1 s is at its greatest speed, 2, half-way:

    >>> rise = SegmentedLaw(0.0, (Segment("cycloidal", 1.0, 1.0),))
    >>> [float(value[0]) for value in rise([0.5])[:2]]
    [0.5, 2.0]
    """

    start: Real
    segments: tuple[Segment, ...]

    def __post_init__(self) -> None:
        """Refuse a law that cannot be followed."""
        if not self.segments:
            raise LawError(1, "a law needs at least one segment")
        for number, segment in enumerate(self.segments, 1):
            if segment.curve not in CURVES:
                raise LawError(number, f'there is no curve "{segment.curve}", there are {", ".join(CURVES)}')
            if not segment.duration > 0:
                raise LawError(number, f"lasts {segment.duration:g} s, expected more than 0")
            if segment.curve == "dwell" and segment.rise:
                raise LawError(number, f"a dwell cannot rise by {segment.rise:g}")
        for number, (before, after) in enumerate(zip(self.speeds, self.speeds[1:], strict=False), 2):
            if abs(after[0] - before[1]) > JUMP * (abs(after[0]) + abs(before[1])):
                raise LawError(
                    number,
                    f"the speed jumps from {before[1]:g} to {after[0]:g}, an impact: "
                    "put a polynomial-345 between rest and constant speed",
                )

    @cached_property
    def speeds(self) -> tuple[tuple[float, float], ...]:
        """Speeds at the two ends of every segment."""
        steady = [piece.rise / piece.duration if piece.curve == "constant-speed" else 0.0 for piece in self.segments]
        around = [0.0, *steady, 0.0]
        return tuple(
            (around[k], around[k + 2]) if piece.curve == "polynomial-345" else (steady[k], steady[k])
            for k, piece in enumerate(self.segments)
        )

    @cached_property
    def _ends(self) -> Reals:
        """Times at which the segments end [s]."""
        return np.cumsum([segment.duration for segment in self.segments])

    @property
    def duration(self) -> float:
        """Time from the start of the first segment to the end of the last [s]."""
        return float(self._ends[-1])

    @property
    def final_speed(self) -> float:
        """Speed at the end of the last segment [rad/s or m/s]."""
        return self.speeds[-1][1]

    def __call__(self, time: ArrayLike) -> Triple:
        """Coordinate, rate and acceleration at given times [s], each of their shape.

        At a jump of the acceleration the side after it counts, at the very end the side before. An instant that misses
        a jump by round-off is at it.
        """
        time = np.asarray(time, float)
        if isinstance(self.start, np.ndarray):
            value, rate, acceleration = replace(self, start=0.0)(time)
            return self.start + value, rate, acceleration
        ends = self._ends[:-1]
        at = np.searchsorted(ends - SAME * self._ends[-1], time, side="right")
        value, rate, acceleration = np.empty(time.shape), np.empty(time.shape), np.empty(time.shape)
        level: Any = self.start
        for k, segment in enumerate(self.segments):
            here, lasts = at == k, segment.duration
            z = np.clip(1.0 + (time[here] - self._ends[k]) / lasts, 0.0, 1.0)
            for step in STEPS.get(segment.curve, ()):
                z = np.where(np.abs(z - step) * lasts <= SAME * self._ends[-1], step, z)
            rise, speed, bend = self.stretched(k, z)
            value[here], rate[here], acceleration[here] = level + rise, speed / lasts, bend / lasts**2
            level += segment.rise
        over = time > self.duration * (1 + SAME)
        rate[over] = acceleration[over] = 0.0
        return value, rate, acceleration

    def stretched(self, number: int, z: Reals) -> Triple:
        """Rise of a segment, counted from 0, at shares z of its time, and the derivatives by z, each of its shape."""
        segment, speeds = self.segments[number], self.speeds[number]
        if segment.curve == "polynomial-345" and any(speeds):
            return _polynomial(*quintic(segment, speeds))(z)
        rise, speed, bend = CURVES[segment.curve](z)
        return segment.rise * rise, segment.rise * speed, segment.rise * bend


def quintic(segment: Segment, speeds: tuple[float, float]) -> Reals:
    """Coefficients, of rising powers, of the quintic of given end speeds without acceleration at its ends.

    At rest at both ends it is the 3-4-5.
    """
    h = segment.rise
    a, b = (speed * segment.duration for speed in speeds)
    return np.array([0.0, a, 0.0, 10 * h - 6 * a - 4 * b, -15 * h + 8 * a + 7 * b, 6 * h - 3 * (a + b)])
