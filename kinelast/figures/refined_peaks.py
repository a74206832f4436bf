"""Search for peaks between the positions of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from elastic import extremes
from elastic.assessment import safety_factor
from kinelast.figures.cycle import EXTREME_FIELDS, MAX_CONDITION
from kinelast.figures.peaks import Peak
from kinelast.figures.registry import NAMES
from kinelast.scene.data import scene_deflection
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Flags, Reals

if TYPE_CHECKING:
    from kinelast.answers.results import Results

POINTS = 9  # number of instants in each bracket (interval that contains a peak) and round
ROUNDS = 9  # number of rounds, each of which shrinks the bracket to a quarter: enough to find smooth peaks to round-off


def refined(results: Results, progress: Progress = SILENT) -> Results:
    """Return results in which the peak of each field (quantity along beams) is also searched between positions.

    A peak that is found between the positions is marked `refined`. A narrow peak is missed if no position is near it.
    The run then needs more positions. A peak is not refined if the condition number exceeds `MAX_CONDITION` at a
    neighbouring position or between the neighbouring positions.
    """
    run = results.figures
    names = [(field, beam) for field in EXTREME_FIELDS for beam, peak in enumerate(run.of_field(field))
             if math.isfinite(peak.value)]  # fmt: skip
    if not names or len(results.motion.time) < 2:
        return results
    better = dict(_moved_peaks(results, _searched(results, names, progress)))
    peaks = {key: list(each) for key, each in run.peaks.items()}
    for row, peak in better.items():
        field, beam = names[row]
        peaks[NAMES.get(field, field)][beam] = peak
    stresses = np.array([peak.value for peak in peaks["stress"]])
    factors = safety_factor(results.deflection.sections, stresses[:, None])[:, 0]
    peaks["safety"] = [
        replace(peak, value=float(factor)) for peak, factor in zip(peaks["stress"], factors, strict=True)
    ]
    return replace(results, run=replace(run, peaks=peaks))


def _searched(
    results: Results, names: list[tuple[str, int]], progress: Progress
) -> dict[int, tuple[float, float, float]]:
    """Return the values between positions that exceed the known peaks, with location and time, by index in `names`."""
    best = [results.figures.of_field(field)[beam] for field, beam in names]
    low, high = np.array([_bracket(results, peak.time) for peak in best]).T
    better: dict[int, tuple[float, float, float]] = {}
    ill_conditioned: set[int] = set()
    for number in range(ROUNDS):
        progress(f"{results.scene.name}: between the positions", number, ROUNDS)
        grid = np.linspace(low, high, POINTS, axis=-1)
        values, xi, well = _values(results, names, grid)
        ill_conditioned |= set(np.flatnonzero(~well.all(axis=-1)).tolist())
        at = np.where(np.isfinite(values), np.abs(values), -1.0).argmax(axis=-1)
        for row, (peak, choice) in enumerate(zip(best, at, strict=True)):
            if abs(values[row, choice]) > abs(better[row][0] if row in better else peak.value):
                better[row] = (values[row, choice], xi[row, choice], grid[row, choice])
        rows = np.arange(len(names))
        low, high = grid[rows, np.maximum(at - 1, 0)], grid[rows, np.minimum(at + 1, POINTS - 1)]
    return {row: each for row, each in better.items() if row not in ill_conditioned}


def _bracket(results: Results, time: float) -> tuple[float, float]:
    """Return the instants of the positions before and after the position at `time`.

    They may lie in the previous or in the next cycle.
    """
    instants, run = results.motion.time, results.scene.run
    at = int(np.argmin(np.abs(instants - time)))
    step = float(instants[1] - instants[0])
    before = float(instants[at - 1]) if at else time - step if run.turn else time
    after = float(instants[at + 1]) if at + 1 < len(instants) else time + step if run.turn else time
    return before, after


def _values(results: Results, names: list[tuple[str, int]], grid: Reals) -> tuple[Reals, Reals, Flags]:
    """Return extreme values along beams, their locations, and whether the instants are well conditioned.

    Each row of `grid` contains the instants for one pair of field and beam in `names`. The results have the shape of
    `grid`.
    """
    instants, back = np.unique(grid, return_inverse=True)  # several peaks may lie between the same positions
    moved = results.scene.course.at(instants)
    bent = scene_deflection(results.scene, moved)
    found = extremes(bent, tuple(dict.fromkeys(field for field, _ in names)))
    back = back.reshape(grid.shape)
    rows = [
        (found[field].value[beam, back[row]], found[field].xi[beam, back[row]])
        for row, (field, beam) in enumerate(names)
    ]
    values, places = zip(*rows, strict=True)
    return np.array(values), np.array(places), (moved.condition <= MAX_CONDITION)[back]


def _moved_peaks(results: Results, better: dict[int, tuple[float, float, float]]) -> Iterator[tuple[int, Peak]]:
    """Yield the index in `names` and the `Peak` of each value that `_searched` found between the positions."""
    if not better:
        return
    run = results.scene.run
    time = {row: float(at % run.duration if run.turn else at) for row, (_, _, at) in better.items()}
    rows = sorted(better, key=lambda row: time[row])
    drive = results.scene.course.at([time[row] for row in rows]).drive
    for k, row in enumerate(rows):
        value, xi, _ = better[row]
        yield row, Peak(float(value), float(xi), time[row], tuple(drive[:, k].tolist()), refined=True)
