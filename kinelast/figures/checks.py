"""Checks by other methods: nonlinear finite elements in the time domain, and links modelled as plane bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from elastic import Deflection, reference_deflection, sample
from elastic.beams import POISSON
from elastic.links import members_of
from kinelast.figures import errors
from kinelast.figures.errors import FigureError
from kinelast.figures.measured import Measured
from kinelast.figures.registry import NAMES
from kinelast.figures.report import FurtherCheck
from kinelast.scene.course import CourseByLaws
from kinelast.scene.data import ACCURACY, ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC
from kinelast.scene.figure import OUTPUT_ERROR, points_of
from kinelast.scene.numbers import UNRELIABLE, percent
from kinelast.scene.reading import known, reading

if TYPE_CHECKING:
    from fem_check import MomentumBalance
    from fem_check.nonlinear import RefinedDeflection
    from fem_check.solid import SolidComparison
    from kinelast.figures.answer import Answer
    from kinelast.figures.results import Results
    from kinelast.scene.data import Scene
    from rigid import Mechanism, Reals

DIVISORS = 1.5, 6.0  # allowed difference / tolerance, in the first run and in the second, if the first is undecided
MEASURING = 0.2  # error of a check / estimated error, up to which the check replaces the estimate
DEFAULT_TOLERANCE = 0.005  # tolerance of a check without an allowed difference
MIN_ACCURACY = 1e-4  # finest accuracy that a message suggests
MIN_ALLOWED, MAX_ALLOWED = 0.005, 0.1  # bounds of the allowed momentum difference of vibrating links
ALLOWED_PER_ACCURACY = 0.2  # momentum difference relative to the accuracy, which sets the solver's tolerance
POSITIONS = 360  # default positions of a run; with more, a finer time grid widens the allowed momentum difference


def nonlinear_check(results: Results, progress: Callable[[float, str], None] | None = None) -> NonlinearCheck | NotMade:
    """Solve the mechanism by nonlinear finite elements, using only the scene and the damping from the results.

    The elements are also beams, so the allowed difference does not include errors of beam theory.
    """
    from fem_check.nonlinear import DoesNotCloseError, NotCheckedError

    course = results.scene.course
    if results.buckles:
        return NotMade(f"there are no results to compare: {results.buckles}")
    if not isinstance(course, CourseByLaws) or results.left_out:
        return NotMade("it requires drives that follow laws and reach all positions")
    estimate = math.nan
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


def _nonlinear(
    results: Results,
    course: CourseByLaws,
    tolerance: float,
    estimate: float,
    progress: Callable[[float, str], None] | None,
) -> NonlinearCheck:
    """Run the check with a given tolerance."""
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
        _damping(results),
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
    """Return the errors of the largest displacements of the beams, points and output, measured by the check.

    Displacements are compared at the nodes and instants of the check. The check's own error is known relative to the
    chord deflection, and is applied to all displacements.
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
    """Return the greatest magnitude of each beam, shape (beams,)."""
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
    """Return the additional discretization error of each beam, relative to the beam's own deflection.

    Parameters
    ----------
    smaller
        Largest deflection of all beams / largest deflection of each beam.
    """
    share = results.answer.off.shares.get(errors.TIME, 0.0) if results.answer else 0.0
    return dict(zip(results.scene.labels, (share * np.maximum(smaller - 1.0, 0.0)).tolist(), strict=True))


def _damping(results: Results) -> Reals:
    """Return the damping beta of each beam [s], from the vibration if solved, or from the lowest natural frequency."""
    if results.answer and results.answer.vibrating:
        return results.answer.vibrating.damping.beams
    from kinelast.figures.bounds import damping_of

    frequencies = results.frequencies
    return damping_of(results.scene).settled(frequencies.lowest if frequencies else math.inf).beams


def _poisson(scene: Scene) -> list[float]:
    """Return Poisson's ratio of each beam; the default is that of metals."""
    names = [made.material for made in scene.made_of] or [""] * len(scene.labels)
    given = [scene.materials[name].poisson if name in scene.materials else None for name in names]
    return [POISSON if ratio is None else ratio for ratio in given]


def nearer(results: Results, error: FigureError, share: float) -> str:
    """Return advice on how to reduce the relative error of a figure to `share`, or an empty string.

    The advice names the largest part of the error and an option that is applicable to this scene.
    """
    answer, largest = results.answer, error.largest
    if largest == errors.BEAM_THEORY:
        return "" if results.solid or _hollow(results) else f"mostly {largest}: --check solid would measure it"
    if answer is None or largest in (errors.ROUND_OFF, errors.BODIES) or share <= 0.0:
        return ""
    if largest == errors.BETWEEN:
        more = max(POSITIONS, 4 * len(results.motion.time))
        return f"mostly {largest}: --positions {more} would reduce it"
    if results.scene.theory.plain:
        return f'mostly {largest}: without theory = "quasi-static" the error would be small'
    return f"mostly {largest}{_by_a_finer_theory(results, answer, max(share / 2, MIN_ACCURACY))}"


def _by_a_finer_theory(results: Results, answer: Answer, aim: float) -> str:
    """Return advice on an error due to the theory of motion.

    A finer accuracy is suggested only if the present accuracy has been reached.
    """
    wanted = answer.accuracy or ACCURACY
    reached = max((each.error.without(errors.NOT_OF_MOTION).size / each.base for each in results.graded), default=0.0)
    if (answer.theory == GEOMETRICALLY_EXACT or answer.finer) and max(aim, reached) <= wanted:
        return f': accuracy = "{percent(aim)}" would suffice'
    if isinstance(results.scene.course, CourseByLaws) and not results.left_out and not results.nonlinear:
        return ": --check nonlinear would measure it"
    return ", which a finer computation cannot reduce; stiffer links or more damping would"


def _hollow(results: Results) -> bool:
    """Whether the beam with the largest error of beam theory has thin walls, which plane bodies cannot model."""
    parts = [abs(error.parts.get(errors.BEAM_THEORY, 0.0)) for error in results.errors.get("chord", ())]
    return bool(parts) and results.scene.sections[int(np.argmax(parts))].thin_walled


def momentum_balances(results: Results) -> dict[str, MomentumBalance]:
    """Return the momentum balances of the whole machine by theory: quasi-static and, if solved, with vibration.

    The allowed difference for vibrating links is the error due to time steps, coordinates and large displacement. It is
    at least `MIN_ALLOWED`, which is increased with the square of the number of positions, and at least a fraction of
    the accuracy.
    """
    from elastic.elastodynamics import deflection_at
    from fem_check import balance

    scene = results.scene
    course, answer = scene.course, results.answer
    balances = {QUASI_STATIC: balance(results.quasi_static, course.near, course.span)}
    if answer is not None and results.vibrates and answer.vibrating is not None:
        wanted = ACCURACY if answer.accuracy is None else answer.accuracy
        off = max(answer.by_motion, ALLOWED_PER_ACCURACY * wanted)
        allowed = max(MIN_ALLOWED * max(1.0, len(results.motion.time) / POSITIONS) ** 2, off)
        if allowed <= MAX_ALLOWED:
            cycle = results.period if math.isfinite(results.period) else None
            transient = partial(deflection_at, answer.vibrating), answer.vibrating.edges
            in_time = cycle, allowed, answer.theory != ELASTODYNAMIC, None if cycle else transient
            balances[answer.theory] = balance(results.deflection, course.near, course.span, *in_time)
    return balances


def check_passed(results: Results) -> bool | None:
    """Return whether the finite element check is within its bounds, or None if no position was compared."""
    comparison, verdicts = results.comparison, []
    assert comparison is not None
    if not comparison.passed or (results.scene.labels and comparison.compared):
        verdicts.append(comparison.passed)
    verdicts += [balance.passed for balance in results.balances.values() if balance.compared]
    return all(verdicts) if verdicts else None


def solid_check(results: Results) -> SolidComparison | NotMade:
    """Measure the error of beam theory in the quasi-static deflection with plane-stress bodies."""
    from fem_check.solid import compare_solid

    try:
        compared = compare_solid(results.quasi_static, _poisson(results.scene))
    except ValueError as error:
        return NotMade(str(error))
    if compared.by_link:
        return compared
    return NotMade("; ".join(f"{link}: {reason}" for link, reason in compared.left_out.items()))


MAX_RATIO = 2.0  # allowed difference of a check / estimated error
MIN_DIFFERENCE = 0.01  # smallest difference that a check resolves, relative to the largest deflection


@dataclass(frozen=True)
class NotMade:
    """A requested check that could not be made; `problem` is the reason."""

    problem: str


@dataclass(frozen=True)
class NonlinearCheck:
    """Comparison of the chord deflection with nonlinear finite elements of the whole mechanism.

    Attributes
    ----------
    elements, steps, positions
        Number of elements per beam, of time steps, and of compared positions.
    difference, without_vibration
        Largest difference of the answer and of the quasi-static answer from the check, relative to the largest
        deflection of the beam, by beam label.
    peak
        Largest deflection according to the check [m], by beam label.
    estimate
        Estimated error of the answer, without the errors that the check has too; nan if it is unknown.
    mesh, step
        Estimated relative errors of the check due to its elements and time steps.
    allowance
        Additional allowance relative to the beam's deflection, by beam label. It is needed because the convergence
        tolerance is relative to the largest displacement, and therefore large for a link that hardly bends.
    measured
        Errors of the figures that the check computes as well.
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
        """Whether the check is undecided because its error is unreliable or exceeds the distance to the bound."""
        return abs(self._beyond) < self.error or self.error > UNRELIABLE

    @property
    def cannot_tell(self) -> bool:
        """Whether the estimated error exceeds the deflection itself, so that any difference would be within it."""
        return self.estimate > 1.0

    @property
    def _beyond(self) -> float:
        """The difference minus its bound, for the worst beam."""
        off = ((each, self.estimate + self.allowance.get(label, 0.0)) for label, each in self.difference.items())
        return max((each - allowed_difference(own) for each, own in off), default=-allowed_difference(self.estimate))

    @property
    def passed(self) -> bool | None:
        """Whether the difference is within its bound; None if there is no estimate or the check is undecided."""
        if math.isnan(self.estimate) or self.near or self.cannot_tell:
            return None
        return self._beyond <= 0.0


def allowed_difference(estimate: float) -> float:
    """Return the largest difference that is allowed in a check; nan if the error could not be estimated."""
    return math.nan if math.isnan(estimate) else max(MAX_RATIO * estimate, MIN_DIFFERENCE)


def nonlinear_report(check: NonlinearCheck | NotMade | None) -> FurtherCheck | None:
    """Return the nonlinear check for the report. Differences are relative to the largest deflection from the chord."""
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
    """Return the check with plane bodies for the report, relative to the largest deflection from the chord."""
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
