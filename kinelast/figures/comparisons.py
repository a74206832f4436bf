"""What further checks found, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fem_check.solid.comparison import SolidComparison

WITHIN = 2.0  # times the answer's own estimate of its error that the check may find
LEAST = 0.01  # share of the largest deflection that the check itself is good to


@dataclass(frozen=True)
class NonlinearCheck:
    """The deflection from the chord beside that of the whole mechanism, by finite elements of any displacement.

    Attributes
    ----------
    elements, positions
        To a beam, and of the cycle.
    difference, without_vibration
        By label of the beam: greatest difference of the answer, and of the quasi-static one, at any place and
        instant, over the largest deflection of the beam.
    peak
        By label: largest deflection by the check [m].
    estimate
        What the answer said that it is off by; nan where it did not.
    mesh, step
        Estimated errors of the check itself, as shares.
    """

    elements: int
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
    def passed(self) -> bool | None:
        """Whether the answer is as near as it said; None where it said nothing."""
        return None if math.isnan(self.estimate) else self.largest <= max(WITHIN * self.estimate, LEAST)


def nonlinear_figures(check: NonlinearCheck | None) -> dict[str, Any] | None:
    """The nonlinear check as plain data, shares of the largest deflection from the chord."""
    if check is None:
        return None
    return {
        "passed": check.passed,
        "largest": check.largest,
        "elements": check.elements,
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


def solid_figures(check: SolidComparison | None) -> dict[str, Any] | None:
    """The solid check as plain data, shares of the largest deflection from the chord."""
    if check is None:
        return None
    return {
        "largest": None if math.isnan(check.relative) else check.relative,
        "links": dict(check.by_link),
        "left_out": dict(check.left_out),
        "refinement": check.refinement,
        "positions": check.compared,
    }
