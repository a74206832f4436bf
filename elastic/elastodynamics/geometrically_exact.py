"""Geometrically exact elastodynamics, starting from the solution for small displacements."""

import math
from dataclasses import replace
from typing import Any

from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import Discretization, halved, numbers_of
from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displaced_points import require_known
from elastic.elastodynamics.exact_residual import carried_over
from elastic.elastodynamics.exact_steps import exact_deflection, first_steps, has_dry_friction, next_step, settled_links
from elastic.elastodynamics.newton import newly_shortened, settled_by_newton
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.settled import Settled
from elastic.elastodynamics.solution import (
    TOLERANCE,
    Elastodynamic,
    moved_to,
    resolved_in_time,
    time_error,
    vibration_in,
)
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.solution import Deflection


def with_large_displacement(linear: Elastodynamic, finer: Vibration | None = None) -> tuple[Elastodynamic, float]:
    """Estimate the effect of large displacement at the same positions by a few steps towards the exact solution.

    The difference from the linear solution is the error of the latter. One step, which is the second-order effect,
    usually suffices.

    Parameters
    ----------
    finer
        Result of `finer_vibration`. If given, the steps use this finer discretization, because the exact solution may
        need it.

    Returns
    -------
    The solution with the change by the last step in `exact`, and the possible change by further steps, relative to the
    largest displacement (0 if converged). If no link vibrates or there is no steady state, these are the linear
    solution and 0.

    Raises
    ------
    MechanismError
        If a wheel runs along a rack, or a slider moves on an elastic link while joints are redundant.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear, 0.0
    if finer is not None:
        vibration, discretization = finer, discretization.wider()
    step, left = steps_to_exact(vibration, discretization)
    bent = _at_positions(step.displaced, linear)
    return replace(linear, deflection=bent, vibration=vibration, discretization=discretization, exact=step), left


def stepped_on(answer: Elastodynamic) -> Elastodynamic:
    """Take one more step from a solution of `with_large_displacement`; the difference is the error of that solution.

    `exact.change` is the change by this step.
    """
    assert answer.exact is not None
    assert answer.discretization is not None
    step = next_step(answer.exact, answer.discretization.fastest)
    return replace(answer, deflection=_at_positions(step.displaced, answer), exact=step)


def finer_vibration(answer: Elastodynamic) -> Vibration | None:
    """Return the vibration with small displacements, half the element length and twice the modes.

    Return None if no link vibrates.
    """
    vibration, discretization = answer.vibration, answer.discretization
    if vibration is None or discretization is None:
        return None
    return vibration_in(*halved(discretization, vibration.problem.terms.grid))


def discretized_finer(
    answer: Elastodynamic, finer: Vibration | None, tolerance: float = TOLERANCE, begun: Elastodynamic | None = None
) -> tuple[Elastodynamic, float]:
    """Return the solution at the same positions in a finer discretization, and the convergence error of this solution.

    The convergence error is relative to the largest displacement, or for large displacement to that of the worst beam.
    The difference of both solutions is the discretization error of the given one. Time and coordinates are refined
    together, because refining only one of them may show little.

    Parameters
    ----------
    finer
        Result of `finer_vibration`, which the exact solution and that for small displacements share.
    tolerance
        Tolerance of the finer solution.
    begun
        Result of `with_large_displacement` in the finer discretization, if known.
    """
    if finer is None or answer.discretization is None:
        return answer, 0.0
    if answer.exact is None:
        found, left = corrected(finer, tolerance)
        after = replace(answer, vibration=found)
    else:
        wider = answer.discretization.wider()
        now = _carried(answer.exact.displaced, finer, answer.discretization, wider)
        if now is None:
            now = begun.exact.displaced if begun and begun.exact else None
        settled = settled_links(finer, tolerance, wider.fastest, begun=now)
        after, left = replace(answer, vibration=finer, exact=settled), settled.worst
    return moved_to(after, answer.quasi_static), left


def steps_to_exact(
    vibration: Vibration, discretization: Discretization, newton_to: float | None = None
) -> tuple[Settled, float]:
    """Take a few steps from linear vibration towards the exact solution, see `first_steps`.

    Newton's method follows if the remaining change exceeds `newton_to`, relative to the largest displacement.

    Raises
    ------
    MechanismError
        See `with_large_displacement`.
    """
    require_known(vibration.motion)
    settled, left = first_steps(vibration, discretization.fastest)
    if newton_to is not None and left > newton_to and not has_dry_friction(vibration.motion.mechanism):
        further = settled_by_newton(vibration, newton_to, discretization.fastest, settled.displaced)
        if further is not None and further.open < left:
            return further, further.open
    return settled, left


def geometrically_exact(
    linear: Elastodynamic, tolerance: float = TOLERANCE, begun: Settled | None = None
) -> Elastodynamic:
    """Solve the vibrating mechanism with large displacement, with Reissner's beams, shear and rotary inertia.

    Stability refers to vibration about the rigid motion. If the iteration does not converge, `reduction_error` is its
    last change.

    Parameters
    ----------
    linear
        Solution for small displacements, steady or transient.
    tolerance
        Tolerance relative to the largest displacement.
    begun
        First steps from the linear solution if known, see `with_large_displacement`.

    Raises
    ------
    MechanismError
        If a wheel runs along a rack, or a slider moves on an elastic link while joints are redundant.

    Returns
    -------
    Solution at the same positions. N, V and M are in the axes of the rotated section and include damping. If no link
    vibrates or there is no steady state, it is the linear solution.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear
    require_known(vibration.motion)
    best: Any = None
    made_finer = refined = False
    now, before, made = begun.displaced if begun else None, math.inf, begun.steps if begun else 0
    for _ in range(VIBRATION.max_refinements):
        exact = settled_links(vibration, tolerance, discretization.fastest, begun=now)
        exact = replace(exact, steps=(made := made + exact.steps))
        moving = replace(vibration, history=exact.displaced.history)
        in_elements, finer = time_error(moving, discretization.resolved)
        if refined and in_elements <= VIBRATION.min_refined_ratio * discretization.resolved:
            finer = None
        answer_now = _settled(linear, exact, vibration, discretization, in_elements)
        best = answer_now if best is None or _off(answer_now) < _off(best) else best
        few = tolerance < exact.open < VIBRATION.max_residual_fall * before
        coarse, grid = discretization, finer or vibration.problem.terms.grid
        lost = exact.open > VIBRATION.max_open_residual
        carried = now is not None and now.shortened is not None
        if (lost and (made_finer or carried)) or best is not answer_now:
            break
        if lost:
            discretization, grid = halved(discretization, vibration.problem.terms.grid)
            discretization, made_finer = discretization.complete(VIBRATION.max_complete), True
        elif few:
            discretization = discretization.wider()
        before = exact.open
        if not (few or finer or lost) or numbers_of(discretization, grid) > VIBRATION.max_numbers:
            break
        refined = finer is not None
        vibration = resolved_in_time(discretization, grid, tolerance)[0]
        now = None if lost else _carried(exact.displaced, vibration, coarse, discretization)
    answer: Elastodynamic = replace(best, deflection=_at_positions(best.exact.displaced, linear))
    return answer


def _settled(
    linear: Elastodynamic, exact: Settled, vibration: Vibration, discretization: Discretization, in_elements: float
) -> Elastodynamic:
    """Assemble the solution of displaced links without its deflection."""
    return replace(
        linear,
        coordinates=vibration.history[0].shape[1],
        elements=len(vibration.problem.terms.grid.steps),
        time_error=VIBRATION.residual_time_ratio * in_elements,
        reduction_error=exact.open,
        vibration=vibration,
        discretization=discretization,
        exact=exact,
    )


def _carried(known: Displaced, vibration: Vibration, before: Discretization, now: Discretization) -> Displaced | None:
    """Transfer displaced links to another discretization, or return None if this is not useful.

    It is not useful with friction, or if linearized steps use other coordinates: motion that only the old coordinates
    represent would remain in the residual.
    """
    if has_dry_friction(vibration.motion.mechanism) or (known.shortened is None and now is not before):
        return None
    there = carried_over(known, vibration, now.per_coordinate_of(before))
    return there if known.shortened is None else newly_shortened(there)


def _off(found: Elastodynamic) -> float:
    """Return the total error of a solution."""
    return found.time_error + found.reduction_error


def _bends(linear: Elastodynamic) -> bool:
    """Return whether beams vibrate and there is a steady state."""
    vibration = linear.vibration
    return linear.stable and vibration is not None and bool(vibration.problem.terms.kinematics.structure.weights.size)


def _at_positions(displaced: Displaced, linear: Elastodynamic) -> Deflection:
    """Return the deflection of displaced links at the positions of the linear solution."""
    plain = linear.quasi_static
    return exact_deflection(displaced, plain, displaced.vibration.sampler(plain.motion.time))
