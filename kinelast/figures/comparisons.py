"""Results of further checks, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fem_check.solid import SolidComparison

WITHIN = 2.0  # times the answer's own estimate of its error that the check may find
LEAST = 0.01  # share of the largest deflection that the check itself is good to


@dataclass(frozen=True)
class NotMade:
    """A check that was asked for and cannot be made; `problem` says why."""

    problem: str


@dataclass(frozen=True)
class NonlinearCheck:
    """The deflection from the chord beside that of the whole mechanism, by finite elements of any displacement.

    Attributes
    ----------
    elements, steps, positions
        To a beam, of time, and how many positions are compared.
    difference, without_vibration
        By label of the beam: greatest difference of the answer, and of the quasi-static one, at any place and
        instant, over the largest deflection of the beam.
    peak
        By label: largest deflection by the check [m].
    estimate
        What the answer said that it is off by, without what the check's beams share; nan where it did not.
    mesh, step
        Estimated errors of the check itself, as shares.
    """

    elements: int
    steps: int
    positions: int
    difference: Mapping[str, float]
    without_vibration: Mapping[str, float]
    peak: Mapping[str, float]
    estimate: float
    mesh: float
    step: float

    @property
    def largest(self) -> float:
        """Of the worst beam."""
        return max(self.difference.values(), default=0.0)

    @property
    def error(self) -> float:
        """Of the check itself."""
        return self.mesh + self.step

    @property
    def near(self) -> bool:
        """Whether the difference is so near to its bound that the check's own error decides."""
        return abs(self.largest - allowed_difference(self.estimate)) < self.error

    @property
    def passed(self) -> bool | None:
        """Whether the answer is as near as it said; None where it said nothing, or that is too near to call."""
        if math.isnan(self.estimate) or self.near:
            return None
        return self.largest <= allowed_difference(self.estimate)


def allowed_difference(estimate: float) -> float:
    """Largest difference that a check may find of an answer with an estimated error; nan without an estimate."""
    return math.nan if math.isnan(estimate) else max(WITHIN * estimate, LEAST)


def nonlinear_figures(check: NonlinearCheck | NotMade | None) -> dict[str, Any] | None:
    """The nonlinear check as plain data, shares of the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return {"passed": None, "largest": None, "problem": check.problem}
    return {
        "passed": check.passed,
        "largest": check.largest,
        "too_near_to_call": check.near,
        "elements": check.elements,
        "steps": check.steps,
        "positions": check.positions,
        "estimate": None if math.isnan(check.estimate) else check.estimate,
        "own_errors": {"mesh": check.mesh, "step": check.step},
        "links": {
            label: {
                "difference": check.difference[label],
                "without_vibration": check.without_vibration[label],
                "peak": {"value": check.peak[label], "unit": "m"},
            }
            for label in check.difference
        },
    }


def solid_figures(check: SolidComparison | NotMade | None) -> dict[str, Any] | None:
    """The solid check as plain data, shares of the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return {"largest": None, "problem": check.problem}
    return {
        "largest": None if math.isnan(check.relative) else check.relative,
        "links": dict(check.by_link),
        "left_out": dict(check.left_out),
        "refinement": check.refinement,
        "positions": check.compared,
    }
