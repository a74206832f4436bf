"""Search for peaks, limits of unstable speed ranges, and the first speed at which a bound is exceeded.

A `SpeedScan` guides the search. The step between scanned speeds is half the width of the narrowest resonance peak. It
is larger if the scan would otherwise require too many speeds. Near local maxima it is smaller. At speeds with a
computed solution, the scan is multiplied by a factor so that it equals the solution. Between these speeds, the factor
is interpolated linearly.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.speed_map import SpeedMap, SpeedSolutions
from elastic.elastodynamics.speed_scan import Scan
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.vibration_settings import VIBRATION
from rigid.arrays import Flags, Reals

TINY = float(np.finfo(float).tiny)


class BoundUtilisation(Struct, frozen=True, eq=False):
    """Utilisation of several bounds, i.e. ratios of a value to its bound.

    Attributes
    ----------
    used
        Function that computes the ratios of values to bounds from a `SpeedMap`, shape (bounds, speeds). If a ratio is
        above 1, the bound is exceeded. If it is nan, the value is unknown.
    field
        For each bound, the index of the field in `Scan.largest` that is used for interpolation between speeds.
    beam
        For each bound, the index of the beam in `Scan.largest`, or -1 for the largest value of all beams.
    """

    used: Callable[[SpeedMap], Reals]
    field: Sequence[int]
    beam: Sequence[int]


class SpeedSearch:
    """Search for special speeds between the smallest and the largest known speed.

    It adds solutions at further speeds to `solutions`.

    Parameters
    ----------
    solutions
        Solutions at two or more speeds.
    curves
        Function that computes the values of `Scan.largest` from a `SpeedMap`, in any unit, shape (3, beams, speeds).
    on_speed
        Function that is called with the number of scanned speeds and the total number of speeds.
    """

    def __init__(
        self,
        solutions: SpeedSolutions,
        curves: Callable[[SpeedMap], Reals],
        on_speed: Callable[[int, int], None] | None = None,
    ) -> None:
        self.solutions, self.curves, self._on_speed = solutions, curves, on_speed
        self.model = solutions.scan()
        self.width = solutions.least_damping
        known = solutions.map().ratio
        span = math.log(known[-1] / known[0])
        self.step = max(self.width, span / SPEEDS.max_scanned)
        self.scan: Scan = self.model.at(np.concatenate([known, *_speeds_between(known, self.step)]), on_speed)

    def scan_more(self, ratios: Any) -> None:
        """Scan more speeds."""
        more = np.setdiff1d(np.ravel(ratios), self.scan.ratio)
        if len(more):
            self.scan = self.scan.with_more(self.model.at(more, self._on_speed))

    def find_peaks(self) -> None:
        """Compute solutions at peaks that rise above their valleys and above the line between known solutions."""
        for _ in range(SPEEDS.max_refinements):
            chosen = self._without_close_peaks(self._peaks())
            if not chosen:
                break
            self._find(chosen)

    def plot_curves(self) -> tuple[Reals, Reals]:
        """Return curves for plots: relative speeds, shape (speeds,), and values, shape (3, beams, speeds).

        At known speeds, the values are taken from the solutions. Between known speeds, they are taken from the
        corrected scan. At speeds without a steady state, they are nan.
        """
        known = self.solutions.map()
        values = self._predicted(known, self.curves(known), self.scan.largest)
        values[..., np.searchsorted(self.scan.ratio, known.ratio)] = self.curves(known)
        thin = math.ceil(len(self.scan.ratio) / SPEEDS.max_drawn)
        chosen = np.unique(
            np.append(np.arange(0, len(self.scan.ratio), thin), np.searchsorted(self.scan.ratio, known.ratio))
        )
        return self.scan.ratio[chosen], values[..., chosen]

    def _find(self, ratios: Sequence[float]) -> None:
        self.scan_more(ratios)
        self.solutions.find(ratios)

    def _predicted(self, known: SpeedMap, values: Reals, scanned: Reals) -> Reals:
        """Return the corrected scan: multiply scanned values by a factor so that they agree with known solutions.

        The shape is (..., scanned speeds).
        """
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
        result[:, ~VIBRATION.stable(self.scan.growth)] = np.nan
        return result.reshape(shape)

    def _peaks(self) -> list[tuple[float, float]]:
        """Return height and speed of each peak. The height is relative to the line between known solutions.

        The scan is refined around the peaks.
        """
        while True:
            known = self.solutions.map()
            values = self.curves(known)
            predicted = self._predicted(known, values, self.scan.largest)
            floor = SPEEDS.negligible * np.nanmax(predicted, axis=(1, 2), initial=TINY)[:, None, None]
            line = np.array([[_interpolated(self.scan.ratio, known.ratio, row) for row in rows] for rows in values])
            above = np.where(predicted > floor, predicted / np.maximum(line, TINY), 0.0)
            columns = predicted.shape[-1]
            rows, shares = predicted.reshape(-1, columns), above.reshape(-1, columns)
            visible = [
                (float(share[at]), at, rise)
                for row, share in zip(rows, shares, strict=True)
                for at, rise in prominences(row)
                if share[at] > 1 + SPEEDS.min_visible_height
            ]
            more = {ratio for _, at, _ in visible for ratio in self._midpoints(at)}
            if not more:
                return [(share, float(self.scan.ratio[at])) for share, at, rise in visible if rise > SPEEDS.min_rise]
            self.scan_more(sorted(more))

    def _midpoints(self, at: int) -> Iterator[float]:
        """Yield the midpoint between a scanned speed and each neighbouring scanned speed that is too far from it."""
        ratio = self.scan.ratio
        for other in (at - 1, at + 1):
            if 0 <= other < len(ratio) and abs(math.log(ratio[other] / ratio[at])) > SPEEDS.min_scan_step * max(
                self.width, self.step / 6
            ):
                yield float(np.sqrt(ratio[other] * ratio[at]))

    def _without_close_peaks(self, peaks: list[tuple[float, float]]) -> list[float]:
        """Return the speeds of peaks that are not close to a higher peak and have no computed solution yet."""
        chosen: list[float] = []
        for _, ratio in sorted(peaks, reverse=True):
            min_distance = SPEEDS.min_separation * self.width * ratio
            if all(abs(ratio - other) > min_distance for other in chosen):
                chosen.append(ratio)
        return sorted(set(chosen) - set(self.solutions.map().ratio.tolist()))

    def find_stability_limits(self) -> list[tuple[float, float]]:
        """Return the speed ranges without a stable steady state.

        Solutions are computed on both sides of each limit of such a range.
        """
        self._refine_growth()
        unstable = ~VIBRATION.stable(self.scan.growth)
        changes = np.flatnonzero(unstable[1:] != unstable[:-1])
        limits = [self._stability_limit(int(at), bool(unstable[at])) for at in changes]
        self._find(sorted({ratio for pair in limits for ratio in pair}))
        known = self.solutions.map()
        return list(_ranges(known.ratio, ~known.stable))

    def _refine_growth(self) -> None:
        """Refine the scan near minima of the decay rate.

        A narrow unstable range may be hidden there between two scanned speeds.
        """
        for _ in range(SPEEDS.max_refinements):
            rate = -np.log(np.maximum(self.scan.growth, TINY)) * self.scan.ratio
            tops = [at for at in _local_maxima(-rate) if rate[at] < SPEEDS.max_decay_ratio * np.median(rate)]
            more = {ratio for at in tops for ratio in self._midpoints(at) if rate[at] > 0.0}
            if not more:
                break
            self.scan_more(sorted(more))

    def _stability_limit(self, at: int, low_is_unstable: bool) -> tuple[float, float]:
        """Return two close speeds, one on each side of the stability limit between scanned speeds `at` and `at` + 1."""
        ratio = self.scan.ratio
        low, high = float(ratio[at]), float(ratio[at + 1])
        widen = 1.0 + (high / low - 1.0)
        if self.solutions.stable(low) == low_is_unstable:
            low /= widen
        if self.solutions.stable(high) != low_is_unstable:
            high *= widen
        while high / low - 1 > SPEEDS.limit_accuracy:
            middle = math.sqrt(low * high)
            if self.solutions.stable(middle) == low_is_unstable:
                high = middle
            else:
                low = middle
        first, last = float(ratio[0]), float(ratio[-1])
        return min(max(low, first), last), min(max(high, first), last)

    def find_limit(self, utilisation: BoundUtilisation) -> tuple[float, float] | None:
        """Return the largest known speed up to which all bounds are met, and the next higher known speed.

        Return None if no bound is exceeded. The first speed is 0 if a bound is exceeded at the smallest known speed.
        """
        for _ in range(4 * SPEEDS.max_refinements):
            known = self.solutions.map()
            used = utilisation.used(known)
            good = np.asarray((used <= 1.0).all(axis=0), bool)
            bad = int(np.argmin(good)) if not good.all() else len(good)
            if not bad:
                return 0.0, float(known.ratio[0])
            low, high = float(known.ratio[bad - 1]), float(known.ratio[min(bad, len(good) - 1)])
            crossing = self._first_passed(utilisation, known, used, high)
            if crossing is not None and crossing < low:
                self._find([crossing])
            elif bad == len(good):
                return None
            elif high / low - 1 <= 2 * SPEEDS.limit_accuracy:
                if not self.solutions.refine_errors(high):
                    return low, high
            else:
                self._find(_around(crossing, low, high))
        return low, high

    def _first_passed(self, utilisation: BoundUtilisation, known: SpeedMap, used: Reals, high: float) -> float | None:
        """Return the lowest speed at which the corrected scan exceeds a bound, or None if this is above `high`.

        The scan is refined around this speed.
        """
        for _ in range(SPEEDS.max_refinements):
            largest = self.scan.largest
            scanned = np.array(
                [
                    largest[field].max(axis=0) if beam < 0 else largest[field, beam]
                    for field, beam in zip(utilisation.field, utilisation.beam, strict=True)
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
            if above / low - 1 < SPEEDS.limit_accuracy:
                break
            self.scan_more([crossing * (1 - SPEEDS.limit_accuracy / 4), crossing * (1 + SPEEDS.limit_accuracy / 4)])
        return crossing


def _around(crossing: float | None, low: float, high: float) -> list[float]:
    """Return speeds on both sides of the expected crossing of a bound, or else the midpoint of `low` and `high`."""
    middle = math.sqrt(low * high)
    if crossing is None or not low < crossing < high:
        return [middle]
    around = [crossing * (1 + side * SPEEDS.limit_accuracy / 2) for side in (-1, 1)]
    return [each for each in around if low < each < high] or [middle]


def _speeds_between(known: Reals, step: float) -> Iterator[Reals]:
    """Yield speeds between known speeds, in geometric sequences in which log(speed) increases by at most `step`."""
    for low, high in pairwise(known):
        count = math.ceil(math.log(high / low) / step)
        yield np.geomspace(low, high, count + 1)[1:-1]


def _interpolated(ratio: Reals, known: Reals, values: Reals) -> Reals:
    """Interpolate known values linearly to the speeds `ratio`, ignoring nan."""
    good = np.isfinite(values)
    return np.interp(ratio, known[good], values[good]) if good.any() else np.zeros(len(ratio))


def prominences(values: Any) -> Iterator[tuple[int, float]]:
    """Yield the index of each inner local maximum, and its rise above the higher one of its two valleys.

    The rise is relative to the maximum. The valley on each side extends to the next value that is higher than the
    maximum, or to the next nan or end. Its level is its lowest value.

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


def _local_maxima(values: Reals) -> list[int]:
    """Return the indices of the inner local maxima; nan counts as smaller than any number."""
    padded = np.where(np.isnan(values), -np.inf, values)
    inner = (padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:])
    return [int(at) for at in np.flatnonzero(inner) + 1]


def _ranges(ratio: Reals, marked: Flags) -> Iterator[tuple[float, float]]:
    """Yield the first and last speed of each run of marked speeds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        yield float(ratio[first]), float(ratio[end - 1])
