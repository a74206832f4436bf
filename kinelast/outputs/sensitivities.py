"""Output of two design studies as plain data, tables and bar charts.

A sensitivity study computes derivatives of results (such as the largest stress) with respect to input values, called
variables. A tolerance study computes how far results scatter if input values vary within tolerances.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from msgspec import Struct, field
from msgspec.structs import asdict

from kinelast.designs.problem import PER_CENT, TOLERANCE, SensitivityStep
from kinelast.designs.sensitivities import Sensitivities
from kinelast.designs.tolerances import GEOMETRIC, WHOLE, KeptShare, Scatter, ToleranceResult
from kinelast.outputs.table import Table
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.variables import Variable
from kinelast.values.numbers import SI, DisplayUnits, number, percent, quantity
from kinelast.values.reading import known
from rigid.arrays import Reals

WIDTH, LEFT, ROW, HEADING, GAP = 770, 250, 22, 30, 14  # [pixels] dimensions of a bar chart
MAX_NAME = 36  # maximum number of characters in the name of a bar
DEGREES: DisplayUnits = {"rad": (180 / math.pi, "deg")}


class Bars(Struct, frozen=True):
    """A group of horizontal bars with a heading.

    `rows` contains the name, the size and the text of each bar. A bar with a negative size points to the left.
    """

    title: str
    rows: tuple[tuple[str, float, str], ...]


def bars_svg(charts: Sequence[Bars]) -> str:
    """Return groups of bars as one SVG. In each group, the longest bar fills the available width."""
    parts, y = [], 0
    for chart in charts:
        parts.append(f'<text x="0" y="{y + 18}" class="head">{escape(chart.title)}</text>')
        y += HEADING
        most = max((abs(size) for _, size, _ in chart.rows), default=0.0) or 1.0
        two_ways = any(size < 0 for _, size, _ in chart.rows)
        room = WIDTH - LEFT - 180
        zero, unit = (LEFT + room / 2, room / 2) if two_ways else (LEFT, room)
        for name, size, words in chart.rows:
            length = unit * abs(size) / most
            start = zero - length if size < 0 else zero
            way = "less" if size < 0 else "more"
            parts.append(f'<text x="{LEFT - 8}" y="{y + 15}" class="name">{escape(_short(name))}</text>')
            parts.append(
                f'<rect x="{start:.1f}" y="{y + 4}" width="{length:.1f}" height="{ROW - 8}" class="{way}"/>'
                f'<text x="{WIDTH - 172}" y="{y + 15}">{escape(words)}</text>'
            )
            y += ROW
        parts.append(f'<path d="M{zero:.1f} {y - ROW * len(chart.rows)}V{y}" class="zero"/>')
        y += GAP
    style = (
        "text{font:13px system-ui,sans-serif;fill:var(--ink,#17202a)}.head{font-weight:600;font-size:14px}"
        ".name{text-anchor:end}.more{fill:var(--accent,#0b5fa5)}.less{fill:var(--amber,#8a5200)}"
        ".zero{stroke:var(--soft,#55606c)}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" width="{WIDTH}" height="{y}" role="img">'
        f"<style>{style}</style>{''.join(parts)}</svg>\n"
    )


def _short(name: str) -> str:
    return name if len(name) <= MAX_NAME else f"{name[: MAX_NAME // 3]}…{name[-(2 * MAX_NAME // 3 - 1) :]}"


HEAD = ("figure", "value", "unit", "number", "value", "unit", "slope", "difference error", "per cent to one per cent",
        "kink", "slope below", "slope above", "stays by", "step", "change by step")  # fmt: skip
MOST_BARS = 12  # maximum number of bars, and of sentences, for each result
NAMED = 2  # the sentences in the terminal mention this number of results
MIN_CHANGE = 5e-6  # a change is only reported if |change in a result / value of the result| exceeds this limit


class PrintedSensitivities(Struct, frozen=True, eq=False, dict=True):
    """Sensitivities, with the information that is needed to print them.

    Attributes
    ----------
    result
        Derivatives of the results.
    variables
        Input values with respect to which the derivatives are computed.
    units
        Units of the results, by name of the result.
    steps
        A small change in each variable. The output states the resulting change in each result.
    shown_in
        Display units.
    """

    result: Sensitivities
    variables: Sequence[Variable]
    units: Mapping[str, str]
    steps: Sequence[SensitivityStep]
    shown_in: DisplayUnits = field(default_factory=dict)

    @cached_property
    def change(self) -> Reals:
        """Change in each result if each variable changes by its step, shape (results, variables)."""
        return np.asarray(self.result.slope * [step.size for step in self.steps])

    def step_words(self, column: int) -> str:
        """Return the step of a variable as text."""
        step, unit = self.steps[column], self.variables[column].unit
        return "1 %" if step.kind == PER_CENT else quantity(step.size, unit, shown_in={**DEGREES, **self.shown_in})

    def change_words(self, row: int, column: int) -> str:
        """Return the change in a result, as text, if a variable changes by its step."""
        change, name = float(self.change[row, column]), self.result.figures[row]
        size = quantity(change, self.units[name], 3, {**DEGREES, **self.shown_in})
        figure = float(self.result.figure[row])
        share = f" ({_signed(number(100 * change / figure, 3), change / figure)} %)" if figure else ""
        return f"{_signed(size, change)}{share}"

    def ranked(self, row: int) -> list[int]:
        """Return the indices of the variables that influence a result, starting with the largest influence."""
        sizes = np.where(np.isfinite(self.change[row]), abs(self.change[row]), 0.0)
        least = MIN_CHANGE * abs(float(self.result.figure[row]))
        return [int(column) for column in np.argsort(-sizes, kind="stable") if sizes[column] > least]

    def sentence(self, row: int, column: int) -> str:
        """Return a sentence such as "1 mm more points.D.y: +0.52 µm (+1.1 %) deflection"."""
        own = ", its tolerance" if self.steps[column].kind == TOLERANCE else ""
        change = self.change_words(row, column)
        return f"{self.step_words(column)} more {self.variables[column].path}{own}: {change} {self.result.figures[row]}"

    def sentences(self, row: int, most: int) -> list[str]:
        """Return a sentence for each of the `most` variables with the largest influence on a result."""
        return [self.sentence(row, column) for column in self.ranked(row)[:most]]


def _signed(words: str, size: float) -> str:
    return f"+{words}" if size > 0 else words


def sensitivity_figures(shown: PrintedSensitivities) -> dict[str, Any]:
    """Return sensitivities as plain data for JSON.

    The entry `words` contains sentences about the largest sensitivities of the first results.
    """
    result, variables, units = shown.result, shown.variables, shown.units
    rows = range(min(NAMED, len(result.figures)))
    return {
        "words": [words for row in rows for words in shown.sentences(row, 1)],
        "numbers": [
            {
                "path": one.path,
                "value": one.base,
                "unit": one.unit,
                "step": {"value": shown.steps[at].size, "words": shown.step_words(at), "kind": shown.steps[at].kind},
            }
            for at, one in enumerate(variables)
        ],
        "figures": [
            {
                "name": name,
                "value": float(result.figure[row]),
                "unit": units[name],
                "slopes": [_slope(shown, row, column) for column in range(len(variables))],
                "words": shown.sentences(row, MOST_BARS),
            }
            for row, name in enumerate(result.figures)
        ],
    }


def _slope(shown: PrintedSensitivities, row: int, column: int) -> dict[str, Any]:
    result = shown.result
    kinked = bool(result.kink[row, column])
    return {
        "slope": float(result.slope[row, column]),
        "error": float(result.error[row, column]),
        "percent": float(result.logarithmic[row, column]),
        "change": float(shown.change[row, column]),
        "kink": kinked,
        "stays_by": float(result.valid_range[row, column]),
        **({"below": float(result.below[row, column]), "above": float(result.above[row, column])} if kinked else {}),
    }


def sensitivity_table(shown: PrintedSensitivities) -> Table:
    """Return the sensitivities as a table. Each row contains the derivative of a result with respect to a variable."""
    result = shown.result
    sides = (
        result.slope,
        result.error,
        result.logarithmic,
        result.kink,
        result.below,
        result.above,
        result.valid_range,
    )
    return Table.of_rows(
        HEAD,
        [
            (
                name,
                result.figure[row],
                shown.units[name],
                variable.path,
                variable.base,
                variable.unit,
                *(each[row, column].item() for each in sides),
                shown.steps[column].size,
                shown.change[row, column].item(),
            )
            for row, name in enumerate(result.figures)
            for column, variable in enumerate(shown.variables)
        ],
    )


def sensitivity_bars(shown: PrintedSensitivities) -> str:
    """Return a bar chart as SVG. For each result, the chart shows the variables with the largest influence."""
    result, charts = shown.result, []
    for row, name in enumerate(result.figures):
        size = quantity(float(result.figure[row]), shown.units[name], shown_in=shown.shown_in)
        bars = []
        for column in shown.ranked(row)[:MOST_BARS]:
            mark = " (kink)" if result.kink[row, column] else ""
            heading = f"{shown.step_words(column)} more {shown.variables[column].path}"
            bars.append((heading, float(shown.change[row, column]), shown.change_words(row, column) + mark))
        if bars:
            charts.append(Bars(f"{name}, {size}: largest influences", tuple(bars)))
    return bars_svg(charts)


SAMPLED = ("mean", "deviation", "low", "median", "high", "least", "largest", "known")


def tolerance_figures(result: ToleranceResult, shown_in: DisplayUnits = SI) -> dict[str, Any]:
    """Return the scatter of the results due to tolerances as plain data for JSON.

    The entry `words` contains sentences about the scatter of the output errors. If the scene has no output, the
    sentences are about the first results. If there are limits, a sentence states how many machines meet all limits.
    """
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
    names = [name for name in (GEOMETRIC, WHOLE) if name in result.sampled] or result.nominal.figures[:NAMED]
    words = [_range_words(name, result.sampled[name], result.units[name], shown_in) for name in names]
    if result.answer.theory != QUASI_STATIC:
        words = [f"{word} ({QUASI_STATIC})" if name == WHOLE else word for name, word in zip(names, words, strict=True)]
    kept = None if result.kept is None else {key: known(each) for key, each in asdict(result.kept).items()}
    words += [] if result.kept is None else [_kept_words(result.kept)]
    return {
        "designs": result.designs,
        "theory": result.answer.theory,
        "limits_kept": kept,
        "words": words,
        "numbers": numbers,
        "figures": figures,
    }


def _kept_words(kept: KeptShare) -> str:
    """Return a phrase that states which percentage of machines meets all limits."""
    plain = f"{percent(kept.plain)} without"
    beyond = "" if math.isnan(kept.beyond) else (
        f"; the limit of the output applies to its deflection: including geometry, {percent(kept.beyond)} of machines"
        " exceed it"
    )  # fmt: skip
    plain += beyond
    if math.isnan(kept.in_full):
        return f"all limits are met by {plain}; with vibration and error this cannot be judged"
    sure = f"95 % confidence: {percent(kept.low)} to {percent(kept.high)}"
    return f"all limits are met by {percent(kept.in_full)} of machines with vibration and error ({sure}), {plain}"


def _range_words(name: str, sampled: Scatter, unit: str, shown_in: DisplayUnits) -> str:
    """Return a phrase about the scatter of a result: 95 % range and median."""
    low, median, high = (
        quantity(value, unit, shown_in=shown_in) for value in (sampled.low, sampled.median, sampled.high)
    )
    return f"{name} of 95 % of machines: {low} to {high}, median {median}"


def _figure(result: ToleranceResult, row: int, name: str) -> dict[str, Any]:
    sampled, (alone, together) = result.sampled[name], result.shares[name]
    return {
        "name": name,
        "unit": result.units[name],
        "value": float(result.nominal.figure[row]),
        **dict(zip(("in_full", "error"), map(known, _in_full(result, name)), strict=True)),
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


def _in_full(result: ToleranceResult, name: str) -> tuple[float, float]:
    """Return a nominal result of the full deflection analysis, and the error of the result. Both may be nan."""
    return result.answer.figures.get(name, (math.nan, math.nan))


def tolerance_table(result: ToleranceResult) -> Table:
    """Return a table with a row for each result: value, scatter, and the contribution of each variable to the variance.

    The scatter is given twice: to first order, and from sampled designs. The contribution (Sobol index) is the fraction
    of the variance of the result that the tolerance of a variable causes. The contribution is also given
    twice: without and with interactions with other variables.
    """
    names = [one.path for one in result.variables]
    head = ["figure", "unit", "value", "in full", "error", "theory", "first order deviation", "first order worst",
            *SAMPLED, *(f"share of {name}" for name in names),
            *(f"share of {name} with others" for name in names)]  # fmt: skip
    rows = []
    for row, name in enumerate(result.nominal.figures):
        sampled, (alone, together) = result.sampled[name], result.shares[name]
        first = result.nominal.figure[row], result.first.deviation[row], result.first.worst[row]
        cells = (*first, *(getattr(sampled, key) for key in SAMPLED), *alone, *together)
        full = *_in_full(result, name), result.answer.theory
        rows.append((name, result.units[name], float(first[0]), *full, *map(float, cells[1:])))
    return Table.of_rows(head, rows)


def tolerance_bars(result: ToleranceResult, shown_in: DisplayUnits = SI) -> str:
    """Return a bar chart as SVG. The bars show the contribution of each variable to the variance of a result [%]."""
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
                quantity(each, unit, shown_in=shown_in)
                for each in (result.nominal.figure[row], sampled.low, sampled.high)
            )
            charts.append(Bars(f"{name}, {value}: 95 % of machines from {low} to {high}; causes", bars))
    return bars_svg(charts)
