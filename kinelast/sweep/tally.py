"""Summary (tally) of the designs of a sweep, and full answers for the best designs.

The results of a design are called figures, e.g. the largest stress. A sweep computes quasi-static figures. A full
answer contains the figures of one design, computed by the theory that the scene names, with errors.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from kinelast.designs.base import base_of
from kinelast.designs.evaluate import Evaluation, evaluated
from kinelast.designs.problem import adjusted_bound
from kinelast.reports.full_answer import FullAnswer, full_answer
from kinelast.reports.limits import LIMITS_KEPT, LIMITS_MARGIN, limits_of_items, verdict_on
from kinelast.reports.report import Verdict
from kinelast.scene.data import QUASI_STATIC
from kinelast.sweep.store import NUMBER, THEORY, VERDICT
from kinelast.tasks.progress import Progress
from kinelast.values.reading import known

# Candidates for a full answer are at most MAX_LEADING designs that meet all limits, and at most MAX_LEADING designs
# that violate a limit.
MAX_LEADING = 1000
SHORTLIST = 8  # maximum number of full answers for the best designs
MAX_NEAR = 4  # maximum number of further full answers, for designs close to a limit or close to the best design
# A design is no candidate for a full answer if its smallest relative margin to a limit is below MIN_MARGIN.
MIN_MARGIN = -0.5
IN_FULL, ERROR = " in full", " error"  # suffixes of column names
NUMBERS = re.compile(r"(?<![\w\"\[])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?![\w\"\]])")  # numbers in reasons


class Aim(Struct, frozen=True):
    """Name of the figure (result) to be minimised, or maximised if `largest`."""

    figure: str
    largest: bool

    @property
    def sign(self) -> float:
        """Sign of the figure in a minimisation: -1 if the figure is to be maximised, otherwise 1."""
        return -1.0 if self.largest else 1.0


class Rows(Struct, frozen=True, dict=True):
    """Callable object that computes the rows of the table of a sweep, see `kinelast.sweep.running.Compute`.

    Each row contains the input values and quasi-static figures of a design, in the display units of the scene. A row
    also has cells for a full answer: theory, figures with errors, and verdict. These cells are empty at first. For
    designs with a full answer, `cells` returns the content of these cells.
    """

    evaluation: Evaluation

    @cached_property
    def elastic_figures(self) -> tuple[str, ...]:
        """Names of the figures that depend on the theory by which the deflection is computed."""
        base = self.evaluation.base
        known = (each for each in base.measures if not each.figure.rigid and base.scene.labels)
        return tuple(each.name for each in known if each.name not in (LIMITS_KEPT, LIMITS_MARGIN))

    @property
    def units(self) -> dict[str, str]:
        """Display units by column name."""
        return {name: self._unit_of(unit)[1] for name, unit in self._si.items()}

    @cached_property
    def _si(self) -> dict[str, str]:
        units = self.evaluation.units
        return {**units, **{name + end: units[name] for name in self.elastic_figures for end in (IN_FULL, ERROR)}}

    def _unit_of(self, unit: str) -> tuple[float, str]:
        return self.evaluation.base.scene.shown_in.get(unit, (1.0, unit))

    def factor(self, name: str) -> float:
        """Return the conversion factor of a column from the SI unit to the display unit."""
        return self._unit_of(self._si.get(name, ""))[0]

    def __call__(self, first: int, last: int) -> tuple[dict[str, Any], Sequence[str]]:
        """Return the columns for designs `first` to `last` - 1, and the reasons for missing figures."""
        columns, reasons = self.evaluation(first, last)
        shown = {name: values * self.factor(name) for name, values in columns.items()}
        later = {name + end: np.full(last - first, np.nan) for name in self.elastic_figures for end in (IN_FULL, ERROR)}
        theory = ["" if reason else QUASI_STATIC for reason in reasons]
        return {**shown, **later, THEORY: theory, VERDICT: [""] * (last - first)}, reasons

    def stored(
        self, chunks: Iterable[tuple[Mapping[str, Any], Sequence[str]]]
    ) -> Iterator[tuple[dict[str, Any], Sequence[str]]]:
        """Yield the quasi-static columns of each stored chunk in SI units, and the reasons for missing figures."""
        plan = self.evaluation.plan
        for columns, reasons in chunks:
            first = int(columns[NUMBER][0])
            own = {name: columns[name] / self.factor(name) for name in self.evaluation.units}
            numbers = dict(zip(plan.paths, plan.values(first, first + len(reasons)).T, strict=True))
            yield {NUMBER: columns[NUMBER], **own, **numbers}, reasons

    def cells(self, tally: Tally) -> dict[int, dict[str, Any]]:
        """Return the content of the cells for full answers, by index of the design and column name."""
        return {
            number: {
                **{name + end: value * self.factor(name) for name, pair in found.figures.items()
                   for end, value in zip((IN_FULL, ERROR), pair, strict=True)},
                THEORY: found.theory or QUASI_STATIC,
                VERDICT: verdict_on(found.judgements).verdict,
            }
            for number, found in tally.answered.items()
        }  # fmt: skip


@dataclass
class Tally:
    """Summary of a sweep. Each design is stored as a dictionary that maps column names to values.

    Attributes
    ----------
    aim
        Figure to be minimised or maximised.
    designs
        Number of designs.
    reasons
        Number of designs for each reason why figures are missing. Numbers in reasons are replaced by "...", so that
        reasons that differ only in numbers are counted together.
    limits_kept
        Number of designs that meet all limits according to quasi-static figures; None if there are no limits.
    ranges
        Smallest and largest value by column name.
    leading
        The best designs that meet all limits according to quasi-static figures, best first.
    short
        Designs that violate a limit according to quasi-static figures, designs with the smallest violation first.
    best
        Best design. If the full answers of one or more designs meet all limits, the best of these designs.
    answered
        Full answers by index of the design, in the order of computation.
    near
        Number of designs for which a full answer is missing and may change the result of the sweep.
    kept
        Columns and reasons of all designs, chunk by chunk; may be empty, see `tallied`.
    """

    aim: Aim
    designs: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    limits_kept: int | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    leading: list[dict[str, float]] = field(default_factory=list)
    short: list[dict[str, float]] = field(default_factory=list)
    best: dict[str, float] | None = None
    answered: dict[int, FullAnswer] = field(default_factory=dict)
    near: int = 0
    kept: list[tuple[Mapping[str, Any], Sequence[str]]] = field(default_factory=list)

    def add(self, columns: Mapping[str, Any], reasons: Sequence[str]) -> None:
        """Add designs to the tally."""
        self.designs += len(reasons)
        self.reasons.update(NUMBERS.sub("...", reason) for reason in reasons if reason)
        for name, values in columns.items():
            known = values[np.isfinite(values)]
            if len(known):
                low, high = self.ranges.get(name, (np.inf, -np.inf))
                self.ranges[name] = min(low, float(known.min())), max(high, float(known.max()))
        good = np.isfinite(columns[self.aim.figure])
        if LIMITS_KEPT in columns:
            kept, margin = columns[LIMITS_KEPT] == 1.0, columns[LIMITS_MARGIN]
            self.limits_kept = (self.limits_kept or 0) + int(np.count_nonzero(kept))
            near = good & ~kept & (margin >= MIN_MARGIN)
            self.short = _merged_rows(self.short, columns, np.where(near, -margin, np.inf), LIMITS_MARGIN, -1.0)
            good &= kept
        sign = self.aim.sign
        order = np.where(good, sign * columns[self.aim.figure], np.inf)
        self.leading = _merged_rows(self.leading, columns, order, self.aim.figure, sign)
        self.best = self.leading[0] if self.leading else None

    @property
    def accepted(self) -> Verdict | None:
        """Verdict of the full answer for the best design; None if there are no limits or there is no full answer."""
        found = self.answered.get(int(self.best[NUMBER])) if self.best else None
        return verdict_on(found.judgements) if found and self.limits_kept is not None else None


def _merged_rows(
    rows: list[dict[str, float]], columns: Mapping[str, Any], order: Any, key: str, sign: float
) -> list[dict[str, float]]:
    """Add designs with finite `order` to `rows`; return at most `MAX_LEADING` rows, sorted by `sign` * column `key`."""
    some = np.argsort(order, kind="stable")[: min(MAX_LEADING, int(np.count_nonzero(np.isfinite(order))))].tolist()
    more = [{name: float(values[at]) for name, values in columns.items()} for at in some]
    return sorted([*rows, *more], key=lambda row: sign * row[key])[:MAX_LEADING]


def tallied(chunks: Iterable[tuple[Mapping[str, Any], Sequence[str]]], aim: Aim, keep: bool) -> Tally:
    """Return the summary of all designs. If `keep`, the summary contains the columns of all designs."""
    tally = Tally(aim)
    for columns, reasons in chunks:
        tally.add(columns, reasons)
        if keep:
            tally.kept.append((columns, reasons))
    return tally


@dataclass(eq=False)
class FullAnswers:
    """Computation of full answers for selected designs of a sweep.

    The designs are selected by predicting whether their full answers meet the limits. The prediction assumes that the
    ratio (figure of the full answer) / (quasi-static figure) is equal for all designs, see `adjusted_bound`. The last
    computed full answer gives this ratio.

    First, full answers are computed for designs that are predicted to meet all limits, best designs first. This step
    ends if a full answer meets all limits and no other design is better. Second, full answers are computed for designs
    for which the prediction and the quasi-static figures disagree about the limits. The second step includes designs
    that may be better than the best design within the error.
    """

    rows: Rows
    tally: Tally
    progress: Progress

    def __post_init__(self) -> None:
        tally, plan = self.tally, self.rows.evaluation.plan
        self.document, self.paths = self.rows.evaluation.document, plan.paths
        self.designs = [*tally.leading, *tally.short]
        self.aims = np.array([tally.aim.sign * row[tally.aim.figure] for row in self.designs])
        self.in_full = np.full(len(self.designs), np.nan)  # values of the figure to be minimised, from full answers
        limits = list(dict.fromkeys(limit.figure for limit in limits_of_items(self.document.scene)))
        self.known: Mapping[str, Any] = {}
        if limits and self.designs:
            values = np.array([[row[path] for path in self.paths] for row in self.designs])
            self.known = evaluated(base_of(self.document, self.paths, limits), values).columns
        self.alike = not any(path.startswith("limits.") for path in self.paths)
        self.before = np.arange(len(self.designs)) < len(tally.leading)
        self.expected, self.passed = self.before.copy(), np.zeros(len(self.designs), bool)
        self.left, self.off = np.ones(len(self.designs), bool), 0.0

    def __call__(self) -> None:
        """Compute the full answers, and update the tally."""
        tally = self.tally
        # Nothing to compute, because no figure depends on the theory.
        if not self.rows.elastic_figures and not self.known:
            return
        if not tally.leading and tally.short:
            self._answer(0, "full answer of the design closest to its limits", 0, 1)
        for done in range(SHORTLIST):
            at = self._best(self.left & self.expected)
            if at is None or (self.passed.any() and self.aims[at] >= self.aims[self.passed].min()):
                break
            self._answer(at, "full answers of the best designs", done, SHORTLIST)
        for done in range(MAX_NEAR):
            at = self._best(self._near)
            if at is None:
                break
            self._answer(at, "full answers of designs close to a limit or to the best", done, MAX_NEAR)
        tally.near = int(np.count_nonzero(self._near))
        if self.passed.any():
            tally.best = self.designs[int(np.where(self.passed, self.in_full, np.inf).argmin())]

    @property
    def _near(self) -> Any:
        """True if a full answer is missing and may change the result of the sweep, shape (designs,)."""
        best = self.aims[self.passed].min(initial=np.inf)
        better = self.expected & (self.aims < best + self.off) if self.passed.any() else False
        return self.left & ((self.expected != self.before) | better)

    def _best(self, among: Any) -> int | None:
        """Return the index of the best design for which `among` is True; None if there is no such design."""
        return int(np.where(among, self.aims, np.inf).argmin()) if among.any() else None

    def _answer(self, at: int, stage: str, done: int, most: int) -> None:
        self.progress(stage, done, most)
        row, aim = self.designs[at], self.tally.aim
        scene = self.document.with_values({path: row[path] for path in self.paths}).scene
        answer = full_answer(scene, limits_of_items(scene), self.rows.elastic_figures)
        self.tally.answered[int(row[NUMBER])] = answer
        value, error = answer.figures.get(aim.figure, (row[aim.figure], 0.0))
        known = bool(answer.theory) and math.isfinite(value)
        self.in_full[at] = aim.sign * value if known else self.aims[at]
        self.off = abs(self.in_full[at] - self.aims[at]) + (error if math.isfinite(error) else 0.0)
        self.left[at] = False
        self.passed[at] = bool(verdict_on(answer.judgements).passed) if answer.judgements else known
        if self.alike and answer.judgements:
            self.expected = np.ones(len(self.designs), bool)
            for judged in answer.judgements:
                figures = self.known[judged.limit.figure]
                bound = adjusted_bound(judged, [(float(figures[at]), judged.worst)])
                self.expected &= replace(judged.limit, bound=bound).kept(figures)


def answers_as_data(tally: Tally, units: Mapping[str, str]) -> dict[int, dict[str, Any]]:
    """Return the full answers as JSON data, by index of the design. Unknown values are None."""
    plain_data: dict[int, dict[str, Any]] = {}
    for number, answer in tally.answered.items():
        figures = {
            name: {"value": known(value), "unit": units[name], "error": known(error)}
            for name, (value, error) in answer.figures.items()
        }  # fmt: skip
        verdict = to_builtins(verdict_on(answer.judgements))
        plain_data[number] = {"theory": answer.theory, **verdict, "figures": figures}
    return plain_data
