"""Speeds at which something happens: peaks, borders of unstable ranges, the first speed at which a bound is passed.

A `SpeedScan` tells where to look, in steps of the damping's width and closer about each local maximum; answers are
found there and put the scan right in between, by a factor that is linear from one known answer to the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from elastic.elastodynamics.speed_map import SpeedAnswers, SpeedMap
from elastic.elastodynamics.speed_scan import Scan
from rigid.arrays import Flags, Reals

VISIBLE = 0.01  # by how much a peak is above the line between known speeds, from where it is looked for
RISING = 0.01  # of itself that it rises above the valleys beside it; one that rises less is drawn by the scan alone
NEGLIGIBLE = 1e-4  # of the largest of all links, below which a peak is none
CLOSE = 0.3  # of a peak's half width, within which one answer is enough
FINEST = 0.15  # of a half width, between which steps the scan stops being refined
MOST_SCANNED = 2000
MOST_DRAWN = 600
ROUNDS = 6
KNOWN_TO = 1e-3  # to which a border or a limit speed is known, as a share of it
CAREFUL = 0.6  # of the usual decay, below which a free vibration is looked at closely
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Bounded:
    """Shares of bounds that are used, one a row.

    Attributes
    ----------
    used
        From a map to the values over their bounds, shape (rows, speeds): above 1 a bound is passed, nan is no answer.
    field, beam
        Of `Scan.largest`, by which each goes between the speeds; beam -1 for the largest of all.
    """

    used: Callable[[SpeedMap], Reals]
    field: Sequence[int]
    beam: Sequence[int]


class SpeedSearch:
    """Answers at more and more speeds between the least and the greatest of those known.

    Parameters
    ----------
    answers
        At two speeds or more.
    curves
        From a map to the largest values as `Scan.largest` has them, in any unit, shape (3, beams, speeds).
    on_speed
        Called with how many speeds are scanned, and of how many.
    """

    def __init__(
        self,
        answers: SpeedAnswers,
        curves: Callable[[SpeedMap], Reals],
        on_speed: Callable[[int, int], None] | None = None,
    ) -> None:
        self.answers, self.curves, self._on_speed = answers, curves, on_speed
        self.model = answers.scan()
        self.width = answers.least_damping
        known = answers.map().ratio
        span = math.log(known[-1] / known[0])
        self.step = max(self.width, span / MOST_SCANNED)
        self.scan: Scan = self.model.at(np.concatenate([known, *_filled(known, self.step)]), on_speed)

    def look(self, ratios: Any) -> None:
        """Look closely at more speeds."""
        more = np.setdiff1d(np.ravel(ratios), self.scan.ratio)
        if len(more):
            self.scan = self.scan.with_more(self.model.at(more, self._on_speed))

    def find_peaks(self) -> None:
        """Find answers at all peaks that stand out from the line between the known speeds, and rise from valleys."""
        for _ in range(ROUNDS):
            chosen = self._apart(self._peaks())
            if not chosen:
                break
            self._find(chosen)

    def between(self) -> tuple[Reals, Reals]:
        """The curves at all speeds that were looked at: speeds, and values of shape (3, beams, speeds).

        Known answers are among them; in between they are the scan's, put right. nan where no steady state comes about.
        """
        known = self.answers.map()
        values = self._predicted(known, self.curves(known), self.scan.largest)
        values[..., np.searchsorted(self.scan.ratio, known.ratio)] = self.curves(known)
        thin = math.ceil(len(self.scan.ratio) / MOST_DRAWN)
        chosen = np.unique(
            np.append(np.arange(0, len(self.scan.ratio), thin), np.searchsorted(self.scan.ratio, known.ratio))
        )
        return self.scan.ratio[chosen], values[..., chosen]

    def _find(self, ratios: Sequence[float]) -> None:
        self.look(ratios)
        self.answers.find(ratios)

    def _predicted(self, known: SpeedMap, values: Reals, scanned: Reals) -> Reals:
        """The scan's values put right by known ones, shape (..., scanned speeds)."""
        at = np.searchsorted(self.scan.ratio, known.ratio)
        shape = (*values.shape[:-1], len(self.scan.ratio))
        flat, own = values.reshape(-1, values.shape[-1]), scanned.reshape(-1, scanned.shape[-1])
        result = np.empty((len(flat), shape[-1]))
        for row, (value, seen) in enumerate(zip(flat, own, strict=True)):
            good = np.isfinite(value) & (seen[at] > TINY)
            if not good.any():
                result[row] = np.nan
                continue
            factor = np.interp(self.scan.ratio, known.ratio[good], value[good] / seen[at][good])
            result[row] = seen * factor
        result[:, self.scan.growth > 1.0] = np.nan
        return result.reshape(shape)

    def _peaks(self) -> list[tuple[float, float]]:
        """By how much and where largest values stand out, the scan refined until it does not move them."""
        while True:
            known = self.answers.map()
            values = self.curves(known)
            predicted = self._predicted(known, values, self.scan.largest)
            floor = NEGLIGIBLE * np.nanmax(predicted, axis=(1, 2), initial=TINY)[:, None, None]
            line = np.array([[_line(self.scan.ratio, known.ratio, row) for row in rows] for rows in values])
            above = np.where(predicted > floor, predicted / np.maximum(line, TINY), 0.0)
            columns = predicted.shape[-1]
            rows, shares = predicted.reshape(-1, columns), above.reshape(-1, columns)
            standing = [
                (float(share[at]), at, rise)
                for row, share in zip(rows, shares, strict=True)
                for at, rise in prominences(row)
                if share[at] > 1 + VISIBLE
            ]
            more = {ratio for _, at, _ in standing for ratio in self._between(at)}
            if not more:
                return [(share, float(self.scan.ratio[at])) for share, at, rise in standing if rise > RISING]
            self.look(sorted(more))

    def _between(self, at: int) -> Iterator[float]:
        """Speeds between a scanned one and its neighbours that are further away than need be."""
        ratio = self.scan.ratio
        for other in (at - 1, at + 1):
            if 0 <= other < len(ratio) and abs(math.log(ratio[other] / ratio[at])) > FINEST * max(
                self.width, self.step / 6
            ):
                yield float(np.sqrt(ratio[other] * ratio[at]))

    def _apart(self, peaks: list[tuple[float, float]]) -> list[float]:
        """Of peaks those that are not close to a greater one, or to an answer that is known."""
        chosen: list[float] = []
        for _, ratio in sorted(peaks, reverse=True):
            near = CLOSE * self.width * ratio
            if all(abs(ratio - other) > near for other in chosen):
                chosen.append(ratio)
        return sorted(set(chosen) - set(self.answers.map().ratio.tolist()))

    def find_borders(self) -> list[tuple[float, float]]:
        """Ranges of speed in which no steady state comes about, answers found beside their borders."""
        self._refine_growth()
        unstable = self.scan.growth > 1.0
        changes = np.flatnonzero(unstable[1:] != unstable[:-1])
        borders = [self._border(int(at), bool(unstable[at])) for at in changes]
        self._find(sorted({ratio for pair in borders for ratio in pair}))
        known = self.answers.map()
        return list(_ranges(known.ratio, ~known.stable))

    def _refine_growth(self) -> None:
        """Look closely where free vibrations hardly die out."""
        for _ in range(ROUNDS):
            rate = -np.log(np.maximum(self.scan.growth, TINY)) * self.scan.ratio
            tops = [at for at in _tops(-rate) if rate[at] < CAREFUL * np.median(rate)]
            more = {ratio for at in tops for ratio in self._between(at) if rate[at] > 0.0}
            if not more:
                break
            self.look(sorted(more))

    def _border(self, at: int, low_is_unstable: bool) -> tuple[float, float]:
        """Two speeds close together, one on either side of a border of stability."""
        ratio = self.scan.ratio
        low, high = float(ratio[at]), float(ratio[at + 1])
        widen = 1.0 + (high / low - 1.0)
        if self.answers.stable(low) == low_is_unstable:
            low /= widen
        if self.answers.stable(high) != low_is_unstable:
            high *= widen
        while high / low - 1 > KNOWN_TO:
            middle = math.sqrt(low * high)
            if self.answers.stable(middle) == low_is_unstable:
                high = middle
            else:
                low = middle
        first, last = float(ratio[0]), float(ratio[-1])
        return min(max(low, first), last), min(max(high, first), last)

    def find_limit(self, bounded: Bounded) -> tuple[float, float] | None:
        """The greatest speed up to which no bound is passed, and the next one above; None where none is.

        The first is 0 where a bound is passed at the least speed.
        """
        for _ in range(4 * ROUNDS):
            known = self.answers.map()
            used = bounded.used(known)
            good = np.asarray((used <= 1.0).all(axis=0), bool)
            bad = int(np.argmin(good)) if not good.all() else len(good)
            if not bad:
                return 0.0, float(known.ratio[0])
            low, high = float(known.ratio[bad - 1]), float(known.ratio[min(bad, len(good) - 1)])
            crossing = self._first_passed(bounded, known, used, high)
            if crossing is not None and crossing < low:
                self._find([crossing])
            elif bad == len(good):
                return None
            elif high / low - 1 <= 2 * KNOWN_TO:
                if not self.answers.sharpen(high):
                    return low, high
            else:
                self._find(_beside(crossing, low, high))
        return low, high

    def _first_passed(self, bounded: Bounded, known: SpeedMap, used: Reals, high: float) -> float | None:
        """First speed at which the scan, put right by known answers, has a bound passed; closely looked at."""
        for _ in range(ROUNDS):
            largest = self.scan.largest
            scanned = np.array(
                [
                    largest[field].max(axis=0) if beam < 0 else largest[field, beam]
                    for field, beam in zip(bounded.field, bounded.beam, strict=True)
                ]
            )
            most = np.nan_to_num(self._predicted(known, used, scanned), nan=0.0).max(axis=0)
            passed = np.flatnonzero((most > 1.0) & (self.scan.ratio <= high))
            if not len(passed) or not passed[0]:
                return None
            at = int(passed[0])
            low, above = self.scan.ratio[at - 1], self.scan.ratio[at]
            share = (1.0 - most[at - 1]) / (most[at] - most[at - 1])
            crossing = float(low + share * (above - low))
            if above / low - 1 < KNOWN_TO:
                break
            self.look([crossing * (1 - KNOWN_TO / 4), crossing * (1 + KNOWN_TO / 4)])
        return crossing


def _beside(crossing: float | None, low: float, high: float) -> list[float]:
    """Speeds within a bracket, one on either side of where a bound is expected to be passed, or its middle."""
    middle = math.sqrt(low * high)
    if crossing is None or not low < crossing < high:
        return [middle]
    beside = [crossing * (1 + side * KNOWN_TO / 2) for side in (-1, 1)]
    return [each for each in beside if low < each < high] or [middle]


def _filled(known: Reals, step: float) -> Iterator[Reals]:
    """Speeds between known ones, so that no step is longer than asked."""
    for low, high in pairwise(known):
        count = math.ceil(math.log(high / low) / step)
        yield np.geomspace(low, high, count + 1)[1:-1]


def _line(ratio: Reals, known: Reals, values: Reals) -> Reals:
    """The line through known values; nan values are left out."""
    good = np.isfinite(values)
    return np.interp(ratio, known[good], values[good]) if good.any() else np.zeros(len(ratio))


def prominences(values: Any) -> Iterator[tuple[int, float]]:
    """Inner local maxima with the share of themselves by which they rise above the higher of the valleys beside them.

    A valley reaches to the next higher value; nan ends it.

    Examples
    --------
    >>> [*prominences(np.array([1.0, 4.0, 2.0, 3.0, 1.0]))]
    [(1, 0.75), (3, 0.333...)]
    """
    for at in range(1, len(values) - 1):
        if not (values[at] > values[at - 1] and values[at] >= values[at + 1]):
            continue
        valleys = []
        for side in (values[at - 1 :: -1], values[at + 1 :]):
            ends = np.flatnonzero(~(side <= values[at]))
            valleys.append(side[: ends[0] if len(ends) else None].min())
        yield at, float(1 - max(valleys) / values[at])


def _tops(values: Reals) -> list[int]:
    """Where values are greater than their neighbours, ends left out."""
    padded = np.where(np.isnan(values), -np.inf, values)
    inner = (padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:])
    return [int(at) for at in np.flatnonzero(inner) + 1]


def _ranges(ratio: Reals, marked: Flags) -> Iterator[tuple[float, float]]:
    """First and last speeds of every run of marked ones."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        yield float(ratio[first]), float(ratio[end - 1])
