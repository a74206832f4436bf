"""Results of the nonlinear check and of the check with plane bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kinelast.figures.errors import Measured
from kinelast.figures.report import FurtherCheck
from kinelast.scene.reading import known, reading

if TYPE_CHECKING:
    from fem_check.solid import SolidComparison

MAX_RATIO = 2.0  # largest difference that a check may find, relative to the estimated error
MIN_DIFFERENCE = 0.01  # smallest difference that a check resolves, relative to the largest deflection


@dataclass(frozen=True)
class NotMade:
    """Requested check that cannot be made, with the reason in `problem`."""

    problem: str


@dataclass(frozen=True)
class NonlinearCheck:
    """Comparison of the chord deflection with nonlinear finite elements of the whole mechanism.

    Attributes
    ----------
    elements, steps, positions
        Elements per beam, time steps, and compared positions.
    difference, without_vibration
        By label of the beam: greatest difference of the answer, and of the quasi-static answer, relative to the
        largest deflection of the beam.
    peak
        By label: largest deflection in the check [m].
    estimate
        Estimated error of the answer, without errors that the check shares; nan if unknown.
    mesh, step
        Estimated relative errors of the check.
    allowance
        By label: additional allowance, relative to the beam's own deflection. An answer converges to a share of the
        largest displacement, which is more for a link that hardly bends.
    measured
        Errors of the figures that the check also computes.
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
    allowance: Mapping[str, float] = field(default_factory=dict)
    measured: Measured = field(default_factory=Measured)

    @property
    def largest(self) -> float:
        """Difference of the worst beam."""
        return max(self.difference.values(), default=0.0)

    @property
    def error(self) -> float:
        """Error of the check."""
        return self.mesh + self.step

    @property
    def near(self) -> bool:
        """Whether the difference is closer to its bound than the error of the check."""
        return abs(self._beyond) < self.error

    @property
    def cannot_tell(self) -> bool:
        """Whether the stated error exceeds the answer, so that any difference would agree."""
        return self.estimate > 1.0

    @property
    def _beyond(self) -> float:
        """Difference of the worst beam minus its bound."""
        off = ((each, self.estimate + self.allowance.get(label, 0.0)) for label, each in self.difference.items())
        return max((each - allowed_difference(own) for each, own in off), default=-allowed_difference(self.estimate))

    @property
    def passed(self) -> bool | None:
        """Whether the difference is within its bound; None without an estimate or if the check is undecided."""
        if math.isnan(self.estimate) or self.near or self.cannot_tell:
            return None
        return self._beyond <= 0.0


def allowed_difference(estimate: float) -> float:
    """Return the largest difference that a check may find, nan without an estimated error."""
    return math.nan if math.isnan(estimate) else max(MAX_RATIO * estimate, MIN_DIFFERENCE)


def nonlinear_report(check: NonlinearCheck | NotMade | None) -> FurtherCheck | None:
    """Return the nonlinear check as data, relative to the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return FurtherCheck(None, None, check.problem)
    return FurtherCheck(
        passed=check.passed,
        largest=check.largest,
        too_close_to_decide=check.near,
        cannot_tell=check.cannot_tell,
        elements=check.elements,
        steps=check.steps,
        positions=check.positions,
        estimate=known(check.estimate),
        own_errors={"mesh": check.mesh, "step": check.step},
        links={
            label: {
                "difference": check.difference[label],
                "without_vibration": check.without_vibration[label],
                "peak": reading(check.peak[label], "m"),
            }
            for label in check.difference
        },
    )


def solid_report(check: SolidComparison | NotMade | None) -> FurtherCheck | None:
    """Return the check with plane bodies as data, relative to the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return FurtherCheck(problem=check.problem)
    return FurtherCheck(
        largest=known(check.relative),
        links=dict(check.by_link),
        left_out=dict(check.left_out),
        refinement=check.refinement,
        positions=check.compared,
    )
