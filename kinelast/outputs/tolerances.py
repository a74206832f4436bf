"""Scatter of figures from tolerances, as plain data, as a table and as bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.designs.accuracy import GEOMETRIC, WHOLE
from kinelast.designs.tolerances import Scatter, ToleranceResult
from kinelast.outputs.bars import Bars, bars_svg
from kinelast.outputs.table import Table
from kinelast.scene.numbers import number, quantity

TOLD = 2  # figures of which the closing words tell, where there are no errors of the output
SAMPLED = ("mean", "deviation", "low", "median", "high", "least", "largest", "known")


def tolerance_figures(result: ToleranceResult) -> dict[str, Any]:
    """Ranges of figures as plain data that JSON can hold, null where not known; `words` tell the first of them."""
    numbers = [
        {
            "path": variable.path,
            "value": variable.base,
            "unit": variable.unit,
            "plus_minus": tolerance.half,
            "distribution": "normal" if tolerance.normal else "uniform",
        }
        for variable, tolerance in zip(result.variables, result.tolerances, strict=True)
    ]
    figures = [_figure(result, row, name) for row, name in enumerate(result.nominal.figures)]
    names = [name for name in (GEOMETRIC, WHOLE) if name in result.sampled] or result.nominal.figures[:TOLD]
    words = [_told(name, result.sampled[name], result.units[name]) for name in names]
    return {"designs": result.designs, "words": words, "numbers": numbers, "figures": figures}


def _told(name: str, sampled: Scatter, unit: str) -> str:
    """The range of a figure in words."""
    low, median, high = (quantity(value, unit) for value in (sampled.low, sampled.median, sampled.high))
    return f"{name} of 95 % of the machines: {low} to {high}, of half of them below {median}"


def _figure(result: ToleranceResult, row: int, name: str) -> dict[str, Any]:
    sampled, (alone, together) = result.sampled[name], result.shares[name]
    return {
        "name": name,
        "unit": result.units[name],
        "value": float(result.nominal.figure[row]),
        "first_order": {"deviation": float(result.first.deviation[row]), "worst": float(result.first.worst[row])},
        "sampled": {key: float(getattr(sampled, key)) for key in SAMPLED},
        "errors": dict(zip(SAMPLED[:5], map(float, sampled.error), strict=True)),
        "shares": [
            {
                "path": variable.path,
                "first_order": float(result.first.share[row, column]),
                "alone": float(alone[column]),
                "together": float(together[column]),
            }
            for column, variable in enumerate(result.variables)
        ],
    }


def tolerance_table(result: ToleranceResult) -> Table:
    """A row a figure: its value, its range to first order and by samples, and the share of each number in it."""
    names = [one.path for one in result.variables]
    head = ["figure", "unit", "value", "first order deviation", "first order worst", *SAMPLED,
            *(f"share of {name}" for name in names), *(f"share of {name} with others" for name in names)]  # fmt: skip
    rows = []
    for row, name in enumerate(result.nominal.figures):
        sampled, (alone, together) = result.sampled[name], result.shares[name]
        first = result.nominal.figure[row], result.first.deviation[row], result.first.worst[row]
        cells = (*first, *(getattr(sampled, key) for key in SAMPLED), *alone, *together)
        rows.append((name, result.units[name], *map(float, cells)))
    return Table.of_rows(head, rows)


def tolerance_bars(result: ToleranceResult) -> str:
    """Shares of the numbers in the variance of every figure, as bars in SVG."""
    charts = []
    for row, name in enumerate(result.nominal.figures):
        sampled, unit = result.sampled[name], result.units[name]
        shares = np.where(np.isfinite(result.shares[name][1]), result.shares[name][1], result.first.share[row])
        order = [int(column) for column in np.argsort(-shares, kind="stable") if shares[column] > 0.005]
        bars = tuple(
            (result.variables[column].path, shares[column], f"{number(100 * shares[column], 3)} %") for column in order
        )
        if bars and sampled.known:
            value, low, high = (
                quantity(each, unit) for each in (result.nominal.figure[row], sampled.low, sampled.high)
            )
            charts.append(Bars(f"{name}, {value}: 95 % of all from {low} to {high}; why", bars))
    return bars_svg(charts)
