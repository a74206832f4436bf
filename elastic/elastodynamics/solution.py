"""Vibration of a moving mechanism. Coordinates and time elements are refined until a tolerance is met."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.correction import corrected, with_inertia_of
from elastic.elastodynamics.discretization import (
    Discretization,
    Model,
    MotionAt,
    array_size,
    array_size_per_amplitude,
    checked,
    first_discretization,
    first_grid,
    require_unlocked,
    vibrating_model,
)
from elastic.elastodynamics.equations_of_motion import kinematics, motion_terms
from elastic.elastodynamics.exact_iterate import ExactIterate, Sliding
from elastic.elastodynamics.exact_steps import exact_deflection, has_dry_friction, vibration_with_friction
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import Start, Vibration, vibration
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.time_error import force_error, time_error
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import MechanismError, Motion
from rigid.arrays import Numbers, Reals

TOLERANCE = 1e-4


class Elastodynamic(Struct, frozen=True, eq=False, dict=True):
    """Vibrating mechanism at given positions.

    Attributes
    ----------
    deflection
        All fields, joint forces and drive efforts of the vibrating mechanism; nan if not `stable`. With large
        displacement, the section forces N, V and M include the damping forces, i.e. beta times their rates. With small
        displacement, they do not.
    quasi_static
        Quasi-static deflection (without vibration) at the same positions.
    damping
        Kelvin-Voigt damping, in which default values are replaced by numbers.
    lowest
        Lowest natural frequency over the cycle with locked drives [rad/s]; inf if no link vibrates.
    multipliers
        Floquet multipliers, i.e. factors by which free vibrations grow in a cycle or, without a cycle, in the run,
        complex, shape (2 coordinates,); empty if no link vibrates.
    time_error
        Error due to the finite length of the time elements, relative to the largest displacement.
    reduction_error
        Error due to the finite number of coordinates, relative to the largest displacement.
    vibration
        Vibration in reduced coordinates, or None if no link vibrates.
    discretization
        Discretization of `vibration`, or None if no link vibrates.
    exact
        Iterate for large displacement from which `deflection` was computed, or None for small displacements.
    coarser
        Solution for large displacement in the previous, coarser discretization, or None if there is none. Its
        `deflection` is still the linear one.
    """

    deflection: Deflection
    quasi_static: Deflection
    damping: Damping
    lowest: float
    multipliers: Numbers
    time_error: float
    reduction_error: float
    vibration: Vibration | None = None
    discretization: Discretization | None = None
    exact: ExactIterate | None = None
    coarser: Elastodynamic | None = None

    def __repr__(self) -> str:
        return f"Elastodynamic({self.coordinates} coordinates, {self.elements} elements, growth {self.growth:.3g})"

    @property
    def coordinates(self) -> int:
        """Number of reduced coordinates."""
        return 0 if self.vibration is None else self.vibration.history[0].shape[1]

    @property
    def elements(self) -> int:
        """Number of time elements."""
        return max(len(self.edges) - 1, 0)

    @property
    def edges(self) -> Reals:
        """Starts and ends of the time elements [s]; empty if no link vibrates."""
        return np.zeros(0) if self.vibration is None else self.vibration.problem.terms.grid.edges

    @cached_property
    def force_error(self) -> float:
        """Error in section and joint forces due to time elements, relative to the largest force of the same kind.

        It is larger than `time_error`, because forces depend on accelerations.
        """
        if self.vibration is None:
            return 0.0
        exact = self.exact
        return force_error(self.vibration, (exact.displaced.force, exact.displaced.joints) if exact else None)

    @property
    def discretization_error(self) -> float:
        """Error in displacements due to time elements and reduced coordinates, relative to the largest displacement."""
        return self.time_error + self.reduction_error

    @property
    def bound(self) -> float:
        """Upper bound on the relative discretization error in displacements and forces.

        For a transient it is infinite, because the error estimates may miss errors due to unresolved axial vibration.
        """
        if self.vibration is not None and not self.vibration.cyclic:
            return math.inf
        return max(self.discretization_error, self.force_error)

    def resolved_to(self, tolerance: float) -> Elastodynamic:
        """Set the time tolerance of later refinements to at most `tolerance`. The solution itself does not change."""
        known = self.discretization
        if known is None:
            return self
        return replace(self, discretization=replace(known, time_tolerance=min(known.time_tolerance, tolerance)))

    @property
    def growth(self) -> float:
        """Factor by which the least stable free vibration grows in a cycle or in a run without cycle.

        All vibrations decay if it is below 1.
        """
        return float(np.abs(self.multipliers).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether free vibrations do not grow in a cycle, or grow little in a run without cycle."""
        return bool(VIBRATION.stable(self.growth, self.vibration is None or self.vibration.cyclic))


def elastodynamic(
    motion: Motion,
    motion_at: MotionAt,
    period: float,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
    tolerance: float = TOLERANCE,
    breaks: Reals | None = None,
    static: Deflection | None = None,
) -> Elastodynamic:
    """Compute the steady state of vibrating links over a cycle, at the positions of a motion.

    The model includes the inertia and damping of displacements from the rigid positions, and the geometric stiffness
    due to the forces of the rigid motion. Drives move exactly as prescribed.

    Parameters
    ----------
    motion
        Motion of one design at the requested positions, with their times.
    motion_at
        Function that returns the motion at any instants [s], shape (positions,).
    period
        Period of the cycle [s]. If gears or laws require it, a cycle comprises several turns of a drive.
    sections, joints
        See `deflection`.
    damping
        Kelvin-Voigt beta of all beams and compliant joints [s], or a `Damping`. By default, the damping ratio is 0.01
        at the lowest natural frequency over the cycle.
    tolerance
        Largest accepted discretization error, relative to the largest displacement.
    breaks
        Instants just before discontinuities of drive laws or loads [s], at which time elements end.
    static
        Quasi-static deflection at the requested positions, if known.

    Raises
    ------
    MechanismError
        If the cycle contains a singular position, a block leaves its beam, or friction may lock the mechanism.
    ValueError
        If there are several designs.
    """
    model = vibrating_model(motion_at, motion.time[0], period, sections, joints or {}, damping)
    grid = first_grid(model, float(motion.time[0]), period, breaks)
    return refined_solution(model, motion, grid, tolerance, static=static)


def refined_solution(
    model: Model,
    motion: Motion,
    grid: Grid,
    tolerance: float,
    start: Start | None = None,
    static: Deflection | None = None,
) -> Elastodynamic:
    """Refine time elements, then coordinates, until the solution at the positions of a motion has converged.

    `start` is the function that returns the initial state. If it is None, the result is the steady state, and the
    duration of the grid is the period of the cycle. `static` is the quasi-static deflection at the positions, if known.
    """
    checked(motion)
    quasi_static = static or deflection(motion, model.sections, model.joints)
    if model.cycle is None:
        return Elastodynamic(quasi_static, quasi_static, model.damping, np.inf, np.zeros(0, complex), 0.0, 0.0)
    lowest = float(model.cycle.omega.min())
    discretization = replace(first_discretization(model, tolerance), start=start)
    best: Elastodynamic | None = None
    dry_friction = has_dry_friction(motion.mechanism)
    for _ in range(VIBRATION.max_refinements_with_friction if dry_friction else VIBRATION.max_refinements):
        solved, reduced, grid, grid_error = resolved_in_time(discretization, grid, tolerance)
        given = model.damping, lowest, solved.multipliers, grid_error, reduced, solved, discretization
        found = Elastodynamic(quasi_static, quasi_static, *given)
        if best is None or found.discretization_error < best.discretization_error:  # jumps of loads may increase it
            best = found
        if reduced <= tolerance or not solved.stable or grid_error > discretization.time_tolerance:
            break
        most = VIBRATION.max_entries // array_size_per_amplitude(discretization, grid)
        finer = discretization.finer(reduced, most)
        if finer is None or array_size(finer, grid) > VIBRATION.max_entries:
            break
        discretization = finer
    assert best is not None
    assert best.vibration is not None
    loads = resampled(best.vibration.loads, best.vibration.sampler(motion.time))
    answer = replace(best, deflection=deflection(motion, model.sections, model.joints, loads))
    return answer if answer.stable else with_nan_fields(answer)


def deflection_at(answer: Elastodynamic, motion: Motion) -> Deflection:
    """Return the deflection of the vibrating mechanism at other positions of its motion."""
    plain = answer.quasi_static
    if answer.vibration is None:
        return deflection(motion, plain.sections, plain.joints)
    sampler = answer.vibration.sampler(motion.time)
    if answer.exact is not None:
        return exact_deflection(answer.exact.displaced, replace(plain, motion=motion), sampler)
    return deflection(motion, plain.sections, plain.joints, resampled(answer.vibration.loads, sampler))


def including(neglected: Callable[[Deflection], Deflection], answer: Elastodynamic) -> Elastodynamic:
    """Add to a linear vibration the effect of the inertia of displacements that its model neglects.

    This is a first-order correction, see `with_inertia_of`.

    Parameters
    ----------
    neglected
        Function that returns a deflection together with the neglected displacements that it causes.
    """
    vibration, discretization = answer.vibration, answer.discretization
    if vibration is None or discretization is None:
        return replace(answer, exact=None)
    shaken = with_inertia_of(neglected(vibration.deflection), vibration, discretization.cutoff)
    more = replace(answer, vibration=shaken, exact=None)
    return replace(more, deflection=neglected(deflection_at(more, answer.quasi_static.motion)))


def moved_to(answer: Elastodynamic, quasi_static: Deflection) -> Elastodynamic:
    """Return the same vibration at the positions of another quasi-static deflection."""
    return replace(answer, deflection=deflection_at(answer, quasi_static.motion), quasi_static=quasi_static)


def resolved_in_time(
    discretization: Discretization, grid: Grid, tolerance: float
) -> tuple[Vibration, float, Grid, float]:
    """Refine the time elements until the time error meets the tolerance of the discretization.

    Parameters
    ----------
    tolerance
        Tolerance of the iteration for Coulomb friction, or, without Coulomb friction, of the iterative correction.

    Returns
    -------
    Vibration, error of the iteration or correction, grid, and time error.
    """
    solved: Any = None
    dry_friction = has_dry_friction(discretization.model.structure.mechanism)
    friction_tolerance = VIBRATION.first_friction_tolerance
    least, stalled_count = math.inf, 0
    sliding: Sliding = ()
    while True:
        solved = None  # free memory before the finer solution is computed
        solved = vibration_in(discretization, grid)
        if dry_friction:
            solved, iterate = vibration_with_friction(solved, friction_tolerance, discretization.cutoff, sliding)
        error, finer = time_error(solved, discretization.time_tolerance)
        stalled_count = stalled_count + 1 if 0.5 * least <= error < VIBRATION.max_round_off else 0
        least = min(least, error)
        finer = finer if stalled_count < VIBRATION.patience else None
        if finer is None and not dry_friction:
            return *corrected(solved, tolerance), grid, error
        if (finer is None and friction_tolerance <= tolerance) or (
            dry_friction and iterate.convergence_error > VIBRATION.max_residual_ratio * friction_tolerance
        ):
            return solved, iterate.convergence_error, grid, error
        if dry_friction:
            coarse = min(VIBRATION.first_friction_tolerance, VIBRATION.friction_share * error)
            friction_tolerance = max(tolerance, coarse) if finer else tolerance
            sliding = _interpolated_rates(iterate.sliding, grid, finer or grid)
        grid = finer or grid


def vibration_in(discretization: Discretization, grid: Grid) -> Vibration:
    """Compute the vibration on a given time grid."""
    model, basis = discretization.model, discretization.basis
    motion = checked(model.motion_at(grid.nodes))
    bent = require_unlocked(deflection(motion, model.sections, model.joints))
    kinematics_ = kinematics(model.structure, motion, basis, chosen_points(model.structure.mechanism))
    return bounded(vibration(motion_terms(kinematics_, grid, model.damping), bent, discretization.start))


def bounded(answer: Vibration) -> Vibration:
    """Return the vibration unchanged if it is finite.

    Raises
    ------
    MechanismError
        If it is not finite, usually because a node of the time grid is too close to a singular position.
    """
    lost = ~np.isfinite(answer.history[0]).all(axis=-1)
    if lost.any():
        time = answer.motion.time[1:][lost][0]
        raise MechanismError(f"displacements have no bound from {time:.6g} s on: a position may be nearly singular")
    return answer


def _interpolated_rates(sliding: Sliding, known: Grid, grid: Grid) -> Sliding:
    """Interpolate the sliding rates of joints with friction to the points of another grid."""
    sampler = known.sampler(grid.nodes[1:])
    return tuple((number, sampler(rate), creep) for number, rate, creep in sliding)


def with_nan_fields(answer: Elastodynamic) -> Elastodynamic:
    """Replace the fields of a solution without a steady state by nan."""
    quasi_static = answer.quasi_static
    zeros = (0.0,) * len(quasi_static.motion.structure.joints)
    nan_loads = AddedLoads(np.full((1, *answer.deflection.q.shape[1:]), np.nan, complex), (), (), zeros, zeros)
    return replace(
        answer, deflection=deflection(quasi_static.motion, quasi_static.sections, quasi_static.joints, nan_loads)
    )
