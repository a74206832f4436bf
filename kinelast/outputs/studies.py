"""Studies of a scene's designs, written into its folder, and the best design as data, table and words."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.designs.optimum import ACTIVE, RADII, OptimumResult
from kinelast.designs.problem import steps_of
from kinelast.designs.studies import optimum_study, sensitivity_study, tolerance_study
from kinelast.designs.tolerances import DESIGNS
from kinelast.figures.limits import BROKEN, UNKNOWN, VERDICTS, Judgement, verdict_on
from kinelast.outputs.sensitivities import (
    ToldSensitivities,
    sensitivity_bars,
    sensitivity_figures,
    sensitivity_table,
    tolerance_bars,
    tolerance_figures,
    tolerance_table,
)
from kinelast.outputs.table import Table, write_table
from kinelast.outputs.words import error_words
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.document import Document
from kinelast.scene.numbers import SI, ToldIn, number, percent, quantity
from kinelast.scene.text import of_file
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Request

HEAD = (
    *("what", "name", "unit", "before", "value", "lower bound", "upper bound", "margin", "multiplier"),
    *("held to", "in full", "error", "outcome"),
)


def optimum_figures(solved: OptimumResult, told_in: ToldIn = SI) -> dict[str, Any]:
    """Return the best design and its certificate as plain data for JSON."""
    task, best = solved.task, solved.optimum
    held, name = best.certificate, task.figure
    sign = -1.0 if task.largest else 1.0
    return {
        "goal": "maximize" if task.largest else "minimize",
        "figure": name,
        "unit": solved.units[name],
        "before": float(solved.before[name]),
        "value": float(solved.after[name]),
        **_goal_in_full(solved),
        "feasible": best.feasible,
        **_verdict(solved, told_in),
        "variables": _variables(solved),
        "limits": _limits(solved),
        "residual": float(held.residual),
        "kinked": held.kinked,
        "neighbours": [
            {"within": radius, "tried": tried, "feasible": feasible, "better": better}
            for radius, tried, feasible, better in zip(
                RADII, held.neighbours.tried, held.neighbours.feasible, held.neighbours.better, strict=True
            )
        ],
        "searches": [
            {"value": float(sign * each.cost), "violation": float(each.violation), "feasible": each.violation == 0}
            for each in best.searches
        ],
        "designs": best.designs,
        "calls": best.calls,
        "words": words(solved, told_in),
    }


def _variables(solved: OptimumResult) -> list[dict[str, Any]]:
    task, best = solved.task, solved.optimum
    rows = []
    for k, variable in enumerate(task.variables):
        at = "low" if best.shares[k] < ACTIVE else "high" if best.shares[k] > 1 - ACTIVE else None
        multiplier = max(best.certificate.low[k], best.certificate.high[k])
        rows.append(
            {
                "path": variable.path,
                "unit": variable.unit,
                "before": variable.base,
                "value": float(best.values[k]),
                "low": float(task.low[k]),
                "high": float(task.high[k]),
                "at_bound": at,
                "multiplier": float(multiplier),
            }
        )
    return rows


def _limits(solved: OptimumResult) -> list[dict[str, Any]]:
    held = solved.optimum.certificate
    return [
        {
            "figure": limit.figure,
            "unit": solved.units[limit.figure],
            "bound": limit.bound,
            "kind": "least" if limit.least else "most",
            "before": float(solved.before[limit.figure]),
            "value": float(solved.after[limit.figure]),
            "held_to": held_to,
            **_in_full(judged),
            "margin": float(margin),
            "active": bool(abs(margin) < ACTIVE),
            "multiplier": float(multiplier),
        }
        for limit, held_to, margin, multiplier, judged in zip(
            solved.task.limits,
            solved.held_to,
            held.margin,
            held.multiplier,
            solved.judgements or (None,) * len(solved.held_to),
            strict=True,
        )
    ]


def _goal_in_full(solved: OptimumResult) -> dict[str, Any]:
    """Return the theory of the full answer, and its goal figure with error, null if unknown."""
    found = solved.answer
    pair = found.figures.get(solved.task.figure, (math.nan, math.nan)) if found else (math.nan, math.nan)
    value, error = (each if math.isfinite(each) else None for each in pair)
    return {"theory": found.theory if found and found.theory else QUASI_STATIC, "in_full": value, "error": error}


def _in_full(judged: Judgement | None) -> dict[str, Any]:
    """Return the full answer's figure of a limit, with error and outcome, null if unknown."""
    if judged is None:
        return {"in_full": None, "error": None, "outcome": UNKNOWN}
    value, error = (each if math.isfinite(each) else None for each in (judged.value, judged.error))
    return {"in_full": value, "error": error, "outcome": judged.outcome}


def _verdict(solved: OptimumResult, told_in: ToldIn) -> dict[str, Any]:
    """Return the verdict on the best design."""
    if solved.task.limits and not solved.optimum.feasible:
        return {"verdict": VERDICTS[BROKEN], "passed": False, "problem": _missed(solved, told_in)}
    return verdict_on(solved.judgements)


def words(solved: OptimumResult, told_in: ToldIn = SI) -> list[str]:
    """Return sentences on an optimum."""
    task, best, unit = solved.task, solved.optimum, solved.units[solved.task.figure]
    held = best.certificate
    told = _verdict(solved, told_in)
    kept = told["verdict"] if told["passed"] else f"{told['verdict'].upper()}: {told['problem']}".rstrip(": ")
    if told["passed"] is False:
        kept = f"NO design keeps all limits: at best {told['problem']}"
    kept = f"; {kept}" if kept else ""
    before, after = (quantity(each[task.figure], unit, told_in=told_in) for each in (solved.before, solved.after))
    said = [f"{task.figure}: {before} -> {after}{_goal_words(solved, told_in)}{kept}"]
    less = "more" if task.largest else "less"
    rows = zip(task.limits, solved.held_to, held.margin, held.multiplier, strict=True)
    for limit, held_to, margin, multiplier in rows:
        if abs(margin) < ACTIVE:
            bound, moved = (
                quantity(each, solved.units[limit.figure], told_in=told_in) for each in (limit.bound, held_to)
            )
            room = f" ({moved} without vibration and error)" if moved != bound else ""
            gain = f"relaxing it by 1 % gives {number(multiplier, 3)} % {less}"
            said.append(f"active limit {limit.figure}, {bound}{room}: {gain}")
    for row in _variables(solved):
        if row["at_bound"]:
            end = "lower" if row["at_bound"] == "low" else "upper"
            size = quantity(row["value"], row["unit"], told_in=told_in)
            said.append(f"active {end} bound of {row['path']}, {size}")
    residual = f"converged to {percent(held.residual)}" + (", at a kink" if held.kinked else "")
    better, tried = int(np.sum(held.neighbours.better)), int(np.sum(held.neighbours.tried))
    near = f"{better or 'no'} better {'designs' if better > 1 else 'design'} among {tried} neighbours"
    said.append(f"{residual}; {near}; {best.designs} designs computed")
    if not solved.quasi_static and solved.answer is None:
        said.append("found without vibration: a report on optimum.toml has the scene's own theory")
    return said


def _goal_words(solved: OptimumResult, told_in: ToldIn) -> str:
    """Return the goal by the full answer in words, empty without one."""
    told, unit = _goal_in_full(solved), solved.units[solved.task.figure]
    if told["theory"] == QUASI_STATIC or told["in_full"] is None or told["error"] == 0.0:
        return ""
    size = quantity(told["in_full"], unit, told_in=told_in)
    row = {"value": told["in_full"], "unit": unit, "error": told["error"]}
    return f" (full answer {size}{error_words(row, told_in)}, {told['theory']})"


def _missed(solved: OptimumResult, told_in: ToldIn) -> str:
    """Return the limits that the closest design exceeds, and by how much, in words."""
    told = []
    for limit, held_to, margin in zip(
        solved.task.limits, solved.held_to, solved.optimum.certificate.margin, strict=True
    ):
        if not margin >= 0:
            value, bound = (
                quantity(each, solved.units[limit.figure], told_in=told_in)
                for each in (solved.after[limit.figure], held_to)
            )
            told.append(f"{limit.figure} is {value}, {percent(-margin)} {'below' if limit.least else 'above'} {bound}")
    return "; ".join(told) or "they are exceeded by round-off"


def optimum_table(solved: OptimumResult) -> Table:
    """Return a table with rows for the goal, the variables and the limits."""
    figures = optimum_figures(solved)
    goal = (figures["goal"], figures["figure"], figures["unit"], figures["before"], figures["value"])
    rows: list[tuple[Any, ...]] = [(*goal, *(None,) * 5, figures["in_full"], figures["error"], None)]
    for each in figures["variables"]:
        keys = ("path", "unit", "before", "value", "low", "high")
        rows.append(("variable", *(each[key] for key in keys), None, each["multiplier"], *(None,) * 4))
    for each in figures["limits"]:
        bounds = (each["bound"], None) if each["kind"] == "least" else (None, each["bound"])
        first = (each[key] for key in ("figure", "unit", "before", "value"))
        last = (each[key] for key in ("margin", "multiplier", "held_to", "in_full", "error", "outcome"))
        rows.append(("limit", *first, *bounds, *last))
    return Table.of_rows(HEAD, rows)


def write_studies(part: Path, document: Document, request: Request, progress: Progress) -> dict[str, Any]:
    """Write the files of the requested studies and return their figures by study.

    Parameters
    ----------
    part
        Folder.
    document
        Document of the scene.
    request
        Studies, number of samples, and formats.

    Raises
    ------
    SceneError
        The study cannot be answered.
    """
    figures = {}
    with of_file(document.path):
        if request.sensitivities:
            result, numbers, units = sensitivity_study(document, progress=progress)
            steps = steps_of(document, numbers)
            told_so = ToldSensitivities(result, numbers, units, steps, document.scene.told_in)
            write_table(part / "sensitivities.csv", sensitivity_table(told_so), request.tables)
            (part / "sensitivities.svg").write_text(sensitivity_bars(told_so), encoding="utf-8")
            figures["sensitivities"] = sensitivity_figures(told_so)
        if request.tolerances:
            ranges = tolerance_study(document, request.samples or DESIGNS, progress)
            write_table(part / "tolerances.csv", tolerance_table(ranges), request.tables)
            (part / "tolerances.svg").write_text(tolerance_bars(ranges, document.scene.told_in), encoding="utf-8")
            figures["tolerances"] = tolerance_figures(ranges, document.scene.told_in)
        if request.optimize:
            best = optimum_study(document, progress)
            paths = (number.path for number in best.task.variables)
            values = dict(zip(paths, best.optimum.values.tolist(), strict=True))
            figures["optimum"] = optimum_figures(best, document.scene.told_in)
            told = figures["optimum"]["verdict"]
            head = f"The best design by [optimize] of the scene {document.name}{told and ': '}{told}."
            new = document.with_values(values).text(head)
            (part / "optimum.toml").write_text(new, encoding="utf-8")
            write_table(part / "optimum.csv", optimum_table(best), request.tables)
    return figures
