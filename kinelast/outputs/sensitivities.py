"""Sensitivities as plain data, as a table and as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kinelast.designs.sensitivities import Sensitivities
from kinelast.numbers import number, quantity
from kinelast.outputs.bars import Bars, bars_svg
from kinelast.outputs.table import Table
from kinelast.scene.variables import Variable

HEAD = ("figure", "value", "unit", "number", "value", "unit", "slope", "error", "per cent to one per cent", "kink",
        "slope below", "slope above", "stays by")  # fmt: skip
MOST_BARS = 12
TOLD = 2  # figures of which the closing words tell
SIZED = 5e-4  # per cent to one per cent: what changes a figure by less is not drawn


def sensitivity_figures(
    found: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]
) -> dict[str, Any]:
    """Sensitivities as plain data that JSON can hold, null where not known; `words` tell the largest."""
    rows = range(min(TOLD, len(found.figures)))
    return {
        "words": [words for row in rows for _, words in _ranked(found, variables, row)[:1]],
        "numbers": [{"path": one.path, "value": one.base, "unit": one.unit} for one in variables],
        "figures": [
            {
                "name": name,
                "value": float(found.figure[row]),
                "unit": units[name],
                "slopes": [_slope(found, row, column) for column in range(len(variables))],
                "words": [words for _, words in _ranked(found, variables, row)[:MOST_BARS]],
            }
            for row, name in enumerate(found.figures)
        ],
    }


def _slope(found: Sensitivities, row: int, column: int) -> dict[str, Any]:
    kinked = bool(found.kink[row, column])
    return {
        "slope": float(found.slope[row, column]),
        "error": float(found.error[row, column]),
        "percent": float(found.logarithmic[row, column]),
        "kink": kinked,
        "stays_by": float(found.still[row, column]),
        **({"below": float(found.below[row, column]), "above": float(found.above[row, column])} if kinked else {}),
    }


def _ranked(found: Sensitivities, variables: Sequence[Variable], row: int) -> list[tuple[int, str]]:
    """Numbers of the variables that matter to a figure, the largest sensitivity first, and a sentence on each."""
    sizes = np.where(np.isfinite(found.logarithmic[row]), found.logarithmic[row], 0.0)
    order = [int(column) for column in np.argsort(-abs(sizes), kind="stable") if abs(sizes[column]) > SIZED]
    return [(column, told(variables[column].path, sizes[column], found.figures[row])) for column in order]


def told(path: str, percent: float, figure: str) -> str:
    """A sensitivity in words.

    >>> told("sections.bar.depth", -2.7, "deflection")
    '1 % more sections.bar.depth: −2.7 % deflection'
    """
    return f"1 % more {path}: {'+' if percent > 0 else ''}{number(percent, 3)} % {figure}"


def sensitivity_table(found: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]) -> Table:
    """A row a figure and number: derivative, estimate of its error, logarithmic derivative, kinks."""
    sides = (found.slope, found.error, found.logarithmic, found.kink, found.below, found.above, found.still)
    return Table.of_rows(
        HEAD,
        [
            (
                name,
                found.figure[row],
                units[name],
                one.path,
                one.base,
                one.unit,
                *(each[row, column].item() for each in sides),
            )
            for row, name in enumerate(found.figures)
            for column, one in enumerate(variables)
        ],
    )


def sensitivity_bars(found: Sensitivities, variables: Sequence[Variable], units: Mapping[str, str]) -> str:
    """Largest sensitivities of every figure, as bars in SVG: per cent of the figure to one per cent of the number."""
    charts = []
    for row, name in enumerate(found.figures):
        ranked = _ranked(found, variables, row)[:MOST_BARS]
        size = quantity(float(found.figure[row]), units[name])
        bars = []
        for column, _ in ranked:
            share = float(found.logarithmic[row, column])
            mark = " (kink)" if found.kink[row, column] else ""
            bars.append((variables[column].path, share, f"{'+' if share > 0 else ''}{number(share, 3)} %{mark}"))
        if bars:
            charts.append(Bars(f"{name}, {size}: what 1 % more makes of it", tuple(bars)))
    return bars_svg(charts)
