"""The designs of a plan computed by their numbers, wherever a sweep has them computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

from kinelast.designs.base import Base, base_of
from kinelast.designs.evaluate import evaluated
from kinelast.scene.document import Document


class DesignPlan(Protocol):
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

    document: Document
    plan: DesignPlan
    figures: tuple[str, ...] | None = None

    def __reduce__(self) -> Any:
        """Pickled by document, plan and figures: the base is built again."""
        return Evaluation, (self.document, self.plan, self.figures)

    @cached_property
    def base(self) -> Base:
        """The base of all designs, made once in every process."""
        return base_of(self.document, self.plan.paths, self.figures)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns."""
        numbers = {place.variable.path: place.variable.unit for place in self.base.places}
        return {**numbers, **{measure.name: measure.unit for measure in self.base.measures}}

    def __call__(self, first: int, last: int) -> tuple[dict[str, Any], Sequence[str]]:
        """Columns of designs first to last - 1, and why some have no figures."""
        values = self.plan.values(first, last)
        found = evaluated(self.base, values)
        numbers = dict(zip(self.plan.paths, values.T, strict=True))
        return {**numbers, **found.columns}, found.reason
