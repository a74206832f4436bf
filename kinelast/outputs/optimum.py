"""The best design and its certificate as plain data, as a table and in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.designs.certificate import ACTIVE, RADII
from kinelast.designs.optimum import Solved
from kinelast.numbers import number, percent, quantity
from kinelast.outputs.table import Table

HEAD = ("what", "name", "unit", "before", "value", "lower bound", "upper bound", "margin", "multiplier")


def optimum_figures(solved: Solved) -> dict[str, Any]:
    """The best design and its certificate, as plain data that JSON can hold; null where not known."""
    sought, found = solved.sought, solved.optimum
    held, name = found.certificate, sought.figure
    sign = -1.0 if sought.largest else 1.0
    return {
        "goal": "maximize" if sought.largest else "minimize",
        "figure": name,
        "unit": solved.units[name],
        "before": float(solved.before[name]),
        "value": float(solved.after[name]),
        "feasible": found.feasible,
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
            for each in found.searches
        ],
        "designs": found.designs,
        "calls": found.calls,
        "words": words(solved),
    }


def _variables(solved: Solved) -> list[dict[str, Any]]:
    sought, found = solved.sought, solved.optimum
    rows = []
    for k, one in enumerate(sought.variables):
        at = "low" if found.shares[k] < ACTIVE else "high" if found.shares[k] > 1 - ACTIVE else None
        multiplier = max(found.certificate.low[k], found.certificate.high[k])
        rows.append(
            {
                "path": one.path,
                "unit": one.unit,
                "before": one.base,
                "value": float(found.values[k]),
                "low": float(sought.low[k]),
                "high": float(sought.high[k]),
                "at_bound": at,
                "multiplier": float(multiplier),
            }
        )
    return rows


def _limits(solved: Solved) -> list[dict[str, Any]]:
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
        for limit, margin, multiplier in zip(solved.sought.limits, held.margin, held.multiplier, strict=True)
    ]


def words(solved: Solved) -> list[str]:
    """Sentences on an optimum."""
    sought, found, unit = solved.sought, solved.optimum, solved.units[solved.sought.figure]
    held = found.certificate
    kept = "all limits kept" if found.feasible else "NOT all limits can be kept: this is the nearest to that"
    said = [f"{sought.figure}: {quantity(solved.before[sought.figure], unit)} -> "
            f"{quantity(solved.after[sought.figure], unit)}; {kept}"]  # fmt: skip
    less = "more" if sought.largest else "less"
    for limit, margin, multiplier in zip(sought.limits, held.margin, held.multiplier, strict=True):
        if abs(margin) < ACTIVE:
            bound = quantity(limit.bound, solved.units[limit.figure])
            said.append(f"held by {limit.figure}, {bound}: 1 % more room is {number(multiplier, 3)} % {less}")
    for row in _variables(solved):
        if row["at_bound"]:
            end = "lower" if row["at_bound"] == "low" else "upper"
            said.append(f"held by the {end} bound of {row['path']}, {quantity(row['value'], row['unit'])}")
    residual = f"stationary to {percent(held.residual)}" + (", at a kink" if held.kinked else "")
    better, tried = int(np.sum(held.neighbours.better)), int(np.sum(held.neighbours.tried))
    said.append(f"{residual}; {better or 'none'} of {tried} neighbours better; {found.designs} designs computed")
    if not solved.quasi_static:
        said.append("found without vibration, whatever the scene's theory or accuracy: report on optimum.toml")
    return said


def optimum_table(solved: Solved) -> Table:
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
