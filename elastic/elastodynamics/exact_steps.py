"""Nonlinear elastodynamics: friction, and the exact equations of displaced links, by steps of the linear ones.

The residual of the exact equations is that of the quasi-static answer under the loads of displaced links. What an
answer changes of the displacements before is a quasi-static response; the linear equations of motion in the reduced
coordinates make it a dynamic one. The first step is the second order of large displacement; steps are mixed after
Anderson (Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (1965) 547-560) until both what
one changes and the residual are below the tolerance: the residual has what steps smooth in time, and never feel.
Where friction is hard, that is where such steps do not halve what is left, each step takes it as viscous, as so much
per rate as there was at the last one: Coulomb's law is met by ever nearer secants, which joints that stick allow too.
Derivation: docs/theory.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced, ExactLoads, exact_loads
from elastic.elastodynamics.exact_residual import Response, begin, mixed, stepped, unbalanced
from elastic.elastodynamics.exact_settings import SETTINGS
from elastic.elastodynamics.newton import settled_by_newton
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
    """The vibration of small displacements with friction in the joints by its own forces and rates.

    Parameters and the second result as for `settled_links`.
    """
    rubbed = settled_links(linear, tolerance, fastest, _linear_loads, sliding)
    return replace(linear, history=rubbed.displaced.history, residual=rubbed.displaced.residual), rubbed


def _linear_loads(now: Displaced) -> ExactLoads:
    """Loads of small displacements, which leave sections as they are."""
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
    """Links displaced by any amount; they are open by more than the tolerance where steps do not get there.

    Steps about the rigid motion come first: each of them costs little. Newton's method takes over if they stall.

    Parameters
    ----------
    fastest
        Angular frequency [rad/s] up to which accelerations of what the linear coordinates do not follow are taken.
    loads_of
        Loads of displaced links.
    sliding
        Rates of the joints with friction that the first step takes, as `AddedLoads` has them; their own without.
    begun
        Links that steps begin with, on the same grid; without it they begin with the linear answer.
    """
    if begun is not None and begun.shortened is not None:
        settled = settled_by_newton(linear, tolerance, fastest, begun)
        if settled is not None:
            return settled
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
    """Links after steps about the rigid motion, as of `settled_links`."""
    now, last, least = begun or begin(linear), np.inf, np.inf
    response: Response = partial(linear.under, often=begun is None)
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    hard, blunt, rubs = False, 1.0, has_dry_friction(linear.motion.mechanism)
    for count in range(1, (SETTINGS.max_steps_with_friction if rubs else SETTINGS.max_steps) + 1):
        loads = loads_of(now)
        loads = _rubbed(loads, sliding if sliding and count == 1 else loads.added.sliding, blunt)
        after, residual, bent = _step(now, response, loads, fastest)
        change = places_of(after.moved) - places_of(now.moved)
        settled = Settled(now, change, residual, count, loads.added.sliding if hard else ())
        size = float(np.abs(change).max(initial=0.0))
        if best and not hard and not settled.open < SETTINGS.max_growth * best.open:
            break
        best = settled if best is None or settled.open < best.open or blunt > 1.0 else best
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
    """Return whether a joint has Coulomb's friction: the linear equations hold viscous friction from the start."""
    return any(bool(np.any(each.coefficient)) for each in mechanism.friction.values())


def _rubbed(loads: ExactLoads, sliding: Sliding, blunt: float) -> ExactLoads:
    """Loads with rates of the joints with friction, and so many times the creep."""
    creeping = tuple((number, rate, creep * blunt) for number, rate, creep in sliding)
    return replace(loads, added=replace(loads.added, sliding=creeping))


def first_steps(linear: Vibration, fastest: float) -> tuple[Settled, float]:
    """Links after as few steps as tell all that large displacement changes but for a small share of it.

    Returns
    -------
    The links after the last step, with the changes that it made; and what further steps may change, as `Settled.open`,
    where they do not get there, else 0.
    """
    now, enough = begin(linear), 0.0
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    least = np.inf
    for count in range(1, SETTINGS.max_first_steps + 1):
        after, residual, _ = _step(now, linear.under, exact_loads(now), fastest)
        change = places_of(after.moved) - places_of(now.moved)
        size = Settled(now, change, residual, count).open
        enough = enough or max(SETTINGS.first_step_share * size, SETTINGS.first_resolved)
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


def _held_back(linear: Vibration, bent: Deflection, sliding: Sliding) -> Response:
    """Response of the linear equations with Coulomb's friction as if it were viscous: as much per rate as there is."""
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


def _step(
    now: Displaced, response: Response, loads: ExactLoads, fastest: float
) -> tuple[Displaced, Complexes, Deflection]:
    """Displaced links after a step under given loads, with the vibration that a response to loads gives.

    Also the residual of the beams' displacements, as of `Settled`, and the quasi-static answer under those loads.
    """
    found = unbalanced(now, loads)
    return stepped(found, now.vibration, response, fastest), places_of(found.change), found.bent


def exact_deflection(now: Displaced, bent: Deflection, sampler: Callable[[Any], Any]) -> Deflection:
    """Deflection of displaced links at other positions than those of their grid.

    Parameters
    ----------
    bent
        Quasi-static, at these positions.
    sampler
        From values at the points of the grid to those at the positions.
    """
    loads = resampled(exact_loads(now).added, sampler)
    return deflection(bent.motion, bent.sections, bent.joints, loads)
