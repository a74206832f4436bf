"""After how long a mechanism is where it was: the common period of its drives, and the turns that its links take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isclose, lcm, nan, pi
from typing import Any

import numpy as np

from kinelast.scene.course import Course
from kinelast.scene.drives import Drive, DriveEffort, DriveLaw
from kinelast.scene.error import SceneError
from kinelast.scene.laws import RepeatedLaw, TableLaw
from kinelast.scene.numbers import any_nonzero
from rigid import ConstantSpeed, MechanismError, Reals, SegmentedLaw

MOST = 32  # turns or rounds of any drive in a cycle: at 360 positions eleven are left to each
EQUAL = 1e-9  # relative, of ratios: as written they are equal to round-off
TURNS = (1, 2, 4, 8)  # after which links of a mechanism without gears may be back
SAME = 1e-7  # of the size, and of a unit vector
STEPS = 64  # positions to a turn or round, at which several drives are followed


@dataclass(frozen=True, eq=False)
class Repetition:
    """How the drives of a mechanism, or the mechanism, repeat.

    Attributes
    ----------
    turn
        One turn of the first drive at constant speed, or the longest of repeated laws, of as many rounds as bring the
        drive back [s]; None without either.
    period
        After which all is as it was [s], shape (designs, 1) where it differs by design; nan where that is never.
    why
        Why there is no period; empty where there is one.
    """

    turn: Any
    period: Any
    why: str = ""


def drives_repeat(drives: Sequence[Drive], laws: Sequence[DriveLaw | DriveEffort]) -> Repetition:
    """The common period of the drives, each at constant speed, by a repeated law, or at rest."""
    turns: list[Any] = []
    rounds: list[float] = []
    why = ""
    for number, (drive, law) in enumerate(zip(drives, laws, strict=True), 1):
        if isinstance(law, ConstantSpeed):
            speed: Any = law.speed
            if not any_nonzero(speed):
                continue
            if drive.turns:
                with np.errstate(divide="ignore"):
                    turns.append(2 * pi / abs(speed))
            else:
                why = why or f"drive no. {number} slides on at constant speed"
        elif isinstance(law, RepeatedLaw):
            count = law.rounds(MOST) if drive.turns else int(law.closes(False))
            rounds.append(law.duration * max(count, 1))
            if not count:
                why = why or f"repeated, the law of drive no. {number} does not bring it back"
        elif isinstance(law, DriveEffort):
            why = why or f"drive no. {number} is an effort"
        elif isinstance(law, TableLaw) or (
            isinstance(law, SegmentedLaw) and any(piece.curve != "dwell" for piece in law.segments)
        ):
            why = why or f"the law of drive no. {number} is not repeated"
    first = turns[0] if turns else max(rounds, default=None)
    if first is None or why:
        return Repetition(first, nan, why)
    period = common_period([*turns, *rounds])
    if np.isnan(period).any():
        why = f"the drives have no common period: none within {MOST} turns or rounds of each"
    return Repetition(first, period, why)


def common_period(periods: Sequence[Any]) -> Any:
    """The least common multiple of durations [s], each at most `MOST` times in it; nan where there is none.

    Of durations of shape (designs, 1), one for each design.
    """
    if not any(isinstance(period, np.ndarray) for period in periods):
        return _least_common([float(period) for period in periods])
    columns = np.broadcast_arrays(*(np.asarray(period, float) for period in periods))
    rows = np.stack([column.ravel() for column in columns], axis=1)
    return np.array([_least_common(row) for row in rows.tolist()]).reshape(columns[0].shape)


def _least_common(periods: Sequence[float]) -> float:
    """The least common multiple of durations; nan where one of them would be in it more than `MOST` times."""
    first = periods[0]
    if len(periods) == 1 or not np.isfinite(periods).all():
        return first
    ratios = [Fraction(period / first).limit_denominator(MOST) for period in periods]
    pairs = zip(ratios, periods, strict=True)
    if not all(isclose(float(ratio), period / first, rel_tol=EQUAL) for ratio, period in pairs):
        return nan
    # first * n is a whole multiple of every first * p / q, where p divides n q: the least n is the l.c.m. of all p.
    times = lcm(*(ratio.numerator for ratio in ratios))
    return first * times if max(times / ratio for ratio in ratios) <= MOST else nan


def mechanism_repeats(course: Course, drives: Repetition) -> Repetition:
    """After how many common periods of its drives a mechanism is where it was.

    Gears, and links that come to another assembly, may take several. A mechanism that does not close, or not all the
    way through the first period, is not judged here.
    """
    if drives.why or drives.turn is None:
        return drives
    for most in (1, MOST) if course.mechanism.gears else TURNS:
        try:
            away, size = _away(course, drives, most)
        except (MechanismError, SceneError):
            return drives
        if not np.isfinite(away[..., 0]).all():
            return drives
        back = away < SAME * size
        if back.any(axis=-1).all():
            times = back.argmax(axis=-1) + 1
            if (times == 1).all():
                return drives
            return replace(drives, period=drives.period * (times[:, None] if times.ndim else int(times)))
        if np.isnan(away).any():
            break
    why = "the mechanism comes to another assembly, or its wheels to other places, and"
    return replace(drives, period=nan, why=f"{why} is not back where it was within {most} rounds of its drives")


def _away(course: Course, drives: Repetition, most: int) -> tuple[Reals, float]:
    """How far links are from where they were after each of some periods [m], shape (..., most); and the size [m]."""
    steps = STEPS * int(np.max(np.ceil(drives.period / drives.turn))) if len(course.laws) > 1 else 1
    motion = course.at(drives.period * (np.arange(most * steps + 1) / steps))
    origin, direction = (part[..., ::steps] for part in (motion.origin, motion.direction))
    size = course.mechanism.size
    apart = np.maximum(np.abs(origin - origin[..., :1]), size * np.abs(direction - direction[..., :1]))
    return np.asarray(apart[..., 1:].max(axis=0)), size
