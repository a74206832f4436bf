"""The judge of limits: of a run, of every design and of every speed; and its verdict on a run as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from kinelast.figures.checks import nearer
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import FIXED, SCENE, Figure, bounded_items, fixed, items_of, magnitudes
from kinelast.figures.peaks import Peak
from kinelast.figures.registry import ALONG_BEAMS
from kinelast.figures.results import Results, at_peak, figure, largest
from kinelast.scene.data import Scene
from kinelast.scene.limits import Limit
from rigid.arrays import Flags, Reals

KEPT, BROKEN, TOO_NEAR, UNKNOWN = "kept", "not kept", "too near to call", "cannot be judged"
SEVERITY = BROKEN, UNKNOWN, TOO_NEAR, KEPT
VERDICTS = {KEPT: "acceptable", BROKEN: "not acceptable", TOO_NEAR: TOO_NEAR, UNKNOWN: UNKNOWN}
PLACES = {figure.limit: figure.fields[0] for figure in ALONG_BEAMS if figure.limit and figure.fields}
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
        Number of the item of which that is, shape (...).
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
        By key, the magnitude of the figure of every item in its SI unit, shape (items, ...): items in the order of
        `items_of`; a limit is not kept where its figure is left out.
    """
    return [_verdict(scene, limit, figures.get(limit.figure)) for limit in scene.limits]


def kept(verdicts: Iterable[Verdict]) -> Flags | bool:
    """Whether all limits are kept, bool, shape (...)."""
    return reduce(np.logical_and, (verdict.kept for verdict in verdicts), True)


def _verdict(scene: Scene, limit: Limit, values: Any) -> Verdict:
    if values is None:
        return Verdict(limit, np.float64(np.nan), np.zeros((), int), np.zeros((), bool))
    items = np.array(bounded_items(scene, limit), int)
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


def outcome(limit: Limit, value: float, error: float) -> str:
    """Outcome for a figure with its error: neither kept nor not where the bound is within the error."""
    if math.isnan(value) or math.isnan(error):
        return UNKNOWN
    kept_by = [bool(limit.kept(value + side * error)) for side in (-1, 1)]
    return KEPT if all(kept_by) else TOO_NEAR if any(kept_by) else BROKEN


def acceptance(results: Results, figures: Mapping[str, Any]) -> dict[str, Any]:
    """Every limit of the scene with the figure that it bounds and its outcome, and the verdict on all.

    Parameters
    ----------
    figures
        The rest of the summary, see `kinelast.figures.summary.summary`: places and units.

    Returns
    -------
    `verdict`: the worst outcome in words; empty where no limit is set. `passed`: whether it is acceptable; None where
    that is not known, `problem` says why or what would settle it. `limits`: a row each, `kept` were there no error.
    """
    rows = [_judged_row(results, figures, limit) for limit in results.scene.limits]
    worst = min((row["outcome"] for row in rows), key=SEVERITY.index, default=None)
    problem = next((row["problem"] for row in rows if row["outcome"] == worst and worst in (UNKNOWN, TOO_NEAR)), "")
    passed = {KEPT: True, BROKEN: False}.get(worst) if worst else None
    return {"verdict": VERDICTS[worst] if worst else "", "passed": passed, "problem": problem, "limits": rows}


def _judged_row(results: Results, figures: Mapping[str, Any], limit: Limit) -> dict[str, Any]:
    """A limit with the figure that decides its outcome: of those that are alike the one nearest to the bound."""
    peaks = results.figures.peaks.get(limit.figure, [])
    items = bounded_items(results.scene, limit) if peaks else []
    of = next((each for each in results.figures.figures if each.key == limit.figure), None)
    exact = not results.scene.labels or (of is not None and of.rigid)  # then nothing that bends is in it
    told = [(item, abs(peaks[item].value), 0.0 if exact else _error(peaks[item])) for item in items]
    found = min(
        ((outcome(limit, value, error), float(limit.margin(value)), item, value) for item, value, error in told),
        key=lambda each: (SEVERITY.index(each[0]), each[1]),
        default=(UNKNOWN, math.nan, 0, math.nan),
    )
    how, _, item, value = found
    row = _row(results, figures, Verdict(limit, value, item, how == KEPT))
    problem = ""
    if how == UNKNOWN:
        problem = "there is no figure" if math.isnan(value) else results.error_unknown or "its error is not known"
    elif how == TOO_NEAR:
        error = peaks[item].error
        assert error is not None
        problem = nearer(results, error, abs(value - float(limit.bound)) / value)
    return {
        "kind": limit.kind,
        "name": limit.kind if of is None else of.name,
        "least": limit.least,
        "on": limit.item,
        "limit": figure(limit.bound, row["unit"] if limit.kind == "output" else limit.unit),
        "found": row,
        "outcome": how,
        "kept": bool(limit.kept(value)),
        "passed": {KEPT: True, BROKEN: False}.get(how),
        "problem": problem,
    }


def _error(peak: Peak) -> float:
    return math.nan if peak.error is None else peak.error.size


def _row(results: Results, figures: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    """The figure that a limit bounds, with its place; without a value where it is not known."""
    kind = verdict.limit.kind
    if np.isnan(verdict.value):
        return figure(np.nan, verdict.limit.unit or "m")
    if kind == "output":
        output = figures["output"]
        return {**output, "label": output["name"], "shares": None}
    item = int(verdict.item)
    if kind not in PLACES:
        peak, label = results.figures.peaks[verdict.limit.figure][item], items_of(results.scene, verdict.limit.of)[item]
        return {**largest(results, peak, verdict.limit.unit), "label": label}
    label = results.scene.labels[item]
    row = figures["peaks"][label][PLACES[kind]]
    if kind == "safety":
        place = {key: value for key, value in row.items() if key not in ("value", "unit")}
        row = {**place, **figures["strength"][label]["safety_factor"]}
    return {**row, "label": label}


RESERVES = {  # by mode of failure: the figure of beams, and the power of it that is the reserve
    "yield": ("safety", 1.0),
    "endurance": ("endurance", 1.0),
    "buckling": ("buckling", -1.0),
}
LIMITED = {"deflection": -1.0, "chord": -1.0}  # modes by the limits that a scene sets, likewise


def breaks_first(results: Results) -> list[dict[str, Any]]:
    """Modes of failure of every link with its reserve: the factor that is left until it fails.

    Of what is computed and known: yield, endurance and buckling where their figures are; deflection where a limit is
    set, and where one of life is and the life ends, in place of endurance the factor of the stress by the slope of the
    S-N line. Compression over Euler's load is taken as each beam's own, and grows with the load. `kinelast.runs`
    adds the speed at which the limits end where that is asked for.

    Returns
    -------
    A row for every link with beams, the one that fails first on top: `governs`, its mode, `reserve` with its error, and
    `reserves` of all modes.
    """
    mechanism, rows = results.mechanism, []
    for number, link in enumerate(mechanism.links):
        beams = [beam for beam, (owner, _) in enumerate(mechanism.beams) if owner == number]
        reserves = dict(_reserves(results, link.name, beams)) if beams else {}
        if reserves:
            mode = min(reserves, key=lambda each: reserves[each]["value"])
            rows.append({"link": link.name, "governs": mode, "reserve": reserves[mode], "reserves": reserves})
    return sorted(rows, key=lambda row: row["reserve"]["value"])


def _reserves(results: Results, link: str, beams: Sequence[int]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Modes of failure of a link and their reserves, the least of its beams, of those that are known."""
    own = [limit for limit in results.scene.limits if limit.item in ("", link)]
    asked = next((float(limit.bound) for limit in own if limit.kind == "life"), None)
    finite = asked is not None and any(math.isfinite(results.figures.peaks["life"][beam].value) for beam in beams)
    for mode, (key, power) in RESERVES.items():
        if mode == "endurance" and finite and results.scene.fatigue and asked is not None:
            slope = float(results.scene.fatigue.strengths[beams[0]].slope)
            yield from _reserve(results, "life", "life", 1.0 / slope, beams, asked)
        else:
            yield from _reserve(results, mode, key, power, beams, 1.0)
    for limit in own:
        if limit.kind in LIMITED:
            yield from _reserve(results, limit.kind, limit.figure, LIMITED[limit.kind], beams, float(limit.bound))


def _reserve(
    results: Results, mode: str, key: str, power: float, beams: Sequence[int], bound: float
) -> Iterator[tuple[str, dict[str, Any]]]:
    peaks = results.figures.peaks.get(key) or []
    known = [(beam, peaks[beam]) for beam in beams if peaks and math.isfinite(peaks[beam].value) and peaks[beam].value]
    if not known:
        return
    beam, peak = min(known, key=lambda each: abs(each[1].value) ** power)
    value = (abs(peak.value) / bound) ** power
    error = _error(peak) * abs(power) * value / abs(peak.value)
    told = {"error": error if math.isfinite(error) else None}
    yield mode, figure(value, "1", **told, label=results.scene.labels[beam], **_moment(results, peak))


def _moment(results: Results, peak: Peak) -> dict[str, Any]:
    """Time and drives of a peak, where it has any."""
    return {} if math.isnan(peak.time) else at_peak(results, peak)
