"""The figures of one run with their places, reduced over its positions chunk by chunk."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from elastic import FIELDS, Kind, Largest
from elastic.assessment import stress_ends
from kinelast.figures.cycle import EXTREME_FIELDS, NOISE, WELL, Cycle
from kinelast.figures.entry import AVERAGE, FIXED, LARGEST, LEAST, Figure
from kinelast.figures.errors import LITTLE, FigureError
from kinelast.figures.registry import NAMES, figures_of
from kinelast.scene.limits import Output
from kinelast.scene.numbers import UNRELIABLE
from rigid import Motion
from rigid.arrays import Reals

STATIONS = np.linspace(0.0, 1.0, 101)  # where the swing of stresses is looked at


@dataclass(frozen=True)
class Peak:
    """The largest magnitude of a figure of one item over the cycle: value in the figure's unit, and its place.

    `xi` along the beam; `time` [s]; `drive` coordinates [rad or m]; `refined`: found between the positions; `row`: of
    several values of the item, which it is; `error`: None where nobody looked.
    """

    value: float
    xi: float
    time: float
    drive: tuple[float, ...]
    refined: bool = False
    row: int = 0
    error: FigureError | None = None


@dataclass(frozen=True, eq=False)
class RunFigures:
    """The figures of a run.

    Attributes
    ----------
    output
        The output that the figures are of.
    figures, peaks
        The figures, and by their keys the peak of every item.
    positions, singular, locked, ill
        How many there are, have no figures, have none as friction may lock there, and are conditioned beyond `WELL`.
    well
        Whether a position is conditioned up to `WELL`: else all that could be computed count.
    span
        Time of the first position and of the last [s].
    rates
        Least and largest rate of every drive [rad/s or m/s], shape (2, drives).
    stress
        Least and largest normal stress [Pa], as of `elastic.assessment.stress_ends` at `STATIONS`.
    length
        Length of the longest beam [m].
    efforts
        Units of the drives' efforts.
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
        """The same, every peak with its error."""
        peaks = {
            key: [replace(peak, error=error) for peak, error in zip(rows, errors[key], strict=True)]
            for key, rows in self.peaks.items()
        }
        return replace(self, peaks=peaks)

    def with_averages(self, cycle: Cycle) -> RunFigures:
        """The same, with those figures that are of the run as a whole as another cycle of the same run has them."""
        of_all = [each for each in self.figures if each.over == AVERAGE or each.whole]
        averages = {each.key: _peaks(cycle.of(each), cycle.motion) for each in of_all}
        return replace(self, peaks={**self.peaks, **averages})

    def with_motion(self, cycle: Cycle) -> RunFigures:
        """The same, with figures of the rigid motion as a cycle of closer instants has them."""
        better = {}
        for each in (each for each in self.figures if each.of_motion(cycle.scene) and not each.exact):
            rows, known = _peaks(cycle.of(each), cycle.motion), self.peaks[each.key]
            whole = each.over in (FIXED, AVERAGE) or each.whole
            pairs = zip(known, rows, strict=True)
            better[each.key] = rows if whole else [
                here if (found := _further(here, there, each.over)) is here else replace(found, refined=True)
                for here, there in pairs
            ]  # fmt: skip
        return replace(self, peaks={**self.peaks, **better})

    def with_instants(self, further: RunFigures) -> RunFigures:
        """The same, with those of further instants of the run, which are no positions of it."""
        both = joined(self, further)
        keys = "positions", "singular", "locked", "ill", "span"
        return replace(both, **{key: getattr(self, key) for key in keys})

    def of_field(self, key: str) -> list[Peak]:
        """Peaks of a field on every beam."""
        return self.peaks[NAMES.get(key, key)]

    @cached_property
    def swings(self) -> Reals:
        """Swing of the normal stress in the left and the right fibre [Pa], shape (2, beams, stations)."""
        least, most = self.stress
        return np.where(least <= most, most - least, np.nan)

    @cached_property
    def scales(self) -> dict[str, float]:
        """By unit, the greatest forces, moments of them, displacements, stresses and power over the counted positions.

        Of energy, that power for as long as the run.
        """

        def greatest(keys: Iterable[str]) -> float:
            sizes = (abs(peak.value) for key in keys for peak in self.peaks[key])
            return max((size for size in sizes if math.isfinite(size)), default=0.0)

        force = greatest(("joint_force", "shaking_force", "N", "V"))
        power = greatest(("drive_power", "friction_power"))
        stresses = (NAMES.get(key, key) for key in EXTREME_FIELDS if FIELDS[key].kind is Kind.STRESS)
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

    def rounded(self, values: Any, unit: str) -> Reals:
        """Return the values with round-off set to zero."""
        scale = self.scales.get(unit, 0.0)
        if unit in ("W", "J"):  # a drive without effort has round-off of the forces times its rate
            power = max(self.scales["N"], self.scales["N m"]) * float(np.nanmax(np.abs(self.rates), initial=0.0))
            scale = max(scale, power if unit == "W" else power * (self.span[1] - self.span[0]))
        return np.where(np.abs(values) <= NOISE * scale, 0.0, values)

    def unreliable(self, value: float, error: float, unit: str) -> bool:
        """Return whether an error is large, relative to the value or, if that is nearly zero, to the scale."""
        return error > UNRELIABLE * max(abs(value), LITTLE * self.scales.get(unit, 0.0))


def run_figures(cycle: Cycle, output: Output | None) -> RunFigures:
    """The figures of a run, or of a chunk of it.

    Parameters
    ----------
    output
        The output of the scene. Figures that are only computed where they are asked for are left out.
    """
    scene, motion, bent = cycle.scene, cycle.motion, cycle.deflection
    chosen = tuple(figure for figure in figures_of(output) if not figure.asked)
    ill = ~cycle.singular & ~(cycle.condition <= WELL)
    return RunFigures(
        output,
        chosen,
        {figure.key: _peaks(cycle.of(figure), motion) for figure in chosen},
        len(motion.time),
        int(np.count_nonzero(cycle.singular)),
        int(np.count_nonzero(np.broadcast_to(bent.forces.locked, cycle.columns))),
        int(np.count_nonzero(ill)),
        bool((cycle.counted & (cycle.condition <= WELL)).any()),
        (float(motion.time[0]), float(motion.time[-1])),
        _rates(motion),
        np.array(stress_ends(cycle.well_conditioned, STATIONS)) if scene.labels else np.zeros((2, 2, 0, len(STATIONS))),
        float(np.max(bent.length, initial=0.0)),
        tuple(next(each for each in chosen if each.key == "drive_effort").units(scene)),
    )


def joined(first: RunFigures | None, second: RunFigures) -> RunFigures:
    """The figures of a run of two parts, the second right behind the first."""
    if first is None:
        return second
    peaks = {}
    for figure in second.figures:
        pairs = zip(first.peaks[figure.key], second.peaks[figure.key], strict=True)
        both = first.well == second.well or figure.everywhere
        peaks[figure.key] = [_further(before, after, figure.over) if both else before if first.well else after
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


def _further(first: Peak, second: Peak, over: str) -> Peak:
    """The one that is larger in magnitude, or less; of equal ones the first; of one that is not known the other."""
    if over in (FIXED, AVERAGE) or math.isnan(second.value):
        return first
    if math.isnan(first.value):
        return second
    if over == LEAST:
        return second if second.value < first.value else first
    larger = abs(second.value) > abs(first.value) if over == LARGEST else second.value > first.value
    return second if larger else first


def _peaks(found: Largest, motion: Motion) -> list[Peak]:
    values, positions = np.asarray(found.value, float), np.asarray(found.position)
    shape = values.shape
    parts = (np.broadcast_to(part, shape).tolist() for part in (found.xi, found.row))
    time, drive = motion.time[positions].tolist(), motion.drive[:, positions].T.tolist()
    rows = zip(values.tolist(), positions.tolist(), time, drive, *parts, strict=True)
    nowhere = (math.nan,) * len(motion.drive)
    return [
        Peak(value, xi, when, tuple(where), row=row) if at >= 0 else Peak(value, xi, math.nan, nowhere)
        for value, at, when, where, xi, row in rows
    ]


def _rates(motion: Motion) -> Reals:
    """Least and largest rate of the drives where it is known, shape (2, drives); nan where nowhere."""
    rate = np.broadcast_to(motion.drive_rate, motion.drive.shape)
    return np.array([np.fmin.reduce(rate, axis=-1), np.fmax.reduce(rate, axis=-1)])


def greatest(peaks: Sequence[Peak], over: str = LARGEST) -> int | None:
    """Number of the item that has the greatest magnitude of those known; or the least, where all are known; or None."""
    known = [number for number, peak in enumerate(peaks) if not math.isnan(peak.value)]
    if over == LEAST:
        return min(known, key=lambda number: peaks[number].value) if peaks and len(known) == len(peaks) else None
    return max(known, key=lambda number: abs(peaks[number].value), default=None)
