"""Newton's method for the exact equations of displaced links, at growing shares of the loads if it needs them.

The operator is that of small vibrations about the displaced links: coordinates move masses with the foreshortening of
the turned beams, and geometric stiffness is that of the section forces there. Within a step the forces of turned
sections are brought into balance at every instant, which takes no inertia. If steps lead away from the solution, the
loads of the rigid motion grow from nothing: the answer is then the one that is connected with the straight links.
Derivation: docs/theory.md.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced, exact_loads
from elastic.elastodynamics.equations_of_motion import Kinematics, motion_terms, problem
from elastic.elastodynamics.exact_residual import (
    Loaded,
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
    """Return displaced links settled by Newton's method; None if it leads nowhere.

    Parameters
    ----------
    linear, tolerance, fastest
        As for `exact_steps.settled_links`.
    near
        Links to begin with. Without them, or if the method leads away from them, the loads grow from nothing.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        still, fastest = loaded(linear, linear.quasi_static), SETTINGS.newton_fastest * fastest
        if near is not None:
            found = _at_share(_with_foreshortening(near), 1.0, still, tolerance, fastest)
            if found is not None and (found.change_share < SETTINGS.part_tolerance or near.shortened is not None):
                return found
        return _loaded_in_steps(_with_foreshortening(begin(linear)), still, tolerance, fastest)


def _with_foreshortening(now: Displaced) -> Displaced:
    """The same links with their foreshortening apart from the displacements beside the coordinates."""
    if now.shortened is not None:
        return now
    return newly_shortened(replace(now, residual=_scaled(now, 0.0).residual))


def _scaled(now: Displaced, share: float) -> Displaced:
    """A share of displaced links."""
    x, x1, x2 = (share * part for part in now.history)
    residual = replace(now.residual, moved=now.residual.moved @ np.array([[share]]), forces=share * now.residual.forces)
    held = {name: share * getattr(now, name) for name in ("force", "joints", "moments")}
    return shortened(replace(now, history=(x, x1, x2), residual=residual, **held))


def _loaded_in_steps(first: Displaced, still: Loaded, tolerance: float, fastest: float) -> Settled | None:
    """Links under loads that grow from nothing; None where a small step of the loads leads nowhere."""
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
    """Links at a share of the loads, on the straight line through those at two other shares."""
    reach = (share - last[0]) / (last[0] - before[0])
    return summed([before[1], last[1]], np.array([-reach, 1.0 + reach]))


def _at_share(begun: Displaced, share: float, still: Loaded, tolerance: float, fastest: float) -> Settled | None:
    """The links nearest to balance under a share of the rigid motion's loads; None where numbers overflow."""
    now, last, least = begun, np.inf, np.inf
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
        settled = Settled(settled_now.now, change, places_of(settled_now.change), count)
        size = float(np.abs(change).max(initial=0.0))
        best = settled if best is None or settled.open < best.open else best
        done = settled.open if share == 1.0 else settled.change_share
        if done <= tolerance or not size <= SETTINGS.max_newton_ratio * last:
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
    """Residual of links with section forces in balance at their displaced places."""
    for _ in range(SETTINGS.max_balances):
        solution = unbalanced(now, exact_loads(now), still, share)
        answer = solution.found
        off = float(np.abs(answer.force - now.force).max(initial=0.0))
        if off <= SETTINGS.balance * float(np.abs(answer.force).max(initial=TINY)):
            break
        now = replace(now, force=answer.force, joints=answer.joints, moments=answer.moments)
    return solution


def newly_shortened(now: Displaced) -> Displaced:
    """Return links that were carried over to another grid with their foreshortening there."""
    shape = foreshortening(now.vibration)
    return replace(now, shortened=shape, amplitudes=shape.amplitudes(now.history[0], now.residual.moved))


def tangent(now: Displaced, bent: Deflection) -> Vibration:
    """Return the small vibrations about displaced links, in the coordinates of the linear ones.

    Parameters
    ----------
    bent
        Quasi-static answer under their loads.
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
    turned = replace(unit, slope=unit.phi)  # a slope is no rotation where the foreshortening goes across
    stiffness = equations.stiffness + (felt.stiffness(turned, turned) - posed.felt.stiffness(unit, unit))[1:]
    posed = replace(posed, felt=felt, equations=replace(equations, stiffness=stiffness))
    return replace(linear, problem=posed, propagation=propagation(terms.grid, posed.equations))
