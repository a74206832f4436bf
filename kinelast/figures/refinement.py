"""Search for the largest values of fields between the positions of a cycle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from elastic import extremes
from kinelast.figures.cycle import EXTREME_FIELDS, WELL
from kinelast.figures.peaks import Peak
from kinelast.figures.registry import NAMES, safety_factor
from kinelast.figures.results import Results
from kinelast.scene.data import scene_deflection
from kinelast.tasks.progress import SILENT, Progress
from rigid import Reals
from rigid.arrays import Flags

POINTS = 9  # instants per bracket and round
ROUNDS = 9  # each round narrows brackets four times; enough for round-off of a smooth peak


def refined(results: Results, progress: Progress = SILENT) -> Results:
    """Return results with the peak of each field refined between the neighbours of its position.

    A peak that moves between the positions is marked `refined`. The search does not find a narrow peak elsewhere in the
    cycle that all positions miss: compute more positions for that. A peak stays if the condition at its neighbours, or
    at an instant between them, exceeds `WELL`.
    """
    run = results.figures
    names = [(field, beam) for field in EXTREME_FIELDS for beam, peak in enumerate(run.of_field(field))
             if math.isfinite(peak.value)]  # fmt: skip
    if not names or len(results.motion.time) < 2:
        return results
    better = dict(_peaks(results, _searched(results, names, progress)))
    peaks = {key: list(each) for key, each in run.peaks.items()}
    for row, peak in better.items():
        field, beam = names[row]
        peaks[NAMES.get(field, field)][beam] = peak
    stresses = np.array([peak.value for peak in peaks["stress"]])
    factors = safety_factor(results.deflection.sections, stresses)
    peaks["safety"] = [
        replace(peak, value=float(factor)) for peak, factor in zip(peaks["stress"], factors, strict=True)
    ]
    return replace(results, run=replace(run, peaks=peaks))


def _searched(
    results: Results, names: list[tuple[str, int]], progress: Progress
) -> dict[int, tuple[float, float, float]]:
    """Return value, place and time of larger values between the positions, by number."""
    best = [results.figures.of_field(field)[beam] for field, beam in names]
    low, high = np.array([_bracket(results, peak.time) for peak in best]).T
    better: dict[int, tuple[float, float, float]] = {}
    spoiled: set[int] = set()
    for number in range(ROUNDS):
        progress(f"{results.scene.name}: between the positions", number, ROUNDS)
        grid = np.linspace(low, high, POINTS, axis=-1)
        values, xi, well = _values(results, names, grid)
        spoiled |= set(np.flatnonzero(~well.all(axis=-1)).tolist())
        at = np.where(np.isfinite(values), np.abs(values), -1.0).argmax(axis=-1)
        for row, (peak, choice) in enumerate(zip(best, at, strict=True)):
            if abs(values[row, choice]) > abs(better[row][0] if row in better else peak.value):
                better[row] = (values[row, choice], xi[row, choice], grid[row, choice])
        rows = np.arange(len(names))
        low, high = grid[rows, np.maximum(at - 1, 0)], grid[rows, np.minimum(at + 1, POINTS - 1)]
    return {row: each for row, each in better.items() if row not in spoiled}


def _bracket(results: Results, time: float) -> tuple[float, float]:
    """Return the instants of the neighbours of a position; a cycle continues beyond its ends."""
    instants, run = results.motion.time, results.scene.run
    at = int(np.argmin(np.abs(instants - time)))
    step = float(instants[1] - instants[0])
    before = float(instants[at - 1]) if at else time - step if run.turn else time
    after = float(instants[at + 1]) if at + 1 < len(instants) else time + step if run.turn else time
    return before, after


def _values(results: Results, names: list[tuple[str, int]], grid: Reals) -> tuple[Reals, Reals, Flags]:
    """Return the extreme along the beam for each name, its place, and True if well conditioned.

    Each name has its own instants; the results have the shape of `grid`.
    """
    instants, back = np.unique(grid, return_inverse=True)  # many peaks lie between the same positions
    moved = results.scene.course.at(instants)
    bent = scene_deflection(results.scene, moved)
    found = extremes(bent, tuple(dict.fromkeys(field for field, _ in names)))
    back = back.reshape(grid.shape)
    rows = [
        (found[field].value[beam, back[row]], found[field].xi[beam, back[row]])
        for row, (field, beam) in enumerate(names)
    ]
    values, places = zip(*rows, strict=True)
    return np.array(values), np.array(places), (moved.condition <= WELL)[back]


def _peaks(results: Results, better: dict[int, tuple[float, float, float]]) -> Iterator[tuple[int, Peak]]:
    """Yield number, value, place and time of peaks that are larger between the positions."""
    if not better:
        return
    run = results.scene.run
    time = {row: float(at % run.duration if run.turn else at) for row, (_, _, at) in better.items()}
    rows = sorted(better, key=lambda row: time[row])
    drive = results.scene.course.at([time[row] for row in rows]).drive
    for k, row in enumerate(rows):
        value, xi, _ = better[row]
        yield row, Peak(float(value), float(xi), time[row], tuple(drive[:, k].tolist()), refined=True)
