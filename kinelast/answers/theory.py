"""Choice of the theory of motion for a scene. The answer is the deflection by this theory, with its errors.

One class computes the answers of all theories, because the answers share solutions with vibration, finer
discretizations and figures.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec.structs import replace

from elastic import Deflection
from elastic.assessment import beyond_beam_theory
from elastic.elastodynamics import (
    Elastodynamic,
    Vibration,
    elastodynamic,
    finer_solution,
    finer_vibration,
    geometrically_exact,
    has_dry_friction,
    large_displacement_error,
    moved_to,
    transient,
    with_large_displacement,
    worth_halving,
)
from kinelast.answers.answer import NEGLIGIBLE_GAIN, Answer
from kinelast.answers.bounds import accepted_bound, bound_of_vibration, damping_of, largest_rotation
from kinelast.answers.builder import AnswerBuilder
from kinelast.answers.exact_errors import (
    errors_by_coarser,
    errors_by_more_steps,
    errors_of_exact,
    estimated_errors_of_exact,
)
from kinelast.answers.theory_settings import THEORY
from kinelast.figures.beam_limits import too_many_beams
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import Estimate
from kinelast.figures.figure_error import HIGHER_ORDERS, LARGE, TIME, VIBRATION
from kinelast.figures.main_figures import HEADLINE, main_figures_of
from kinelast.figures.measures import magnitudes
from kinelast.figures.registry import limits_of
from kinelast.scene.data import ACCURACY, ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC, Scene, Theory
from kinelast.tasks.progress import SILENT, Progress, lasting, one_thread
from kinelast.values.error import SceneError
from kinelast.values.numbers import UNRELIABLE
from rigid import MechanismError, Motion
from rigid.arrays import Reals

MotionAt = Callable[[Any], Motion]

STICKING = "the iteration for sticking friction does not converge"
UNSTABLE = "there is no steady state, because the vibration of the links grows"


@one_thread()
def answer(
    quasi_static: Cycle, theory: Theory, period: float, progress: Progress = SILENT, known: Elastodynamic | None = None
) -> Answer:
    """Return the deflection by the requested theory of motion, with errors.

    If no theory is requested, use the cheapest one that is accurate enough.

    Parameters
    ----------
    quasi_static
        `Cycle` with the quasi-static deflection at the positions of the run.
    period
        Duration of the cycle [s], or nan if there is no cycle. Without a cycle, vibration is not periodic but begins at
        the start of the run.
    progress
        Function that is called at each stage of the computation.
    known
        Solution with vibration at other positions, if known. It is used if its displacements are small. Vibration is
        then not solved again.

    Raises
    ------
    SceneError
        The requested theory cannot solve the scene, e.g. because of a singular position, a block beyond the end of its
        beam, or a wheel on a rack.
    """
    wanted = theory.wanted
    scene, plain = quasi_static.scene, quasi_static.deflection
    answers, named = _Theories(quasi_static, theory, progress), theory.name is not None and not theory.plain
    if not scene.labels:
        return answers.rigid()
    rests = _rests(plain)
    if not named and not rests and (early := answers.without_vibration(period, wanted)):
        return early
    aim, tolerance = answers.aim_and_tolerance(named)
    try:
        motion_at, cycle = _motion_at_rest(scene, plain.motion) if rests else (scene.course.at, period)

        def announced(times: Reals) -> Motion:
            progress(f"{scene.name}: solving vibration ({len(times):,} points)", 0, THEORY.stages)
            return motion_at(times)

        if known and known.exact is None:
            linear = moved_to(known, plain)
        else:
            linear = _vibrating(scene, plain, announced, cycle, tolerance)
        if not named and linear.stable and linear.discretization_error > max(wanted, ACCURACY):
            reason = STICKING if has_dry_friction(scene.mechanism) else "it needs too many time elements or coordinates"
            raise SceneError(scene.path, "run", "theory", f"vibration cannot be solved: {reason}")
    except SceneError as error:
        if named:
            raise
        return answers.at_rest() if rests else answers.unknown(error.problem)
    if rests and linear.vibration is None:
        return answers.at_rest()
    tried: list[Answer] = []
    for candidate in answers.candidates(linear, tolerance, aim):
        if candidate.theory == theory.name or (not named and (candidate.enough or not linear.stable)):
            return candidate
        tried.append(candidate)
    return answers.best(tried)


@one_thread()
def answer_at(known: Answer, quasi_static: Cycle, theory: Theory) -> Answer:
    """Return a known answer at other positions of the run, namely the positions of `quasi_static`."""
    return AnswerBuilder(quasi_static, theory).at_positions(known)


class _Theories(AnswerBuilder, frozen=True, eq=False, dict=True):
    """The theories of motion for a scene, from the cheapest to the most accurate, with their answers."""

    progress: Progress = SILENT

    @cached_property
    def error_without_motion(self) -> float:
        """The largest relative error in the main figures due to causes other than the theory of motion.

        An example of such a cause is beam theory.
        """
        cycle = self.cycle(self.plain)
        off = Estimate({}, self.cycle(beyond_beam_theory(self.plain)), {})
        return max((each.share for each in main_figures_of(self.scene, cycle, self.figures, off)), default=0.0)

    def aim_and_tolerance(self, named: bool) -> tuple[float, float]:
        """Return the accuracy to aim at, and the tolerance of the solver, relative to the largest displacement.

        `named` is true if a theory is requested by name. Otherwise, a very small tolerance would take long. The aim is
        then less strict than the accuracy if other errors than that of the solver are larger anyway.
        """
        scene, wanted = self.scene, self.theory.wanted
        ratio = THEORY.tolerance_ratio
        if self.theory.accuracy is None and not named and not limits_of(scene):
            ratio = THEORY.default_tolerance_ratio
        if scene.mechanism.friction:
            ratio = THEORY.friction_tolerance_ratio
        aim = wanted
        if not named and ratio * wanted < THEORY.max_named_tolerance:
            aim = max(wanted, NEGLIGIBLE_GAIN * self.error_without_motion)
        tolerance = min(THEORY.max_named_tolerance, ratio * aim) if named else max(ratio * aim, THEORY.min_tolerance)
        return aim, max(tolerance, ratio * wanted) if scene.mechanism.friction else tolerance

    def _report(self, number: int, stage: str) -> None:
        self.progress(f"{self.scene.name}: {stage}", number, THEORY.stages)

    def _announce(self, first_steps: float) -> None:
        """Inform the user if the geometrically exact answer will probably take long.

        `first_steps` is the computing time of the first steps to this answer [s].
        """
        expected = THEORY.exact_over_first_steps * first_steps
        if expected > THEORY.long:
            advice = '"--theory elastodynamic" or a larger --accuracy is faster'
            self.progress.tell(f"{self.scene.name}: large displacement may take up to {lasting(expected)}; {advice}")

    def candidates(self, linear: Elastodynamic, tolerance: float, aim: float) -> Iterator[Answer]:
        """Yield the answers of all theories, from the cheapest theory to the most accurate.

        The errors in an answer are measured only if a bound on them exceeds a fraction of the accuracy (see
        `kinelast.answers.bounds`). A finer discretization measures the discretization error. The first steps of the
        iteration for the geometrically exact answer measure the effect of large displacement. If no theory is requested
        by name, the result of these first steps is also yielded as an answer, provided that the last of them changes
        deflections by at most `max_last_change` times the accuracy. If a theory is requested by name and vibration is
        stable, answers of cheaper theories are skipped.

        Raises
        ------
        SceneError
            The geometrically exact theory is requested by name but cannot solve the scene, e.g. one with a wheel on a
            rack.
        """
        settled = {TIME: linear.discretization_error / THEORY.bound_over_error}
        if not linear.stable:
            for name in (QUASI_STATIC, ELASTODYNAMIC, GEOMETRICALLY_EXACT):
                yield self.built(name, linear, {}, settled, UNSTABLE)
            return
        shared: Vibration | None = None
        stages: dict[str, Elastodynamic] = {}
        shares = settled
        if self._worth_measuring(linear, aim, THEORY.negligible_bound):
            self._report(1, "error in time and coordinates")
            shared = finer_vibration(linear)
            stages, shares = {TIME: finer_solution(linear, shared, tolerance)[0]}, {}
        began = time.perf_counter()
        finest, displaced, open_by = self._large_displacement(linear, shared, aim)
        first_steps = time.perf_counter() - began
        stages, shares = {**stages, **displaced}, {**shares, **open_by}
        asked = self.theory.name
        if asked == QUASI_STATIC or (asked is None and not self._far(linear, aim)):
            yield self.built(QUASI_STATIC, linear, {VIBRATION: linear, **stages}, shares)
        if asked != GEOMETRICALLY_EXACT:
            by_vibration = self.built(ELASTODYNAMIC, linear, stages, shares)
            yield by_vibration
            if asked is None and by_vibration.enough_if_resolved:
                resolved = self._resolved(linear, stages.get(TIME), tolerance)
                if resolved:
                    yield from self.candidates(resolved, tolerance, aim)
                    return
        # if the first steps used the finer discretization, they are done again with that of the linear answer
        stepped = finest if shared is None or not displaced else with_large_displacement(linear)[0]
        almost_exact = stepped.exact is not None and stepped.exact.worst <= THEORY.max_last_change * aim
        if asked is None and almost_exact and not _rests(self.plain):
            yield self._after_first_steps(stepped, tolerance, aim, shared, finest)
        self._report(3, "geometrically exact")
        self._announce(first_steps)
        try:
            begun = None if has_dry_friction(self.scene.mechanism) else stepped.exact
            if asked is None and not has_dry_friction(self.scene.mechanism):
                tolerance = max(THEORY.exact_tolerance_ratio * aim, THEORY.min_tolerance)
                linear = linear.resolved_to(tolerance)
            exact = geometrically_exact(linear, tolerance, begun)
        except MechanismError as error:
            if asked == GEOMETRICALLY_EXACT:
                problem = f"large displacement cannot be solved: {error}"
                raise SceneError(self.scene.path, "run", "theory", problem) from None
            return
        same_discretization = exact.vibration is linear.vibration
        known = (shared, finest) if same_discretization else (None, None)
        yield self.built(GEOMETRICALLY_EXACT, exact, *self._errors_of_exact(exact, tolerance, aim, *known))

    def _after_first_steps(
        self, stepped: Elastodynamic, tolerance: float, aim: float, finer: Vibration | None, finest: Elastodynamic
    ) -> Answer:
        """Return the answer after the first steps to the geometrically exact answer.

        `stepped` uses the discretization of the linear answer, and `finest` that of `finer`.
        """
        negligible = THEORY.negligible_bound_of_steps
        measured, left = self._errors_of_exact(stepped, tolerance, aim, finer, finest, negligible)
        if LARGE in left:
            left = {**left, LARGE: THEORY.forces_later * left[LARGE]}
            if not measured and left[LARGE] > self.accepted_bound(aim):
                measured, left = errors_by_more_steps(stepped, left)
        return self.built(GEOMETRICALLY_EXACT, stepped, measured, left)

    def _resolved(self, linear: Elastodynamic, finer: Elastodynamic | None, tolerance: float) -> Elastodynamic | None:
        """Return the vibration in a finer discretization, or None if this would take long.

        `finer` is the result of `finer_solution`, if known.
        """
        if finer is None and worth_halving(self.scene.mechanism, linear.elements, linear.coordinates, math.inf, 0.0):
            return finer_solution(linear, finer_vibration(linear), tolerance)[0]
        return finer

    def best(self, tried: Sequence[Answer]) -> Answer:
        """Return the answer with the smallest error due to the theory of motion.

        With dry friction, the quasi-static answer with an unknown error is returned if the error of the best answer is
        large.
        """
        best = min(reversed(tried), key=lambda candidate: candidate.off_by_motion)
        if best.off_by_motion > UNRELIABLE and has_dry_friction(self.scene.mechanism):
            return self.unknown(f"large displacement cannot be solved: {STICKING}")
        return best

    def _far(self, linear: Elastodynamic, aim: float) -> bool:
        """Return whether vibration changes the largest deflection too much for the quasi-static answer."""
        plain, vibrating = self.cycle(self.plain), self.cycle(linear.deflection)
        headline = [figure for figure in self.figures if figure.key == HEADLINE[0]]
        here, there = (magnitudes(each, headline)[HEADLINE[0]].max(initial=0.0) for each in (plain, vibrating))
        stretch = vibrating.along("u").value.max(initial=0.0)
        return bool(abs(there - here) > THEORY.max_neglected_change * aim * max(there, stretch))

    def without_vibration(self, period: float, wanted: float) -> Answer | None:
        """Return the quasi-static answer if vibration need not or cannot be solved, otherwise None.

        Vibration is not solved if the bounds on the effects of vibration and large displacement are small. These bounds
        are then used as errors of the answer. Vibration is not solved either if a section rotates by more than
        `max_rotation`. The error is then unknown.
        """
        if largest_rotation(self.cycle(self.plain)) > THEORY.max_rotation:
            return self.unknown("vibration is not computed for such large rotations of the links")
        large = self.bound_of_large(self.plain)
        if large > self.accepted_bound(wanted, THEORY.max_theory_bound):
            return None
        vibration = bound_of_vibration(self.quasi_static, period)
        if vibration + large > self.accepted_bound(wanted, THEORY.max_theory_bound):
            return None
        return self.built(QUASI_STATIC, None, {}, {VIBRATION: vibration, LARGE: large})

    def accepted_bound(self, aim: float, share: float = THEORY.max_discretization_bound) -> float:
        """Return the largest error bound that is accepted in place of an error, see `kinelast.answers.bounds`."""
        bound = accepted_bound(aim, bool(limits_of(self.scene)), share)
        return bound if self.theory.accuracy is None else min(bound, THEORY.max_requested_bound)

    def _worth_measuring(self, answer: Elastodynamic, aim: float, negligible: float) -> bool:
        """Return whether the discretization error has to be measured by another discretization.

        It has not if its bound is below the accepted bound, or below `negligible`, relative to the accuracy.
        """
        accepted = max(self.accepted_bound(aim), negligible * aim)
        return worth_halving(self.scene.mechanism, answer.elements, answer.coordinates, answer.bound, accepted)

    def _large_displacement(
        self, linear: Elastodynamic, finer: Vibration | None, aim: float
    ) -> tuple[Elastodynamic, dict[str, Elastodynamic], dict[str, float]]:
        """Measure the effect of large displacement by the first steps of the iteration to the exact answer.

        Return the answer after these steps, the corrected answer by cause, and relative errors by cause. If the effect
        is small or the steps do not converge, there is no corrected answer, and a relative error is estimated. The
        steps use the discretization `finer` if there is one, because that of the linear answer may be too coarse.
        """
        large = self.bound_of_large(linear.deflection)
        if self.theory.name is None and large <= self.accepted_bound(aim, THEORY.max_theory_bound):
            return linear, {}, {LARGE: large}
        self._report(2, "large displacement")
        try:
            stepped, left = with_large_displacement(linear, finer)
        except MechanismError:
            return linear, {}, {LARGE: large_displacement_error(linear)}
        return stepped, {LARGE: stepped}, {HIGHER_ORDERS: left}

    def _errors_of_exact(
        self,
        exact: Elastodynamic,
        tolerance: float,
        aim: float,
        finer: Vibration | None,
        begun: Elastodynamic | None = None,
        negligible: float = 0.0,
    ) -> tuple[dict[str, Elastodynamic], dict[str, float]]:
        """Measure the errors of an exact answer, or estimate them if the bounds on discretization errors are small.

        If a finer answer would take too long, or if the iteration of the exact answer did not converge, the coarser
        answer measures the errors. Without one, they are estimated.
        """
        if exact.exact is None or not self._worth_measuring(exact, aim, negligible):
            return {}, estimated_errors_of_exact(exact)
        unconverged = exact.exact.worst > max(aim, THEORY.max_unconverged)
        if unconverged or exact.elements * exact.coordinates**2 > THEORY.max_finer_work:
            return errors_by_coarser(exact)
        self._report(4, "error in time and coordinates")
        return errors_of_exact(exact, tolerance, finer, begun)


def _rests(plain: Deflection) -> bool:
    """Return whether the drives and the loads are constant."""
    moments, motion = plain.amplitudes.M, plain.motion
    travel = np.abs(motion.drive_rate).max(initial=0.0) * np.ptp(motion.time)
    largest = np.abs(moments).max(axis=-1)
    by_travel = THEORY.max_change_per_travel * travel * largest.max(initial=0.0)
    same = np.ptp(moments, axis=-1) <= THEORY.max_rest_change * largest + by_travel
    return bool(travel <= THEORY.max_rest_travel and same.all())


def _motion_at_rest(scene: Scene, motion: Motion) -> tuple[MotionAt, float]:
    """Return a function of time for a motion that rests at the first position, and the duration of this motion."""

    def held(times: Any) -> Motion:
        return replace(scene.course.at(np.repeat(motion.time[:1], len(times))), time=np.asarray(times))

    return held, max(float(np.ptp(motion.time)), 1.0)


def _vibrating(scene: Scene, plain: Deflection, motion_at: MotionAt, period: float, tolerance: float) -> Elastodynamic:
    given = scene.sections, scene.joints, damping_of(scene), tolerance
    if many := too_many_beams(scene.mechanism):
        raise SceneError(scene.path, "run", "theory", many)
    try:
        if math.isnan(period):
            return transient(plain.motion, motion_at, *given, breaks=scene.course.breaks.edges)
        return elastodynamic(plain.motion, motion_at, period, *given, breaks=scene.course.breaks.edges, static=plain)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "run", "theory", f"vibration cannot be solved: {error}") from None
