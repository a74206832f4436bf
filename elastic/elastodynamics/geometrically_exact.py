"""Geometrically exact elastodynamics: the whole theory of beams, from the answer of small displacements."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displaced_points import require_known
from elastic.elastodynamics.exact_residual import carried_over
from elastic.elastodynamics.exact_steps import exact_deflection, first_steps, has_dry_friction, settled_links
from elastic.elastodynamics.newton import newly_shortened, settled_by_newton
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.settled import Settled
from elastic.elastodynamics.solution import (
    MOST_NUMBERS,
    ROUNDS,
    TOLERANCE,
    Discretization,
    Elastodynamic,
    deflection_at,
    halved,
    numbers_of,
    resolved_in_time,
    time_error,
    vibration_in,
)
from elastic.solution import Deflection

BESIDE = 4.0  # times as much as of the coordinates do elements leave open of what lies beside them, at most

FALL = 0.7  # of what steps leave open, to which more coordinates are to bring it: else there were enough
MAX_COMPLETE = 60  # coordinates, up to which all of them are taken if steps lead nowhere in a part of them
LOST = 0.1  # of the displacements, beyond which steps leave open what nothing finer settles


def with_large_displacement(linear: Elastodynamic, finer: Vibration | None = None) -> tuple[Elastodynamic, float]:
    """The vibrating mechanism at the same positions after a few steps towards the exact answer, and how much is open.

    The difference is what the linear answer leaves out: most often one step tells it, the effect of large displacement
    to second order.

    Parameters
    ----------
    finer
        As of `finer_vibration`, where steps are to be those of a finer discretization: what is fine enough for the
        linear answer may not be for the exact one.

    Returns
    -------
    The answer, of which `exact` tells by how much the last step changed it; and what further steps may change as a
    share of the largest displacement, 0 where they settle. The linear answer and 0 where nothing vibrates or no steady
    state comes about.

    Raises
    ------
    MechanismError
        A wheel that runs along a rack; a slider along an elastic link where other joints are redundant.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear, 0.0
    if finer is not None:
        vibration, discretization = finer, discretization.wider()
    step, left = steps_to_exact(vibration, discretization)
    bent = _at_positions(step.displaced, linear)
    return replace(linear, deflection=bent, vibration=vibration, discretization=discretization, exact=step), left


def finer_vibration(answer: Elastodynamic) -> Vibration | None:
    """Vibration of small displacements, elements half as long and twice as many modes; None where nothing vibrates."""
    vibration, discretization = answer.vibration, answer.discretization
    if vibration is None or discretization is None:
        return None
    return vibration_in(*halved(discretization, vibration.problem.terms.grid))


def discretized_finer(
    answer: Elastodynamic, finer: Vibration | None, tolerance: float = TOLERANCE, begun: Elastodynamic | None = None
) -> tuple[Deflection, float]:
    """Deflection at the same positions in a finer discretization, and the share left open there.

    The difference is what the discretization leaves open of the answer, exact or of small displacements: either time or
    coordinates alone may show little where both together show more.

    Parameters
    ----------
    finer
        As of `finer_vibration`, which the exact answer shares with that of small displacements it is made of.
    tolerance
        To which the answer is settled there.
    begun
        As of `with_large_displacement` there, where that is known.
    """
    if finer is None or answer.discretization is None:
        return answer.deflection, 0.0
    if answer.exact is None:
        found, left = corrected(finer, tolerance)
        after = replace(answer, vibration=found)
    else:
        wider = answer.discretization.wider()
        now = _carried(answer.exact.displaced, finer, answer.discretization, wider)
        if now is None:
            now = begun.exact.displaced if begun and begun.exact else None
        settled = settled_links(finer, tolerance, wider.fastest, begun=now)
        after, left = replace(answer, vibration=finer, exact=settled), settled.open
    return deflection_at(after, answer.quasi_static.motion), left


def steps_to_exact(
    vibration: Vibration, discretization: Discretization, newton_to: float | None = None
) -> tuple[Settled, float]:
    """Return displaced links after a few steps from linear vibration, and what they leave open, as of `first_steps`.

    If these leave more open than `newton_to`, a share of the largest displacement, Newton's method takes over.

    Raises
    ------
    MechanismError
        As of `with_large_displacement`.
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
    """The vibrating mechanism with links displaced by any amount: Reissner's beams with shear and rotary inertia.

    Stability is that about the rigid motion. Where steps towards the exact answer do not settle, `reduction_error` says
    by how much the last one changed it.

    Parameters
    ----------
    linear
        The answer of small displacements, steady or from a start.
    tolerance
        How far the answer may be from settled, as a share of the largest displacement.
    begun
        The first steps from the linear answer, as of `with_large_displacement`, where these are known.

    Raises
    ------
    MechanismError
        A wheel that runs along a rack; a slider along an elastic link where other joints are redundant.

    Returns
    -------
    At the same positions. N, V, M are in the axes of the section as it is turned, and hold what damping adds. Where
    nothing vibrates, or no steady state comes about, the linear answer.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear
    require_known(vibration.motion)
    best: Any = None
    made_finer = False
    now, before, made = begun.displaced if begun else None, math.inf, begun.steps if begun else 0
    for _ in range(ROUNDS):
        exact = settled_links(vibration, tolerance, discretization.fastest, begun=now)
        exact = replace(exact, steps=(made := made + exact.steps))
        moving = replace(vibration, history=exact.displaced.history)
        in_elements, finer = time_error(moving, discretization.resolved)
        answer_now = _settled(linear, exact, vibration, discretization, in_elements)
        best = answer_now if best is None or _off(answer_now) < _off(best) else best
        few = tolerance < exact.open < FALL * before
        coarse, grid = discretization, finer or vibration.problem.terms.grid
        lost = exact.open > LOST
        carried = now is not None and now.shortened is not None
        if (lost and (made_finer or carried)) or best is not answer_now:
            break
        if lost:
            discretization, grid = halved(discretization, vibration.problem.terms.grid)
            discretization, made_finer = discretization.complete(MAX_COMPLETE), True
        elif few:
            discretization = discretization.wider()
        before = exact.open
        if not (few or finer or lost) or numbers_of(discretization, grid) > MOST_NUMBERS:
            break
        vibration = resolved_in_time(discretization, grid, tolerance)[0]
        now = None if lost else _carried(exact.displaced, vibration, coarse, discretization)
    answer: Elastodynamic = replace(best, deflection=_at_positions(best.exact.displaced, linear))
    return answer


def _settled(
    linear: Elastodynamic, exact: Settled, vibration: Vibration, discretization: Discretization, in_elements: float
) -> Elastodynamic:
    """The answer of displaced links as it stands, but for its deflection."""
    return replace(
        linear,
        coordinates=vibration.history[0].shape[1],
        elements=len(vibration.problem.terms.grid.steps),
        time_error=BESIDE * in_elements,
        reduction_error=exact.open,
        vibration=vibration,
        discretization=discretization,
        exact=exact,
    )


def _carried(known: Displaced, vibration: Vibration, before: Discretization, now: Discretization) -> Displaced | None:
    """Links that Newton's method found, in another discretization; None where other steps found them."""
    if known.shortened is None or has_dry_friction(vibration.motion.mechanism):
        return None
    return newly_shortened(carried_over(known, vibration, now.per_coordinate_of(before)))


def _off(found: Elastodynamic) -> float:
    """How far an answer may be from settled."""
    return found.time_error + found.reduction_error


def _bends(linear: Elastodynamic) -> bool:
    """Whether beams vibrate, and come to a steady state."""
    vibration = linear.vibration
    return linear.stable and vibration is not None and bool(vibration.problem.terms.kinematics.structure.weights.size)


def _at_positions(displaced: Displaced, linear: Elastodynamic) -> Deflection:
    """Deflection of displaced links at the positions of the linear answer."""
    plain, grid = linear.quasi_static, displaced.vibration.problem.terms.grid
    time = plain.motion.time
    return exact_deflection(displaced, plain, grid.sampler(grid.cycled(time) if displaced.vibration.cyclic else time))
