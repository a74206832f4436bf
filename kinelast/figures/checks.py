"""The answer beside two that rest on other theories: large displacements in time, and links as plane bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import Deflection, sample
from kinelast.scene.drives import DriveEffort
from kinelast.scene.error import SceneError

if TYPE_CHECKING:
    from fem_check.solid.comparison import SolidComparison
    from kinelast.figures.results import Results

ELEMENTS = 8  # to a beam
FEWEST, ENOUGH = 16, 96  # positions of a cycle
WITHIN = 2.0  # times the answer's own estimate of its error that the check may find
LEAST = 0.01  # share of the largest deflection that the check itself is good to
UNBENT = 0.01  # of the largest deflection of all beams, below which one of them counts as bent by so much


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


def nonlinear_check(results: Results, progress: Callable[[float, str], None] | None = None) -> NonlinearCheck:
    """The mechanism solved once more, with nothing taken from the answer but the scene and its damping.

    Raises
    ------
    SceneError
        The motion is no cycle of drives that follow laws, or holds what this check does not know.
    """
    from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, estimated_errors, nonlinear_steady_state

    scene, motion = results.scene, results.motion
    laws = [law for law in scene.laws if not isinstance(law, DriveEffort)]
    cyclic = scene.run.turn and len(laws) == len(scene.laws) and not results.left_out
    strides = [n for n in range(1, len(motion.time)) if len(motion.time) % (2 * n) == 0]
    if not cyclic or not strides or len(motion.time) < FEWEST:
        problem = f"the nonlinear check takes a turn of drives that follow laws, {FEWEST} positions or more, even"
        raise SceneError(scene.path, "run", "", problem)
    stride = max((n for n in strides if len(motion.time) // n >= ENOUGH), default=1)

    def solve(elements: int, positions: int) -> Any:
        given = scene.mechanism, scene.sections, laws, scene.run.duration, positions, elements, scene.joints
        return nonlinear_steady_state(*given, _damping(results), float(motion.time[0]), progress)

    try:
        found, errors = estimated_errors(solve, ELEMENTS, len(motion.time) // stride)
    except (NotCheckedError, DoesNotCloseError) as error:
        raise SceneError(scene.path, "", "", f"the nonlinear check: {error}") from None
    largest = np.abs(found.chord).max(axis=(1, 2))
    taken = np.maximum(largest, UNBENT * largest.max(initial=0.0))

    def apart(bent: Deflection) -> dict[str, float]:
        away = np.abs(sample(bent, "chord", found.xi)[:, ::stride] - found.chord).max(axis=(1, 2))
        return dict(zip(scene.labels, (away / np.where(taken > 0, taken, 1.0)).tolist(), strict=True))

    return NonlinearCheck(
        ELEMENTS,
        len(found.time),
        apart(results.deflection),
        apart(results.quasi_static),
        dict(zip(scene.labels, largest.tolist(), strict=True)),
        results.answer.error if results.answer else math.nan,
        errors.mesh["w"],
        errors.step["w"],
    )


def _damping(results: Results) -> Any:
    """beta of every beam [s]: that of the answer, or of the lowest natural frequency."""
    if results.answer and results.answer.vibrating:
        return results.answer.vibrating.damping.beams
    theory, frequencies = results.scene.theory, results.frequencies
    lowest = frequencies.lowest if frequencies else math.inf
    own = np.array(theory.damping or (math.nan,) * len(results.scene.labels))
    return np.where(np.isnan(own), 2 * theory.damping_ratio / lowest, own)


def solid_check(results: Results) -> SolidComparison:
    """What beam theory leaves out of the quasi-static answer, by links as plane-stress bodies.

    Raises
    ------
    SceneError
        A link is no body that the check can make.
    """
    from fem_check.solid.comparison import compare_solid

    try:
        return compare_solid(results.quasi_static)
    except ValueError as error:
        raise SceneError(results.scene.path, "links", "", f"the solid check: {error}") from None


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
