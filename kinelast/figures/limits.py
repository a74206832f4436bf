"""Judgement of limits, for a run, for designs and for speeds, and the verdict as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from kinelast.figures.checks import nearer
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import bounded_items, magnitudes
from kinelast.figures.ranges import STRENGTH, can_yield, needed_by_limits, refusals
from kinelast.figures.registry import limits_of
from kinelast.figures.report import Verdict
from kinelast.figures.results import Results
from kinelast.figures.trust import doubts
from kinelast.scene.data import Scene
from kinelast.scene.figure import FIXED, LARGEST, SCENE, Figure, fixed
from kinelast.scene.limits import Limit
from kinelast.scene.numbers import UNRELIABLE
from rigid.arrays import Integers, Real, Reals, of_designs

KEPT, BROKEN, TOO_NEAR, UNKNOWN = "kept", "not kept", "too close to decide", "cannot be judged"
SEVERITY = BROKEN, UNKNOWN, TOO_NEAR, KEPT
VERDICTS = {KEPT: "acceptable", BROKEN: "not acceptable", TOO_NEAR: TOO_NEAR, UNKNOWN: UNKNOWN}
PASSED = {KEPT: True, BROKEN: False}
LIMITS_KEPT, LIMITS_MARGIN = "limits_kept", "limits_margin"
ONE_POSITION = "only one position of the cycle is computed: give more --positions"
WIDENED = 2.0  # margin of an unreliable figure, relative to its error
RECIPROCAL = "safety", "endurance"  # figures that are a strength over a stress
SPARE = 1e-4  # margin in addition to the error, relative to the limit, because errors change with the design


def widened(value: Any, error: Any) -> Any:
    """Return the errors for judgements: `WIDENED` times larger if the figure is unreliable."""
    return np.where(error > UNRELIABLE * np.abs(value), WIDENED * error, error)


def severity(limit: Limit, value: Any, error: Any) -> Integers:
    """Return the outcomes of a limit for figures and their errors, as indices into `SEVERITY`, shape (...).

    A limit is too close to decide if its bound is within the error, or within `WIDENED` times an unreliable error.
    """
    below, above = (limit.kept(end) for end in ends(limit, value, error))
    known = np.where(below & above, SEVERITY.index(KEPT), np.where(below | above, SEVERITY.index(TOO_NEAR), 0))
    return np.where(np.isnan(value) | np.isnan(error), SEVERITY.index(UNKNOWN), known)


def ends(limit: Limit, value: Any, error: Any) -> tuple[Any, Any]:
    """Return the smallest and the largest value of figures within their `widened` errors.

    The error of a safety factor is that of the stress in its denominator.
    """
    error = widened(value, error)
    if limit.figure.partition(".")[0] not in RECIPROCAL:
        return value - error, value + error
    share = np.divide(error, value, where=value > 0.0, out=np.zeros(np.shape(value)))
    return np.divide(value, 1.0 + share), value + error


def severities(scene: Scene, figures: Mapping[str, Any], errors: Mapping[str, Any] | None = None) -> Iterator[Integers]:
    """Yield the outcome of each limit of a scene, as indices into `SEVERITY`, shape (...).

    Parameters
    ----------
    figures
        Magnitudes of the figures in SI units by key, shape (items, ...), in the order of `items_of`. A limit cannot be
        judged if its figure is missing or out of range, if a link yields, or if a cam does not work.
    errors
        Errors of the same shapes. Without them, the outcomes are no verdicts.
    """
    for limit in limits_of(scene):
        items = bounded_items(scene, limit) if limit.figure in figures else []
        values = figures[limit.figure][items] if items else np.full(1, np.nan)
        given = replace(limit, bound=of_designs(limit.bound))
        worst = severity(given, values, errors[limit.figure][items] if errors and items else 0.0).min(axis=0)
        for _, refused in refusals(scene, limit.figure, items, figures):
            worst = np.minimum(worst, np.where(refused, SEVERITY.index(UNKNOWN), SEVERITY.index(KEPT)))
        yield worst


def decisive(scene: Scene, limit: Limit, figures: Mapping[str, Any]) -> Real:
    """Return the figure closest to a limit or farthest beyond it, shape (...), nan if one is unknown."""
    items = bounded_items(scene, limit) if limit.figure in figures else []
    if not items:
        return math.nan
    values: Reals = figures[limit.figure][items]
    nearest: Reals = values.min(axis=0) if limit.least else values.max(axis=0)
    return nearest


def limits_kept(scene: Scene, figures: Iterable[Figure]) -> tuple[Figure, Figure]:
    """Return two figures without errors: whether all limits are kept (1 or 0), and the smallest margin."""
    needed = {limit.figure for limit in limits_of(scene)} | needed_by_limits(scene)
    bounded = [figure for figure in figures if figure.key in needed]

    def kept(cycle: Cycle) -> Reals:
        every = severities(cycle.scene, magnitudes(cycle, bounded))
        return np.where(reduce(np.minimum, every) == SEVERITY.index(KEPT), 1.0, 0.0)

    def margin(cycle: Cycle) -> Reals:
        known = magnitudes(cycle, bounded)
        given = [(replace(limit, bound=of_designs(limit.bound)), decisive(cycle.scene, limit, known))
                 for limit in limits_of(cycle.scene)]  # fmt: skip
        if can_yield(cycle.scene):
            given.append((STRENGTH, np.fmin.reduce(known[STRENGTH.figure], axis=0)))
        return reduce(np.minimum, [limit.margin(value) for limit, value in given])

    fields = tuple(dict.fromkeys(field for figure in bounded for field in figure.fields))
    words = "all limits are kept, errors not counted", "least margin of all limits, as a share, errors not counted"
    return (
        Figure(LIMITS_KEPT, words[0], "1", SCENE, fixed(kept), FIXED, fields, told=True),
        Figure(LIMITS_MARGIN, words[1], "1", SCENE, fixed(margin), FIXED, fields),
    )


@dataclass(frozen=True)
class Judgement:
    """Outcome of a limit, with the figure that decides it: the worst, and then the closest to the bound.

    Attributes
    ----------
    limit
        The limit.
    outcome
        One of `SEVERITY`.
    item
        Number of the figure's item.
    value, error
        Magnitude and error of the figure in its SI unit, nan if unknown.
    problem
        Reason why the limit cannot be judged, or advice that decides it; otherwise empty.
    """

    limit: Limit
    outcome: str
    item: int
    value: float
    error: float
    problem: str

    @property
    def worst(self) -> float:
        """Figure with its error towards the bound."""
        return float(ends(self.limit, self.value, self.error)[0 if self.limit.least else 1])


def judgement(results: Results, limit: Limit, key: str, items: Sequence[int] | None = None) -> Judgement:
    """Judge a limit of a figure, for some of its items or for all."""
    peaks = results.figures.peaks.get(key, [])
    exact = any(each.exact for each in results.figures.figures if each.key == key)
    errors = [0.0 if exact else peak.error_size for peak in peaks]
    signed = any(each.over != LARGEST for each in results.figures.figures if each.key == key)
    sizes = [peak.value if signed else abs(peak.value) for peak in peaks]
    known = [(item, sizes[item], errors[item]) for item in (items or range(len(peaks)))]
    how, _, item, value, error = min(
        ((int(severity(limit, value, error)), float(limit.margin(value)), item, value, error)
         for item, value, error in known),
        default=(SEVERITY.index(UNKNOWN), math.nan, 0, math.nan, math.nan),
    )  # fmt: skip
    outcome, problem = SEVERITY[how], ""
    if results.buckles and math.isnan(value):
        outcome, problem = BROKEN, results.buckles
    elif outcome == UNKNOWN:
        problem = "the figure is unknown" if math.isnan(value) else results.error_unknown or "its error is unknown"
    elif outcome == TOO_NEAR:
        parts = peaks[item].error
        assert parts is not None
        problem = nearer(results, parts, abs(value - float(limit.bound)) / (abs(value) or 1.0))
    if results.one_position and outcome != BROKEN and not exact:
        outcome, problem = UNKNOWN, ONE_POSITION
    judged = Judgement(limit, outcome, item, value, error, problem)
    return or_refused(results, judged, key, [item for item, *_ in known])


def or_refused(results: Results, judged: Judgement, key: str, items: Sequence[int]) -> Judgement:
    """Return the judgement, or "cannot be judged" for one of the reasons of `refusals`."""
    if judged.outcome == BROKEN:
        return judged
    values = {other: [peak.value for peak in peaks] for other, peaks in results.figures.peaks.items() if peaks}
    why = "; ".join(words for words, refused in refusals(results.scene, key, items, values) if refused)
    if not why:
        return judged
    before = judged.problem if judged.outcome == UNKNOWN else ""
    return replace(judged, outcome=UNKNOWN, problem="; ".join(filter(None, (before, why))))


def if_reliable(results: Results, judgements: Sequence[Judgement]) -> tuple[Judgement, ...]:
    """Return the judgements, with "cannot be judged" for all that are not broken if the figures are not reliable."""
    doubtful = [judged.outcome in (KEPT, TOO_NEAR) for judged in judgements]
    why = "; ".join(doubts(results)) if any(doubtful) else ""
    if not why:
        return tuple(judgements)
    pairs = zip(judgements, doubtful, strict=True)
    return tuple(replace(judged, outcome=UNKNOWN, problem=why) if doubt else judged for judged, doubt in pairs)


def verdict_on(judgements: Sequence[Judgement]) -> Verdict:
    """Return the verdict on several limits; its `problem` is the reason or the advice that decides it."""
    worst = min((each.outcome for each in judgements), key=SEVERITY.index, default="")
    problem = next((each.problem for each in judgements if each.outcome == worst), "")
    return Verdict(verdict=VERDICTS.get(worst, ""), passed=PASSED.get(worst), problem=problem)
