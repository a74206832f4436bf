"""Vibration of a moving mechanism, with coordinates and time elements refined to a tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import (
    Discretization,
    Model,
    checked,
    first_discretization,
    numbers_of,
    numbers_per_amplitude,
    unlocked,
)
from elastic.elastodynamics.equations_of_motion import kinematics, motion_terms
from elastic.elastodynamics.exact_residual import loaded
from elastic.elastodynamics.exact_steps import exact_deflection, has_dry_friction, with_friction
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import Start, Vibration, vibration
from elastic.elastodynamics.settled import Settled, Sliding
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import MechanismError, Motion
from rigid.arrays import Complexes, Flags, Integers, Numbers, Reals

TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Elastodynamic:
    """Vibrating mechanism at given positions.

    Attributes
    ----------
    deflection
        All fields, joint forces and drive efforts of the vibrating mechanism; nan if not `stable`. N, V and M are the
        elastic parts, to which damping adds beta times their rates.
    quasi_static
        Deflection without vibration at the same positions.
    damping
        Damping that was used.
    lowest
        Lowest natural frequency over the cycle with locked drives [rad/s]; inf if no link vibrates.
    multipliers
        Floquet multipliers, i.e. the growth of free vibrations per cycle, complex, shape (2 coordinates,); empty for a
        transient.
    coordinates, elements
        Numbers of amplitudes and of time elements.
    time_error, reduction_error
        Errors due to time elements and due to coordinates, relative to the largest displacement.
    vibration
        Vibration in reduced coordinates, or None if no link vibrates.
    discretization
        Discretization that was used, or None if no link vibrates.
    exact
        Links with large displacement to which the deflection belongs, or None for small displacements.
    """

    deflection: Deflection
    quasi_static: Deflection
    damping: Damping
    lowest: float
    multipliers: Numbers
    coordinates: int
    elements: int
    time_error: float
    reduction_error: float
    vibration: Vibration | None = None
    discretization: Discretization | None = None
    exact: Settled | None = None

    def __repr__(self) -> str:
        return f"Elastodynamic({self.coordinates} coordinates, {self.elements} elements, growth {self.growth:.3g})"

    @property
    def edges(self) -> Reals:
        """Edges of the time elements [s]; empty if no link vibrates."""
        return np.zeros(0) if self.vibration is None else self.vibration.problem.terms.grid.edges

    @cached_property
    def force_error(self) -> float:
        """Error of section and joint forces due to time elements, relative to the largest force of each kind.

        Forces depend on accelerations, so they are less well resolved than displacements.
        """
        if self.vibration is None:
            return 0.0
        exact = self.exact
        return force_error(self.vibration, (exact.displaced.force, exact.displaced.joints) if exact else None)

    @property
    def bound(self) -> float:
        """Bound on the discretization error, which is infinite for a transient, because axial ringing may exceed it."""
        if self.vibration is not None and not self.vibration.cyclic:
            return math.inf
        return max(self.time_error + self.reduction_error, self.force_error)

    def resolved_to(self, tolerance: float) -> Elastodynamic:
        """Return this solution, from which others continue with time elements resolved at least to this tolerance."""
        known = self.discretization
        return replace(self, discretization=replace(known, resolved=min(known.resolved, tolerance))) if known else self

    @property
    def growth(self) -> float:
        """Growth of the least stable free vibration per cycle; it decays if this is below 1."""
        return float(np.abs(self.multipliers).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """True if all free vibrations decay, so that there is a steady state."""
        return self.growth <= 1 + VIBRATION.max_neutral_growth


def settled(
    model: Model,
    motion: Motion,
    grid: Grid,
    tolerance: float,
    start: Start | None = None,
    static: Deflection | None = None,
) -> Elastodynamic:
    """Refine time elements, then coordinates, until the solution at the positions of a motion has converged.

    Without a `start`, the result is the steady state for a cycle with the duration of the grid. `static` is the
    quasi-static deflection, if known.
    """
    checked(motion)
    plain = static or deflection(motion, model.sections, model.joints)
    if model.cycle is None:
        none = np.zeros(0, complex)
        return Elastodynamic(plain, plain, model.damping, np.inf, none, 0, 0, 0.0, 0.0)
    lowest = float(model.cycle.omega.min())
    discretization = replace(first_discretization(model, tolerance), start=start)
    best: Any = None
    for _ in range(
        VIBRATION.max_refinements_with_friction if has_dry_friction(motion.mechanism) else VIBRATION.max_refinements
    ):
        solved, reduced, grid, in_elements = resolved_in_time(discretization, grid, tolerance)
        off = reduced + in_elements
        if best is None or off < best[0]:  # more coordinates may increase the error if loads jump
            best = off, solved, reduced, grid, in_elements, discretization
        unstable = np.abs(solved.multipliers).max(initial=0.0) > 1 + VIBRATION.max_neutral_growth
        finer = (
            None
            if reduced <= tolerance or unstable or in_elements > discretization.resolved
            else discretization.finer(reduced, VIBRATION.max_numbers // numbers_per_amplitude(discretization, grid))
        )
        if finer is None or numbers_of(finer, grid) > VIBRATION.max_numbers:
            break
        discretization = finer
    _, solved, reduced, grid, in_elements, discretization = best
    loads = resampled(solved.loads, solved.sampler(motion.time))
    bent = deflection(motion, model.sections, model.joints, loads)
    size = solved.history[0].shape[1]
    answer = Elastodynamic(
        bent,
        plain,
        model.damping,
        lowest,
        solved.multipliers,
        size,
        len(grid.steps),
        in_elements,
        reduced,
        solved,
        discretization,
    )
    return answer if answer.stable else unanswered(answer)


def deflection_at(answer: Elastodynamic, motion: Motion) -> Deflection:
    """Return the deflection of the vibrating mechanism at other positions of its motion."""
    plain = answer.quasi_static
    if answer.vibration is None:
        return deflection(motion, plain.sections, plain.joints)
    sampler = answer.vibration.sampler(motion.time)
    if answer.exact is not None:
        return exact_deflection(answer.exact.displaced, replace(plain, motion=motion), sampler)
    return deflection(motion, plain.sections, plain.joints, resampled(answer.vibration.loads, sampler))


def moved_to(answer: Elastodynamic, quasi_static: Deflection) -> Elastodynamic:
    """Return the same vibration at the positions of another quasi-static deflection."""
    return replace(answer, deflection=deflection_at(answer, quasi_static.motion), quasi_static=quasi_static)


def resolved_in_time(
    discretization: Discretization, grid: Grid, tolerance: float
) -> tuple[Vibration, float, Grid, float]:
    """Refine time elements to the tolerance, and return vibration, error of the coordinates, grid and time error."""
    resolved: Any = None
    rubs, loose = has_dry_friction(discretization.model.structure.mechanism), VIBRATION.first_friction_tolerance
    least, in_vain = math.inf, 0
    sliding: Sliding = ()
    while True:
        resolved = None  # free the memory for the finer solution
        resolved = vibration_in(discretization, grid)
        if rubs:
            resolved, rubbed = with_friction(resolved, loose, discretization.fastest, sliding)
        error, finer = time_error(resolved, discretization.resolved)
        in_vain = in_vain + 1 if 0.5 * least <= error < VIBRATION.max_round_off else 0
        least = min(least, error)
        finer = finer if in_vain < VIBRATION.patience else None
        if finer is None and not rubs:
            return *corrected(resolved, tolerance), grid, error
        if (finer is None and loose <= tolerance) or (rubs and rubbed.open > VIBRATION.max_residual_ratio * loose):
            return resolved, rubbed.open, grid, error
        if rubs:
            loose = (
                max(tolerance, min(VIBRATION.first_friction_tolerance, VIBRATION.friction_share * error))
                if finer
                else tolerance
            )
            sliding = _sampled(rubbed.sliding, grid, finer or grid)
        grid = finer or grid


def vibration_in(discretization: Discretization, grid: Grid) -> Vibration:
    """Compute the vibration on a given time grid."""
    model, basis = discretization.model, discretization.basis
    motion = checked(model.motion_at(grid.nodes))
    bent = unlocked(deflection(motion, model.sections, model.joints))
    kinds = kinematics(model.structure, motion, basis, chosen_points(model.structure.mechanism))
    return bounded(vibration(motion_terms(kinds, grid, model.damping), bent, discretization.start))


def bounded(answer: Vibration) -> Vibration:
    """Return the vibration if it is finite.

    Raises
    ------
    MechanismError
        If it is unbounded, usually because a node of the time grid is too close to a singular position.
    """
    lost = ~np.isfinite(answer.history[0]).all(axis=-1)
    if lost.any():
        time = answer.motion.time[1:][lost][0]
        raise MechanismError(f"it has no bound from {time:.6g} s on, as near a singular position")
    return answer


def _sampled(sliding: Sliding, known: Grid, grid: Grid) -> Sliding:
    """Interpolate the rates of joints with friction to the points of another grid."""
    sampler = known.sampler(grid.nodes[1:])
    return tuple((number, sampler(rate), creep) for number, rate, creep in sliding)


def time_error(resolved: Vibration, tolerance: float) -> tuple[float, Grid | None]:
    """Return the error due to time elements, and a finer grid if it exceeds the tolerance (otherwise None).

    The error is relative to the largest displacement. The shortest elements are ignored, because a jump of the loads
    remains a jump in any element.
    """
    grid = resolved.problem.terms.grid
    error = np.where(_counted(grid), VIBRATION.time_error_ratio * resolved.unresolved, 0.0)
    if error.max() <= tolerance or len(error) > VIBRATION.max_elements:
        return float(error.max()), None
    aim = VIBRATION.refined_error * tolerance
    parts = np.clip(np.ceil((error / aim) ** (1 / VIBRATION.order)), 1, VIBRATION.max_parts).astype(int)
    return float(error.max()), grid.divided(_graded(grid.steps, parts))


def force_error(vibration: Vibration, forces: tuple[Complexes, Complexes] | None = None) -> float:
    """Return the error of section and joint forces due to time elements, relative to the largest force of each kind.

    `forces` are given at the nodes, shape (nodes, ...), by default those of the vibration.
    """
    grid = vibration.problem.terms.grid
    if forces is None:
        known = loaded(vibration, vibration.deflection)
        forces = known.force, known.joints
    kinds = [values[1:].reshape(len(values) - 1, -1) for values in forces]
    tails = [grid.tail(each, np.abs(each).max(initial=0.0)) for each in kinds if each.size]
    return VIBRATION.time_error_ratio * max(
        (float(tail[_counted(grid)].max(initial=0.0)) for tail in tails), default=0.0
    )


def _counted(grid: Grid) -> Flags:
    """Return for each element whether it is long enough to be divided."""
    return grid.steps > VIBRATION.min_step * np.ptp(grid.edges)


def _graded(steps: Reals, parts: Integers) -> Integers:
    """Increase the number of parts of elements that follow a much shorter, divided element.

    Otherwise, vibration that is excited in the short element would be damped in the next, coarse one, and would be
    resolved only after further refinements.
    """
    graded, longest = parts.copy(), math.inf
    for number, step in enumerate(steps):
        graded[number] = max(parts[number], min(math.ceil(step / longest), VIBRATION.max_parts**2))
        longest = VIBRATION.max_step_ratio * (step / graded[number] if parts[number] > 1 else longest)
    return graded


def unanswered(answer: Elastodynamic) -> Elastodynamic:
    """Replace the fields of a solution without a steady state by nan."""
    nothing = AddedLoads(np.full((1, *answer.deflection.q.shape[1:]), np.nan, complex), (), (), *_still(answer))
    own = answer.quasi_static
    return replace(answer, deflection=deflection(own.motion, own.sections, own.joints, nothing))


def _still(found: Elastodynamic) -> tuple[Any, Any]:
    zeros = (0.0,) * len(found.deflection.motion.structure.joints)
    return zeros, zeros
