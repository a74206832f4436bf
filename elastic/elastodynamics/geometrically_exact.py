"""Geometrically exact elastodynamics: the whole theory of beams, from the answer of small displacements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displaced_points import require_known
from elastic.elastodynamics.exact_steps import exact_deflection, exact_step, settled_links
from elastic.elastodynamics.solution import ROUNDS, TOLERANCE, TWICE, Elastodynamic, resolved_in_time, time_error
from elastic.solution import Deflection

BESIDE = 4.0  # times as much as of the coordinates do elements leave open of what lies beside them, at most


def with_large_displacement(linear: Elastodynamic) -> tuple[Deflection, float]:
    """Deflection at the same positions after one step towards the exact answer, and how much the step changes.

    With the effect of large displacement to second order: the difference is what the linear answer leaves out.

    Returns
    -------
    The deflection, and the greatest change of a displacement as a share of the largest; the linear deflection and 0
    where nothing vibrates or no steady state comes about.

    Raises
    ------
    MechanismError
        A gear, or a slider along an elastic link.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear.deflection, 0.0
    require_known(vibration.motion)
    step = exact_step(vibration, TWICE * discretization.left_out)
    return _at_positions(step.displaced, linear), step.share


def geometrically_exact(linear: Elastodynamic, tolerance: float = TOLERANCE) -> Elastodynamic:
    """The vibrating mechanism with links displaced by any amount: Reissner's beams with shear and rotary inertia.

    Stability is that about the rigid motion. Where steps towards the exact answer do not settle, `reduction_error` says
    by how much the last one changed it.

    Parameters
    ----------
    linear
        The answer of small displacements, steady or from a start.
    tolerance
        How far the answer may be from settled, as a share of the largest displacement.

    Raises
    ------
    MechanismError
        A gear, or a slider along an elastic link.

    Returns
    -------
    At the same positions. N, V, M are in the axes of the section as it is turned, and hold what damping adds. Where
    nothing vibrates, or no steady state comes about, the linear answer.
    """
    vibration, discretization = linear.vibration, linear.discretization
    if vibration is None or discretization is None or not _bends(linear):
        return linear
    require_known(vibration.motion)
    for _ in range(ROUNDS):
        exact = settled_links(vibration, tolerance, TWICE * discretization.left_out)
        moving = replace(vibration, history=exact.displaced.history)
        in_elements, finer = time_error(moving, discretization.resolved)
        if finer is None or not exact.open <= tolerance:
            break
        vibration = resolved_in_time(discretization, finer, tolerance)[0]
    return replace(
        linear,
        deflection=_at_positions(exact.displaced, linear),
        elements=len(vibration.problem.terms.grid.steps),
        time_error=BESIDE * in_elements,
        reduction_error=exact.share,
        vibration=vibration,
        exact=exact,
    )


def _bends(linear: Elastodynamic) -> bool:
    """Whether beams vibrate, and come to a steady state."""
    vibration = linear.vibration
    return linear.stable and vibration is not None and bool(vibration.problem.terms.kinematics.structure.weights.size)


def _at_positions(displaced: Displaced, linear: Elastodynamic) -> Deflection:
    """Deflection of displaced links at the positions of the linear answer."""
    plain, grid = linear.quasi_static, displaced.vibration.problem.terms.grid
    time = plain.motion.time
    cycled = grid.edges[0] + np.mod(time - grid.edges[0], np.ptp(grid.edges)) if displaced.vibration.cyclic else time
    return exact_deflection(displaced, plain, grid.sampler(cycled))
