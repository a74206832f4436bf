"""Extreme values of figures (results such as the largest deflection) over a run, with their locations.

Chunks of a run are merged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, reduce
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import FIELDS, FieldKind, Largest
from elastic.assessment import stress_ends
from elastic.vibration import TOLERANCE
from kinelast.figures.cycle import EXTREME_FIELDS, MAX_CONDITION, Cycle
from kinelast.figures.errors import MIN_SHARE_OF_UNIT, frequency_error
from kinelast.figures.figure_error import FigureError
from kinelast.figures.registry import NAMES, figures_of
from kinelast.scene.limits import Output
from kinelast.values.figure import AVERAGE, FIXED, LARGEST, LEAST, NOISE, Figure, items_of
from kinelast.values.numbers import has_large_error
from rigid import Motion
from rigid.arrays import Reals

STATIONS = np.linspace(0.0, 1.0, 101)  # locations along a beam at which the stress range is computed


class Peak(Struct, frozen=True):
    """The extreme value of a figure over the cycle for one item (e.g. a beam), in its unit, and where it occurs.

    `xi` is the location along the beam, `time` the instant [s], and `drive` the drive coordinates [rad or m]. `refined`
    is true if the peak occurs between the positions. If the figure is the largest of several values of an item, such as
    the angle errors at the points of a link, `row` is the number of this value. `error` is None if it was not
    estimated.
    """

    value: float
    xi: float
    time: float
    drive: tuple[float, ...]
    refined: bool = False
    row: int = 0
    error: FigureError | None = None

    @property
    def error_size(self) -> float:
        """The size of the error; nan if the error was not estimated."""
        return math.nan if self.error is None else self.error.size


class RunFigures(Struct, frozen=True, eq=False, dict=True):
    """The figures of a run.

    Attributes
    ----------
    output
        Output of the machine; None if it has none.
    figures, peaks
        The figures, and a list with the peak of each item by figure key.
    positions, singular, locked, ill
        Numbers of positions: all, those without figures, those locked by friction, and ill-conditioned ones.
    well
        Whether any position is well conditioned. If so, only such positions are included in the peaks. Otherwise all
        positions with figures are included.
    span
        Times of the first and the last position [s].
    rates
        Smallest and largest rate of each drive [rad/s or m/s], shape (2, drives).
    stress
        Smallest and largest normal stress [Pa] over the run in each fibre at `STATIONS`, from
        `elastic.assessment.stress_ends`.
    length
        Length of the longest beam [m].
    efforts
        Unit of the effort of each drive.
    """

    output: Output | None
    figures: tuple[Figure, ...]
    peaks: Mapping[str, list[Peak]]
    positions: int
    singular: int
    locked: int
    ill: int
    well: bool
    span: tuple[float, float]
    rates: Reals
    stress: Reals
    length: float
    efforts: tuple[str, ...]

    def with_errors(self, errors: Mapping[str, Sequence[FigureError]]) -> RunFigures:
        """Return these figures with the given errors, one for each peak."""
        peaks = {
            key: [replace(peak, error=error) for peak, error in zip(rows, errors[key], strict=True)]
            for key, rows in self.peaks.items()
        }
        return replace(self, peaks=peaks)

    def with_averages(self, cycle: Cycle) -> RunFigures:
        """Return these figures. Averages, and figures of the whole run, are taken from another `Cycle` of the run."""
        of_all = [each for each in self.figures if each.over == AVERAGE or each.whole]
        averages = {each.key: _peaks(cycle.of(each), cycle.motion) for each in of_all}
        return replace(self, peaks={**self.peaks, **averages})

    def with_motion(self, cycle: Cycle) -> RunFigures:
        """Return these figures.

        Those of the rigid motion are taken from a `Cycle` with more closely spaced instants.
        """
        better = {}
        for each in (
            each for each in self.figures if each.of_motion(cycle.scene) and not each.exact and self.peaks[each.key]
        ):
            rows, known = _peaks(cycle.of(each), cycle.motion), self.peaks[each.key]
            whole = each.over in (FIXED, AVERAGE) or each.whole
            pairs = zip(known, rows, strict=True)
            better[each.key] = rows if whole else [
                here if (found := _more_extreme(here, there, each.over)) is here else replace(found, refined=True)
                for here, there in pairs
            ]  # fmt: skip
        return replace(self, peaks={**self.peaks, **better})

    def with_instants(self, further: RunFigures) -> RunFigures:
        """Return these figures merged with figures at additional instants, which do not count as positions."""
        between = {key: [replace(peak, refined=True) for peak in peaks] for key, peaks in further.peaks.items()}
        both = joined(self, replace(further, peaks=between))
        keys = "positions", "singular", "locked", "ill", "span"
        return replace(both, **{key: getattr(self, key) for key in keys})

    def of_field(self, key: str) -> list[Peak]:
        """Return the peaks of a field on all beams."""
        return self.peaks[NAMES.get(key, key)]

    @cached_property
    def by_key(self) -> dict[str, Figure]:
        """The figures by key."""
        return {figure.key: figure for figure in self.figures}

    @cached_property
    def swings(self) -> Reals:
        """The stress range over the run in the left and the right fibre [Pa], shape (2, beams, stations)."""
        least, most = self.stress
        return np.where(least <= most, most - least, np.nan)

    @cached_property
    def frequency_error(self) -> float:
        """Relative error in the lowest natural frequency: tolerance of its computation, plus error of beam theory."""
        bent = [(peak.value, peak.error) for peak in self.peaks.get("deflection", []) if peak.error]
        return TOLERANCE + frequency_error((size for size, _ in bent), (error for _, error in bent))

    @cached_property
    def scales(self) -> dict[str, float]:
        """The greatest force, moment, displacement, stress, power and energy of the run, by unit."""

        def greatest(keys: Iterable[str]) -> float:
            sizes = (abs(peak.value) for key in keys for peak in self.peaks[key])
            return max((size for size in sizes if math.isfinite(size)), default=0.0)

        force = greatest(("joint_force", "shaking_force", "N", "V"))
        power = greatest(("drive_power", "friction_power"))
        stresses = (NAMES.get(key, key) for key in EXTREME_FIELDS if FIELDS[key].kind is FieldKind.STRESS)
        turning = [abs(peak.value) for peak, unit in zip(self.peaks["drive_effort"], self.efforts, strict=True)
                   if unit == "N m" and math.isfinite(peak.value)]  # fmt: skip
        return {
            "N": force,
            "N m": max(force * self.length, *turning, greatest(("M", "shaking_moment"))),
            "m": greatest(("u", "deflection", "displacement")),
            "rad": greatest(("phi", "angle_error")),
            "Pa": greatest(stresses),
            "W": power,
            "J": power * (self.span[1] - self.span[0]),
        }

    @cached_property
    def noise(self) -> dict[str, float]:
        """The largest round-off error in values, by unit."""
        scales = self.scales
        # the power of a drive without load is round-off: the round-off in forces times the speed of the drive
        power = max(scales["N"], scales["N m"]) * float(np.nanmax(np.abs(self.rates), initial=0.0))
        least = {"W": power, "J": power * (self.span[1] - self.span[0])}
        return {unit: NOISE * max(scale, least.get(unit, 0.0)) for unit, scale in scales.items()}

    def rounded(self, values: Any, unit: str) -> Any:
        """Return a number or an array, with zero in place of values below the round-off error."""
        noise = self.noise.get(unit, 0.0)
        if isinstance(values, float):
            return 0.0 if abs(values) <= noise else values
        return np.where(np.abs(values) <= noise, 0.0, values)

    def unreliable(self, value: float, error: float, unit: str) -> bool:
        """Return whether a value is unreliable: its error is large relative to the value.

        If the value is nearly zero, the error is compared with `MIN_SHARE_OF_UNIT` times the largest value with the
        unit (`scales`) instead. For dimensionless ratios, such as load to critical load, this largest value is taken as
        1. A value of exactly zero is not unreliable.
        """
        scale = 1.0 if unit == "1" else self.scales.get(unit, 0.0)
        return value != 0.0 and bool(has_large_error(value, error, MIN_SHARE_OF_UNIT * scale))


def run_figures(cycle: Cycle, output: Output | None) -> RunFigures:
    """Return the figures of a run, or of a chunk of a run, except for figures that are computed only on request."""
    scene, motion, bent = cycle.scene, cycle.motion, cycle.deflection
    chosen = tuple(figure for figure in figures_of(output) if not figure.asked)
    present = tuple(figure for figure in chosen if items_of(scene, figure.of))
    cycle.search(present)
    ill = ~cycle.lost & ~(cycle.condition <= MAX_CONDITION)
    return RunFigures(
        output,
        chosen,
        {figure.key: [] for figure in chosen} | {figure.key: _peaks(cycle.of(figure), motion) for figure in present},
        len(motion.time),
        int(np.count_nonzero(cycle.lost)),
        int(np.count_nonzero(np.broadcast_to(bent.forces.locked, cycle.columns))),
        int(np.count_nonzero(ill)),
        bool((cycle.counted & (cycle.condition <= MAX_CONDITION)).any()),
        (float(motion.time[0]), float(motion.time[-1])),
        _rates(motion),
        np.array(stress_ends(cycle.well_conditioned, STATIONS)) if scene.labels else np.zeros((2, 2, 0, len(STATIONS))),
        float(np.max(bent.length, initial=0.0)),
        tuple(next(each for each in chosen if each.key == "drive_effort").units(scene)),
    )


def joined(first: RunFigures | None, second: RunFigures) -> RunFigures:
    """Merge the figures of two consecutive parts of a run."""
    if first is None:
        return second
    peaks = {}
    for figure in second.figures:
        pairs = zip(first.peaks[figure.key], second.peaks[figure.key], strict=True)
        both = first.well == second.well or figure.everywhere
        over = FIXED if figure.whole else figure.over  # a part says nothing about a figure of the whole run
        peaks[figure.key] = [_more_extreme(before, after, over) if both else before if first.well else after
                             for before, after in pairs]  # fmt: skip
    counted = [part for part in (first, second) if part.well == (first.well or second.well)]
    return RunFigures(
        second.output,
        second.figures,
        peaks,
        first.positions + second.positions,
        first.singular + second.singular,
        first.locked + second.locked,
        first.ill + second.ill,
        first.well or second.well,
        (first.span[0], second.span[1]),
        np.array([np.fmin(first.rates[0], second.rates[0]), np.fmax(first.rates[1], second.rates[1])]),
        np.array([reduce(np.minimum, (part.stress[0] for part in counted)),
                  reduce(np.maximum, (part.stress[1] for part in counted))]),
        max(first.length, second.length),
        second.efforts,
    )  # fmt: skip


def _more_extreme(first: Peak, second: Peak, over: str) -> Peak:
    """Return the more extreme of two peaks of the same item.

    If they are equal, return the first. If one is nan, return the other.
    """
    if over in (FIXED, AVERAGE) or math.isnan(second.value):
        return first
    if math.isnan(first.value):
        return second
    if over == LEAST:
        return second if second.value < first.value else first
    larger = abs(second.value) > abs(first.value) if over == LARGEST else second.value > first.value
    return second if larger else first


def _peaks(extremes: Largest, motion: Motion) -> list[Peak]:
    values, positions = np.asarray(extremes.value, float), np.asarray(extremes.position)
    if not values.size:
        return []
    parts = (np.full(values.shape, part).tolist() for part in (extremes.xi, extremes.row))
    time, drive = motion.time[positions].tolist(), motion.drive[:, positions].T.tolist()
    rows = zip(values.tolist(), positions.tolist(), time, drive, *parts, strict=True)
    nowhere = (math.nan,) * len(motion.drive)
    return [
        Peak(value, xi, when, tuple(where), row=row) if at >= 0 else Peak(value, xi, math.nan, nowhere)
        for value, at, when, where, xi, row in rows
    ]


def _rates(motion: Motion) -> Reals:
    """Return the smallest and largest known rate of each drive, shape (2, drives)."""
    rate = np.broadcast_to(motion.drive_rate, motion.drive.shape)
    return np.array([np.fmin.reduce(rate, axis=-1), np.fmax.reduce(rate, axis=-1)])


def greatest(peaks: Sequence[Peak], over: str = LARGEST) -> int | None:
    """Return the number of the item with the greatest known magnitude, or None if all are unknown.

    If `over` is `LEAST`, return the item with the smallest value, or None if any value is unknown.
    """
    known = [number for number, peak in enumerate(peaks) if not math.isnan(peak.value)]
    if over == LEAST:
        return min(known, key=lambda number: peaks[number].value) if peaks and len(known) == len(peaks) else None
    return max(known, key=lambda number: abs(peaks[number].value), default=None)


def error_of_extreme(peaks: Sequence[Peak], best: int, over: str = LARGEST) -> float:
    """Return the error of the extreme value of all items, which is that of the item `best` (see `greatest`).

    It is larger than the error of this item if another item may have a more extreme value within its own error.
    """
    error, value = peaks[best].error_size, peaks[best].value
    known = [peak for peak in peaks if math.isfinite(peak.error_size)]
    if over == LEAST:
        return max([error, *(value - peak.value + peak.error_size for peak in known)])
    return max([error, *(abs(peak.value) - abs(value) + peak.error_size for peak in known)])
