"""Sensitivities as plain data, as a table and as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kinelast.designs.sensitivities import Sensitivities
from kinelast.outputs.bars import Bars, bars_svg
from kinelast.outputs.table import Table
from kinelast.scene.numbers import number, quantity
from kinelast.scene.variables import Variable

HEAD = ("figure", "value", "unit", "number", "value", "unit", "slope", "error", "per cent to one per cent", "kink",
        "slope below", "slope above", "stays by")  # fmt: skip
MOST_BARS = 12
TOLD = 2  # figures of which the closing words tell
SIZED = 5e-4  # per cent to one per cent: what changes a figure by less is not drawn


def sensitivity_figures(
    result: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]
) -> dict[str, Any]:
    """Sensitivities as plain data that JSON can hold, null where not known; `words` tell the largest."""
    rows = range(min(TOLD, len(result.figures)))
    return {
        "words": [words for row in rows for _, words in _ranked(result, variables, row)[:1]],
        "numbers": [{"path": one.path, "value": one.base, "unit": one.unit} for one in variables],
        "figures": [
            {
                "name": name,
                "value": float(result.figure[row]),
                "unit": units[name],
                "slopes": [_slope(result, row, column) for column in range(len(variables))],
                "words": [words for _, words in _ranked(result, variables, row)[:MOST_BARS]],
            }
            for row, name in enumerate(result.figures)
        ],
    }


def _slope(result: Sensitivities, row: int, column: int) -> dict[str, Any]:
    kinked = bool(result.kink[row, column])
    return {
        "slope": float(result.slope[row, column]),
        "error": float(result.error[row, column]),
        "percent": float(result.logarithmic[row, column]),
        "kink": kinked,
        "stays_by": float(result.still[row, column]),
        **({"below": float(result.below[row, column]), "above": float(result.above[row, column])} if kinked else {}),
    }


def _ranked(result: Sensitivities, variables: Sequence[Variable], row: int) -> list[tuple[int, str]]:
    """Numbers of the variables that matter to a figure, the largest sensitivity first, and a sentence on each."""
    sizes = np.where(np.isfinite(result.logarithmic[row]), result.logarithmic[row], 0.0)
    order = [int(column) for column in np.argsort(-abs(sizes), kind="stable") if abs(sizes[column]) > SIZED]
    return [(column, told(variables[column].path, sizes[column], result.figures[row])) for column in order]


def told(path: str, percent: float, figure: str) -> str:
    """A sensitivity in words.

    >>> told("sections.bar.depth", -2.7, "deflection")
    '1 % more sections.bar.depth: −2.7 % deflection'
    """
    return f"1 % more {path}: {'+' if percent > 0 else ''}{number(percent, 3)} % {figure}"


def sensitivity_table(result: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]) -> Table:
    """A row a figure and number: derivative, estimate of its error, logarithmic derivative, kinks."""
    sides = (result.slope, result.error, result.logarithmic, result.kink, result.below, result.above, result.still)
    return Table.of_rows(
        HEAD,
        [
            (
                name,
                result.figure[row],
                units[name],
                variable.path,
                variable.base,
                variable.unit,
                *(each[row, column].item() for each in sides),
            )
            for row, name in enumerate(result.figures)
            for column, variable in enumerate(variables)
        ],
    )


def sensitivity_bars(result: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]) -> str:
    """Largest sensitivities of every figure, as bars in SVG: per cent of the figure to one per cent of the number."""
    charts = []
    for row, name in enumerate(result.figures):
        ranked = _ranked(result, variables, row)[:MOST_BARS]
        size = quantity(float(result.figure[row]), units[name])
        bars = []
        for column, _ in ranked:
            share = float(result.logarithmic[row, column])
            mark = " (kink)" if result.kink[row, column] else ""
            bars.append((variables[column].path, share, f"{'+' if share > 0 else ''}{number(share, 3)} %{mark}"))
        if bars:
            charts.append(Bars(f"{name}, {size}: what 1 % more makes of it", tuple(bars)))
    return bars_svg(charts)
