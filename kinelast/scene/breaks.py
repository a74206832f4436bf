"""Times of breaks in the laws of drives and loads: jumps of an acceleration; jumps, kinks and reversals of a load."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import Any

import numpy as np

from rigid import Motion, RepeatedLaw, Resistance, SegmentedLaw, TableLaw, law_peaks
from rigid.arrays import Flags, Reals

SIDE_DISTANCE = 1e-8  # distance of each side from a break / duration of the run; longer than the rest at a dead centre
MIN_BREAK_DISTANCE = 4.0  # smallest distance between two breaks / SIDE_DISTANCE
SEARCH_INSTANTS = 1441  # number of times in a search; between two of them a load's coordinate passes at most one break
BISECTIONS = 26  # enough to reduce the distance between two times of the search to less than SIDE_DISTANCE


@dataclass(frozen=True)
class Breaks:
    """Times at which laws have breaks.

    Attributes
    ----------
    before, after
        Times just before and just after each break [s], shape (breaks,). The end of a cycle comes before its start.
    aside
        Distance of each side from its break [s].
    """

    before: Reals
    after: Reals
    aside: float

    @property
    def sides(self) -> Reals:
        """Times on both sides of all breaks [s], in increasing order."""
        return np.sort(np.concatenate([self.before, self.after]))

    def far(self, times: Reals) -> Flags:
        """Return whether times are neither between the two sides of a break nor close to a side."""
        sides = np.append(self.sides, np.inf)
        at = np.searchsorted(sides, times)
        return np.minimum(np.abs(sides[at] - times), np.abs(sides[at - 1] - times)) > self.aside

    @property
    def edges(self) -> Reals:
        """Time between each break and the side before it [s]; the break itself belongs to the side after it."""
        return self.before + self.aside / 2


def breaks_of(
    laws: Iterable[Any], loads: Iterable[Any], end: float, turn: bool, motion_at: Callable[[Reals], Motion], last: float
) -> Breaks:
    """Return the breaks of all laws in a run.

    Parameters
    ----------
    laws
        Laws of the drives: motion laws, and efforts that follow a law.
    loads
        Loads of the mechanism.
    end, turn
        End of the run [s], which starts at 0, and whether it is a cycle.
    motion_at
        Function that returns the motion at any times. It is needed for loads that depend on a coordinate.
    last
        End of the motion [s]; an integration may stop before the end of the run.
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
    """Return the times of the entries of motion tables [s]. Between two entries, the acceleration has no maximum."""
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
    for time in peaks.jumps:  # at the end of the last segment, use the side before the break
        yield time + aside if isinstance(law, SegmentedLaw) and time >= law.duration * (1.0 - SIDE_DISTANCE) else time


def _passed(law: Any, seen: Motion, motion_at: Callable[[Reals], Motion]) -> Iterable[float]:
    """Return the times at which the coordinate of a load passes a break of its curve [s]."""
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
    """Return the times at which a coordinate passes one of several values, or an angle jumps by a turn [s].

    An angle jumps half a turn away from `middle`.
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
