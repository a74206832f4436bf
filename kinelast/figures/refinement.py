"""The largest values over the cycle, searched between the positions too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinelast.figures.peaks import Peak, peak_positions
from kinelast.figures.results import WELL, Results, extremes_of
from kinelast.scene.motion import scene_deflection
from rigid import Reals

POINTS = 9  # instants looked at in every bracket in a round
ROUNDS = 9  # each makes the brackets four times narrower; a smooth peak is flat, so this is beyond round-off


def refined_peaks(results: Results, found: dict[str, list[Peak]]) -> dict[str, list[Peak]]:
    """The peaks, each improved between the neighbours of the position where it was found.

    A peak keeps its place where nothing larger is near; one that lies between positions is marked `refined`. A second,
    narrower peak elsewhere in the cycle that all positions miss is not found: that takes more positions. A peak is left
    as it is where the condition at its neighbours, or at any instant looked at between them, is beyond `WELL`.
    """
    names = [(field, beam) for field, extreme in results.extremes.items()
             for beam, at in enumerate(peak_positions(results, extreme.value)) if at >= 0]  # fmt: skip
    if not names or len(results.motion.time) < 2:
        return found
    low, high = np.array([_bracket(results, found[field][beam].time) for field, beam in names]).T
    best = [found[field][beam] for field, beam in names]
    better: dict[int, tuple[float, float, float]] = {}
    spoiled: set[int] = set()
    for _ in range(ROUNDS):
        grid = np.linspace(low, high, POINTS, axis=-1)
        values, xi, well = _values(results, names, grid)
        spoiled |= set(np.flatnonzero(~well.all(axis=-1)).tolist())
        at = np.where(np.isfinite(values), np.abs(values), -1.0).argmax(axis=-1)
        for row, (peak, choice) in enumerate(zip(best, at, strict=True)):
            if abs(values[row, choice]) > abs(better[row][0] if row in better else peak.value):
                better[row] = (values[row, choice], xi[row, choice], grid[row, choice])
        rows = np.arange(len(names))
        low, high = grid[rows, np.maximum(at - 1, 0)], grid[rows, np.minimum(at + 1, POINTS - 1)]
    improved = {field: list(peaks) for field, peaks in found.items()}
    for row, peak in _peaks(results, {row: one for row, one in better.items() if row not in spoiled}):
        field, beam = names[row]
        improved[field][beam] = peak
    return improved


def _bracket(results: Results, time: float) -> tuple[float, float]:
    """The instants of a position's neighbours; a cycle goes on beyond its ends, any other run ends there."""
    instants, run = results.motion.time, results.scene.run
    at = int(np.argmin(np.abs(instants - time)))
    step = float(instants[1] - instants[0])
    before = float(instants[at - 1]) if at else time - step if run.turn else time
    after = float(instants[at + 1]) if at + 1 < len(instants) else time + step if run.turn else time
    return before, after


def _values(results: Results, names: list[tuple[str, int]], grid: Reals) -> tuple[Any, Any, Any]:
    """Every name's extreme along its beam, where it is, and whether the mechanism is well conditioned there.

    At every name's own instants; shapes of `grid`.
    """
    order = np.argsort(grid, axis=None)
    moved = results.scene.course.at(grid.ravel()[order])
    bent = scene_deflection(results.scene, moved)
    found = extremes_of(bent, tuple(dict.fromkeys(field for field, _ in names)))
    back = np.argsort(order).reshape(grid.shape)
    rows = [
        (found[field].value[beam, back[row]], found[field].xi[beam, back[row]])
        for row, (field, beam) in enumerate(names)
    ]
    values, places = zip(*rows, strict=True)
    return np.array(values), np.array(places), (moved.condition <= WELL)[back]


def _peaks(results: Results, better: dict[int, tuple[float, float, float]]) -> Iterator[tuple[int, Peak]]:
    """Numbers and peaks of those that are larger between the positions: value, place and time of each."""
    if not better:
        return
    run = results.scene.run
    time = {row: float(at % run.duration if run.turn else at) for row, (_, _, at) in better.items()}
    rows = sorted(better, key=lambda row: time[row])
    drive = results.scene.course.at([time[row] for row in rows]).drive
    for k, row in enumerate(rows):
        value, xi, _ = better[row]
        yield row, Peak(float(value), float(xi), time[row], tuple(drive[:, k].tolist()), refined=True)
