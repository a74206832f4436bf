"""What tolerances make of figures, as plain data, as a table and as bars."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.designs.accuracy import GEOMETRIC, WHOLE
from kinelast.designs.tolerances import Scatter, Toleranced
from kinelast.numbers import number, quantity
from kinelast.outputs.bars import Bars, bars_svg

TOLD = 2  # figures of which the closing words tell, where there are no errors of the output
SAMPLED = ("mean", "deviation", "low", "median", "high", "least", "largest", "known")


def tolerance_figures(found: Toleranced) -> dict[str, Any]:
    """Ranges of figures as plain data that JSON can hold, what is not known null; `words` tell the first of them."""
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


def _figure(found: Toleranced, row: int, name: str) -> dict[str, Any]:
    sampled, (alone, together) = found.sampled[name], found.shares[name]
    return {
        "name": name,
        "unit": found.units[name],
        "value": _known(found.nominal.figure[row]),
        "first_order": {"deviation": _known(found.first.deviation[row]), "worst": _known(found.first.worst[row])},
        "sampled": {key: _known(getattr(sampled, key)) for key in SAMPLED},
        "errors": dict(zip(SAMPLED[:5], map(_known, sampled.error), strict=True)),
        "shares": [
            {
                "path": one.path,
                "first_order": _known(found.first.share[row, column]),
                "alone": _known(alone[column]),
                "together": _known(together[column]),
            }
            for column, one in enumerate(found.variables)
        ],
    }


def _known(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def write_tolerances(path: Path, found: Toleranced) -> None:
    """A row a figure: its value, its range to first order and by samples, and the share of each number in it."""
    names = [one.path for one in found.variables]
    head = ["figure", "unit", "value", "first order deviation", "first order worst", *SAMPLED,
            *(f"share of {name}" for name in names), *(f"share of {name} with others" for name in names)]  # fmt: skip
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(head)
        for row, name in enumerate(found.nominal.figures):
            sampled, (alone, together) = found.sampled[name], found.shares[name]
            own = [found.nominal.figure[row], found.first.deviation[row], found.first.worst[row]]
            own += [getattr(sampled, key) for key in SAMPLED]
            rows.writerow([name, found.units[name], *(_cell(value) for value in (*own, *alone, *together))])


def _cell(value: Any) -> str:
    return repr(float(value)) if math.isfinite(value) else ""


def tolerance_bars(found: Toleranced) -> str:
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


def shares_told(figures: Sequence[Mapping[str, Any]]) -> list[str]:
    """A sentence a figure: its range, and what it comes from most."""
    said = []
    for each in figures:
        sampled, unit = each["sampled"], each["unit"]
        if sampled["low"] is None or each["value"] is None:
            continue
        most = max(each["shares"], key=lambda share: share["together"] or share["first_order"] or 0.0)
        share = most["together"] or most["first_order"] or 0.0
        low, high = quantity(sampled["low"], unit), quantity(sampled["high"], unit)
        said.append(f"{each['name']}: 95 % from {low} to {high}; {number(100 * share, 3)} % of that by {most['path']}")
    return said
