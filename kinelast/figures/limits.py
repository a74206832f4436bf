"""The judge of limits: of a run, of every design and of every speed; and its verdict on a run as plain data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import FIXED, LARGEST, SCENE, Figure, fixed
from kinelast.figures.registry import ALONG_BEAMS
from kinelast.figures.results import Results, figure
from kinelast.scene.data import Scene
from kinelast.scene.limits import OUTPUT_ERROR, Limit
from rigid.arrays import Reals

PLACES = {figure.limit: figure.fields[0] for figure in ALONG_BEAMS if figure.limit}
"""Keys under `[limits]` of figures of beams, and the fields that have their place."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """A limit beside the figure that it bounds.

    Attributes
    ----------
    limit
        The limit.
    value
        The figure of those items for which it holds that is nearest to the bound, or farthest past it, shape (...); nan
        where that of one of them is not known.
    item
        Number of the beam whose figure that is, shape (...); 0 of a figure of the whole machine.
    kept
        Whether the limit is kept, bool, shape (...): not where the figure is not known.
    """

    limit: Limit
    value: Any
    item: Any
    kept: Any


def judged(scene: Scene, figures: Mapping[str, Any]) -> list[Verdict]:
    """Every limit of a scene beside its figure.

    Parameters
    ----------
    figures
        By key, the magnitude of the figure of every item in its SI unit, shape (items, ...): of every beam in the order
        of the scene's labels, or of the one machine; a limit is not kept where its figure is left out.
    """
    return [_verdict(scene, limit, figures.get(limit.figure)) for limit in scene.limits]


def kept(verdicts: Iterable[Verdict]) -> Any:
    """Whether all limits are kept, bool, shape (...)."""
    return reduce(np.logical_and, (verdict.kept for verdict in verdicts), True)


def _verdict(scene: Scene, limit: Limit, values: Any) -> Verdict:
    if values is None:
        return Verdict(limit, np.float64(np.nan), np.zeros((), int), np.zeros((), bool))
    items = np.array([0] if limit.figure == OUTPUT_ERROR else bounded_beams(scene, limit), int)
    if not len(items):
        nothing = np.zeros(values.shape[1:], int)
        return Verdict(limit, np.full(nothing.shape, np.nan), nothing, nothing != 0)
    values = values[items]
    row = values.argmin(axis=0) if limit.least else values.argmax(axis=0)  # one that is not known before all others
    value = np.take_along_axis(values, row[None], 0)[0]
    bound = np.ravel(limit.bound) if np.ndim(limit.bound) else limit.bound
    return Verdict(limit, value, items[row], replace(limit, bound=bound).kept(value))


def acceptable(scene: Scene, figures: Iterable[Figure]) -> Figure:
    """Whether all limits of a scene are kept, 1 or 0, as a figure."""
    bounded = [figure for figure in figures if figure.key in {limit.figure for limit in scene.limits}]

    def find(cycle: Cycle) -> Reals:
        return np.where(kept(judged(cycle.scene, magnitudes(cycle, bounded))), 1.0, 0.0)

    fields = tuple(dict.fromkeys(field for figure in bounded for field in figure.fields))
    return Figure("acceptable", "all limits are kept", "1", SCENE, fixed(find), FIXED, fields, told=True)


def magnitudes(cycle: Cycle, figures: Iterable[Figure]) -> dict[str, Any]:
    """Magnitudes of figures for `judged`, by key."""
    values = {figure: cycle.of(figure).value for figure in figures}
    return {figure.key: np.abs(each) if figure.over == LARGEST else each for figure, each in values.items()}


def bounded_beams(scene: Scene, limit: Limit) -> list[int]:
    """Numbers of the beams that a limit holds for."""
    owners = [scene.mechanism.links[at].name for at, _ in scene.mechanism.beams]
    return [number for number, owner in enumerate(owners) if limit.link in ("", owner)]


def acceptance(results: Results, figures: Mapping[str, Any]) -> dict[str, Any]:
    """Every limit of the scene with the figure that it bounds, and whether all are kept.

    Parameters
    ----------
    figures
        The rest of the summary, see `kinelast.figures.summary.summary`: places and units.

    Returns
    -------
    `passed`: None where no limit is set, and where all seem kept by figures of which nobody knows how far they are
    off, `problem` says why; a limit that there is no figure for is not kept. `limits`: a row each.
    """
    peaks = results.figures.peaks
    bounded = {limit.figure for limit in results.scene.limits} & peaks.keys()
    sizes = {key: np.abs([peak.value for peak in peaks[key]]) for key in bounded}
    rows = [
        {
            "kind": verdict.limit.kind,
            "on": verdict.limit.link,
            "limit": figure(verdict.limit.bound, row["unit"] if verdict.limit.kind == "output" else verdict.limit.unit),
            "found": row,
            "passed": bool(verdict.kept),
        }
        for verdict in judged(results.scene, sizes)
        for row in [_row(results, figures, verdict)]
    ]
    passed = all(row["passed"] for row in rows) if rows else None
    problem = error_unknown(results) if passed else ""
    return {"passed": None if problem else passed, "problem": problem, "limits": rows}


def error_unknown(results: Results) -> str:
    """Reason why nobody knows how far the figures of moving links are off; nothing where that is known or not asked."""
    answer = results.answer
    if answer is None or not np.any(results.motion.drive_rate):
        return ""
    return results.instability or answer.unknown


def _row(results: Results, figures: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    """The figure that a limit bounds, with its place; without a value where it is not known."""
    kind = verdict.limit.kind
    if np.isnan(verdict.value):
        return figure(np.nan, verdict.limit.unit or "m")
    if kind == "output":
        output = figures["output"]
        return {**output, "label": output["name"], "shares": None}
    label = results.scene.labels[int(verdict.item)]
    row = figures["peaks"][label][PLACES[kind]]
    if kind == "safety":
        place = {key: value for key, value in row.items() if key not in ("value", "unit")}
        row = {**place, **figures["strength"][label]["safety_factor"]}
    return {**row, "label": label}
