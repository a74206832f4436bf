"""Breaks of a run: times at which the acceleration of a drive jumps, or at which a load jumps, kinks or reverses.

The times at which friction reverses are found in the same way.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import ceil, pi
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Motion, RepeatedLaw, Resistance, SegmentedLaw, TableLaw, law_peaks
from rigid.arrays import Flags, Reals
from rigid.kinetostatics import sliding_directions, sliding_rate

SIDE_DISTANCE = 1e-8  # distance of the times just before and after a break from it, relative to the run
MIN_BREAK_DISTANCE = 4.0  # smallest distance between two breaks, as a multiple of SIDE_DISTANCE
SEARCH_INSTANTS = 1441  # number of times at which a coordinate is sampled to find its breaks
BISECTIONS = 26  # number of bisections, enough to locate a break more accurately than SIDE_DISTANCE


class Breaks(Struct, frozen=True):
    """Breaks: times at which the acceleration of a drive jumps, or at which a load jumps, kinks or reverses.

    Attributes
    ----------
    before, after
        Times just before and just after each break [s], shape (breaks,). If a cycle has a break at its start, the time
        just before it is at the end of the cycle.
    aside
        Distance of each of these times from its break [s].
    """

    before: Reals
    after: Reals
    aside: float

    @property
    def sides(self) -> Reals:
        """Times just before and just after all breaks [s], in increasing order."""
        return np.sort(np.concatenate([self.before, self.after]))

    def far(self, times: Reals) -> Flags:
        """Return True for each time that is farther than `aside` from the times in `sides`.

        Such a time is not between the two sides of a break either.
        """
        sides = np.append(self.sides, np.inf)
        at = np.searchsorted(sides, times)
        return np.minimum(np.abs(sides[at] - times), np.abs(sides[at - 1] - times)) > self.aside

    @property
    def edges(self) -> Reals:
        """Boundaries of the time elements of a solution with vibration [s], each slightly before a break.

        The break itself is in the element after the boundary.
        """
        return self.before + self.aside / 2


def breaks_of(
    laws: Iterable[Any], loads: Iterable[Any], end: float, turn: bool, motion_at: Callable[[Reals], Motion], last: float
) -> Breaks:
    """Return the breaks of all drives and loads in a run.

    Parameters
    ----------
    laws
        For each drive, its motion law or its effort. An effort may depend on a coordinate or on time.
    loads
        Loads of the mechanism.
    end, turn
        End of the run [s], and whether the run is one cycle. The run starts at 0.
    motion_at
        Function that returns the motion at any times. It is needed for loads that depend on a coordinate.
    last
        End of the motion [s]. It is earlier than `end` if the integration of the motion stopped early.
    """
    aside, laws, loads = SIDE_DISTANCE * end, [*laws], [*loads]
    efforts = (law.effort.law for law in laws if hasattr(law, "effort"))
    factors = [*efforts, *(getattr(load.load if isinstance(load, Resistance) else load, "law", None) for load in loads)]
    instants = [time for law in laws if not hasattr(law, "effort") for time in _jumps(law, end, aside)]
    curves = [factor for factor in factors if getattr(factor, "breaks", ())]
    resisting = [load for load in loads if isinstance(load, Resistance)]
    if curves or resisting:
        seen = motion_at(np.linspace(0.0, min(end, last), SEARCH_INSTANTS))
        instants += [time for curve in curves for time in _passed(curve, seen, motion_at)]
        for load in resisting:
            bounds = (-0.5,) if load.one_way else (-0.5, 0.5)
            instants += _passes(load.direction, bounds, seen, motion_at)
    return _breaks_at(instants, end, turn)


def reversals_of(
    joints: Iterable[int], end: float, turn: bool, motion_at: Callable[[Reals], Motion], last: float
) -> Breaks:
    """Return the times at which a joint starts or stops sliding, or reverses. Coulomb friction jumps at these times.

    `joints` are indices in `Structure.joints`. For the other arguments see `breaks_of`.
    """
    instants: list[float] = []
    if joints := [*joints]:
        seen = motion_at(np.linspace(0.0, min(end, last), SEARCH_INSTANTS))
        for number in joints:
            instants += _passes(partial(_direction, number), (-0.5, 0.5), seen, motion_at)
    return _breaks_at(instants, end, turn)


def _direction(number: int, motion: Motion) -> Reals:
    """Return the sign of the sliding rate of a joint, shape (..., positions); 0 at rest."""
    return sliding_directions(motion, {number: sliding_rate(motion, number)})[number]


def _breaks_at(instants: Sequence[float], end: float, turn: bool) -> Breaks:
    """Return breaks at the given times [s].

    A break that is closer to the preceding one than `MIN_BREAK_DISTANCE` is left out.
    """
    aside = SIDE_DISTANCE * end
    times = np.sort(np.mod(instants, end) if turn else np.array(instants, float))
    inside = (times > MIN_BREAK_DISTANCE * aside) & (times < end - MIN_BREAK_DISTANCE * aside)
    wraps = turn and not inside.all()
    times = times[inside]
    times = times[np.diff(times, prepend=-end) > MIN_BREAK_DISTANCE * aside]
    before, after = times - aside, times + aside
    return (
        Breaks(np.append(before, end - aside), np.append(after, aside), aside)
        if wraps
        else Breaks(before, after, aside)
    )


def knots_of(laws: Iterable[Any], end: float) -> Reals:
    """Return the times of the entries of motion tables [s]. The acceleration is linear between two entries."""
    tables = ((law.law, law.duration) if isinstance(law, RepeatedLaw) else (law, end) for law in laws)
    knots = [
        np.add.outer(np.arange(_rounds(end, lasts)) * lasts, table.times).ravel()
        for table, lasts in tables
        if isinstance(table, TableLaw)
    ]
    times = np.concatenate([np.zeros(0), *knots])
    return times[times <= end]


def _rounds(end: float, lasts: float) -> int:
    return max(ceil(end / lasts * (1.0 - SIDE_DISTANCE)), 1)


def _jumps(law: Any, end: float, aside: float) -> Iterator[float]:
    """Yield the times at which the acceleration of a motion law jumps [s]."""
    peaks = law_peaks(law)
    if peaks is None or not peaks.jumps:
        return
    if isinstance(law, RepeatedLaw):
        yield from np.add.outer(np.arange(_rounds(end, law.duration)) * law.duration, peaks.jumps).ravel().tolist()
        return
    for time in peaks.jumps:  # at the end of the law, the time just before the break must be the end itself
        yield time + aside if isinstance(law, SegmentedLaw) and time >= law.duration * (1.0 - SIDE_DISTANCE) else time


def _passed(law: Any, seen: Motion, motion_at: Callable[[Reals], Motion]) -> Iterable[float]:
    """Return the times [s] at which the coordinate that determines a load passes a break in the table of the load."""
    times = seen.time
    if np.array_equal(law.place(seen), times):
        return [time for time in law.breaks if times[0] <= time <= times[-1]]
    return _passes(law.place, law.breaks, seen, motion_at, law.middle)


def _passes(
    place_of: Callable[[Motion], Any],
    bounds: Sequence[float],
    seen: Motion,
    motion_at: Callable[[Reals], Motion],
    middle: float | None = None,
) -> list[float]:
    """Return the times [s] at which a coordinate passes one of the values `bounds`, or jumps by a turn.

    If `middle` is given, the coordinate is an angle that jumps by a turn at half a turn from `middle`.
    """
    place, times = np.broadcast_to(place_of(seen), seen.columns), seen.time
    wrapped = np.abs(np.diff(place)) > (pi if middle is not None else np.inf)
    rows = [(np.flatnonzero(((place[:-1] >= at) != (place[1:] >= at)) & ~wrapped), at) for at in bounds]
    rows.append((np.flatnonzero(wrapped), middle or 0.0))
    at = np.concatenate([row for row, _ in rows])
    if not len(at):
        return []
    target = np.concatenate([np.full(len(row), bound) for row, bound in rows])
    low, high, begun = times[at], times[at + 1], place[at] >= target
    for _ in range(BISECTIONS):
        half = (low + high) / 2
        order = np.argsort(half, kind="stable")
        there = np.empty(len(half))
        there[order] = np.broadcast_to(place_of(motion_at(half[order])), len(half))
        same = (there >= target) == begun
        low, high = np.where(same, half, low), np.where(same, high, half)
    return high.tolist()
