"""Period of a mechanism: the common period of the drives, times the number of such periods until the links return."""

from collections.abc import Sequence
from math import isclose, lcm, nan, pi
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import Real, Reals
from rigid.kinematics import by_laws, postures
from rigid.laws import ConstantSpeed, MotionLaw, SegmentedLaw, TableError
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError
from rigid.table_laws import RepeatedLaw, TableLaw

MAX_ROUNDS = 32  # maximum number of drive turns or periods in a cycle (360 positions then give 11 for each)
RATIO_TOLERANCE = 1e-9  # largest relative difference between ratios that count as equal
TURNS = (1, 2, 4, 8)  # numbers of periods to try for a mechanism without gears
CLOSING_TOLERANCE = 1e-7  # largest closing error, relative to the mechanism's size
NEAR_STEPS = 72  # steps per turn, fine enough that a mechanism far from change points needs no tracking
STEPS_PER_TURN = 64  # steps per turn or period with several drives, whose path must be tracked


class Repetition(Struct, frozen=True, eq=False):
    """Repetition of a mechanism or of its drives.

    Attributes
    ----------
    turn
        Duration of one turn of the first drive that turns at constant speed [s]. Without such a drive, longest time
        after which a repeated law returns its drive to the start. None if there is neither.
    period
        Common period [s], or nan. Shape (designs, 1) if designs differ.
    reason
        Reason why there is no period, or "".
    """

    turn: Any
    period: Any
    reason: str = ""


def drives_repeat(mechanism: Mechanism, laws: Sequence[MotionLaw | None]) -> Repetition:
    """Return the common period of the drives. The law of a drive with a given effort is None."""
    turns: list[Any] = []
    rounds: list[float] = []
    reason = ""
    for number, (drive, law) in enumerate(zip(mechanism.drives, laws, strict=True), 1):
        if isinstance(law, ConstantSpeed):
            speed: Any = law.speed
            if not np.any(speed):
                continue
            if drive.turns:
                with np.errstate(divide="ignore"):
                    turns.append(2 * pi / abs(speed))
            else:
                reason = reason or f"drive no. {number} slides at constant speed and does not return"
        elif isinstance(law, RepeatedLaw):
            count = law.rounds(MAX_ROUNDS) if drive.turns else int(law.closes(False))
            rounds.append(law.duration * max(count, 1))
            if not count:
                reason = reason or f"the repeated law of drive no. {number} does not return it to the start"
        elif law is None:
            reason = reason or f"drive no. {number} has a given effort"
        elif isinstance(law, TableLaw) or (
            isinstance(law, SegmentedLaw) and any(piece.curve != "dwell" for piece in law.segments)
        ):
            reason = reason or f"the law of drive no. {number} is not repeated"
    first = turns[0] if turns else max(rounds, default=None)
    if first is None or reason:
        return Repetition(first, nan, reason)
    period = common_period([*turns, *rounds])
    if np.isnan(period).any():
        reason = f"the drives have no common period within {MAX_ROUNDS} turns or periods of each drive"
    return Repetition(first, period, reason)


def common_period(periods: Sequence[Real]) -> Real:
    """Return the least common multiple of durations [s], or nan.

    The result is at most `MAX_ROUNDS` times each duration. Durations of shape (designs, 1) give one result per design.
    """
    if not any(isinstance(period, np.ndarray) for period in periods):
        return _least_common([float(period) for period in periods])
    columns = np.broadcast_arrays(*(np.asarray(period, float) for period in periods))
    rows = np.stack([column.ravel() for column in columns], axis=1)
    return np.array([_least_common(row) for row in rows.tolist()]).reshape(columns[0].shape)


def _least_common(periods: Sequence[float]) -> float:
    """Return the least common multiple of durations; nan if it exceeds `MAX_ROUNDS` times the shortest duration."""
    first = periods[0]
    if len(periods) == 1 or not np.isfinite(periods).all():
        return first
    from fractions import Fraction

    ratios = [Fraction(period / first).limit_denominator(MAX_ROUNDS) for period in periods]
    pairs = zip(ratios, periods, strict=True)
    if not all(isclose(float(ratio), period / first, rel_tol=RATIO_TOLERANCE) for ratio, period in pairs):
        return nan
    # first * n is a multiple of each first * p / q if p divides n q, so the smallest n is the l.c.m. of all p
    times = lcm(*(ratio.numerator for ratio in ratios))
    return first * times if max(times / ratio for ratio in ratios) <= MAX_ROUNDS else nan


def mechanism_repeats(mechanism: Mechanism, laws: Sequence[MotionLaw | None], drives: Repetition) -> Repetition:
    """Return the period of the mechanism: the smallest multiple of the drive period after which the links return.

    With gears, or if the links change their assembly branch, this may take several drive periods. If the mechanism
    cannot move through the first period, `drives` is returned unchanged.
    """
    if drives.reason or drives.turn is None:
        return drives
    given = [law for law in laws if law is not None]
    for most in (1, MAX_ROUNDS) if mechanism.gears else TURNS:
        try:
            away = _away(mechanism, given, drives, most)
        except (MechanismError, TableError):
            return drives
        if not np.isfinite(away[..., 0]).all():
            return drives
        back = away < CLOSING_TOLERANCE * mechanism.size
        if back.any(axis=-1).all():
            times = back.argmax(axis=-1) + 1
            if (times == 1).all():
                return drives
            return replace(drives, period=drives.period * (times[:, None] if times.ndim else int(times)))
        if np.isnan(away).any():
            break
    reason = f"the links or wheels of the mechanism do not return to the start within {most} periods of its drives"
    return replace(drives, period=nan, reason=reason)


def _away(mechanism: Mechanism, laws: Sequence[MotionLaw], drives: Repetition, most: int) -> Reals:
    """Return the largest distance of a link from its start after each period [m], shape (..., most).

    The distance includes the difference of the unit vectors of the link, times the size of the mechanism.
    """
    one = NEAR_STEPS if most == 1 else 1
    steps = STEPS_PER_TURN * int(np.max(np.ceil(drives.period / drives.turn))) if len(laws) > 1 else one
    times = np.asarray(drives.period * (np.arange(most * steps + 1) / steps))
    moved = postures(mechanism, by_laws(laws, times)[0])
    origin, direction = (part[..., ::steps] for part in (moved.origin, moved.direction))
    turned = mechanism.size * np.abs(direction - direction[..., :1])
    return np.asarray(np.maximum(np.abs(origin - origin[..., :1]), turned)[..., 1:].max(axis=0))
