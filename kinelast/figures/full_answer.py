"""Full answer of a design, with judged limits of any figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import Measure, bounded_items, measures_of
from kinelast.figures.errors import stiffness_error
from kinelast.figures.limits import (
    BROKEN,
    SEVERITY,
    SPARE,
    UNKNOWN,
    Judgement,
    if_reliable,
    judgement,
    or_refused,
    severity,
)
from kinelast.figures.registry import figures_of, limits_of
from kinelast.figures.results import Results, results_in_full
from kinelast.scene.data import QUASI_STATIC, Scene
from kinelast.scene.error import SceneError
from kinelast.scene.figure import LARGEST, LEAST, items_of
from kinelast.scene.limits import Limit


def limits_of_items(scene: Scene) -> list[Limit]:
    """Return the limits of a scene for single items, with figure names such as `deflection.rod`."""
    limits = []
    for limit in limits_of(scene):
        items = items_of(scene, limit.of)
        names = [f"{limit.figure}.{items[number]}".rstrip(".") for number in bounded_items(scene, limit)]
        limits += [replace(limit, figure=name) for name in names or [limit.figure]]
    return limits


@dataclass(frozen=True)
class FullAnswer:
    """Answer to a design by the scene's theory, with errors.

    Attributes
    ----------
    theory
        Name of the theory, empty without an answer.
    judgements
        Judgements of the limits.
    figures
        Magnitude and error of figures by name in SI units, nan if unknown.
    """

    theory: str
    judgements: tuple[Judgement, ...]
    figures: Mapping[str, tuple[float, float]]


def full_answer(scene: Scene, limits: Iterable[Limit], names: Iterable[str] = ()) -> FullAnswer:
    """Return the full answer of a scene with judged limits and figures by name."""
    try:
        results = results_in_full(scene)
    except SceneError as error:
        unknown = tuple(Judgement(limit, UNKNOWN, 0, math.nan, math.nan, error.problem) for limit in limits)
        return FullAnswer("", unknown, dict.fromkeys(names, (math.nan, math.nan)))
    measures = measures_of(scene, figures_of(results.figures.output))
    theory = QUASI_STATIC if results.answer is None else results.answer.theory
    judged = [judged_measure(results, limit, measures.get(limit.figure)) for limit in limits]
    judgements = if_reliable(results, judged)
    figures = {name: _known(results, measures[name]) for name in names if name in measures}
    return FullAnswer(theory, judgements, figures)


def _known(results: Results, measure: Measure) -> tuple[float, float]:
    """Return a figure and its error, including figures that are computed on request only."""
    entry, peaks = measure.figure, results.figures.peaks.get(measure.figure.key, [])
    if peaks:
        sign = -1.0 if entry.over == LEAST else 1.0
        sizes = [abs(peak.value) if entry.over == LARGEST else peak.value for peak in peaks]
        items = [item for item in (measure.items or range(len(peaks))) if not math.isnan(sizes[item])]
        if not items:
            return math.nan, math.nan
        item = max(items, key=lambda each: sign * sizes[each])
        return sizes[item], 0.0 if entry.exact else peaks[item].error_size
    value = _value(measure, results.cycle)
    closer = results.answer.off.closer if results.answer else None
    if entry.of_motion(results.scene) or entry.here:
        value = value if closer is None else _value(measure, closer)
        return value, math.nan if closer is None else abs(value - _value(measure, closer.coarser))
    bent = [(peak.value, peak.error) for peak in results.figures.peaks.get("deflection", []) if peak.error]
    stiff = stiffness_error((size for size, _ in bent), (error for _, error in bent))
    return value, (1.0 + value) * stiff


def _value(measure: Measure, cycle: Cycle) -> float:
    return float(np.ravel(measure.of(cycle)[0])[0])


def judged_measure(results: Results, limit: Limit, measure: Measure | None) -> Judgement:
    """Judge a limit of any figure, including figures that are computed on request only."""
    if measure and measure.figure.key in results.figures.peaks:
        return judgement(results, limit, measure.figure.key, measure.items)
    value, error = _known(results, measure) if measure else (math.nan, math.nan)
    outcome = BROKEN if results.buckles and math.isnan(value) else SEVERITY[int(severity(limit, value, error))]
    problem = results.buckles or f"the error of {limit.figure} is unknown" if outcome == UNKNOWN else ""
    return or_refused(results, Judgement(limit, outcome, 0, value, error, problem), limit.figure, [])


def room(judged: Judgement, value: float, before: tuple[float, float] | None = None, spare: float = SPARE) -> float:
    """Return the bound of a quasi-static figure for which the full answer, with its error, keeps its limit.

    The ratio of full to quasi-static answer is taken from this design, or extrapolated linearly from two designs.

    Parameters
    ----------
    value
        Quasi-static figure of the judged design.
    before
        Quasi-static figure of another design, and its full answer with error.
    spare
        Margin in addition to the error, relative to the limit.
    """
    bound, worst = float(judged.limit.bound), judged.worst
    if not math.isfinite(worst) or not math.isfinite(value):
        return bound
    moved = bound * value / worst if value * worst > 0.0 else bound + value - worst
    if before and (worst - before[1]) * (value - before[0]) > 0.0:
        moved = value + (bound - worst) * (value - before[0]) / (worst - before[1])
    return moved + (1 if judged.limit.least else -1) * spare * abs(bound)
