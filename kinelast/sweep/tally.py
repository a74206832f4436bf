"""Summary of a sweep's designs: how many have no figures and why, ranges of the figures, the best."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

NUMBERS = re.compile(r"(?<![\w\"\[])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?![\w\"\]])")  # which differ by design in a reason


@dataclass(frozen=True)
class Aim:
    """Which figure is to be small, or large."""

    figure: str
    largest: bool


@dataclass
class Tally:
    """Summary of a sweep's designs: how many have no figures and why, ranges of figures, the best; or all."""

    aim: Aim
    designs: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    acceptable: int | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    best: dict[str, float] | None = None
    kept: list[tuple[Mapping[str, Any], Sequence[str]]] = field(default_factory=list)

    def add(self, columns: Mapping[str, Any], reasons: Sequence[str]) -> None:
        """Count some more designs."""
        self.designs += len(reasons)
        self.reasons.update(NUMBERS.sub("...", reason) for reason in reasons if reason)
        for name, values in columns.items():
            known = values[np.isfinite(values)]
            if len(known):
                low, high = self.ranges.get(name, (np.inf, -np.inf))
                self.ranges[name] = min(low, float(known.min())), max(high, float(known.max()))
        good = np.isfinite(columns[self.aim.figure])
        if "acceptable" in columns:
            good &= columns["acceptable"] == 1.0
            self.acceptable = (self.acceptable or 0) + int(np.count_nonzero(columns["acceptable"] == 1.0))
        if good.any():
            size = np.where(good, columns[self.aim.figure], np.nan)
            at = int(np.nanargmax(size) if self.aim.largest else np.nanargmin(size))
            found = {name: float(values[at]) for name, values in columns.items()}
            if self.best is None or self._better(found[self.aim.figure]):
                self.best = found

    def _better(self, value: float) -> bool:
        assert self.best is not None
        before = self.best[self.aim.figure]
        return value > before if self.aim.largest else value < before


def tallied(chunks: Iterable[tuple[Mapping[str, Any], Sequence[str]]], aim: Aim, keep: bool) -> Tally:
    """The tally of all designs; `keep` them too."""
    tally = Tally(aim)
    for columns, reasons in chunks:
        tally.add(columns, reasons)
        if keep:
            tally.kept.append((columns, reasons))
    return tally
