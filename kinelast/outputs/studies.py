"""Files of design studies: sensitivities, tolerances, and optimization.

An optimization searches for the best design within limits. The report on the best design is returned as plain data,
table and sentences.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UnsetType

from kinelast.designs.optimum import ACTIVE, RADII, OptimumResult
from kinelast.designs.optimum_study import MAX_SPARE, optimum_study
from kinelast.designs.problem import steps_of
from kinelast.designs.studies import sensitivity_study, tolerance_study
from kinelast.designs.tolerances import DESIGNS
from kinelast.outputs import sensitivities as bars
from kinelast.outputs.table import Table, write_table
from kinelast.outputs.words import error_words, size
from kinelast.reports.limits import BROKEN, UNKNOWN, VERDICTS, verdict_on
from kinelast.reports.report import OptimumLimit, OptimumReport, OptimumVariable, Verdict
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.document import Document
from kinelast.scene.text import of_file
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Request
from kinelast.values.numbers import SI, DisplayUnits, number, percent, quantity
from kinelast.values.reading import Reading, known

HEAD = (
    *("what", "name", "unit", "before", "value", "lower bound", "upper bound", "margin", "multiplier"),
    *("held to", "in full", "error", "outcome"),
)


def optimum_report(solved: OptimumResult, shown_in: DisplayUnits = SI) -> OptimumReport:
    """Return the report on the best design.

    The report includes evidence that the design is optimal, for example that no neighbouring design is better.
    """
    task, best = solved.task, solved.optimum
    held, verdict, (value, error) = best.certificate, _verdict(solved, shown_in), _goal_in_full(solved)
    return OptimumReport(
        goal="maximize" if task.largest else "minimize",
        figure=task.figure,
        unit=solved.units[task.figure],
        before=float(solved.before[task.figure]),
        value=float(solved.after[task.figure]),
        theory=_theory(solved),
        in_full=value,
        error=error,
        feasible=best.feasible,
        verdict=verdict.verdict,
        passed=verdict.passed,
        problem=verdict.problem,
        variables=_variables(solved),
        limits=_limits(solved),
        residual=float(held.residual),
        kinked=held.kinked,
        neighbours=[
            {"within": radius, "tried": tried, "feasible": feasible, "better": better}
            for radius, tried, feasible, better in zip(
                RADII, held.neighbours.tried, held.neighbours.feasible, held.neighbours.better, strict=True
            )
        ],
        searches=[
            {
                "value": float(-each.cost if task.largest else each.cost),
                "violation": float(each.violation),
                "feasible": each.violation == 0,
            }
            for each in best.searches
        ],
        designs=best.designs,
        calls=best.calls,
        words=words(solved, shown_in),
    )


def _variables(solved: OptimumResult) -> list[OptimumVariable]:
    task, best = solved.task, solved.optimum
    rows = []
    for k, variable in enumerate(task.variables):
        at = "low" if best.shares[k] < ACTIVE else "high" if best.shares[k] > 1 - ACTIVE else None
        multiplier = max(best.certificate.low[k], best.certificate.high[k])
        rows.append(
            OptimumVariable(
                path=variable.path,
                unit=variable.unit,
                before=variable.base,
                value=float(best.values[k]),
                low=float(task.low[k]),
                high=float(task.high[k]),
                at_bound=at,
                multiplier=float(multiplier),
            )
        )
    return rows


def _limits(solved: OptimumResult) -> list[OptimumLimit]:
    held, rows = solved.optimum.certificate, []
    judgements = solved.judgements or (None,) * len(solved.held_to)
    columns = solved.task.limits, solved.held_to, held.margin, held.multiplier, judgements
    for limit, held_to, margin, multiplier, judged in zip(*columns, strict=True):
        rows.append(
            OptimumLimit(
                figure=limit.figure,
                unit=solved.units[limit.figure],
                bound=limit.bound,
                kind="least" if limit.least else "most",
                before=float(solved.before[limit.figure]),
                value=float(solved.after[limit.figure]),
                held_to=held_to,
                in_full=None if judged is None else known(judged.value),
                error=None if judged is None else known(judged.error),
                outcome=UNKNOWN if judged is None else judged.outcome,
                margin=float(margin),
                active=bool(abs(margin) < ACTIVE),
                multiplier=float(multiplier),
            )
        )
    return rows


def _theory(solved: OptimumResult) -> str:
    """Return the name of the theory that was used for the full deflection analysis of the best design."""
    return solved.answer.theory if solved.answer and solved.answer.theory else QUASI_STATIC


def _goal_in_full(solved: OptimumResult) -> tuple[float | None, float | None]:
    """Return the optimized result from the full deflection analysis, and the error of the result, or None."""
    value, error = (solved.answer.figures if solved.answer else {}).get(solved.task.figure, (math.nan, math.nan))
    return known(value), known(error)


def _verdict(solved: OptimumResult, shown_in: DisplayUnits) -> Verdict:
    """Return the verdict on the best design: whether the design meets all limits."""
    if solved.task.limits and not solved.optimum.feasible:
        return Verdict(verdict=VERDICTS[BROKEN], passed=False, problem=_missed(solved, shown_in))
    return verdict_on(solved.judgements)


def words(solved: OptimumResult, shown_in: DisplayUnits = SI) -> list[str]:
    """Return sentences about the best design: optimized result, active limits and bounds, and convergence."""
    task, best, unit = solved.task, solved.optimum, solved.units[solved.task.figure]
    held = best.certificate
    found = _verdict(solved, shown_in)
    kept = found.verdict if found.passed else f"{found.verdict.upper()}: {found.problem}".rstrip(": ")
    if found.passed is False:
        kept = f"NO design meets all limits: at best {found.problem}"
    kept = f"; {kept}" if kept else ""
    before, after = (quantity(each[task.figure], unit, shown_in=shown_in) for each in (solved.before, solved.after))
    said = [f"{task.figure}: {before} -> {after}{_goal_words(solved, shown_in)}{kept}"]
    less = "more" if task.largest else "less"
    judgements = solved.judgements or (None,) * len(task.limits)
    rows = zip(task.limits, solved.held_to, held.margin, held.multiplier, judgements, strict=True)
    for limit, held_to, margin, multiplier, judged in rows:
        if abs(margin) < ACTIVE:
            bound, moved = (
                quantity(each, solved.units[limit.figure], shown_in=shown_in) for each in (limit.bound, held_to)
            )
            room = f" ({moved} for the quasi-static figure)" if moved != bound else ""
            gain = f"relaxing it by 1 % gives {number(multiplier, 3)} % {less}"
            unused = float(limit.margin(judged.worst)) if judged else 0.0
            if unused > MAX_SPARE:
                gain = f"with its error, the figure leaves {percent(unused)} unused; a better design may exist"
            said.append(f"active limit {limit.figure}, {bound}{room}: {gain}")
    for row in _variables(solved):
        if row.at_bound:
            end = "lower" if row.at_bound == "low" else "upper"
            said.append(f"active {end} bound of {row.path}, {quantity(row.value, row.unit, shown_in=shown_in)}")
    residual = f"converged to {percent(held.residual)}" + (", at a kink" if held.kinked else "")
    better, tried = int(np.sum(held.neighbours.better)), int(np.sum(held.neighbours.tried))
    near = f"{better or 'no'} better {'designs' if better > 1 else 'design'} among {tried} neighbours"
    said.append(f"{residual}; {near}; {best.designs} designs computed")
    if not solved.quasi_static and solved.answer is None:
        said.append("found without vibration: a report on optimum.toml uses the theory of the scene")
    return said


def _goal_words(solved: OptimumResult, shown_in: DisplayUnits) -> str:
    """Return a phrase about the optimized result from the full deflection analysis.

    The search for the best design is quasi-static. The phrase is empty if the full deflection analysis is quasi-static
    too, or if its result is unknown or has no error.
    """
    theory, (value, error) = _theory(solved), _goal_in_full(solved)
    if theory == QUASI_STATIC or value is None or error == 0.0:
        return ""
    found = Reading(value=value, unit=solved.units[solved.task.figure], error=error)
    return f" (full answer {size(found, shown_in)}{error_words(found, shown_in)}, {theory})"


def _missed(solved: OptimumResult, shown_in: DisplayUnits) -> str:
    """Return a phrase that names the limits that the best design violates, and states each violation in per cent."""
    violated = []
    for limit, held_to, margin in zip(
        solved.task.limits, solved.held_to, solved.optimum.certificate.margin, strict=True
    ):
        if not margin >= 0:
            value, bound = (
                quantity(each, solved.units[limit.figure], shown_in=shown_in)
                for each in (solved.after[limit.figure], held_to)
            )
            violated.append(
                f"{limit.figure} is {value}, {percent(-margin)} {'below' if limit.least else 'above'} {bound}"
            )
    return "; ".join(violated) or "limits are exceeded by round-off"


def optimum_table(best: OptimumReport) -> Table:
    """Return a table with rows for the optimized result, the variables and the limits of the best design."""
    goal = (best.goal, best.figure, best.unit, best.before, best.value)
    rows: list[tuple[Any, ...]] = [(*goal, *(None,) * 5, best.in_full, best.error, None)]
    for each in best.variables:
        own = each.path, each.unit, each.before, each.value, each.low, each.high
        rows.append(("variable", *own, None, each.multiplier, *(None,) * 4))
    for limit in best.limits:
        bounds = (limit.bound, None) if limit.kind == "least" else (None, limit.bound)
        first = limit.figure, limit.unit, limit.before, limit.value
        last = limit.margin, limit.multiplier, limit.held_to, limit.in_full, limit.error, limit.outcome
        rows.append(("limit", *first, *bounds, *last))
    return Table.of_rows(HEAD, rows)


def best_design(document: Document, progress: Progress) -> tuple[Document, OptimumReport]:
    """Find the best design of a scene. Return the scene file of the best design, and the report on the best design."""
    with of_file(document.path):
        solved = optimum_study(document, progress)
    numbers = (variable.path for variable in solved.task.variables)
    values = dict(zip(numbers, solved.optimum.values.tolist(), strict=True))
    return document.with_values(values, "best design"), optimum_report(solved, document.scene.shown_in)


def write_studies(
    part: Path, document: Document, best: OptimumReport | UnsetType, request: Request, progress: Progress
) -> dict[str, Any]:
    """Write the files of the requested studies. Return plain data of each study, by name of the study.

    Parameters
    ----------
    part
        Folder for the files.
    document
        Scene file as a document. If an optimization was requested, this is the document of the best design.
    best
        Report on the best design, or UNSET if no optimization was requested.
    request
        Options of the run: requested studies, number of samples, and formats of tables.

    Raises
    ------
    SceneError
        A requested study is not possible for this scene.
    """
    figures: dict[str, Any] = {}
    with of_file(document.path):
        if request.sensitivities:
            result, numbers, units = sensitivity_study(document, progress=progress)
            steps = steps_of(document, numbers)
            printed = bars.PrintedSensitivities(result, numbers, units, steps, document.scene.shown_in)
            write_table(part / "sensitivities.csv", bars.sensitivity_table(printed), request.tables)
            (part / "sensitivities.svg").write_text(bars.sensitivity_bars(printed), encoding="utf-8")
            figures["sensitivities"] = bars.sensitivity_figures(printed)
        if request.tolerances:
            ranges = tolerance_study(document, request.samples or DESIGNS, progress)
            write_table(part / "tolerances.csv", bars.tolerance_table(ranges), request.tables)
            (part / "tolerances.svg").write_text(bars.tolerance_bars(ranges, document.scene.shown_in), encoding="utf-8")
            figures["tolerances"] = bars.tolerance_figures(ranges, document.scene.shown_in)
    if best:
        verdict = best.verdict
        head = f"The best design by [optimize] of the scene {document.name}{verdict and ': '}{verdict}."
        (part / "optimum.toml").write_text(document.text(head), encoding="utf-8")
        write_table(part / "optimum.csv", optimum_table(best), request.tables)
    return figures
