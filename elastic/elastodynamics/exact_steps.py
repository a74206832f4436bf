"""Solution of the nonlinear equations for friction and large displacement, by iteration with linear equations.

The residual is the quasi-static deflection under the loads of displaced links, minus the displacements of the links. In
each step, the residual is a load on linear equations of motion in reduced coordinates, and their response is added as a
correction. The first correction is the second-order effect of large displacement. Steps are combined as proposed by
Anderson (Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (1965) 547-560), until both the
last change and the residual are below the tolerance. A small change alone is not sufficient, because the steps filter
out fast components of the residual.

Friction is called stiff if the change in a step exceeds half the change in the step before. Further steps then use
equations of motion with viscous friction. Its viscosity is the ratio (friction force / sliding rate) of the previous
step. These secant steps converge to Coulomb's law, even for sticking joints. The derivation is in docs/theory.md.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from msgspec.structs import replace

from elastic.elastodynamics.displaced_links import Displaced, ExactLoads, exact_loads
from elastic.elastodynamics.exact_iterate import ExactIterate, Sliding, compared_displacements
from elastic.elastodynamics.exact_residual import Response, from_linear, mixed, residual_state, stepped
from elastic.elastodynamics.exact_settings import EXACT
from elastic.elastodynamics.newton import solve_by_newton, without_residual
from elastic.elastodynamics.point_effects import sliding_components
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.time_elements import Equations, propagation
from elastic.elastodynamics.vibration_loads import resampled, vibration_loads
from elastic.solution import Deflection, deflection
from rigid import Mechanism
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import friction_per_rate


def vibration_with_friction(
    linear: Vibration, tolerance: float, cutoff: float, sliding: Sliding = ()
) -> tuple[Vibration, ExactIterate]:
    """Return a vibration with small displacements and with joint friction, which depends on the vibration itself.

    The parameters and the second result are described in `solve_exact`.
    """
    iterate = solve_exact(linear, tolerance, cutoff, _linear_loads, sliding)
    return replace(linear, history=iterate.displaced.history, residual=iterate.displaced.residual), iterate


def _linear_loads(now: Displaced) -> ExactLoads:
    """Return the loads on displaced links according to linear theory, which neglects the rotation of sections."""
    linear = now.vibration
    added = vibration_loads(linear.problem, linear.motion, now.history, now.residual)
    return ExactLoads(added, np.zeros_like(now.force[1:]))


def solve_exact(
    linear: Vibration,
    tolerance: float,
    cutoff: float,
    loads_of: Callable[[Displaced], ExactLoads] = exact_loads,
    sliding: Sliding = (),
    guess: Displaced | None = None,
) -> ExactIterate:
    """Solve for links with large displacement by iteration.

    The iteration starts with inexpensive steps that are linearized about the rigid motion. If these steps do not
    converge, Newton's method is used. If the iteration fails, the `convergence_error` of the result exceeds the
    tolerance.

    Parameters
    ----------
    cutoff
        Cutoff frequency of the low-pass filter for the residual response [rad/s].
    loads_of
        Function that returns the loads on displaced links.
    sliding
        Sliding rates that determine the friction in the first step (see `AddedLoads`), by default those at the start of
        the iteration.
    guess
        Displaced links on the same grid from which the iteration starts, by default the linear vibration.
    """
    if guess is not None and guess.foreshortening is not None:
        iterates: list[ExactIterate] = []
        # first without and then with the residual response, to which interpolation adds noise
        for start in (without_residual(guess), guess):
            iterate = solve_by_newton(linear, tolerance, cutoff, start)
            iterates += [iterate] if iterate else []
            if iterate and iterate.convergence_error <= EXACT.max_restart_ratio * tolerance:
                break
        if iterates:
            return min(iterates, key=lambda each: each.convergence_error)
        guess = None
    best = _by_linear_steps(linear, tolerance, cutoff, loads_of, sliding, guess)
    if best.convergence_error <= tolerance or loads_of is not exact_loads or has_dry_friction(linear.motion.mechanism):
        return best
    newton_guess = best.displaced if best.convergence_error < EXACT.newton_from else None
    iterate = solve_by_newton(linear, tolerance, cutoff, newton_guess)
    return iterate if iterate is not None and iterate.convergence_error < best.convergence_error else best


def _by_linear_steps(
    linear: Vibration,
    tolerance: float,
    cutoff: float,
    loads_of: Callable[[Displaced], ExactLoads],
    sliding: Sliding,
    guess: Displaced | None,
) -> ExactIterate:
    """Iterate with steps that are linearized about the rigid motion, see `solve_exact`."""
    now, last, least = guess or from_linear(linear), np.inf, np.inf
    response: Response = partial(linear.response_to, often=guess is None)
    before: list[tuple[Displaced, Complexes]] = []
    best: ExactIterate | None = None
    stiff_friction, smoothing, dry_friction = False, 1.0, has_dry_friction(linear.motion.mechanism)
    for count in range(1, (EXACT.max_steps_with_friction if dry_friction else EXACT.max_steps) + 1):
        loads = loads_of(now)
        loads = _with_friction_rates(loads, sliding if sliding and count == 1 else loads.added.sliding, smoothing)
        residual = residual_state(now, loads)
        after, bent = stepped(residual, linear, response, cutoff), residual.bent
        change = compared_displacements(after.moved) - compared_displacements(now.moved)
        forces = 0.0 if dry_friction else residual.force_residual
        iterate = ExactIterate(
            now,
            change,
            compared_displacements(residual.change),
            count,
            loads.added.sliding if stiff_friction else (),
            forces,
        )
        size = float(np.abs(change).max(initial=0.0))
        if best and not stiff_friction and not iterate.convergence_error < EXACT.max_growth * best.convergence_error:
            break
        if best is None or iterate.convergence_error < best.convergence_error or smoothing > 1.0:
            best = iterate
        least = min(least, best.convergence_error) if count == 1 else least
        if (best.convergence_error <= tolerance and smoothing <= 1.0) or not np.isfinite(size):
            break
        if not dry_friction and count % EXACT.patience == 0:
            if not best.convergence_error < EXACT.min_progress * least:
                break
            least = best.convergence_error
        if bent.forces.friction and (stiff_friction or sliding or size > EXACT.max_ratio * last):
            smoothing = max(smoothing / EXACT.creep_ratio, 1.0) if stiff_friction or sliding else EXACT.first_creep
            response = _response_with_viscous_friction(linear, bent, loads.added.sliding)
            stiff_friction, before = True, []
        last = size
        before = [*before[-EXACT.max_mixed :], (after, change)]
        now = mixed(before)
    assert best is not None
    return best


def has_dry_friction(mechanism: Mechanism) -> bool:
    """Return whether a joint has Coulomb friction.

    Viscous friction needs no iteration, because it is part of the linear equations.
    """
    return any(bool(np.any(each.coefficient)) for each in mechanism.friction.values())


def _with_friction_rates(loads: ExactLoads, sliding: Sliding, smoothing: float) -> ExactLoads:
    """Replace the sliding rates of joints with friction by `sliding`, and multiply their creep rates by `smoothing`."""
    creeping = tuple((number, rate, creep * smoothing) for number, rate, creep in sliding)
    return replace(loads, added=replace(loads.added, sliding=creeping))


def first_steps(linear: Vibration, cutoff: float) -> tuple[ExactIterate, float]:
    """Take steps from a linear vibration until the effect of large displacement is known approximately.

    Returns
    -------
    Links after the step with the smallest convergence error, and an estimate of the change that further steps would
    make. The estimate is this smallest convergence error, or 0 if the steps converged.
    """
    now, accepted_remainder = from_linear(linear), 0.0
    before: list[tuple[Displaced, Complexes]] = []
    best: ExactIterate | None = None
    least = np.inf
    for count in range(1, EXACT.max_first_steps + 1):
        after, residual = _step(now, cutoff)
        change = compared_displacements(after.moved) - compared_displacements(now.moved)
        size = ExactIterate(now, change, residual, count).convergence_error
        accepted_remainder = accepted_remainder or max(
            min(EXACT.first_step_share * size, EXACT.max_first_remainder), EXACT.min_first_remainder
        )
        if best is None or size < least:
            best, least = ExactIterate(after, change, residual, count), size
        if size <= (EXACT.negligible_first_step if count == 1 else accepted_remainder):
            return best, 0.0
        if not size < EXACT.max_growth * least:
            break
        before = [*before[-EXACT.max_mixed :], (after, change)]
        now = mixed(before)
    assert best is not None
    return best, least


def next_step(known: ExactIterate, cutoff: float) -> ExactIterate:
    """Take one more step from displaced links, with equations that are linearized about the rigid motion."""
    now = known.displaced
    after, residual = _step(now, cutoff)
    return ExactIterate(
        after, compared_displacements(after.moved) - compared_displacements(now.moved), residual, known.steps + 1
    )


def _response_with_viscous_friction(linear: Vibration, bent: Deflection, sliding: Sliding) -> Response:
    """Return a response function (load to history) in which viscous friction replaces Coulomb friction.

    The viscosity of a joint is the current ratio (friction force / sliding rate).
    """
    posed = linear.problem
    kinematics, grid = posed.terms.kinematics, posed.terms.grid
    per_rate = friction_per_rate(bent.motion, bent.forces, {number: creep for number, _, creep in sliding})
    damping, stiffness = posed.equations.damping, posed.equations.stiffness
    for viscosity, component in zip(per_rate.values(), sliding_components(bent.motion, kinematics.chosen), strict=True):
        unit = component(kinematics.unit)
        weighted = posed.speed * (viscosity[:, None] * unit)[1:, :, None]
        damping = damping + weighted * unit[1:, None]
        stiffness = stiffness + weighted * grid.rates(unit)[0][:, None]

    def response(load: Reals) -> tuple[Reals, Reals, Reals]:
        steps = propagation(grid, Equations(posed.equations.mass, damping, stiffness, load))
        return steps.history(steps.periodic_start() if linear.cyclic else np.zeros(2 * load.shape[1]))

    return response


def _step(now: Displaced, cutoff: float) -> tuple[Displaced, Complexes]:
    """Return the displaced links after a step, and the residual before the step (see `ExactIterate`)."""
    residual = residual_state(now, exact_loads(now))
    return stepped(residual, now.vibration, now.vibration.response_to, cutoff), compared_displacements(residual.change)


def exact_deflection(now: Displaced, bent: Deflection, sampler: Callable[[Any], Any]) -> Deflection:
    """Compute the deflection of displaced links at any positions.

    Parameters
    ----------
    bent
        Quasi-static deflection at the requested positions.
    sampler
        Function that interpolates values at the points of the grid to the requested positions.
    """
    loads = resampled(exact_loads(now).added, sampler)
    return deflection(bent.motion, bent.sections, bent.joints, loads)
