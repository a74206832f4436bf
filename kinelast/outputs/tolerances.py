"""Scatter of figures from tolerances, as plain data, as a table and as bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.designs.accuracy import GEOMETRIC, WHOLE
from kinelast.designs.tolerances import Scatter, ToleranceResult
from kinelast.numbers import number, quantity
from kinelast.outputs.bars import Bars, bars_svg
from kinelast.outputs.table import Table

TOLD = 2  # figures of which the closing words tell, where there are no errors of the output
SAMPLED = ("mean", "deviation", "low", "median", "high", "least", "largest", "known")


def tolerance_figures(found: ToleranceResult) -> dict[str, Any]:
    """Ranges of figures as plain data that JSON can hold, null where not known; `words` tell the first of them."""
    numbers = [
        {
            "path": one.path,
            "value": one.base,
            "unit": one.unit,
            "plus_minus": tolerance.half,
            "distribution": "normal" if tolerance.normal else "uniform",
        }
        for one, tolerance in zip(found.variables, found.tolerances, strict=True)
    ]
    figures = [_figure(found, row, name) for row, name in enumerate(found.nominal.figures)]
    names = [name for name in (GEOMETRIC, WHOLE) if name in found.sampled] or found.nominal.figures[:TOLD]
    words = [_told(name, found.sampled[name], found.units[name]) for name in names]
    return {"designs": found.designs, "words": words, "numbers": numbers, "figures": figures}


def _told(name: str, sampled: Scatter, unit: str) -> str:
    """The range of a figure in words."""
    low, median, high = (quantity(value, unit) for value in (sampled.low, sampled.median, sampled.high))
    return f"{name} of 95 % of the machines: {low} to {high}, of half of them below {median}"


def _figure(found: ToleranceResult, row: int, name: str) -> dict[str, Any]:
    sampled, (alone, together) = found.sampled[name], found.shares[name]
    return {
        "name": name,
        "unit": found.units[name],
        "value": float(found.nominal.figure[row]),
        "first_order": {"deviation": float(found.first.deviation[row]), "worst": float(found.first.worst[row])},
        "sampled": {key: float(getattr(sampled, key)) for key in SAMPLED},
        "errors": dict(zip(SAMPLED[:5], map(float, sampled.error), strict=True)),
        "shares": [
            {
                "path": one.path,
                "first_order": float(found.first.share[row, column]),
                "alone": float(alone[column]),
                "together": float(together[column]),
            }
            for column, one in enumerate(found.variables)
        ],
    }


def tolerance_table(found: ToleranceResult) -> Table:
    """A row a figure: its value, its range to first order and by samples, and the share of each number in it."""
    names = [one.path for one in found.variables]
    head = ["figure", "unit", "value", "first order deviation", "first order worst", *SAMPLED,
            *(f"share of {name}" for name in names), *(f"share of {name} with others" for name in names)]  # fmt: skip
    rows = []
    for row, name in enumerate(found.nominal.figures):
        sampled, (alone, together) = found.sampled[name], found.shares[name]
        first = found.nominal.figure[row], found.first.deviation[row], found.first.worst[row]
        cells = (*first, *(getattr(sampled, key) for key in SAMPLED), *alone, *together)
        rows.append((name, found.units[name], *map(float, cells)))
    return Table.of_rows(head, rows)


def tolerance_bars(found: ToleranceResult) -> str:
    """Shares of the numbers in the variance of every figure, as bars in SVG."""
    charts = []
    for row, name in enumerate(found.nominal.figures):
        sampled, unit = found.sampled[name], found.units[name]
        shares = np.where(np.isfinite(found.shares[name][1]), found.shares[name][1], found.first.share[row])
        order = [int(column) for column in np.argsort(-shares, kind="stable") if shares[column] > 0.005]
        bars = tuple(
            (found.variables[column].path, shares[column], f"{number(100 * shares[column], 3)} %") for column in order
        )
        if bars and sampled.known:
            value, low, high = (quantity(each, unit) for each in (found.nominal.figure[row], sampled.low, sampled.high))
            charts.append(Bars(f"{name}, {value}: 95 % of all from {low} to {high}; why", bars))
    return bars_svg(charts)
