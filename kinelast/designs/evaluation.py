"""The designs of a plan computed by their numbers, wherever a sweep has them computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

from kinelast.designs.base import base_of
from kinelast.designs.evaluate import evaluate
from kinelast.scene.variables import variable

WORK = 1_000_000  # positions of beams that take about a second, with a handful of figures


class Plan(Protocol):
    """Which designs there are: the values of numbers of a scene, by the number of the design alone."""

    @property
    def count(self) -> int:
        """How many designs."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Which numbers of the scene differ."""

    def values(self, first: int, last: int) -> Any:
        """Values of designs first to last - 1 in SI units, shape (last - first, paths)."""


@dataclass(frozen=True)
class Evaluation:
    """Figures of the designs of a plan, see `kinelast.sweep.running.Compute`.

    A row holds the numbers that differ, by their paths, and the figures by their names; all are kept where a process
    that computes chunks gets it pickled.
    """

    tables: Mapping[str, Any]
    plan: Plan
    figures: tuple[str, ...] | None = None

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the columns."""
        base = base_of(self.tables, self.plan.paths, self.figures)
        numbers = {path: variable(self.tables, path).unit for path in self.plan.paths}
        return {**numbers, **{figure.name: figure.unit for figure in base.figures}}

    @cached_property
    def chunk(self) -> int:
        """Designs that take about a second; the same on every machine, as the files of a sweep depend on it."""
        scene = base_of(self.tables, self.plan.paths, self.figures).scene
        return max(1, min(self.plan.count, WORK // (scene.run.positions * max(1, len(scene.labels)))))

    def __call__(self, first: int, last: int) -> tuple[dict[str, Any], Sequence[str]]:
        """Columns of designs first to last - 1, and why some have no figures."""
        values = self.plan.values(first, last)
        found = evaluate(self.tables, self.plan.paths, values, self.figures)
        numbers = dict(zip(self.plan.paths, values.T, strict=True))
        return {**numbers, **found.columns}, found.reason
