"""Nonlinear elastodynamics by iteration of linear equations, for friction and for large displacement.

The residual is the quasi-static deflection under the loads of displaced links, minus their displacements. Linear
equations of motion in reduced coordinates convert the residual to a dynamic correction. The first step is the
second-order effect of large displacement. Steps are mixed as proposed by Anderson (Iterative procedures for nonlinear
integral equations, Journal of the ACM 12 (1965) 547-560), until both the last change and the residual are below the
tolerance. The residual also contains fast parts, which the steps filter out.

Friction is called hard if steps do not halve the residual. Each step then replaces it by viscous friction with the
ratio of force to rate from the last step. These secants converge to Coulomb's law, even for sticking joints. The
derivation is in docs/theory.md.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced, ExactLoads, exact_loads
from elastic.elastodynamics.exact_residual import Response, begin, mixed, stepped, unbalanced
from elastic.elastodynamics.exact_settings import SETTINGS
from elastic.elastodynamics.newton import settled_by_newton, without_residual
from elastic.elastodynamics.point_effects import sliding_rows
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.settled import Settled, Sliding, places_of
from elastic.elastodynamics.time_elements import Equations, propagation
from elastic.elastodynamics.vibration_loads import resampled, vibration_loads
from elastic.solution import Deflection, deflection
from rigid import Mechanism
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import friction_per_rate


def with_friction(
    linear: Vibration, tolerance: float, fastest: float, sliding: Sliding = ()
) -> tuple[Vibration, Settled]:
    """Return a vibration with small displacements and the joint friction that its forces and rates cause.

    For the parameters and the second result see `settled_links`.
    """
    rubbed = settled_links(linear, tolerance, fastest, _linear_loads, sliding)
    return replace(linear, history=rubbed.displaced.history, residual=rubbed.displaced.residual), rubbed


def _linear_loads(now: Displaced) -> ExactLoads:
    """Return the loads for small displacements, without rotated sections."""
    linear = now.vibration
    added = vibration_loads(linear.problem, linear.motion, now.history, now.residual)
    return ExactLoads(added, np.zeros_like(now.force[1:]))


def settled_links(
    linear: Vibration,
    tolerance: float,
    fastest: float,
    loads_of: Callable[[Displaced], ExactLoads] = exact_loads,
    sliding: Sliding = (),
    begun: Displaced | None = None,
) -> Settled:
    """Solve for links with large displacement by iteration.

    The iteration starts with inexpensive steps that are linearized about the rigid motion. Newton's method takes over
    if they stall. If the iteration fails, the error of the result exceeds the tolerance.

    Parameters
    ----------
    fastest
        Frequency limit for the inertia of the residual response [rad/s].
    loads_of
        Function for the loads of displaced links.
    sliding
        Joint rates for the friction in the first step (see `AddedLoads`), by default those of the links.
    begun
        Initial links on the same grid, by default the linear vibration.
    """
    if begun is not None and begun.shortened is not None:
        answers: list[Settled] = []
        for start in (without_residual(begun), begun):  # the interpolated residual is rough
            settled = settled_by_newton(linear, tolerance, fastest, start)
            answers += [settled] if settled else []
            if settled and settled.open <= SETTINGS.max_rough * tolerance:
                break
        if answers:
            return min(answers, key=lambda each: each.open)
        begun = None
    best = _by_linear_steps(linear, tolerance, fastest, loads_of, sliding, begun)
    if best.open <= tolerance or loads_of is not exact_loads or has_dry_friction(linear.motion.mechanism):
        return best
    near = best.displaced if best.open < SETTINGS.newton_from else None
    settled = settled_by_newton(linear, tolerance, fastest, near)
    return settled if settled is not None and settled.open < best.open else best


def _by_linear_steps(
    linear: Vibration,
    tolerance: float,
    fastest: float,
    loads_of: Callable[[Displaced], ExactLoads],
    sliding: Sliding,
    begun: Displaced | None,
) -> Settled:
    """Iterate with steps that are linearized about the rigid motion, see `settled_links`."""
    now, last, least = begun or begin(linear), np.inf, np.inf
    response: Response = partial(linear.under, often=begun is None)
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    hard, blunt, rubs = False, 1.0, has_dry_friction(linear.motion.mechanism)
    for count in range(1, (SETTINGS.max_steps_with_friction if rubs else SETTINGS.max_steps) + 1):
        loads = loads_of(now)
        loads = _rubbed(loads, sliding if sliding and count == 1 else loads.added.sliding, blunt)
        residual = unbalanced(now, loads)
        after, bent = stepped(residual, linear, response, fastest), residual.bent
        change = places_of(after.moved) - places_of(now.moved)
        forces = 0.0 if rubs else residual.force_share
        settled = Settled(now, change, places_of(residual.change), count, loads.added.sliding if hard else (), forces)
        size = float(np.abs(change).max(initial=0.0))
        if best and not hard and not settled.open < SETTINGS.max_growth * best.open:
            break
        best = settled if best is None or settled.open < best.open or blunt > 1.0 else best
        least = min(least, best.open) if count == 1 else least
        if (best.open <= tolerance and blunt <= 1.0) or not np.isfinite(size):
            break
        if not rubs and count % SETTINGS.patience == 0:
            if not best.open < SETTINGS.min_progress * least:
                break
            least = best.open
        if bent.forces.friction and (hard or sliding or size > SETTINGS.max_ratio * last):
            blunt = max(blunt / SETTINGS.creep_ratio, 1.0) if hard or sliding else SETTINGS.first_creep
            hard, response, before = True, _held_back(linear, bent, loads.added.sliding), []
        last = size
        before = [*before[-SETTINGS.max_mixed :], (after, change)]
        now = mixed(before)
    assert best is not None
    return best


def has_dry_friction(mechanism: Mechanism) -> bool:
    """Return whether a joint has Coulomb friction. Viscous friction is part of the linear equations."""
    return any(bool(np.any(each.coefficient)) for each in mechanism.friction.values())


def _rubbed(loads: ExactLoads, sliding: Sliding, blunt: float) -> ExactLoads:
    """Replace the rates of joints with friction, and multiply their creep rates by `blunt`."""
    creeping = tuple((number, rate, creep * blunt) for number, rate, creep in sliding)
    return replace(loads, added=replace(loads.added, sliding=creeping))


def first_steps(linear: Vibration, fastest: float) -> tuple[Settled, float]:
    """Take steps until they determine the effect of large displacement, apart from a small fraction.

    Returns
    -------
    Links after the last step with its change, and the possible change by further steps (see `Settled.open`), which is 0
    if the steps converged.
    """
    now, enough = begin(linear), 0.0
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    least = np.inf
    for count in range(1, SETTINGS.max_first_steps + 1):
        after, residual = _step(now, fastest)
        change = places_of(after.moved) - places_of(now.moved)
        size = Settled(now, change, residual, count).open
        enough = enough or max(min(SETTINGS.first_step_share * size, SETTINGS.first_rest), SETTINGS.first_resolved)
        if best is None or size < least:
            best, least = Settled(after, change, residual, count), size
        if size <= (SETTINGS.first_enough if count == 1 else enough):
            return best, 0.0
        if not size < SETTINGS.max_growth * least:
            break
        before = [*before[-SETTINGS.max_mixed :], (after, change)]
        now = mixed(before)
    assert best is not None
    return best, least


def next_step(known: Settled, fastest: float) -> Settled:
    """Take one more step from displaced links, linearized about the rigid motion."""
    now = known.displaced
    after, residual = _step(now, fastest)
    return Settled(after, places_of(after.moved) - places_of(now.moved), residual, known.steps + 1)


def _held_back(linear: Vibration, bent: Deflection, sliding: Sliding) -> Response:
    """Return the response function with Coulomb friction replaced by viscous friction of the current force / rate."""
    posed = linear.problem
    kinds, grid = posed.terms.kinematics, posed.terms.grid
    per_rate = friction_per_rate(bent.motion, bent.forces, {number: creep for number, _, creep in sliding})
    damping, stiffness = posed.equations.damping, posed.equations.stiffness
    for viscosity, row in zip(per_rate.values(), sliding_rows(bent.motion, kinds.chosen), strict=True):
        unit = row(kinds.unit)
        felt = posed.speed * (viscosity[:, None] * unit)[1:, :, None]
        damping = damping + felt * unit[1:, None]
        stiffness = stiffness + felt * grid.rates(unit)[0][:, None]

    def response(load: Reals) -> tuple[Reals, Reals, Reals]:
        steps = propagation(grid, Equations(posed.equations.mass, damping, stiffness, load))
        return steps.history(steps.periodic_start() if linear.cyclic else np.zeros(2 * load.shape[1]))

    return response


def _step(now: Displaced, fastest: float) -> tuple[Displaced, Complexes]:
    """Return the displaced links after a step, and the residual before it (see `Settled`)."""
    found = unbalanced(now, exact_loads(now))
    return stepped(found, now.vibration, now.vibration.under, fastest), places_of(found.change)


def exact_deflection(now: Displaced, bent: Deflection, sampler: Callable[[Any], Any]) -> Deflection:
    """Compute the deflection of displaced links at positions other than those of their grid.

    Parameters
    ----------
    bent
        Quasi-static deflection at these positions.
    sampler
        Function from values at the points of the grid to values at the positions.
    """
    loads = resampled(exact_loads(now).added, sampler)
    return deflection(bent.motion, bent.sections, bent.joints, loads)
