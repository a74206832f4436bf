"""How the vibrating mechanism answers to the speed of its drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.equations_of_motion import MotionTerms, Problem, kinematics, motion_terms, problem
from elastic.elastodynamics.exact_steps import exact_deflection, with_friction
from elastic.elastodynamics.geometrically_exact import steps_to_exact
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import vibration
from elastic.elastodynamics.settled import Settled
from elastic.elastodynamics.solution import (
    NEUTRAL,
    ROUNDS,
    Discretization,
    Model,
    MotionAt,
    checked,
    first_discretization,
    halved,
    time_error,
    unlocked,
    vibrating_model,
    vibration_in,
    worth_halving,
)
from elastic.elastodynamics.speed_scan import SpeedScan, speed_scan
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.theory_error import second_order_error
from elastic.elastodynamics.time_elements import propagation
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import of_several_speeds, resampled
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import MechanismError, Motion
from rigid.arrays import Flags, Reals
from rigid.chunks import columns_of, design_chunks
from rigid.kinematics import repeated

ELEMENTS = 12
MANY, EVERY = 8, 3  # of so many speeds asked for at once every third is asked for its errors
SIDE_BY_SIDE = 128  # speeds whose loads are kept at a time
TOLERANCE = 2e-3
NEWTON_TO = 0.1  # share of the largest displacement to which Newton's method settles large displacement for an error
COARSER = 30.0  # times as fine as asked, from where the next speed may do with the grid before
MULTIPLES = 6  # of the cycle's frequency, that are looked at where they meet a natural one

Measure = Callable[[Deflection], Any]
Errors = Callable[[Deflection, Deflection | None, Deflection | None, float, float], Reals]
"""Errors of the measures of an answer: of it, of it discretized finer, of that with large displacement, None where
these are not known, of the share to which it has settled, and of that which large displacement may change besides."""
LOOK, SLOWEST = 0.01, 0.3  # shares of a speed: apart, and down to which, stability is looked at


@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Answers at several speeds, each so many times that of the motion given.

    Attributes
    ----------
    ratio
        Speeds, shape (speeds,).
    values, quasi_static
        What was measured with and without vibration, shape (speeds, ...); nan where the steady state is unstable.
    growth
        Of the least stable free vibration over a cycle, shape (speeds,).
    time_error, reduction_error
        How far the answers may be from settled in time and in the coordinates, as `Elastodynamic` has them, shape
        (speeds,); the latter nan where the steady state is unstable.
    errors
        Of the values, shape (speeds, ...); nan where nobody told, or the steady state is unstable. Where many speeds
        are asked for, as shares of the values they are those on the line between every third.
    damping
        That was taken.
    omega
        Natural frequencies at some positions of the cycle, the drives held: the lowest [rad/s], shape (positions,).
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
        """How far the answers may be from settled altogether, of the largest displacement, shape (speeds,)."""
        return self.time_error + self.reduction_error

    @property
    def stable(self) -> Flags:
        """Where all free vibrations die out, bool, shape (speeds,)."""
        return self.growth <= 1 + NEUTRAL


def speed_map(
    motion_at: MotionAt,
    period: float,
    ratios: Sequence[float],
    sections: Sequence[Section],
    measure: Measure,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
    tolerance: float = TOLERANCE,
) -> SpeedMap:
    """Steady states at many speeds of the drives; positions, and terms that depend on them alone, are found once.

    Grids and coordinates are shared by the speeds and refined where one of them asks for it, as for a single one.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        As for `elastodynamic`, at the speed of ratio 1; the cycle begins at time 0.
    ratios
        Speeds, above 0.
    measure
        What is asked of a deflection at positions all over the cycle, in their order, the last that of the cycle's
        start. It is given that of several speeds at once, whose columns are (speeds, positions), and returns shape
        (..., speeds): reduced over the positions, the last axis.
    tolerance
        How far the answers may be from settled, as a share of the largest displacement.

    Raises
    ------
    MechanismError, ValueError
        As for `elastodynamic`; nothing that vibrates; a speed that is not above 0.
    """
    answers = SpeedAnswers(motion_at, period, sections, measure, joints, damping, tolerance)
    answers.find(ratios)
    return answers.map(ratios)


class SpeedAnswers:
    """Steady states at speeds that are asked for one after the other; see `speed_map`.

    `still` is measured of the answers without vibration, the same as of the others where left out; `errors` tells
    those of what is measured; `on_speed` is called with how many speeds are answered, and of how many;
    `least_damping` is the least damping ratio of a natural mode: half the relative width of its peaks.
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
    ) -> None:
        model = vibrating_model(motion_at, 0.0, period, sections, joints or {}, damping)
        if model.cycle is None:
            raise ValueError("nothing vibrates: all beams and joints are rigid or without mass")
        self.damping, self.omega = model.damping, model.cycle.omega
        betas = [*model.damping.beams[model.damping.beams > 0], *([model.damping.joints] * (model.damping.joints > 0))]
        self.least_damping = float(min(betas, default=0.0) * self.omega.min() / 2)
        self._measure, self._still, self._errors, self._tolerance = measure, still or measure, errors, tolerance
        self._on_speed = on_speed or (lambda done, of: None)
        grids = [Grid(np.linspace(0.0, period, ELEMENTS + 1))]
        self._course = _Course(first_discretization(model, tolerance), grids)
        self._rows: dict[float, _Row] = {}

    def find(self, ratios: Sequence[float]) -> None:
        """Find the answers at more speeds, refining the discretization for those at which they have not settled."""
        if not all(ratio > 0 for ratio in ratios):
            raise ValueError(f"speeds from {min(ratios):g}, expected above 0")
        left = sorted({float(ratio) for ratio in ratios} - self._rows.keys())
        for _ in range(ROUNDS):
            course, resolved = self._course, self._course.resolved
            for first in range(0, len(left), SIDE_BY_SIDE):
                part = left[first : first + SIDE_BY_SIDE]
                every = EVERY if len(part) > MANY else 1
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
        """Measure the errors at a known speed anew if a few steps left large displacement open: by Newton's method.

        Return whether they are new.
        """
        row = self._rows[ratio]
        if self._errors is None or row.growth > 1 + NEUTRAL or (row.told and not row.open):
            return False
        steady = _at_speed(self._course, ratio, self._tolerance, self._errors, by_newton=True)
        assert steady.errors is not None
        self._rows[ratio] = replace(row, errors=steady.errors, told=True, open=0.0)
        return True

    def map(self, ratios: Sequence[float] | None = None) -> SpeedMap:
        """The answers at all speeds that are known, or at some of these."""
        known = sorted(self._rows) if ratios is None else [float(ratio) for ratio in ratios]
        rows = [self._rows[ratio] for ratio in known]
        parts = {name: np.array([getattr(row, name) for row in rows]) for name in _Row.__match_args__}
        gaps = (parts["growth"] <= 1 + NEUTRAL) & np.array([not row.told for row in rows], bool)
        told = sorted(ratio for ratio, row in self._rows.items() if row.told)
        if gaps.any() and told:
            shares = [_share(self._rows[ratio].errors, self._rows[ratio].values) for ratio in told]
            parts["errors"][gaps] = parts["values"][gaps] * _on_line(np.array(known)[gaps], told, np.array(shares))
        del parts["told"], parts["open"]
        return SpeedMap(np.array(known), **parts, damping=self.damping, omega=self.omega)

    def stable(self, ratio: float) -> bool:
        """Whether the steady state at a speed comes about."""
        return self._course.growth(ratio) <= 1 + NEUTRAL

    def scan(self) -> SpeedScan:
        """A close look at the speeds between the least and the greatest one that are known, on the finest grid."""
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
    """Speed of the drives below which all free vibrations die out, of a cycle that is unstable at the speed of ratio 1.

    Looked at is every `LOOK` of the speed down to `SLOWEST`; ranges that are narrower are not seen. Between the last
    two the border is found by bisection.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        As for `elastodynamic`.

    Returns
    -------
    Ratio to the speed, to `LOOK`/16; nan where the slowest is unstable too.
    """
    answers = SpeedAnswers(motion_at, period, sections, _nothing, joints, damping)
    answers.find([1.0])
    looked_at = np.arange(1.0, SLOWEST, -LOOK)
    unstable = [float(ratio) for ratio in looked_at if not answers.stable(float(ratio))]
    if not unstable or unstable[-1] == looked_at[-1]:
        return math.nan if unstable else 1.0
    low, high = unstable[-1] - LOOK, unstable[-1]
    while high - low > LOOK / 16:
        middle = (low + high) / 2
        low, high = (middle, high) if answers.stable(middle) else (low, middle)
    return low


def _nothing(bent: Deflection) -> Reals:
    return np.zeros((1, *bent.motion.columns[:-1]))


def critical_speeds(omega: Reals, multiples: int = MULTIPLES) -> dict[int, tuple[float, float]]:
    """Ranges of speed in which a multiple of the cycle's frequency runs through a natural frequency.

    Parameters
    ----------
    omega
        Natural frequencies over the cycle [rad/s], of one mode, as `SpeedMap.omega` has them, shape (positions,).
    multiples
        From 1 to this.

    Returns
    -------
    Per multiple the least and the greatest angular frequency of the cycle [rad/s].

    Examples
    --------
    >>> critical_speeds([600.0, 900.0], 2)
    {1: (600.0, 900.0), 2: (300.0, 450.0)}
    """
    least, most = float(np.min(omega)), float(np.max(omega))
    return {n: (least / n, most / n) for n in range(1, multiples + 1)}


@dataclass(frozen=True, eq=False)
class _Row:
    """Entry of a map for one speed; `open` is the share that steps towards large displacement left open."""

    values: Reals
    quasi_static: Reals
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals
    told: bool
    open: float


def _share(errors: Any, values: Any) -> Reals:
    """Errors as shares of values; zero where a value is."""
    share: Reals = np.divide(errors, values, out=np.zeros_like(values), where=values > 0.0)
    return share


def _on_line(at: Reals, known: Sequence[float], values: Reals) -> Reals:
    """Values of shape (known, rows) on the lines between those known, shape (at, rows)."""
    return np.stack([np.interp(at, known, column) for column in values.T], axis=-1)


class _Course:
    """Terms of the equations of motion by positions, on grids each finer than the one before, computed on demand."""

    def __init__(self, discretization: Discretization, grids: list[Grid]) -> None:
        self.discretization = discretization
        self.model, self.basis, self.resolved = discretization.model, discretization.basis, discretization.resolved
        self.grids = grids
        self.known: dict[int, tuple[Motion, MotionTerms]] = {}
        self.level = len(grids) - 1

    def here(self) -> tuple[Motion, MotionTerms]:
        """The motion at the nodes of the grid of this level, and the terms."""
        if self.level not in self.known:
            grid, chosen = self.grids[self.level], chosen_points(self.model.structure.mechanism)
            motion = checked(self.model.motion_at(grid.nodes))
            kinds = kinematics(self.model.structure, motion, self.basis, chosen)
            self.known[self.level] = motion, motion_terms(kinds, grid, self.model.damping)
        return self.known[self.level]

    def plain(self, ratio: float) -> Deflection:
        """The quasi-static answer at a speed, at the nodes."""
        return deflection(_passed(self.here()[0], ratio), self.model.sections, self.model.joints)

    def problem(self, ratio: float) -> Problem:
        """Equations of motion at a speed."""
        return problem(self.here()[1], unlocked(self.plain(ratio)), ratio)

    def growth(self, ratio: float) -> float:
        """Of the least stable free vibration over a cycle."""
        self.level = len(self.grids) - 1
        posed = self.problem(ratio)
        return float(np.abs(propagation(posed.terms.grid, posed.equations).multipliers).max())


@dataclass(frozen=True, eq=False)
class _Steady:
    """The steady state at one speed, and on its grid the vibration's loads; none if it is unstable."""

    ratio: float
    grid: Grid
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals | None
    loads: AddedLoads | None
    open: float = 0.0


def _at_speed(
    course: _Course, ratio: float, tolerance: float, errors: Errors | None, by_newton: bool = False
) -> _Steady:
    """On the coarsest of the grids on which the elements leave no more open than asked."""
    rubbed: Settled | None = None
    while True:
        terms = course.here()[1]
        answer = vibration(terms, unlocked(course.plain(ratio)), speed=ratio)
        if answer.motion.mechanism.friction:
            answer, rubbed = with_friction(answer, tolerance, course.discretization.fastest_inertia)
        error, finer = time_error(answer, course.resolved)
        if finer is None:
            break
        course.level += 1
        if course.level == len(course.grids):
            course.grids.append(finer)
    if error < course.resolved / COARSER:  # the next speed may do with less
        course.level = max(course.level - 1, 0)
    growth = float(np.abs(answer.propagation.multipliers).max())
    if growth > 1 + NEUTRAL:
        return _Steady(ratio, terms.grid, growth, error, math.nan, None, None)
    answer, reduced = (answer, rubbed.open) if rubbed else corrected(answer, tolerance)
    if errors is None:
        return _Steady(ratio, terms.grid, growth, error, reduced, None, answer.loads)
    told, left = _errors(_passing(course, ratio), tolerance, error + reduced, errors, by_newton)
    return _Steady(ratio, terms.grid, growth, error, reduced, told, answer.loads, left)


def _passing(course: _Course, ratio: float) -> _Course:
    """The terms of one speed, in its own time, on the grid of this level."""
    model = course.model
    passing = replace(model, motion_at=lambda times: _passed(model.motion_at(times * ratio), ratio))
    grid = Grid(course.grids[course.level].edges / ratio)
    return _Course(replace(course.discretization, model=passing), [grid])


def _errors(course: _Course, tolerance: float, settled: float, errors: Errors, by_newton: bool) -> tuple[Reals, float]:
    """Errors of the measures of an answer at the points of its grid, and what large displacement leaves open.

    They are those of a single answer: from the finer discretization, and from large displacement.
    """
    answer = vibration(course.here()[1], unlocked(course.plain(1.0)))
    if answer.motion.mechanism.friction:
        answer, _ = with_friction(answer, tolerance, course.discretization.fastest_inertia)
    else:
        answer, _ = corrected(answer, tolerance)
    bent = answer.deflection
    if not answer.problem.terms.kinematics.structure.weights.size:  # no beam bends
        return errors(bent, None, bent, settled, 0.0), 0.0
    grid, discretization, finer = answer.problem.terms.grid, course.discretization, None
    begun = answer
    sampler: Callable[[Any], Any] = grid.at_nodes
    if worth_halving(answer.motion.mechanism, len(grid.steps)):
        discretization, grid = halved(discretization, grid)
        begun, sampler = vibration_in(discretization, grid), grid.sampler(bent.motion.time)
        loads = resampled(corrected(begun, tolerance)[0].loads, sampler)
        finer = deflection(bent.motion, bent.sections, bent.joints, loads)
    try:
        step, left = steps_to_exact(begun, discretization, NEWTON_TO if by_newton else None)
    except MechanismError:
        return errors(bent, finer, None, settled, second_order_error(answer, bent)), 0.0
    return errors(bent, finer, exact_deflection(step.displaced, bent, sampler), settled, left), left


def _passed(base: Motion, ratio: Any) -> Motion:
    """The same cycle at another speed, or at several of shape (speeds, 1): rates go with it, accelerations twice."""
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
    """Measures with and without vibration; nan where the steady state is unstable.

    At as many positions, evenly in time, as the finest of the grids has points.
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
    """Measures of several steady states in one deflection."""
    motion = _passed(base, np.array([[each.ratio] for each in some]))
    if not vibrating:
        return np.moveaxis(measure(deflection(motion, model.sections, model.joints)), -1, 0)
    loads = [resampled(each.loads, each.grid.sampler(base.time)) for each in some if each.loads]
    bent = deflection(motion, model.sections, model.joints, of_several_speeds(loads))
    return np.moveaxis(measure(bent), -1, 0)
