"""Search for peaks, limits of unstable ranges, and the first speed that exceeds a bound.

A `SpeedScan` guides the search. Its steps are as wide as damped peaks, and smaller near local maxima. The scan is
multiplied by a factor that makes it agree with the computed solutions, and is interpolated linearly between them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from elastic.elastodynamics.speed_map import SpeedAnswers, SpeedMap
from elastic.elastodynamics.speed_scan import Scan
from elastic.elastodynamics.speed_settings import SPEEDS
from rigid.arrays import Flags, Reals

TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Bounded:
    """Utilisation of bounds, one per row.

    Attributes
    ----------
    used
        Function that converts a map to values / bounds, shape (rows, speeds). A bound is exceeded above 1; nan is
        unknown.
    field, beam
        Field and beam of `Scan.largest` for interpolation between speeds. Beam -1 stands for the largest of all beams.
    """

    used: Callable[[SpeedMap], Reals]
    field: Sequence[int]
    beam: Sequence[int]


class SpeedSearch:
    """Solutions at an increasing number of speeds between the smallest and the largest known speed.

    Parameters
    ----------
    answers
        Solutions at two or more speeds.
    curves
        Function that converts a map to largest values as in `Scan.largest`, in any unit, shape (3, beams, speeds).
    on_speed
        Function that is called with the number of scanned speeds and the total.
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
        self.step = max(self.width, span / SPEEDS.max_scanned)
        self.scan: Scan = self.model.at(np.concatenate([known, *_filled(known, self.step)]), on_speed)

    def look(self, ratios: Any) -> None:
        """Scan more speeds."""
        more = np.setdiff1d(np.ravel(ratios), self.scan.ratio)
        if len(more):
            self.scan = self.scan.with_more(self.model.at(more, self._on_speed))

    def find_peaks(self) -> None:
        """Compute solutions at peaks that rise above their valleys and above the line between known speeds."""
        for _ in range(SPEEDS.max_refinements):
            chosen = self._apart(self._peaks())
            if not chosen:
                break
            self._find(chosen)

    def between(self) -> tuple[Reals, Reals]:
        """Return curves for plots: scanned speeds, and values of shape (3, beams, speeds).

        The values are those of the solutions, and of the corrected scan between them. They are nan if there is no
        steady state.
        """
        known = self.answers.map()
        values = self._predicted(known, self.curves(known), self.scan.largest)
        values[..., np.searchsorted(self.scan.ratio, known.ratio)] = self.curves(known)
        thin = math.ceil(len(self.scan.ratio) / SPEEDS.max_drawn)
        chosen = np.unique(
            np.append(np.arange(0, len(self.scan.ratio), thin), np.searchsorted(self.scan.ratio, known.ratio))
        )
        return self.scan.ratio[chosen], values[..., chosen]

    def _find(self, ratios: Sequence[float]) -> None:
        self.look(ratios)
        self.answers.find(ratios)

    def _predicted(self, known: SpeedMap, values: Reals, scanned: Reals) -> Reals:
        """Correct the scan by known values, shape (..., scanned speeds)."""
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
        """Return the height and speed of peaks, after refining the scan around them."""
        while True:
            known = self.answers.map()
            values = self.curves(known)
            predicted = self._predicted(known, values, self.scan.largest)
            floor = SPEEDS.negligible * np.nanmax(predicted, axis=(1, 2), initial=TINY)[:, None, None]
            line = np.array([[_line(self.scan.ratio, known.ratio, row) for row in rows] for rows in values])
            above = np.where(predicted > floor, predicted / np.maximum(line, TINY), 0.0)
            columns = predicted.shape[-1]
            rows, shares = predicted.reshape(-1, columns), above.reshape(-1, columns)
            standing = [
                (float(share[at]), at, rise)
                for row, share in zip(rows, shares, strict=True)
                for at, rise in prominences(row)
                if share[at] > 1 + SPEEDS.min_visible_height
            ]
            more = {ratio for _, at, _ in standing for ratio in self._between(at)}
            if not more:
                return [(share, float(self.scan.ratio[at])) for share, at, rise in standing if rise > SPEEDS.min_rise]
            self.look(sorted(more))

    def _between(self, at: int) -> Iterator[float]:
        """Yield speeds between a scanned speed and its neighbours if these are too far away."""
        ratio = self.scan.ratio
        for other in (at - 1, at + 1):
            if 0 <= other < len(ratio) and abs(math.log(ratio[other] / ratio[at])) > SPEEDS.min_scan_step * max(
                self.width, self.step / 6
            ):
                yield float(np.sqrt(ratio[other] * ratio[at]))

    def _apart(self, peaks: list[tuple[float, float]]) -> list[float]:
        """Return the speeds of peaks that are not close to a larger peak and not yet computed."""
        chosen: list[float] = []
        for _, ratio in sorted(peaks, reverse=True):
            near = SPEEDS.close * self.width * ratio
            if all(abs(ratio - other) > near for other in chosen):
                chosen.append(ratio)
        return sorted(set(chosen) - set(self.answers.map().ratio.tolist()))

    def find_borders(self) -> list[tuple[float, float]]:
        """Find the speed ranges without a steady state, and compute solutions next to their limits."""
        self._refine_growth()
        unstable = self.scan.growth > 1.0
        changes = np.flatnonzero(unstable[1:] != unstable[:-1])
        borders = [self._border(int(at), bool(unstable[at])) for at in changes]
        self._find(sorted({ratio for pair in borders for ratio in pair}))
        known = self.answers.map()
        return list(_ranges(known.ratio, ~known.stable))

    def _refine_growth(self) -> None:
        """Refine the scan at speeds at which free vibrations decay slowly."""
        for _ in range(SPEEDS.max_refinements):
            rate = -np.log(np.maximum(self.scan.growth, TINY)) * self.scan.ratio
            tops = [at for at in _tops(-rate) if rate[at] < SPEEDS.max_decay_ratio * np.median(rate)]
            more = {ratio for at in tops for ratio in self._between(at) if rate[at] > 0.0}
            if not more:
                break
            self.look(sorted(more))

    def _border(self, at: int, low_is_unstable: bool) -> tuple[float, float]:
        """Return two close speeds on both sides of a stability limit."""
        ratio = self.scan.ratio
        low, high = float(ratio[at]), float(ratio[at + 1])
        widen = 1.0 + (high / low - 1.0)
        if self.answers.stable(low) == low_is_unstable:
            low /= widen
        if self.answers.stable(high) != low_is_unstable:
            high *= widen
        while high / low - 1 > SPEEDS.border_accuracy:
            middle = math.sqrt(low * high)
            if self.answers.stable(middle) == low_is_unstable:
                high = middle
            else:
                low = middle
        first, last = float(ratio[0]), float(ratio[-1])
        return min(max(low, first), last), min(max(high, first), last)

    def find_limit(self, bounded: Bounded) -> tuple[float, float] | None:
        """Return the largest speed up to which all bounds are met, and the next known speed above it.

        Return None if no bound is exceeded. The first speed is 0 if a bound is exceeded at the smallest speed.
        """
        for _ in range(4 * SPEEDS.max_refinements):
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
            elif high / low - 1 <= 2 * SPEEDS.border_accuracy:
                if not self.answers.sharpen(high):
                    return low, high
            else:
                self._find(_beside(crossing, low, high))
        return low, high

    def _first_passed(self, bounded: Bounded, known: SpeedMap, used: Reals, high: float) -> float | None:
        """Return the first speed at which the corrected scan exceeds a bound, after refinement."""
        for _ in range(SPEEDS.max_refinements):
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
            if above / low - 1 < SPEEDS.border_accuracy:
                break
            self.look([crossing * (1 - SPEEDS.border_accuracy / 4), crossing * (1 + SPEEDS.border_accuracy / 4)])
        return crossing


def _beside(crossing: float | None, low: float, high: float) -> list[float]:
    """Return two speeds in a bracket, on both sides of the expected crossing, or the midpoint of the bracket."""
    middle = math.sqrt(low * high)
    if crossing is None or not low < crossing < high:
        return [middle]
    beside = [crossing * (1 + side * SPEEDS.border_accuracy / 2) for side in (-1, 1)]
    return [each for each in beside if low < each < high] or [middle]


def _filled(known: Reals, step: float) -> Iterator[Reals]:
    """Yield speeds between the known ones such that no step exceeds `step`."""
    for low, high in pairwise(known):
        count = math.ceil(math.log(high / low) / step)
        yield np.geomspace(low, high, count + 1)[1:-1]


def _line(ratio: Reals, known: Reals, values: Reals) -> Reals:
    """Interpolate known values linearly, ignoring nan."""
    good = np.isfinite(values)
    return np.interp(ratio, known[good], values[good]) if good.any() else np.zeros(len(ratio))


def prominences(values: Any) -> Iterator[tuple[int, float]]:
    """Yield the inner local maxima, each with its rise above the higher neighbouring valley, relative to the maximum.

    A valley extends to the next higher value, or to the next nan.

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
    """Return the indices of the inner local maxima."""
    padded = np.where(np.isnan(values), -np.inf, values)
    inner = (padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:])
    return [int(at) for at in np.flatnonzero(inner) + 1]


def _ranges(ratio: Reals, marked: Flags) -> Iterator[tuple[float, float]]:
    """Yield the first and last speed of each run of marked speeds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        yield float(ratio[first]), float(ratio[end - 1])
