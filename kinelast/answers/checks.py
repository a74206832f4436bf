"""Checks of results by other methods: nonlinear finite elements in the time domain, and links as plane bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct, field

from elastic import Deflection, reference_deflection, sample
from elastic.beams import POISSON
from elastic.links import members_of
from kinelast.figures import errors, figure_error
from kinelast.figures.measured import Measured
from kinelast.figures.registry import NAMES
from kinelast.scene.course import CourseByLaws
from kinelast.scene.data import ELASTODYNAMIC, QUASI_STATIC
from kinelast.values.figure import OUTPUT_ERROR, points_of
from kinelast.values.numbers import UNRELIABLE

if TYPE_CHECKING:
    from fem_check import MomentumBalance
    from fem_check.nonlinear import RefinedDeflection
    from fem_check.solid import SolidComparison
    from kinelast.answers.results import Results
    from kinelast.scene.data import Scene
    from rigid import Mechanism, Reals

DIVISORS = 1.5, 6.0  # ratios of allowed difference to tolerance in a first run, and in a second if that cannot decide
MEASURING = 0.2  # largest tolerance of the first run, relative to the estimated error of the answer
DEFAULT_TOLERANCE = 0.005  # largest tolerance of the second run; also used if the answer has no estimated error
MIN_ALLOWED, MAX_ALLOWED = 0.005, 0.1  # range of the allowed momentum difference of vibrating links
ALLOWED_PER_ACCURACY = 0.2  # smallest allowed momentum difference, relative to the accuracy
POSITIONS = 360  # default number of positions of a run; with more positions, a larger momentum difference is allowed


def nonlinear_check(results: Results, progress: Callable[[float, str], None] | None = None) -> NonlinearCheck | NotMade:
    """Solve the mechanism by nonlinear finite elements and compare the deflections.

    The check uses the damping of the answer (the results to check), but none of its other results.

    Its elements are beams too. The allowed difference therefore does not include errors of beam theory.
    """
    from fem_check.nonlinear import DoesNotCloseError, NotCheckedError

    if reason := nonlinear_refusal(results):
        return NotMade(reason)
    course, estimate = results.scene.course, math.nan
    assert isinstance(course, CourseByLaws)
    if results.answer:
        estimate = results.answer.by_motion
    try:
        for divisor in DIVISORS:
            allowed = allowed_difference(estimate)
            finest = DEFAULT_TOLERANCE if divisor > DIVISORS[0] else max(MEASURING * estimate, DEFAULT_TOLERANCE)
            tolerance = DEFAULT_TOLERANCE if math.isnan(allowed) else min(allowed / divisor, finest)
            check = _nonlinear(results, course, tolerance, estimate, progress)
            if not check.near:
                break
    except (NotCheckedError, DoesNotCloseError) as error:
        return NotMade(str(error))
    return check


def nonlinear_refusal(results: Results) -> str:
    """Return the reason why the nonlinear check cannot be made, if it is known before solving; otherwise empty."""
    scene, course = results.scene, results.scene.course
    if not isinstance(course, CourseByLaws) or results.left_out:
        return "it requires drives that follow laws and reach all positions"
    if results.buckles:
        return f"there are no results to compare: {results.buckles}"
    from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, system_of

    try:
        system_of(scene.mechanism, scene.sections, course.laws, float(results.motion.time[0]), 1, scene.joints, 0.0)
    except (NotCheckedError, DoesNotCloseError) as error:
        return str(error)
    return ""


def _nonlinear(
    results: Results,
    course: CourseByLaws,
    tolerance: float,
    estimate: float,
    progress: Callable[[float, str], None] | None,
) -> NonlinearCheck:
    """Run the nonlinear check with a given tolerance."""
    from fem_check.nonlinear import refined_deflection

    scene, times, period = results.scene, results.motion.time, results.period
    closed = not math.isnan(period)
    start = float(times[0])
    end = start + period if closed else float(times[-1])
    instants = start + np.remainder(times - start, period) if closed else times
    given = (
        scene.mechanism,
        scene.sections,
        course.laws,
        instants,
        end,
        closed,
        tolerance,
        scene.joints,
        *_damping(results),
    )
    refined = refined_deflection(*given, progress)
    largest = members_of(scene.mechanism).greatest(np.abs(refined.chord).max(axis=(1, 2)))
    base = reference_deflection(largest)

    def apart(bent: Deflection) -> dict[str, float]:
        away = np.nanmax(np.abs(sample(bent, "chord", refined.xi) - refined.chord), axis=(1, 2))
        return dict(zip(scene.labels, (away / np.where(base > 0, base, 1.0)).tolist(), strict=True))

    return NonlinearCheck(
        refined.elements,
        refined.steps,
        len(times),
        apart(results.deflection),
        apart(results.quasi_static),
        dict(zip(scene.labels, largest.tolist(), strict=True)),
        estimate,
        refined.mesh,
        refined.step,
        _allowance(results, largest.max(initial=0.0) / np.where(base > 0, base, 1.0)),
        _measured(results, refined),
    )


def _measured(results: Results, refined: RefinedDeflection) -> Measured:
    """Return the errors in the largest displacements of beams, points and output, as measured by the check.

    Displacements are compared at the nodes of the check's beams and at its instants. The relative error of the check
    itself is known for the chord deflection, and is assumed to be the same for all displacements.
    """
    theirs = dict(zip(("u", "w", "phi"), refined.moved, strict=True)) | {"chord": refined.chord}
    ours = {name: sample(results.deflection, name, refined.xi) for name in theirs}
    sizes = {NAMES.get(name, name): tuple(_greatest(each[name]) for each in (ours, theirs)) for name in theirs}
    names = [name for name, _ in points_of(results.mechanism)]
    sizes["displacement"] = tuple(_of_points(results.mechanism, names, each) for each in (ours, theirs))
    if (output := results.figures.output) and output.point in names:
        sizes[OUTPUT_ERROR] = tuple(each[[names.index(output.point)]] for each in sizes["displacement"])
    differences = {key: np.abs(mine - true).tolist() for key, (mine, true) in sizes.items()}
    least = {key: errors.MIN_SHARE_OF_UNIT * np.nanmax(true, initial=0.0) for key, (_, true) in sizes.items()}
    uncertain = {key: (refined.error * np.maximum(true, least[key])).tolist() for key, (_, true) in sizes.items()}
    return Measured(differences, uncertain)


def _greatest(values: Reals) -> Reals:
    """Return the greatest magnitude in each beam, shape (beams,)."""
    return np.nanmax(np.abs(values), axis=(1, 2))


def _of_points(mechanism: Mechanism, names: Sequence[str], moved: Mapping[str, Reals]) -> Reals:
    """Return the greatest displacement of each point [m], shape (points,); nan for points that are not beam ends."""
    greatest = np.full(len(names), np.nan)
    size = np.hypot(moved["u"], moved["w"])
    for number, (_, beam) in enumerate(mechanism.beams):
        for point, node in ((beam.start, 0), (beam.end, -1)):
            if point in names:
                greatest[names.index(point)] = np.nanmax(size[number, :, node])
    return greatest


def _allowance(results: Results, smaller: Reals) -> dict[str, float]:
    """Return the increase in the allowed difference for each beam, relative to the beam's own deflection.

    The discretization error is known relative to the largest deflection of all beams. It is larger relative to the
    deflection of a beam that bends less. The result is the difference between the two.

    Parameters
    ----------
    smaller
        For each beam, ratio of the largest deflection of all beams to the largest deflection of this beam.
    """
    share = results.answer.off.shares.get(figure_error.TIME, 0.0) if results.answer else 0.0
    return dict(zip(results.scene.labels, (share * np.maximum(smaller - 1.0, 0.0)).tolist(), strict=True))


def _damping(results: Results) -> tuple[Reals, float]:
    """Return the damping coefficient beta of each beam, and that of the compliant joints [s].

    If there is a solution with vibration, the damping is that of this solution. Otherwise a damping ratio is converted
    at the lowest natural frequency.
    """
    if results.answer and results.answer.vibrating:
        damping = results.answer.vibrating.damping
        return damping.beams, damping.joints
    from kinelast.answers.bounds import damping_of

    frequencies = results.frequencies
    damping = damping_of(results.scene).with_default_beta(frequencies.lowest if frequencies else math.inf)
    return damping.beams, damping.joints


def _poisson(scene: Scene) -> list[float]:
    """Return Poisson's ratio of each beam. If the material does not give it, it is that of metals."""
    names = [made.material for made in scene.made_of] or [""] * len(scene.labels)
    given = [scene.materials[name].poisson if name in scene.materials else None for name in names]
    return [POISSON if ratio is None else ratio for ratio in given]


def momentum_balances(results: Results) -> dict[str, MomentumBalance]:
    """Return the momentum balances of the whole machine by theory: one quasi-static and, if solved, one with vibration.

    The allowed difference for vibrating links is the error due to time steps, the number of coordinates and large
    displacement. It is at least `ALLOWED_PER_ACCURACY` times the accuracy. It is also at least `MIN_ALLOWED` or, for
    more than `POSITIONS` positions, `MIN_ALLOWED` times (number of positions / `POSITIONS`)^2. There is no balance with
    vibration if the allowed difference exceeds `MAX_ALLOWED`.
    """
    from elastic.elastodynamics import deflection_at
    from fem_check import balance

    scene = results.scene
    course, answer = scene.course, results.answer
    balances = {QUASI_STATIC: balance(results.quasi_static, course.near, course.span)}
    if answer is not None and results.vibrates and answer.vibrating is not None:
        off = max(answer.by_motion, ALLOWED_PER_ACCURACY * answer.requested.wanted)
        allowed = max(MIN_ALLOWED * max(1.0, len(results.motion.time) / POSITIONS) ** 2, off)
        if allowed <= MAX_ALLOWED:
            cycle = results.period if math.isfinite(results.period) else None
            transient = partial(deflection_at, answer.vibrating), answer.vibrating.edges
            in_time = cycle, allowed, answer.theory != ELASTODYNAMIC, None if cycle else transient
            balances[answer.theory] = balance(results.deflection, course.near, course.span, *in_time)
    return balances


def check_passed(results: Results) -> bool | None:
    """Return whether the finite element check and the momentum balances pass. Return None if nothing was compared."""
    comparison, verdicts = results.comparison, []
    assert comparison is not None
    if not comparison.passed or (results.scene.labels and comparison.compared):
        verdicts.append(comparison.passed)
    verdicts += [balance.passed for balance in results.balances.values() if balance.compared]
    return all(verdicts) if verdicts else None


def solid_check(results: Results) -> SolidComparison | NotMade:
    """Measure the error of beam theory by comparing the quasi-static deflection with plane-stress bodies."""
    from fem_check.solid import compare_solid

    try:
        compared = compare_solid(results.quasi_static, _poisson(results.scene))
    except ValueError as error:
        return NotMade(str(error))
    if compared.by_link:
        return compared
    return NotMade("; ".join(f"{link}: {reason}" for link, reason in compared.left_out.items()))


MAX_RATIO = 2.0  # allowed difference between answer and check, relative to the estimated error of the answer
MIN_DIFFERENCE = 0.01  # smallest allowed difference between answer and check, relative to the largest deflection


class NotMade(Struct, frozen=True):
    """A check that was requested but could not be made. `problem` is the reason."""

    problem: str


class NonlinearCheck(Struct, frozen=True):
    """Comparison of the deflections from the chord with a nonlinear finite element model of the whole mechanism.

    Attributes
    ----------
    elements, steps, positions
        Number of elements per beam, number of time steps, and number of compared positions.
    difference, without_vibration
        Largest difference between the answer and the check, and between the quasi-static answer and the check. Both are
        relative to the largest deflection of the beam, by beam label.
    peak
        Largest deflection according to the check [m], by beam label.
    estimate
        Estimated error of the answer due to its theory (such as quasi-static), without errors of beam theory; nan if it
        is unknown.
    mesh, step
        Estimated relative errors of the check, due to the size of its elements and due to its time steps.
    allowance
        Error that is added to `estimate` for a beam, relative to the deflection of the beam, by beam label. It is
        needed because the discretization error is relative to the largest displacement. Relative to the deflection of a
        link that hardly bends, this error is large.
    measured
        Measured errors in the figures that the check also computes.
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
        """The largest difference of any beam."""
        return max(self.difference.values(), default=0.0)

    @property
    def error(self) -> float:
        """The relative error of the check itself."""
        return self.mesh + self.step

    @property
    def near(self) -> bool:
        """Whether the check cannot decide: its own error is large, or exceeds the margin to the allowed difference."""
        return abs(self._beyond) < self.error or self.error > UNRELIABLE

    @property
    def cannot_tell(self) -> bool:
        """Whether the check is meaningless, because the estimated error of the answer exceeds the deflection itself."""
        return self.estimate > 1.0

    @property
    def _beyond(self) -> float:
        """The difference minus the allowed difference, for the beam where this is largest."""
        off = ((each, self.estimate + self.allowance.get(label, 0.0)) for label, each in self.difference.items())
        return max((each - allowed_difference(own) for each, own in off), default=-allowed_difference(self.estimate))

    @property
    def passed(self) -> bool | None:
        """Whether all differences are allowed; None if the error is not estimated or the check cannot decide."""
        if math.isnan(self.estimate) or self.near or self.cannot_tell:
            return None
        return self._beyond <= 0.0


def allowed_difference(estimate: float) -> float:
    """Return the allowed difference between answer and check, given the estimated error of the answer.

    Return nan if this error is unknown.
    """
    return math.nan if math.isnan(estimate) else max(MAX_RATIO * estimate, MIN_DIFFERENCE)
