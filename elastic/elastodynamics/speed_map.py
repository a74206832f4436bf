"""Response of the vibrating mechanism as a function of drive speed."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import (
    Discretization,
    Model,
    MotionAt,
    checked,
    first_discretization,
    halved,
    unlocked,
    vibrating_model,
    worth_halving,
)
from elastic.elastodynamics.equations_of_motion import MotionTerms, Problem, kinematics, motion_terms, problem
from elastic.elastodynamics.exact_steps import exact_deflection, with_friction
from elastic.elastodynamics.geometrically_exact import steps_to_exact
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import vibration
from elastic.elastodynamics.settled import Settled
from elastic.elastodynamics.solution import force_error, time_error, vibration_in
from elastic.elastodynamics.speed_scan import SpeedScan, speed_scan
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.theory_error import second_order_error
from elastic.elastodynamics.time_elements import propagation
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import of_several_speeds, resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import MechanismError, Motion
from rigid.arrays import Flags, Reals
from rigid.chunks import columns_of, design_chunks
from rigid.kinematics import repeated

TOLERANCE = 2e-3

OneSpeed = Callable[[int], Deflection]
Measure = Callable[[Deflection, OneSpeed], Any]
Errors = Callable[[Deflection, Deflection | None, Deflection | None, float, float, float], Reals]
"""Function that returns the errors of the measures of a solution.

Its arguments are the solution, the solution in a finer discretization and the solution with large displacement (None if
unknown), bounds on the convergence errors of displacements and of forces, and the remaining effect of large
displacement.
"""


@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Solutions at several speeds, relative to the speed of the given motion.

    Attributes
    ----------
    ratio
        Relative speeds, shape (speeds,).
    values, quasi_static
        Measures with and without vibration, shape (speeds, ...). They are nan if the steady state is unstable.
    growth
        Growth of the least stable free vibration per cycle, shape (speeds,).
    time_error, reduction_error
        Convergence errors (see `Elastodynamic`), shape (speeds,). `reduction_error` is nan if the steady state is
        unstable.
    errors
        Errors of the values, shape (speeds, ...). They are nan if not computed, or if the steady state is unstable.
        With many speeds, relative errors are computed at every third speed and interpolated.
    damping
        Damping used.
    omega
        Lowest natural frequency with locked drives at some positions of the cycle [rad/s], shape (positions,).
    """

    ratio: Reals
    values: Reals
    quasi_static: Reals
    growth: Reals
    time_error: Reals
    reduction_error: Reals
    errors: Reals
    damping: Damping
    omega: Reals

    @property
    def error(self) -> Reals:
        """Total convergence error, relative to the largest displacement, shape (speeds,)."""
        return self.time_error + self.reduction_error

    @property
    def stable(self) -> Flags:
        """True if all free vibrations decay, shape (speeds,)."""
        return self.growth <= 1 + VIBRATION.max_neutral_growth


class SpeedAnswers:
    """Steady states at many drive speeds, which share the terms that depend only on the positions.

    `find` computes one set of speeds after the other. Grids and coordinates are shared, and are refined if any speed
    requires it.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        See `elastodynamic`. These are the values for the relative speed 1. The cycle begins at time 0.
    measure
        Function that reduces a deflection over the positions of the cycle to an array of shape (..., speeds). The
        columns of the deflection are (speeds, positions), with positions in order and ending at the start of the cycle.
        The second argument is a function that returns the deflection at one of the speeds, with columns (positions,).
    tolerance
        Tolerance relative to the largest displacement.
    still
        Measure without vibration, by default `measure`.
    errors
        Function for the errors of the measures.
    on_speed
        Function that is called with the number of finished speeds and the total.
    resolved
        A convergence error with a bound below this is not measured by a finer discretization.

    Attributes
    ----------
    least_damping
        Smallest damping ratio of a natural mode, which is half the relative width of its peaks.

    Raises
    ------
    MechanismError, ValueError
        See `elastodynamic`. ValueError is also raised if no link vibrates.
    """

    def __init__(
        self,
        motion_at: MotionAt,
        period: float,
        sections: Sequence[Section],
        measure: Measure,
        joints: Mapping[str, JointCompliance] | None = None,
        damping: Damping | float | None = None,
        tolerance: float = TOLERANCE,
        still: Measure | None = None,
        errors: Errors | None = None,
        on_speed: Callable[[int, int], None] | None = None,
        resolved: float = 0.0,
    ) -> None:
        model = vibrating_model(motion_at, 0.0, period, sections, joints or {}, damping)
        if model.cycle is None:
            raise ValueError("nothing vibrates: all beams and joints are rigid or without mass")
        self.damping, self.omega = model.damping, model.cycle.omega
        betas = [*model.damping.beams[model.damping.beams > 0], *([model.damping.joints] * (model.damping.joints > 0))]
        self.least_damping = float(min(betas, default=0.0) * self.omega.min() / 2)
        self._measure, self._still, self._tolerance = measure, still or measure, tolerance
        self._errors = None if errors is None else _ErrorTask(errors, resolved)
        self._on_speed = on_speed or (lambda done, of: None)
        grids = [Grid(np.linspace(0.0, period, SPEEDS.first_elements + 1))]
        self._course = _Course(first_discretization(model, tolerance), grids)
        self._rows: dict[float, _Row] = {}

    def find(self, ratios: Sequence[float]) -> None:
        """Compute solutions at further relative speeds, refining the discretization for those that have not converged.

        Raise ValueError if a speed is not positive.
        """
        if not all(ratio > 0 for ratio in ratios):
            raise ValueError(f"speeds from {min(ratios):g}, expected above 0")
        left = sorted({float(ratio) for ratio in ratios} - self._rows.keys())
        for _ in range(VIBRATION.max_refinements):
            course, resolved = self._course, self._course.resolved
            for first in range(0, len(left), SPEEDS.loads_in_memory):
                part = left[first : first + SPEEDS.loads_in_memory]
                every = (
                    max(SPEEDS.error_stride, math.ceil(len(part) / SPEEDS.max_errors)) if len(part) > SPEEDS.many else 1
                )
                steady = []
                for number, ratio in enumerate(part):
                    self._on_speed(first + number, len(left))
                    steady.append(_at_speed(course, ratio, self._tolerance, None if number % every else self._errors))
                self._rows |= _measured(course, steady, self._measure, self._still)
            errors = {ratio: self._rows[ratio].reduction_error for ratio in left}
            left = [
                ratio
                for ratio, error in errors.items()
                if error > self._tolerance and self._rows[ratio].time_error <= resolved
            ]
            finer = course.discretization.finer(max(errors[ratio] for ratio in left)) if left else None
            if finer is None:
                break
            self._course = _Course(finer, course.grids)

    def sharpen(self, ratio: float) -> bool:
        """Compute the errors at a known speed by Newton's method if the effect of large displacement is not yet known.

        Return whether the errors were computed.
        """
        row = self._rows[ratio]
        if self._errors is None or row.growth > 1 + VIBRATION.max_neutral_growth or (row.measured and not row.open):
            return False
        steady = _at_speed(self._course, ratio, self._tolerance, replace(self._errors, by_newton=True))
        assert steady.errors is not None
        self._rows[ratio] = replace(row, errors=steady.errors, measured=True, open=0.0)
        return True

    def map(self, ratios: Sequence[float] | None = None) -> SpeedMap:
        """Return the solutions at all known speeds, or at the given ones."""
        known = sorted(self._rows) if ratios is None else [float(ratio) for ratio in ratios]
        rows = [self._rows[ratio] for ratio in known]
        parts = {name: np.array([getattr(row, name) for row in rows]) for name in _Row.__match_args__}
        gaps = (parts["growth"] <= 1 + VIBRATION.max_neutral_growth) & np.array(
            [not row.measured for row in rows], bool
        )
        measured = sorted(ratio for ratio, row in self._rows.items() if row.measured)
        if gaps.any() and measured:
            shares = [_share(self._rows[ratio].errors, self._rows[ratio].values) for ratio in measured]
            parts["errors"][gaps] = parts["values"][gaps] * _on_line(np.array(known)[gaps], measured, np.array(shares))
        del parts["measured"], parts["open"]
        return SpeedMap(np.array(known), **parts, damping=self.damping, omega=self.omega)

    def stable(self, ratio: float) -> bool:
        """Return whether the steady state at a speed is stable."""
        return self._course.growth(ratio) <= 1 + VIBRATION.max_neutral_growth

    def scan(self) -> SpeedScan:
        """Set up a scan between the smallest and the largest known speed on the finest grid."""
        course, ends = self._course, (min(self._rows), max(self._rows))
        course.level = len(course.grids) - 1
        problems = [course.problem(ratio) for ratio in (ends[0], math.sqrt(ends[0] * ends[1]), ends[1])]
        return speed_scan(course.here()[0], problems, ends[1])


def stable_below(
    motion_at: MotionAt,
    period: float,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
) -> float:
    """Find the speed below which all free vibrations decay, for a cycle that is unstable at relative speed 1.

    Speeds are checked in steps of 1 % down to 30 % (see `SpeedSettings`), followed by bisection. Unstable ranges that
    are narrower than a step may be missed.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        See `elastodynamic`.

    Returns
    -------
    Relative speed with an accuracy of 1/16 of a step, or nan if even the lowest speed is unstable.
    """
    answers = SpeedAnswers(motion_at, period, sections, _nothing, joints, damping)
    answers.find([1.0])
    looked_at = np.arange(1.0, SPEEDS.min_stability_speed, -SPEEDS.stability_step)
    unstable = [float(ratio) for ratio in looked_at if not answers.stable(float(ratio))]
    if not unstable or unstable[-1] == looked_at[-1]:
        return math.nan if unstable else 1.0
    low, high = unstable[-1] - SPEEDS.stability_step, unstable[-1]
    while high - low > SPEEDS.stability_step / 16:
        middle = (low + high) / 2
        low, high = (middle, high) if answers.stable(middle) else (low, middle)
    return low


def _nothing(bent: Deflection, _: OneSpeed) -> Reals:
    return np.zeros((1, *bent.motion.columns[:-1]))


def critical_speeds(omega: Reals, multiples: int = SPEEDS.harmonics) -> dict[int, tuple[float, float]]:
    """Return the speed ranges in which a harmonic of the cycle coincides with a natural frequency.

    Parameters
    ----------
    omega
        Natural frequencies of one mode over the cycle (see `SpeedMap.omega`) [rad/s], shape (positions,).
    multiples
        Largest harmonic.

    Returns
    -------
    Smallest and largest angular frequency of the cycle [rad/s] by harmonic.

    Examples
    --------
    >>> critical_speeds([600.0, 900.0], 2)
    {1: (600.0, 900.0), 2: (300.0, 450.0)}
    """
    least, most = float(np.min(omega)), float(np.max(omega))
    return {n: (least / n, most / n) for n in range(1, multiples + 1)}


@dataclass(frozen=True, eq=False)
class _Row:
    """Entry of a map for one speed; `open` is the remaining change after the steps towards large displacement."""

    values: Reals
    quasi_static: Reals
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals
    measured: bool
    open: float


def _share(errors: Any, values: Any) -> Reals:
    """Return the relative errors (zero if a value is zero)."""
    return np.divide(errors, values, out=np.zeros_like(values), where=values > 0.0)


def _on_line(at: Reals, known: Sequence[float], values: Reals) -> Reals:
    """Interpolate values of shape (known, rows) linearly, shape (at, rows)."""
    return np.stack([np.interp(at, known, column) for column in values.T], axis=-1)


class _Course:
    """Terms of the equations of motion on successively finer grids, computed on demand."""

    def __init__(self, discretization: Discretization, grids: list[Grid]) -> None:
        self.discretization = discretization
        self.model, self.basis, self.resolved = discretization.model, discretization.basis, discretization.resolved
        self.grids = grids
        self.known: dict[int, tuple[Motion, MotionTerms]] = {}
        self.level = len(grids) - 1

    def here(self) -> tuple[Motion, MotionTerms]:
        """Return the motion at the nodes of the current grid, and the terms of the equations."""
        if self.level not in self.known:
            grid, chosen = self.grids[self.level], chosen_points(self.model.structure.mechanism)
            motion = checked(self.model.motion_at(grid.nodes))
            kinds = kinematics(self.model.structure, motion, self.basis, chosen)
            self.known[self.level] = motion, motion_terms(kinds, grid, self.model.damping)
        return self.known[self.level]

    def plain(self, ratio: float) -> Deflection:
        """Return the quasi-static deflection at a speed at the nodes."""
        return deflection(_passed(self.here()[0], ratio), self.model.sections, self.model.joints)

    def problem(self, ratio: float) -> Problem:
        """Return the equations of motion at a speed."""
        return problem(self.here()[1], unlocked(self.plain(ratio)), ratio)

    def growth(self, ratio: float) -> float:
        """Return the growth of the least stable free vibration per cycle."""
        self.level = len(self.grids) - 1
        posed = self.problem(ratio)
        return float(np.abs(propagation(posed.terms.grid, posed.equations).multipliers).max())


@dataclass(frozen=True, eq=False)
class _Steady:
    """Steady state at one speed, with the loads of the vibration on its grid (None if unstable)."""

    ratio: float
    grid: Grid
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals | None
    loads: AddedLoads | None
    open: float = 0.0


@dataclass(frozen=True, eq=False)
class _ErrorTask:
    """Computation of errors: function, see `resolved` in `SpeedAnswers`, and whether to use Newton's method."""

    of: Errors
    resolved: float
    by_newton: bool = False


def _at_speed(course: _Course, ratio: float, tolerance: float, errors: _ErrorTask | None) -> _Steady:
    """Compute the steady state on the coarsest grid that meets the tolerance."""
    rubbed: Settled | None = None
    while True:
        terms = course.here()[1]
        answer = vibration(terms, unlocked(course.plain(ratio)), speed=ratio)
        if answer.motion.mechanism.friction:
            answer, rubbed = with_friction(answer, tolerance, course.discretization.fastest)
        error, finer = time_error(answer, course.resolved)
        if finer is None:
            break
        course.level += 1
        if course.level == len(course.grids):
            course.grids.append(finer)
    if error < course.resolved / SPEEDS.coarser_margin:  # start with the coarser grid at the next speed
        course.level = max(course.level - 1, 0)
    growth = float(np.abs(answer.propagation.multipliers).max())
    if growth > 1 + VIBRATION.max_neutral_growth:
        return _Steady(ratio, terms.grid, growth, error, math.nan, None, None)
    answer, reduced = (answer, rubbed.open) if rubbed else corrected(answer, tolerance)
    if errors is None:
        return _Steady(ratio, terms.grid, growth, error, reduced, None, answer.loads)
    measured, left = _errors(_passing(course, ratio), tolerance, error + reduced, errors)
    return _Steady(ratio, terms.grid, growth, error, reduced, measured, answer.loads, left)


def _passing(course: _Course, ratio: float) -> _Course:
    """Return the terms for one speed on the current grid, in the time of this speed."""
    model = course.model
    passing = replace(model, motion_at=lambda times: _passed(model.motion_at(times * ratio), ratio))
    grid = Grid(course.grids[course.level].edges / ratio)
    return _Course(replace(course.discretization, model=passing), [grid])


def _errors(course: _Course, tolerance: float, settled: float, task: _ErrorTask) -> tuple[Reals, float]:
    """Return the errors due to discretization and large displacement, and the remaining change by further steps."""
    answer = vibration(course.here()[1], unlocked(course.plain(1.0)))
    if answer.motion.mechanism.friction:
        answer, _ = with_friction(answer, tolerance, course.discretization.fastest)
    else:
        answer, _ = corrected(answer, tolerance)
    bent, errors = answer.deflection, task.of
    if not answer.problem.terms.kinematics.structure.weights.size:  # no beam bends
        return errors(bent, None, bent, settled, 0.0, 0.0), 0.0
    grid, discretization, finer = answer.problem.terms.grid, course.discretization, None
    begun = answer
    sampler: Callable[[Any], Any] = grid.at_nodes
    forces = settled + force_error(answer)
    if worth_halving(answer.motion.mechanism, len(grid.steps), forces, task.resolved):
        discretization, grid = halved(discretization, grid)
        begun, sampler = vibration_in(discretization, grid), grid.sampler(bent.motion.time)
        loads = resampled(corrected(begun, tolerance)[0].loads, sampler)
        finer = deflection(bent.motion, bent.sections, bent.joints, loads)
    try:
        step, left = steps_to_exact(begun, discretization, SPEEDS.newton_tolerance if task.by_newton else None)
    except MechanismError:
        return errors(bent, finer, None, settled, forces, second_order_error(answer, bent)), 0.0
    return errors(bent, finer, exact_deflection(step.displaced, bent, sampler), settled, forces, left), left


def _passed(base: Motion, ratio: Any) -> Motion:
    """Return the motion of a cycle at another speed, or at several speeds of shape (speeds, 1)."""
    columns = np.broadcast_shapes(np.shape(ratio), base.columns)
    still = base if columns == base.columns else repeated(base, columns)
    drive = {name: getattr(base, name) for name in ("drive", "drive_rate", "drive_acceleration")}
    if still is not base:
        drive = {name: np.broadcast_to(value[:, None], (len(value), *columns)) for name, value in drive.items()}
    return replace(
        still,
        time=base.time / ratio,
        drive=drive["drive"],
        drive_rate=drive["drive_rate"] * ratio,
        drive_acceleration=drive["drive_acceleration"] * ratio**2,
        velocity=still.velocity * ratio,
        angular_velocity=still.angular_velocity * ratio,
        acceleration=still.acceleration * ratio**2,
        turning=still.turning * ratio**2,
    )


def _measured(course: _Course, steady: Sequence[_Steady], measure: Measure, still: Measure) -> dict[float, _Row]:
    """Compute the measures with and without vibration (nan if the steady state is unstable).

    The positions are evenly spaced. Their number is that of the points of the finest grid.
    """
    count = max(len(each.grid.nodes) - 1 for each in steady)
    times = course.grids[0].edges[-1] * np.arange(1, count + 1) / count
    base = checked(course.model.motion_at(times))
    rows: dict[float, _Row] = {}
    for part in design_chunks((len(steady),), count, columns_of(base.mechanism, count)):
        some = steady[part]
        plain = _together(course.model, base, some, still)
        stable = [row for row, each in enumerate(some) if each.loads]
        known = _together(course.model, base, [some[k] for k in stable] or some[:1], measure, bool(stable))
        values = np.full((len(some), *known.shape[1:]), np.nan)
        if stable:
            values[stable] = known
        for row, each in enumerate(some):
            rows[each.ratio] = _Row(
                values[row],
                plain[row],
                each.growth,
                each.time_error,
                each.reduction_error,
                np.full(values.shape[1:], np.nan) if each.errors is None else each.errors,
                each.errors is not None,
                each.open,
            )
    return rows


def _together(model: Model, base: Motion, some: Sequence[_Steady], measure: Measure, vibrating: bool = False) -> Reals:
    """Measure several steady states by one deflection."""
    motion = _passed(base, np.array([[each.ratio] for each in some]))
    loads = []
    if vibrating:
        loads = [resampled(each.loads, each.grid.sampler(base.time)) for each in some if each.loads]
    bent = deflection(motion, model.sections, model.joints, of_several_speeds(loads) if loads else None)

    def alone(number: int) -> Deflection:
        own = loads[number] if loads else None
        return deflection(_passed(base, some[number].ratio), model.sections, model.joints, own)

    return np.moveaxis(measure(bent, alone), -1, 0)
