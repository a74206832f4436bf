"""Steady state of the vibrating mechanism at one of many drive speeds, and its errors."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import Discretization, checked, halved, require_unlocked, worth_halving
from elastic.elastodynamics.equations_of_motion import MotionTerms, Problem, kinematics, motion_terms, problem
from elastic.elastodynamics.exact_iterate import ExactIterate
from elastic.elastodynamics.exact_steps import exact_deflection, vibration_with_friction
from elastic.elastodynamics.geometrically_exact import steps_to_exact
from elastic.elastodynamics.large_displacement import second_order_error
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import vibration
from elastic.elastodynamics.solution import vibration_in
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.time_elements import propagation
from elastic.elastodynamics.time_error import force_error, time_error
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import MechanismError, Motion
from rigid.arrays import Reals
from rigid.kinematics import repeated

Errors = Callable[[Deflection, Deflection | None, Deflection | None, float, float, float], Reals]
"""Function that returns the errors of the measures of a solution.

Its arguments are:

1. the solution,
2. the solution in a finer discretization, or None if unknown,
3. the solution with large displacement, or None if unknown,
4. a bound on the convergence error in displacements,
5. a bound on the convergence error of forces,
6. the remaining effect of large displacement.
"""


class GridHierarchy:
    """Terms of the equations of motion on successively finer time grids. They are computed when they are needed.

    `level` is the index of the current grid.
    """

    def __init__(self, discretization: Discretization, grids: list[Grid]) -> None:
        self.discretization = discretization
        self.model, self.basis = discretization.model, discretization.basis
        self.time_tolerance = discretization.time_tolerance
        self.grids = grids
        self.known: dict[int, tuple[Motion, MotionTerms]] = {}
        self.level = len(grids) - 1

    def current(self) -> tuple[Motion, MotionTerms]:
        """Return the motion at the nodes of the current grid, and the terms of the equations."""
        if self.level not in self.known:
            grid, chosen = self.grids[self.level], chosen_points(self.model.structure.mechanism)
            motion = checked(self.model.motion_at(grid.nodes))
            kinematics_ = kinematics(self.model.structure, motion, self.basis, chosen)
            self.known[self.level] = motion, motion_terms(kinematics_, grid, self.model.damping)
        return self.known[self.level]

    def quasi_static(self, ratio: float) -> Deflection:
        """Return the quasi-static deflection at a relative speed, at the nodes of the current grid."""
        return deflection(motion_at_speed(self.current()[0], ratio), self.model.sections, self.model.joints)

    def problem(self, ratio: float) -> Problem:
        """Return the equations of motion at a relative speed on the current grid."""
        return problem(self.current()[1], require_unlocked(self.quasi_static(ratio)), ratio)

    def growth(self, ratio: float) -> float:
        """Return the factor by which the least stable free vibration grows per cycle, on the finest grid."""
        self.level = len(self.grids) - 1
        posed = self.problem(ratio)
        return float(np.abs(propagation(posed.terms.grid, posed.equations).multipliers).max())


class SteadyState(Struct, frozen=True, eq=False):
    """Steady state at one relative speed.

    `errors` are the errors of the measures, or None if they were not computed. `loads` are the loads of the vibration
    at the points of the grid, or None if the steady state is unstable. `remaining_change` is an estimate of the effect
    of large displacement that `errors` do not yet include, relative to the largest displacement.
    """

    ratio: float
    grid: Grid
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals | None
    loads: AddedLoads | None
    remaining_change: float = 0.0


class ErrorTask(Struct, frozen=True, eq=False):
    """Function that returns the errors of the measures, with settings.

    For `resolved` see `SpeedSolutions`. `by_newton` permits Newton's method for the effect of large displacement.
    """

    function: Errors
    resolved: float
    by_newton: bool = False


def steady_state(hierarchy: GridHierarchy, ratio: float, tolerance: float, errors: ErrorTask | None) -> SteadyState:
    """Compute the steady state at a relative speed, starting on the current grid and refining it if necessary.

    `errors` is None if the errors of the measures are not required.
    """
    iterate: ExactIterate | None = None
    while True:
        terms = hierarchy.current()[1]
        answer = vibration(terms, require_unlocked(hierarchy.quasi_static(ratio)), speed=ratio)
        if answer.motion.mechanism.friction:
            answer, iterate = vibration_with_friction(answer, tolerance, hierarchy.discretization.cutoff)
        error, finer = time_error(answer, hierarchy.time_tolerance)
        if finer is None:
            break
        hierarchy.level += 1
        if hierarchy.level == len(hierarchy.grids):
            hierarchy.grids.append(finer)
    if error < hierarchy.time_tolerance / SPEEDS.coarser_margin:  # start with a coarser grid at the next speed
        hierarchy.level = max(hierarchy.level - 1, 0)
    growth = float(np.abs(answer.propagation.multipliers).max())
    if not VIBRATION.stable(growth):
        return SteadyState(ratio, terms.grid, growth, error, math.nan, None, None)
    answer, reduced = (answer, iterate.convergence_error) if iterate else corrected(answer, tolerance)
    if errors is None:
        return SteadyState(ratio, terms.grid, growth, error, reduced, None, answer.loads)
    measured, left = _errors(_at_one_speed(hierarchy, ratio), tolerance, error + reduced, errors)
    return SteadyState(ratio, terms.grid, growth, error, reduced, measured, answer.loads, left)


def _at_one_speed(hierarchy: GridHierarchy, ratio: float) -> GridHierarchy:
    """Return a hierarchy with only the current grid, in which relative speed 1 means the speed `ratio`."""
    model = hierarchy.model
    at_speed = replace(model, motion_at=lambda times: motion_at_speed(model.motion_at(times * ratio), ratio))
    grid = Grid(hierarchy.grids[hierarchy.level].edges / ratio)
    return GridHierarchy(replace(hierarchy.discretization, model=at_speed), [grid])


def _errors(
    hierarchy: GridHierarchy, tolerance: float, convergence_error: float, task: ErrorTask
) -> tuple[Reals, float]:
    """Return the errors of the measures, and the effect of large displacement that they do not include."""
    answer = vibration(hierarchy.current()[1], require_unlocked(hierarchy.quasi_static(1.0)))
    if answer.motion.mechanism.friction:
        answer, _ = vibration_with_friction(answer, tolerance, hierarchy.discretization.cutoff)
    else:
        answer, _ = corrected(answer, tolerance)
    bent, errors = answer.deflection, task.function
    if not answer.problem.terms.kinematics.structure.weights.size:  # no beam bends
        return errors(bent, None, bent, convergence_error, 0.0, 0.0), 0.0
    grid, discretization, finer = answer.problem.terms.grid, hierarchy.discretization, None
    start = answer
    sampler: Callable[[Any], Any] = grid.with_start
    forces = convergence_error + force_error(answer)
    if worth_halving(answer.motion.mechanism, len(grid.steps), answer.history[0].shape[1], forces, task.resolved):
        discretization, grid = halved(discretization, grid)
        start, sampler = vibration_in(discretization, grid), grid.sampler(bent.motion.time)
        loads = resampled(corrected(start, tolerance)[0].loads, sampler)
        finer = deflection(bent.motion, bent.sections, bent.joints, loads)
    try:
        step, left = steps_to_exact(start, discretization, SPEEDS.newton_tolerance if task.by_newton else None)
    except MechanismError:
        return errors(bent, finer, None, convergence_error, forces, second_order_error(answer, bent)), 0.0
    return errors(bent, finer, exact_deflection(step.displaced, bent, sampler), convergence_error, forces, left), left


def motion_at_speed(base: Motion, ratio: Any) -> Motion:
    """Return the motion of a cycle at another relative speed. For several speeds, `ratio` has the shape (speeds, 1)."""
    columns = np.broadcast_shapes(np.shape(ratio), base.columns)
    motion = base if columns == base.columns else repeated(base, columns)
    drive = {name: getattr(base, name) for name in ("drive", "drive_rate", "drive_acceleration")}
    if motion is not base:
        drive = {name: np.broadcast_to(value[:, None], (len(value), *columns)) for name, value in drive.items()}
    return replace(
        motion,
        time=base.time / ratio,
        drive=drive["drive"],
        drive_rate=drive["drive_rate"] * ratio,
        drive_acceleration=drive["drive_acceleration"] * ratio**2,
        velocity=motion.velocity * ratio,
        angular_velocity=motion.angular_velocity * ratio,
        acceleration=motion.acceleration * ratio**2,
        turning=motion.turning * ratio**2,
    )
