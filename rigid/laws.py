"""Motion laws of drives: coordinate, rate and acceleration as functions of time in closed form.

Cam curves are normalised to a rise of 1 in a time of 1, after R. L. Norton, Cam Design and Manufacturing Handbook,
2nd ed., Industrial Press 2009, chapters 2 and 3.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import ArrayLike, Real, Reals

Triple = tuple[Reals, Reals, Reals]
MotionLaw = Callable[[Any], Triple]
"""Function from times [s] to the coordinate, rate and acceleration of a drive, in the shape of the times."""
MIN_IMPACT = 1e-9  # smallest jump in the speed that counts as an impact, relative to the sum of both speeds
INSTANT_TOLERANCE = 1e-12  # largest difference between equal instants, relative to the duration


class LawError(ValueError):
    """Invalid motion law. `segment` is the number of the invalid segment, counted from 1."""

    def __init__(self, segment: int, problem: str) -> None:
        super().__init__(f"segment {segment}: {problem}")
        self.segment = segment
        self.problem = problem


class TableError(ValueError):
    """Invalid table, or evaluation outside its range.

    `place` is the requested abscissa and `ends` the range of the table; both are None for an invalid table.
    """

    def __init__(self, message: str, place: float | None = None, ends: tuple[float, float] | None = None) -> None:
        super().__init__(message)
        self.place, self.ends = place, ends


def _value(powers: Reals, z: Reals) -> Reals:
    """Evaluate a polynomial without importing `np.polynomial`, which is slow."""
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
    """Return a rise in three phases of equal duration: constant acceleration, speed and deceleration."""
    early, late = z < 1 / 3, z >= 2 / 3
    value = np.select([early, late], [2.25 * z**2, 1 - 2.25 * (1 - z) ** 2], 1.5 * z - 0.25)
    rate = np.select([early, late], [4.5 * z, 4.5 * (1 - z)], 1.5)
    return value, rate, np.select([early, late], [4.5, -4.5], 0.0)


def _scca_transitions(sine: float, cosine: float) -> tuple[float, float, float, float, float]:
    """Return speed and coordinate after the first and the second piece of an SCCA curve, and the peak acceleration.

    The speeds and coordinates are those for a peak acceleration of 1.
    """
    ends, flat = sine / 2, (1 - cosine) / 2
    speed = 2 * ends / pi
    travel = ends**2 * (2 / pi) * (1 - 2 / pi)
    flat_time = flat - ends
    later_travel, later = travel + speed * flat_time + flat_time**2 / 2, speed + flat_time
    peak = 1 / (2 * (later_travel + later * cosine / 2 + (cosine / pi) ** 2))  # half of the curve rises by 1/2
    return speed, travel, later, later_travel, peak


def scca_peaks(sine: float, cosine: float) -> tuple[float, float, float]:
    """Return the peak speed, acceleration and jerk of an SCCA curve (see `_sine_constant_cosine`)."""
    *_, later, _, peak = _scca_transitions(sine, cosine)
    swings = [share for share in (sine, cosine) if share]
    return peak * (later + cosine / pi), peak, peak * pi / min(swings) if swings else 0.0


def _sine_constant_cosine(sine: float, cosine: float) -> Callable[[Reals], Triple]:
    """Return a curve of Norton's SCCA family: sine, constant and cosine pieces of acceleration.

    `sine` is the fraction of the duration that both sine pieces take together. `cosine` is the fraction that the cosine
    piece in the middle takes.
    """
    b, d = sine, cosine
    ends, flat = b / 2, (1 - d) / 2
    speed, travel, later, later_travel, peak = _scca_transitions(sine, cosine)

    def half(z: Reals) -> Triple:
        """Return the first half of the rise."""
        first, third = z < ends, z > flat
        turn = pi * z / b if b else np.zeros(np.shape(z))
        swing = pi * (z - flat) / d if d else np.zeros(np.shape(z))
        on, rest = z - ends, z - flat
        value = np.select(
            [first, third],
            [b / pi * (z - b / pi * np.sin(turn)), later_travel + later * rest + (d / pi) ** 2 * (1 - np.cos(swing))],
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
"""Curves by name: functions from z (0 to 1, any shape) to s, ds/dz and d2s/dz2."""
INNER_JUMPS = {"trapezoidal-velocity": (1 / 3, 2 / 3), "constant-acceleration": (0.5,)}
"""Times of the acceleration jumps inside a curve / duration."""


def polynomial_peaks(powers: Reals) -> tuple[float, float, float]:
    """Return the largest magnitudes of the first three derivatives of a polynomial on [0, 1].

    The coefficients are in the order of increasing powers.

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


PEAKS: dict[str, tuple[float, float, float]] = {
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
"""Peak speed, acceleration and jerk (without acceleration jumps) of `CURVES`, for a rise of 1 in a time of 1."""


class Segment(Struct, frozen=True):
    """A piece of a motion law.

    Attributes
    ----------
    curve
        Name of a curve in `CURVES`.
    duration
        Duration [s].
    rise
        Change of the coordinate [rad or m]; 0 for a dwell.
    """

    curve: str
    duration: float
    rise: float = 0.0


class ConstantSpeed(Struct, frozen=True):
    """Motion law with a constant rate.

    `start` [rad or m] and `speed` [rad/s or m/s] are scalars or arrays of shape (designs, 1). Arrays give coordinates,
    rates and accelerations of shape (designs, positions).
    """

    start: Real
    speed: Real

    def __call__(self, time: ArrayLike) -> Triple:
        """Return coordinate, rate and acceleration at given times [s]."""
        time = np.asarray(time, float)
        coordinate = self.start + self.speed * time
        return coordinate, np.full(coordinate.shape, self.speed), np.zeros(coordinate.shape)


class SegmentedLaw(Struct, frozen=True, dict=True):
    """Motion law of consecutive segments from `start` [rad or m]. After the segments the coordinate is constant.

    If `start` has shape (designs, 1), the coordinates have shape (designs, positions).

    A 3-4-5 polynomial next to a segment of constant speed starts or ends at this speed, without a jump in acceleration.
    At all other ends, the curves are at rest.

    Raises
    ------
    LawError
        If a segment has no duration, a curve is unknown, a dwell has a rise, or the speed jumps between two segments
        (which would require an infinite force).

    Examples
    --------
    A cycloidal rise of 1 in 1 s has its peak speed of 2 in the middle:

    >>> rise = SegmentedLaw(0.0, (Segment("cycloidal", 1.0, 1.0),))
    >>> [float(value[0]) for value in rise([0.5])[:2]]
    [0.5, 2.0]
    """

    start: Real
    segments: tuple[Segment, ...]

    def __post_init__(self) -> None:
        """Raise LawError for an invalid law."""
        if not self.segments:
            raise LawError(1, "a law needs at least one segment")
        for number, segment in enumerate(self.segments, 1):
            if segment.curve not in CURVES:
                raise LawError(number, f'unknown curve "{segment.curve}", expected one of {", ".join(CURVES)}')
            if not segment.duration > 0:
                raise LawError(number, f"the duration is {segment.duration:g} s, expected more than 0")
            if segment.curve == "dwell" and segment.rise:
                raise LawError(number, f"a dwell cannot rise by {segment.rise:g}")
        for number, (before, after) in enumerate(zip(self.speeds, self.speeds[1:], strict=False), 2):
            if abs(after[0] - before[1]) > MIN_IMPACT * (abs(after[0]) + abs(before[1])):
                raise LawError(
                    number,
                    f"the speed jumps from {before[1]:g} to {after[0]:g}, which is an impact: "
                    "put a polynomial-345 between rest and constant speed",
                )

    @cached_property
    def speeds(self) -> tuple[tuple[float, float], ...]:
        """Speeds at both ends of each segment."""
        steady = [piece.rise / piece.duration if piece.curve == "constant-speed" else 0.0 for piece in self.segments]
        around = [0.0, *steady, 0.0]
        return tuple(
            (around[k], around[k + 2]) if piece.curve == "polynomial-345" else (steady[k], steady[k])
            for k, piece in enumerate(self.segments)
        )

    @cached_property
    def _ends(self) -> Reals:
        """End times of the segments [s]."""
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
        """Return coordinate, rate and acceleration at given times [s], in the shape of `time`.

        At a jump in the acceleration, the value after the jump is returned; at the end of the law, the value before
        the end. Times within round-off of a jump count as the time of the jump.
        """
        time = np.asarray(time, float)
        if isinstance(self.start, np.ndarray):
            value, rate, acceleration = replace(self, start=0.0)(time)
            return self.start + value, rate, acceleration
        ends = self._ends[:-1]
        at = np.searchsorted(ends - INSTANT_TOLERANCE * self._ends[-1], time, side="right")
        value, rate, acceleration = np.empty(time.shape), np.empty(time.shape), np.empty(time.shape)
        level: Any = self.start
        for k, segment in enumerate(self.segments):
            here, duration = at == k, segment.duration
            z = np.clip(1.0 + (time[here] - self._ends[k]) / duration, 0.0, 1.0)
            for step in INNER_JUMPS.get(segment.curve, ()):
                z = np.where(np.abs(z - step) * duration <= INSTANT_TOLERANCE * self._ends[-1], step, z)
            rise, speed, curvature = self.stretched(k, z)
            value[here], rate[here], acceleration[here] = level + rise, speed / duration, curvature / duration**2
            level += segment.rise
        over = time > self.duration * (1 + INSTANT_TOLERANCE)
        rate[over] = acceleration[over] = 0.0
        return value, rate, acceleration

    def stretched(self, number: int, z: Reals) -> Triple:
        """Return the rise since the start of a segment, and its derivatives by z, at z = time / duration."""
        segment, speeds = self.segments[number], self.speeds[number]
        if segment.curve == "polynomial-345" and any(speeds):
            return _polynomial(*quintic(segment, speeds))(z)
        rise, speed, bend = CURVES[segment.curve](z)
        return segment.rise * rise, segment.rise * speed, segment.rise * bend


def quintic(segment: Segment, speeds: tuple[float, float]) -> Reals:
    """Return the coefficients of a quintic with given end speeds and zero end accelerations.

    The coefficients are in the order of increasing powers. With zero speeds, the quintic is the 3-4-5 polynomial.
    """
    h = segment.rise
    a, b = (speed * segment.duration for speed in speeds)
    return np.array([0.0, a, 0.0, 10 * h - 6 * a - 4 * b, -15 * h + 8 * a + 7 * b, 6 * h - 3 * (a + b)])
