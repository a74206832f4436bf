"""Newton's method for the exact equations of displaced links, with load steps if necessary.

The operator describes small vibrations about the displaced links. Their masses also move due to the foreshortening of
rotated beams, and the geometric stiffness is due to the current section forces. Within a step, the forces in rotated
sections are brought into equilibrium at every instant, without changing the inertia. If the steps diverge, the loads of
the rigid motion are increased from zero, so that the solution is the one that is continuously connected with the
straight links. The derivation is in docs/theory.md.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced, exact_loads
from elastic.elastodynamics.equations_of_motion import Kinematics, motion_terms, problem
from elastic.elastodynamics.exact_residual import (
    Loaded,
    ResidualResponse,
    Unbalanced,
    begin,
    loaded,
    mixed,
    shortened,
    stepped,
    summed,
    unbalanced,
)
from elastic.elastodynamics.exact_settings import SETTINGS
from elastic.elastodynamics.foreshortening import foreshortening
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.settled import TINY, Settled, places_of
from elastic.elastodynamics.time_elements import propagation
from elastic.solution import Deflection


def settled_by_newton(linear: Vibration, tolerance: float, fastest: float, near: Displaced | None) -> Settled | None:
    """Solve for displaced links by Newton's method, or return None if it fails.

    Parameters
    ----------
    linear, tolerance, fastest
        See `exact_steps.settled_links`.
    near
        Initial links. Without them, or if the method diverges, the loads are increased from zero.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        still, fastest = loaded(linear, linear.quasi_static), SETTINGS.newton_fastest * fastest
        if near is not None:
            found = _at_share(_with_foreshortening(near), 1.0, still, tolerance, fastest)
            if found is not None and (found.change_share < SETTINGS.part_tolerance or near.shortened is not None):
                return found
        return _loaded_in_steps(_with_foreshortening(begin(linear)), still, tolerance, fastest)


def _with_foreshortening(now: Displaced) -> Displaced:
    """Separate the foreshortening from the residual response."""
    return now if now.shortened is not None else without_residual(now)


def without_residual(now: Displaced) -> Displaced:
    """Set the residual response to zero and compute the foreshortening again."""
    return newly_shortened(replace(now, residual=_scaled_residual(now, 0.0)))


def _scaled(now: Displaced, share: float) -> Displaced:
    """Scale displaced links by a factor."""
    x, x1, x2 = (share * part for part in now.history)
    held = {name: share * getattr(now, name) for name in ("force", "joints", "moments")}
    return shortened(replace(now, history=(x, x1, x2), residual=_scaled_residual(now, share), **held))


def _scaled_residual(now: Displaced, share: float) -> ResidualResponse:
    moved = now.residual.moved @ np.array([[share]])
    return replace(now.residual, moved=moved, forces=share * now.residual.forces)


def _loaded_in_steps(first: Displaced, still: Loaded, tolerance: float, fastest: float) -> Settled | None:
    """Solve with loads that increase from zero, or return None if a small load step fails."""
    share, step = 0.0, SETTINGS.first_load_share
    now, before = _scaled(first, 0.0), None
    while step >= SETTINGS.min_load_step:
        following = min(1.0, share + step)
        guess = _scaled(first, following) if before is None else _extended(before, (share, now), following)
        enough = tolerance if following == 1.0 else SETTINGS.part_tolerance
        settled = _at_share(guess, following, still, enough, fastest)
        if settled is not None and following == 1.0 and settled.open < SETTINGS.newton_from:
            return settled
        if settled is None or not settled.change_share < SETTINGS.part_tolerance:
            step /= 2
            continue
        before, share, now = (share, now), following, settled.displaced
        if settled.steps <= SETTINGS.quick_steps:
            step *= SETTINGS.load_step_growth
    return None


def _extended(before: tuple[float, Displaced], last: tuple[float, Displaced], share: float) -> Displaced:
    """Extrapolate links linearly from two load levels to another one."""
    reach = (share - last[0]) / (last[0] - before[0])
    return summed([before[1], last[1]], np.array([-reach, 1.0 + reach]))


def _at_share(begun: Displaced, share: float, still: Loaded, tolerance: float, fastest: float) -> Settled | None:
    """Solve for a share of the loads of the rigid motion, and return the best step (None if numbers overflow)."""
    now, last, least, residual, in_vain = begun, np.inf, np.inf, np.inf, 0
    operator: Vibration | None = None
    before: list[Any] = []
    best: Settled | None = None
    for count in range(1, SETTINGS.max_newton_steps + 1):
        try:
            settled_now = _in_balance(now, share, still)
            if operator is None:
                operator, before = tangent(settled_now.now, settled_now.bent), []
            after = stepped(settled_now, operator, partial(operator.under, often=True), fastest)
        except np.linalg.LinAlgError:
            break
        change = places_of(after.moved) - places_of(settled_now.now.moved)
        residual_now = places_of(settled_now.change)
        settled = Settled(settled_now.now, change, residual_now, count, forces=settled_now.force_share)
        size = float(np.abs(change).max(initial=0.0))
        best = settled if best is None or settled.open < best.open else best
        done = settled.open if share == 1.0 else settled.change_share
        high, residual = SETTINGS.min_fall * residual, settled.residual_share
        filtered = share == 1.0 and settled.change_share < SETTINGS.filtered_change * residual
        in_vain = in_vain + 1 if filtered and residual > high else 0
        # the first step adds mainly the residual response, so the second may be larger
        growing = count > 2 and size > SETTINGS.max_newton_ratio * last
        if done <= tolerance or in_vain == SETTINGS.max_in_vain or growing or not np.isfinite(size):
            break
        if count % SETTINGS.patience == 0:
            if not best.open < SETTINGS.min_progress * least:
                break
            least = best.open
        if size > SETTINGS.min_newton_reuse * last:
            operator = None
        last = size
        before = [*before[-SETTINGS.max_mixed :], (after, change)]
        now = mixed(before)
    return best


def _in_balance(now: Displaced, share: float, still: Loaded) -> Unbalanced:
    """Return the residual of links with section forces that are in equilibrium at the displaced positions."""
    for _ in range(SETTINGS.max_balances):
        solution = unbalanced(now, exact_loads(now), still, share)
        answer = solution.found
        off = float(np.abs(answer.force - now.force).max(initial=0.0))
        if off <= SETTINGS.balance * float(np.abs(answer.force).max(initial=TINY)):
            break
        now = now.under(answer.force, answer.joints, answer.moments)
    return solution


def newly_shortened(now: Displaced) -> Displaced:
    """Compute the foreshortening of displaced links, for example after a transfer to another grid."""
    shape = foreshortening(now.vibration)
    return replace(now, shortened=shape, amplitudes=shape.amplitudes(now.history[0], now.residual.moved))


def tangent(now: Displaced, bent: Deflection) -> Vibration:
    """Return the equations of small vibrations about displaced links, in the coordinates of the linear problem.

    Parameters
    ----------
    bent
        Quasi-static deflection under the loads of the displaced links.
    """
    linear, shape = now.vibration, now.shortened
    assert shape is not None
    terms = linear.problem.terms
    kinds = terms.kinematics
    phi = now.moved.phi[..., 0]
    per = shape.per_coordinate(phi.reshape(len(phi), -1))
    unit = kinds.unit + shape.unit @ per
    moving = Kinematics(kinds.structure, kinds.carried, kinds.chosen, kinds.basis, unit, kinds.rows + shape.rows @ per)
    posed = problem(motion_terms(moving, terms.grid, terms.damping), bent, linear.problem.speed)
    pull = (np.exp(-1j * phi) * now.force).real * kinds.structure.weights
    felt, equations = replace(posed.felt, pull=pull), posed.equations
    # the slope differs from the rotation if foreshortening has a transverse part
    turned = replace(unit, slope=unit.phi)
    stiffness = equations.stiffness + (felt.stiffness(turned, turned) - posed.felt.stiffness(unit, unit))[1:]
    posed = replace(posed, felt=felt, equations=replace(equations, stiffness=stiffness))
    return replace(linear, problem=posed, propagation=propagation(terms.grid, posed.equations))
