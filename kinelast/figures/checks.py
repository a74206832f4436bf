"""The answer beside two that rest on other theories: large displacements in time, and links as plane bodies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import Deflection, reference_deflection, sample
from elastic.beams.cross_sections import POISSON
from kinelast.figures.comparisons import NonlinearCheck
from kinelast.scene.course import CourseByLaws
from kinelast.scene.error import SceneError

if TYPE_CHECKING:
    from fem_check.solid.comparison import SolidComparison
    from kinelast.figures.results import Results
    from kinelast.scene.data import Scene

ELEMENTS = 8  # to a beam
FEWEST, ENOUGH = 16, 96  # positions of a cycle


def nonlinear_check(results: Results, progress: Callable[[float, str], None] | None = None) -> NonlinearCheck:
    """The mechanism solved once more, with nothing taken from the answer but the scene and its damping.

    Raises
    ------
    SceneError
        The motion is no cycle of drives that follow laws, or holds what this check does not know.
    """
    from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, estimated_errors, nonlinear_steady_state

    scene, motion, course = results.scene, results.motion, results.scene.course
    cyclic = course.run.turn and not results.left_out
    strides = [n for n in range(1, len(motion.time)) if len(motion.time) % (2 * n) == 0]
    if not isinstance(course, CourseByLaws) or not cyclic or not strides or len(motion.time) < FEWEST:
        problem = f"the nonlinear check takes a turn of drives that follow laws, {FEWEST} positions or more, even"
        raise SceneError(scene.path, "run", "", problem)
    stride = max((n for n in strides if len(motion.time) // n >= ENOUGH), default=1)

    laws = course.laws

    def solve(elements: int, positions: int) -> Any:
        given = scene.mechanism, scene.sections, laws, course.period, positions, elements, scene.joints
        return nonlinear_steady_state(*given, _damping(results), float(motion.time[0]), progress)

    try:
        found, errors = estimated_errors(solve, ELEMENTS, len(motion.time) // stride)
    except (NotCheckedError, DoesNotCloseError) as error:
        raise SceneError(scene.path, "", "", f"the nonlinear check: {error}") from None
    largest = np.abs(found.chord).max(axis=(1, 2))
    base = reference_deflection(largest)

    def apart(bent: Deflection) -> dict[str, float]:
        away = np.abs(sample(bent, "chord", found.xi)[:, ::stride] - found.chord).max(axis=(1, 2))
        return dict(zip(scene.labels, (away / np.where(base > 0, base, 1.0)).tolist(), strict=True))

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
    from kinelast.figures.theory import damping_of

    frequencies = results.frequencies
    return damping_of(results.scene).settled(frequencies.lowest if frequencies else math.inf).beams


def _poisson(scene: Scene) -> list[float]:
    """Poisson's ratio of every beam, that of metals where its material does not tell."""
    names = [made.material for made in scene.made_of] or [""] * len(scene.labels)
    told = [scene.materials[name].poisson if name in scene.materials else None for name in names]
    return [POISSON if ratio is None else ratio for ratio in told]


def solid_check(results: Results) -> SolidComparison:
    """What beam theory leaves out of the quasi-static answer, by links as plane-stress bodies.

    Raises
    ------
    SceneError
        A link is no body that the check can make.
    """
    from fem_check.solid.comparison import compare_solid

    try:
        return compare_solid(results.quasi_static, _poisson(results.scene))
    except ValueError as error:
        raise SceneError(results.scene.path, "links", "", f"the solid check: {error}") from None
