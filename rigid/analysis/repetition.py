"""After how long a mechanism is where it was: the common period of its drives, and the turns that its links take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isclose, lcm, nan, pi
from typing import Any

import numpy as np

from rigid.arrays import Real, Reals
from rigid.kinematics import by_laws, motion
from rigid.laws import ConstantSpeed, MotionLaw, SegmentedLaw, TableError
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError
from rigid.table_laws import RepeatedLaw, TableLaw

MOST = 32  # turns or rounds of any drive in a cycle: at 360 positions eleven are left to each
EQUAL = 1e-9  # relative, of ratios: as written they are equal to round-off
TURNS = (1, 2, 4, 8)  # after which links of a mechanism without gears may be back
SAME = 1e-7  # of the size, and of a unit vector
NEAR_STEPS = 72  # of one turn: so near that a mechanism far from change points need not be followed
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


def drives_repeat(mechanism: Mechanism, laws: Sequence[MotionLaw | None]) -> Repetition:
    """The common period of the drives, each at constant speed, by a repeated law, or at rest; None is an effort."""
    turns: list[Any] = []
    rounds: list[float] = []
    why = ""
    for number, (drive, law) in enumerate(zip(mechanism.drives, laws, strict=True), 1):
        if isinstance(law, ConstantSpeed):
            speed: Any = law.speed
            if not np.any(speed):
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
        elif law is None:
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


def common_period(periods: Sequence[Real]) -> Real:
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


def mechanism_repeats(mechanism: Mechanism, laws: Sequence[MotionLaw | None], drives: Repetition) -> Repetition:
    """After how many common periods of its drives a mechanism is where it was.

    Gears, and links that come to another assembly, may take several. A mechanism that does not close, or not all the
    way through the first period, is not judged here.
    """
    if drives.why or drives.turn is None:
        return drives
    given = [law for law in laws if law is not None]
    for most in (1, MOST) if mechanism.gears else TURNS:
        try:
            away = _away(mechanism, given, drives, most)
        except (MechanismError, TableError):
            return drives
        if not np.isfinite(away[..., 0]).all():
            return drives
        back = away < SAME * mechanism.size
        if back.any(axis=-1).all():
            times = back.argmax(axis=-1) + 1
            if (times == 1).all():
                return drives
            return replace(drives, period=drives.period * (times[:, None] if times.ndim else int(times)))
        if np.isnan(away).any():
            break
    why = "the mechanism comes to another assembly, or its wheels to other places, and"
    return replace(drives, period=nan, why=f"{why} is not back where it was within {most} rounds of its drives")


def _away(mechanism: Mechanism, laws: Sequence[MotionLaw], drives: Repetition, most: int) -> Reals:
    """How far links are from where they were after each of some periods [m], shape (..., most)."""
    one = NEAR_STEPS if most == 1 else 1
    steps = STEPS * int(np.max(np.ceil(drives.period / drives.turn))) if len(laws) > 1 else one
    times = np.asarray(drives.period * (np.arange(most * steps + 1) / steps))
    moved = motion(mechanism, *by_laws(laws, times), times)
    origin, direction = (part[..., ::steps] for part in (moved.origin, moved.direction))
    turned = mechanism.size * np.abs(direction - direction[..., :1])
    return np.asarray(np.maximum(np.abs(origin - origin[..., :1]), turned)[..., 1:].max(axis=0))
