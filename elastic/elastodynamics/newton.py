"""Newton's method for the exact equations of links with large displacement, with load steps if necessary.

Each step solves the linear equations of small vibrations about the displaced links (the operator). The mass matrix of
the operator includes the foreshortening of rotated beams. The geometric stiffness of the operator depends on the
current section forces. Before each step, the section forces are iterated to equilibrium at every instant, with constant
inertia forces. In fast motion, a step may correct only the reduced coordinates, and keep the residual response (see
`stepped`). If the steps diverge, the loads of the rigid motion are increased from zero. Each solution is then the start
for the next load. The derivation is in docs/theory.md.
"""

from functools import partial

import numpy as np
from msgspec.structs import replace

from elastic.elastodynamics.displaced_links import Displaced, exact_loads
from elastic.elastodynamics.equations_of_motion import Kinematics, motion_terms, problem
from elastic.elastodynamics.exact_iterate import TINY, ExactIterate, compared_displacements
from elastic.elastodynamics.exact_residual import (
    DeflectionState,
    ResidualResponse,
    ResidualState,
    deflection_state,
    from_linear,
    mixed,
    residual_state,
    stepped,
    summed,
    with_updated_foreshortening,
)
from elastic.elastodynamics.exact_settings import EXACT
from elastic.elastodynamics.foreshortening import foreshortening
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.time_elements import propagation
from elastic.solution import Deflection
from rigid.arrays import Complexes


def solve_by_newton(linear: Vibration, tolerance: float, cutoff: float, guess: Displaced | None) -> ExactIterate | None:
    """Solve for links with large displacement (displaced links) by Newton's method, or return None if it fails.

    Parameters
    ----------
    linear, tolerance, cutoff
        See `exact_steps.solve_exact`.
    guess
        Displaced links from which the method starts. If `guess` is None, or the method diverges, the loads are
        increased from zero.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        rigid_loads_state = deflection_state(linear, linear.quasi_static)
        cutoff = EXACT.newton_cutoff_ratio * cutoff
        if guess is not None:
            iterate = _at_load_level(_with_foreshortening(guess), 1.0, rigid_loads_state, tolerance, cutoff)
            if iterate is not None and (
                iterate.relative_change < EXACT.partial_load_tolerance or guess.foreshortening is not None
            ):
                return iterate
        return _loaded_in_steps(_with_foreshortening(from_linear(linear)), rigid_loads_state, tolerance, cutoff)


def _with_foreshortening(now: Displaced) -> Displaced:
    """Return displaced links with separate foreshortening.

    The residual response of links without separate foreshortening includes foreshortening. It is therefore set to zero.
    """
    return now if now.foreshortening is not None else without_residual(now)


def without_residual(now: Displaced) -> Displaced:
    """Set the residual response of displaced links to zero, and compute the foreshortening again."""
    return with_new_foreshortening(replace(now, residual=_scaled_residual(now, 0.0)))


def _scaled(now: Displaced, share: float) -> Displaced:
    """Multiply the displacements and forces of displaced links by the factor `share`."""
    x, x1, x2 = (share * part for part in now.history)
    forces = {name: share * getattr(now, name) for name in ("force", "joints", "moments")}
    return with_updated_foreshortening(
        replace(now, history=(x, x1, x2), residual=_scaled_residual(now, share), **forces)
    )


def _scaled_residual(now: Displaced, share: float) -> ResidualResponse:
    moved = now.residual.moved @ np.array([[share]])
    return replace(now.residual, moved=moved, forces=share * now.residual.forces)


def _loaded_in_steps(
    first: Displaced, rigid_loads_state: DeflectionState, tolerance: float, cutoff: float
) -> ExactIterate | None:
    """Solve with loads that increase from zero to full load, or return None if the smallest load step fails."""
    share, step = 0.0, EXACT.first_load_share
    now, before = _scaled(first, 0.0), None
    while step >= EXACT.min_load_step:
        following = min(1.0, share + step)
        guess = _scaled(first, following) if before is None else _extrapolated(before, (share, now), following)
        level_tolerance = tolerance if following == 1.0 else EXACT.partial_load_tolerance
        iterate = _at_load_level(guess, following, rigid_loads_state, level_tolerance, cutoff)
        if iterate is not None and following == 1.0 and iterate.convergence_error < EXACT.newton_from:
            return iterate
        if iterate is None or not iterate.relative_change < EXACT.partial_load_tolerance:
            step /= 2
            continue
        before, share, now = (share, now), following, iterate.displaced
        if iterate.steps <= EXACT.quick_steps:
            step *= EXACT.load_step_growth
    return None


def _extrapolated(before: tuple[float, Displaced], last: tuple[float, Displaced], share: float) -> Displaced:
    """Extrapolate displaced links linearly from two load levels to the load level `share`.

    `before` and `last` each contain a load level and the links at this level.
    """
    reach = (share - last[0]) / (last[0] - before[0])
    return summed([before[1], last[1]], np.array([-reach, 1.0 + reach]))


def _at_load_level(
    guess: Displaced, share: float, rigid_loads_state: DeflectionState, tolerance: float, cutoff: float
) -> ExactIterate | None:
    """Solve under the fraction `share` of the loads of the rigid motion.

    Return the iterate that meets the tolerance, or else the one with the smallest sum of errors. The sum compares
    iterates that differ only in their smaller errors. Return None if the first step fails.
    """
    now, lowest, lowest_before, stalled_count = guess, np.inf, np.inf, 0
    operator: Vibration | None = None
    best: ExactIterate | None = None
    last: ExactIterate | None = None
    separate = False
    similar_steps: list[tuple[Displaced, Complexes]] = []  # with the same operator and the same kind of correction
    for count in range(1, EXACT.max_newton_steps + 1):
        try:
            state = _with_equilibrium_forces(now, share, rigid_loads_state, tolerance)
            if operator is None:
                operator, similar_steps = tangent(state.now, state.bent), []
            after = stepped(state, operator, partial(operator.response_to, often=True), cutoff, separately=True)
        except np.linalg.LinAlgError:
            break
        change = compared_displacements(after.moved) - compared_displacements(state.now.moved)
        residual_now = compared_displacements(state.change)
        iterate = ExactIterate(state.now, change, residual_now, count, force_residual=state.force_residual)
        if share == 1.0 and iterate.convergence_error <= tolerance:
            return iterate
        lowest = min(lowest, iterate.convergence_error)
        best = iterate if best is None or sum(iterate.errors) < sum(best.errors) else best
        if last is not None and share == 1.0:
            unchanged = _is_unchanged(iterate, last, tolerance)
            if _is_filtered(iterate, last) or (unchanged and not separate):
                stalled_count += 1
            elif not unchanged:
                stalled_count = 0
        done = share < 1.0 and iterate.relative_change <= tolerance
        diverged = not iterate.convergence_error < EXACT.max_growth * lowest
        if done or stalled_count == EXACT.max_stalled or diverged:
            break
        if count % EXACT.patience == 0:
            if not lowest < EXACT.min_progress * lowest_before:
                break
            lowest_before = lowest
        if last is not None and iterate.relative_residual > EXACT.max_reuse_ratio * last.relative_residual:
            operator = None
        last = iterate
        was_separate, separate = separate, after.residual is state.now.residual
        similar_steps = similar_steps[-EXACT.max_mixed :] if separate == was_separate else []
        similar_steps.append((after, change))
        now = mixed(similar_steps)
    return best


def _is_filtered(iterate: ExactIterate, before: ExactIterate) -> bool:
    """Return whether the coordinates cannot represent the residual, see `ExactSettings.max_stalled`."""
    residual = iterate.relative_residual
    slow = residual > EXACT.stall_ratio * before.relative_residual
    return slow and iterate.relative_change < EXACT.filtered_change * residual


def _is_unchanged(iterate: ExactIterate, before: ExactIterate, tolerance: float) -> bool:
    """Return whether all errors above the tolerance have hardly changed, see `ExactSettings.max_stalled`."""
    errors, errors_before = np.array(iterate.errors), np.array(before.errors)
    same = np.abs(errors - errors_before) < EXACT.stalled_change * errors_before
    return bool((same | (errors <= tolerance)).all())


def _with_equilibrium_forces(
    now: Displaced, share: float, rigid_loads_state: DeflectionState, tolerance: float
) -> ResidualState:
    """Iterate the section forces with constant displacements and inertia, and return the resulting residual."""
    for _ in range(EXACT.max_force_iterations):
        solution = residual_state(now, exact_loads(now), rigid_loads_state, share)
        state = solution.state
        change = float(np.abs(state.force - now.force).max(initial=0.0))
        limit = EXACT.force_tolerance_ratio * tolerance * float(np.abs(state.force).max(initial=TINY))
        if change <= limit:
            break
        now = now.with_forces(state.force, state.joints, state.moments)
    return solution


def with_new_foreshortening(now: Displaced) -> Displaced:
    """Set up the foreshortening of displaced links again, for example after a transfer to another grid."""
    shape = foreshortening(now.vibration)
    return replace(now, foreshortening=shape, amplitudes=shape.amplitudes(now.history[0], now.residual.moved))


def tangent(now: Displaced, bent: Deflection) -> Vibration:
    """Return the equations of small vibrations about displaced links, in the coordinates of their linear vibration.

    Parameters
    ----------
    bent
        Quasi-static deflection under the loads of the displaced links.
    """
    linear, shape = now.vibration, now.foreshortening
    assert shape is not None
    assert now.amplitudes is not None
    terms = linear.problem.terms
    kinematics = terms.kinematics
    phi = now.moved.phi[..., 0]
    per = shape.per_coordinate(phi.reshape(len(phi), -1))
    unit = kinematics.unit + shape.unit @ per
    moving = Kinematics(
        kinematics.structure,
        kinematics.rigid_modes,
        kinematics.chosen,
        kinematics.basis,
        unit,
        kinematics.mass_displacements + shape.mass_displacements_by(per),
    )
    added = shape.mass_displacement_rates(now.history, now.residual.moved, now.amplitudes)
    first, second = terms.grid.rates(kinematics.mass_displacements)
    rates = first + added[0], second + added[1]
    posed = problem(motion_terms(moving, terms.grid, terms.damping, rates), bent, linear.problem.speed)
    axial = (np.exp(-1j * phi) * now.force).real * kinematics.structure.weights
    geometric, equations = replace(posed.geometric, axial=axial), posed.equations
    # Foreshortening may have a transverse part. The slope then differs from the rotation, which must be used here.
    unit_rotation = replace(unit, slope=unit.phi, shear=np.zeros_like(unit.shear))
    stiffness = (
        equations.stiffness
        + (geometric.stiffness(unit_rotation, unit_rotation) - posed.geometric.stiffness(unit, unit))[1:]
    )
    posed = replace(posed, geometric=geometric, equations=replace(equations, stiffness=stiffness))
    return replace(linear, problem=posed, propagation=propagation(terms.grid, posed.equations))
