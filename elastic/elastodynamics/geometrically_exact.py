"""Geometrically exact elastodynamics: the whole theory of beams, from the answer of small displacements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elastic.elastodynamics.displaced_points import require_known
from elastic.elastodynamics.exact_steps import exact_deflection, settled_links
from elastic.elastodynamics.solution import ROUNDS, TOLERANCE, TWICE, Elastodynamic, resolved_in_time, time_error

BESIDE = 4.0  # times as much as of the coordinates do elements leave open of what lies beside them, at most


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
    if (
        vibration is None
        or discretization is None
        or not linear.stable
        or not vibration.problem.terms.kinematics.structure.weights.size
    ):
        return linear
    require_known(vibration.motion)
    for _ in range(ROUNDS):
        exact = settled_links(vibration, tolerance, TWICE * discretization.left_out)
        moving = replace(vibration, history=exact.displaced.history)
        in_elements, finer = time_error(moving, discretization.resolved)
        if finer is None or not exact.open <= tolerance:
            break
        vibration = resolved_in_time(discretization, finer, tolerance)[0]
    grid = vibration.problem.terms.grid
    plain, time = linear.quasi_static, linear.quasi_static.motion.time
    cycled = grid.edges[0] + np.mod(time - grid.edges[0], np.ptp(grid.edges)) if vibration.cyclic else time
    return replace(
        linear,
        deflection=exact_deflection(exact.displaced, plain, grid.sampler(cycled)),
        elements=len(grid.steps),
        time_error=BESIDE * in_elements,
        reduction_error=exact.share,
        vibration=vibration,
        exact=exact,
    )
