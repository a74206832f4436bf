"""Geometrically exact elastodynamics (large displacement), starting from the solution for small displacements."""

import math
from typing import Any

from msgspec.structs import replace

from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import Discretization, array_size, halved
from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displaced_points import require_supported
from elastic.elastodynamics.exact_iterate import ExactIterate
from elastic.elastodynamics.exact_residual import transferred
from elastic.elastodynamics.exact_steps import exact_deflection, first_steps, has_dry_friction, next_step, solve_exact
from elastic.elastodynamics.newton import solve_by_newton, with_new_foreshortening
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.solution import TOLERANCE, Elastodynamic, moved_to, resolved_in_time, vibration_in
from elastic.elastodynamics.time_error import time_error
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.solution import Deflection


def with_large_displacement(linear: Elastodynamic, finer: Vibration | None = None) -> tuple[Elastodynamic, float]:
    """Estimate the effect of large displacement by a few steps from a linear solution towards the exact solution.

    The difference between the result and the linear solution is the error of the linear solution. Usually one step is
    sufficient, which gives the second-order effect.

    Parameters
    ----------
    finer
        Result of `finer_vibration`. If given, the steps use its finer discretization, because the discretization of the
        linear solution may be too coarse for the exact solution.

    Returns
    -------
    Solution at the same positions, and an estimate of the change that further steps would make, relative to the largest
    displacement (0 if the steps converged). The last step is in `exact` of the solution. If no beam vibrates or there
    is no steady state, the solution is the linear one and the estimate is 0.

    Raises
    ------
    MechanismError
        If the axis of a wheel on a rack moves, a rigid wheel on a rack rotates about a point other than its first, or a
        block is on an elastic link of a mechanism with redundant joints.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _has_vibrating_beams(linear):
        return linear, 0.0
    if finer is not None:
        vibration, discretization = finer, discretization.wider()
    step, left = steps_to_exact(vibration, discretization)
    bent = _at_positions(step.displaced, linear)
    return replace(linear, deflection=bent, vibration=vibration, discretization=discretization, exact=step), left


def with_one_more_step(answer: Elastodynamic) -> Elastodynamic:
    """Take one more step from a result of `with_large_displacement`.

    The difference between the result and `answer` is the error of `answer`. `exact.change` of the result is the change
    in the beam displacements in this step.
    """
    assert answer.exact is not None
    assert answer.discretization is not None
    step = next_step(answer.exact, answer.discretization.cutoff)
    return replace(answer, deflection=_at_positions(step.displaced, answer), exact=step)


def finer_vibration(answer: Elastodynamic) -> Vibration | None:
    """Return the linear vibration in a finer discretization, or None if no link vibrates.

    The finer discretization has time elements of half the length, and twice as many modes.
    """
    vibration, discretization = answer.vibration, answer.discretization
    if vibration is None or discretization is None:
        return None
    return vibration_in(*halved(discretization, vibration.problem.terms.grid))


def finer_solution(
    answer: Elastodynamic, finer: Vibration | None, tolerance: float = TOLERANCE, guess: Elastodynamic | None = None
) -> tuple[Elastodynamic, float]:
    """Return the solution in a finer discretization at the same positions, and its convergence error.

    The difference between the result and `answer` is the discretization error of `answer`. For small displacements, the
    attributes of the result describe the finer discretization, except for `multipliers`, and the convergence error is
    relative to the largest displacement. For large displacements, it is relative to the chord deflection of the worst
    beam. Time elements and coordinates are refined together, because refinement of only one of them may hardly change
    the result.

    Parameters
    ----------
    finer
        Result of `finer_vibration`, for the linear and for the exact solution alike.
    tolerance
        Tolerance of the finer solution.
    guess
        Result of `with_large_displacement` with the same argument `finer`, if known.
    """
    if finer is None or answer.discretization is None:
        return answer, 0.0
    wider = answer.discretization.wider()
    if answer.exact is None:
        vibration, left = corrected(finer, tolerance)
        after = _with_vibration(answer, vibration, wider, time_error(vibration, tolerance)[0], left)
    else:
        start = _transferred_if_useful(answer.exact.displaced, finer, answer.discretization, wider)
        if start is None:
            start = guess.exact.displaced if guess and guess.exact else None
        iterate = solve_exact(finer, tolerance, wider.cutoff, guess=start)
        after, left = replace(answer, vibration=finer, exact=iterate), iterate.worst
    return moved_to(after, answer.quasi_static), left


def steps_to_exact(
    vibration: Vibration, discretization: Discretization, newton_to: float | None = None
) -> tuple[ExactIterate, float]:
    """Take a few steps from linear vibration towards the exact solution, see `first_steps`.

    If the estimated remaining change exceeds `newton_to`, relative to the largest displacement, Newton's method
    follows.

    Raises
    ------
    MechanismError
        See `with_large_displacement`.
    """
    require_supported(vibration.motion)
    iterate, left = first_steps(vibration, discretization.cutoff)
    if newton_to is not None and left > newton_to and not has_dry_friction(vibration.motion.mechanism):
        further = solve_by_newton(vibration, newton_to, discretization.cutoff, iterate.displaced)
        if further is not None and further.convergence_error < left:
            return further, further.convergence_error
    return iterate, left


def geometrically_exact(
    linear: Elastodynamic, tolerance: float = TOLERANCE, guess: ExactIterate | None = None
) -> Elastodynamic:
    """Solve the vibrating mechanism with large displacement, with Reissner's beams, shear and rotary inertia.

    The attribute `stable` of the result refers to small vibration about the rigid motion. The attribute
    `reduction_error` is `ExactIterate.convergence_error`.

    Parameters
    ----------
    linear
        Solution for small displacements, steady or transient.
    tolerance
        Largest accepted convergence error, relative to the largest displacement.
    guess
        Attribute `exact` of the result of `with_large_displacement`, if known.

    Raises
    ------
    MechanismError
        If the axis of a wheel on a rack moves, a rigid wheel on a rack rotates about a point other than its first, or a
        block is on an elastic link of a mechanism with redundant joints.

    Returns
    -------
    Solution at the same positions. The section forces N, V and M are in the axes of the rotated section and include
    damping forces. If no beam vibrates or there is no steady state, it is the linear solution.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _has_vibrating_beams(linear):
        return linear
    require_supported(vibration.motion)
    best: Any = None
    was_halved = refined = False
    now, before, steps_taken = guess.displaced if guess else None, math.inf, guess.steps if guess else 0
    for _ in range(VIBRATION.max_refinements):
        exact = solve_exact(vibration, tolerance, discretization.cutoff, guess=now)
        exact = replace(exact, steps=(steps_taken := steps_taken + exact.steps))
        moving = replace(vibration, history=exact.displaced.history)
        grid_error, finer = time_error(moving, discretization.time_tolerance, exact.displaced.inertia_load)
        if refined and grid_error <= VIBRATION.min_refined_ratio * discretization.time_tolerance:
            finer = None
        coarser = None if before > VIBRATION.max_convergence_error else best
        answer_now = _assembled(linear, exact, vibration, discretization, grid_error, coarser)
        best = answer_now if best is None or answer_now.discretization_error < best.discretization_error else best
        needs_modes = tolerance < exact.convergence_error < VIBRATION.max_widening_ratio * before
        coarse, grid = discretization, finer or vibration.problem.terms.grid
        diverged = exact.convergence_error > VIBRATION.max_convergence_error
        has_foreshortening = now is not None and now.foreshortening is not None
        if (diverged and (was_halved or has_foreshortening)) or best is not answer_now:
            break
        if diverged:
            discretization, grid = halved(discretization, vibration.problem.terms.grid)
            discretization, was_halved = discretization.complete(VIBRATION.max_complete), True
        elif needs_modes:
            discretization = discretization.wider()
        before = exact.convergence_error
        if not (needs_modes or finer or diverged) or array_size(discretization, grid) > VIBRATION.max_entries:
            break
        refined = finer is not None
        vibration = resolved_in_time(discretization, grid, tolerance)[0]
        now = None if diverged else _transferred_if_useful(exact.displaced, vibration, coarse, discretization)
    answer: Elastodynamic = replace(best, deflection=_at_positions(best.exact.displaced, linear))
    return answer


def _assembled(
    linear: Elastodynamic,
    exact: ExactIterate,
    vibration: Vibration,
    discretization: Discretization,
    grid_error: float,
    coarser: Elastodynamic | None,
) -> Elastodynamic:
    """Assemble the solution for displaced links. Its `deflection` is still the linear one."""
    grid_error = VIBRATION.residual_time_ratio * grid_error
    answer = _with_vibration(linear, vibration, discretization, grid_error, exact.convergence_error)
    return replace(answer, exact=exact, coarser=coarser and replace(coarser, coarser=None))


def _with_vibration(
    answer: Elastodynamic,
    vibration: Vibration,
    discretization: Discretization,
    grid_error: float,
    reduction_error: float,
) -> Elastodynamic:
    """Replace the vibration of a solution, and the attributes that describe its discretization and errors."""
    return replace(
        answer,
        time_error=grid_error,
        reduction_error=reduction_error,
        vibration=vibration,
        discretization=discretization,
    )


def _transferred_if_useful(
    known: Displaced, vibration: Vibration, before: Discretization, now: Discretization
) -> Displaced | None:
    """Transfer displaced links to another discretization, or return None if this is not useful.

    It is not useful with friction. It is also not useful if `known` is the result of linearized steps and the
    coordinates change: motion that only the old coordinates can represent would remain in the residual.
    """
    if has_dry_friction(vibration.motion.mechanism) or (known.foreshortening is None and now is not before):
        return None
    displaced = transferred(known, vibration, now.per_coordinate_of(before))
    return displaced if known.foreshortening is None else with_new_foreshortening(displaced)


def _has_vibrating_beams(linear: Elastodynamic) -> bool:
    """Return whether the mechanism has vibrating beams and is stable."""
    vibration = linear.vibration
    return linear.stable and vibration is not None and bool(vibration.problem.terms.kinematics.structure.weights.size)


def _at_positions(displaced: Displaced, linear: Elastodynamic) -> Deflection:
    """Return the deflection of displaced links at the positions of the linear solution."""
    plain = linear.quasi_static
    return exact_deflection(displaced, plain, displaced.vibration.sampler(plain.motion.time))
