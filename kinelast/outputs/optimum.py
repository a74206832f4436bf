"""The best design and its certificate as plain data, as a table and in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.designs.certificate import ACTIVE, RADII
from kinelast.designs.optimum import OptimumResult
from kinelast.outputs.table import Table
from kinelast.scene.numbers import number, percent, quantity

HEAD = ("what", "name", "unit", "before", "value", "lower bound", "upper bound", "margin", "multiplier")


def optimum_figures(solved: OptimumResult) -> dict[str, Any]:
    """The best design and its certificate, as plain data that JSON can hold; null where not known."""
    task, best = solved.task, solved.optimum
    held, name = best.certificate, task.figure
    sign = -1.0 if task.largest else 1.0
    return {
        "goal": "maximize" if task.largest else "minimize",
        "figure": name,
        "unit": solved.units[name],
        "before": float(solved.before[name]),
        "value": float(solved.after[name]),
        "feasible": best.feasible,
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
        "words": words(solved),
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
            "margin": float(margin),
            "active": bool(abs(margin) < ACTIVE),
            "multiplier": float(multiplier),
        }
        for limit, margin, multiplier in zip(solved.task.limits, held.margin, held.multiplier, strict=True)
    ]


def words(solved: OptimumResult) -> list[str]:
    """Sentences on an optimum."""
    task, best, unit = solved.task, solved.optimum, solved.units[solved.task.figure]
    held = best.certificate
    kept = "all limits kept" if best.feasible else "NOT all limits can be kept: this is the nearest to that"
    said = [f"{task.figure}: {quantity(solved.before[task.figure], unit)} -> "
            f"{quantity(solved.after[task.figure], unit)}; {kept}"]  # fmt: skip
    less = "more" if task.largest else "less"
    for limit, margin, multiplier in zip(task.limits, held.margin, held.multiplier, strict=True):
        if abs(margin) < ACTIVE:
            bound = quantity(limit.bound, solved.units[limit.figure])
            said.append(f"held by {limit.figure}, {bound}: 1 % more room is {number(multiplier, 3)} % {less}")
    for row in _variables(solved):
        if row["at_bound"]:
            end = "lower" if row["at_bound"] == "low" else "upper"
            said.append(f"held by the {end} bound of {row['path']}, {quantity(row['value'], row['unit'])}")
    residual = f"stationary to {percent(held.residual)}" + (", at a kink" if held.kinked else "")
    better, tried = int(np.sum(held.neighbours.better)), int(np.sum(held.neighbours.tried))
    said.append(f"{residual}; {better or 'none'} of {tried} neighbours better; {best.designs} designs computed")
    if not solved.quasi_static:
        said.append("found without vibration, whatever the scene's theory or accuracy: report on optimum.toml")
    return said


def optimum_table(solved: OptimumResult) -> Table:
    """A row for the goal, every variable and every limit."""
    figures = optimum_figures(solved)
    goal = (figures["goal"], figures["figure"], figures["unit"], figures["before"], figures["value"])
    rows: list[tuple[Any, ...]] = [(*goal, None, None, None, None)]
    for each in figures["variables"]:
        keys = ("path", "unit", "before", "value", "low", "high")
        rows.append(("variable", *(each[key] for key in keys), None, each["multiplier"]))
    for each in figures["limits"]:
        bounds = (each["bound"], None) if each["kind"] == "least" else (None, each["bound"])
        first = (each[key] for key in ("figure", "unit", "before", "value"))
        rows.append(("limit", *first, *bounds, each["margin"], each["multiplier"]))
    return Table.of_rows(HEAD, rows)
