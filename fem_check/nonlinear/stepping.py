"""Integration of a motion a few time steps at a time, over a run or over periods towards a cycle.

If links bend much or vibrate near resonance, Newton's method for all steps of a cycle starts too far from the solution
and fails. If only a few steps are solved together, starting from the previous ones, changes remain small.
"""

from collections.abc import Iterator

import numpy as np

from fem_check.nonlinear.collocation import STAGES, Beginning, CollocatedMotion, Collocation
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import System
from rigid import Reals

STEPS_PER_GROUP = 4
"""Number of steps that are solved together as long as this converges."""
MAX_SUBDIVISION = 32.0
"""Largest ratio of a requested step to its subdivided steps."""


def slowest_vibration(system: System) -> float:
    """Return the lowest natural frequency of the unloaded mechanism at the start with locked drives [rad/s]."""
    from scipy.linalg import eigh, null_space

    begin = np.array([system.rigid.start])
    q = system.rigid_coordinates(system.rigid.at(begin))
    system.prescribe(q, system.drives(begin))
    pulls, rates = np.zeros((1, len(system.ties.conditions))), np.zeros_like(q)
    tangents = system.residual(q, rates, rates, pulls, system.drives(begin), 0 * system.load_factors(begin))[2]
    assert tangents is not None
    free = null_space(tangents.rows[0]) if len(system.ties.conditions) else np.eye(len(system.free))
    if not free.size:
        return 0.0
    K, M = (free.T @ (matrix + matrix.T) @ free for matrix in (tangents.stiffness[0], tangents.mass[0]))
    slowness = eigh(M, K + 1e-12 * np.trace(K) * np.eye(len(K)), eigvals_only=True)[-1]
    return float(slowness**-0.5) if slowness > 0 else 0.0


def periods(system: System, edges: Reals, start: Beginning, settled: float, most: int) -> Iterator[CollocatedMotion]:
    """Yield successive periods, each starting from the end of the previous one, minus full turns.

    Raises
    ------
    DoesNotCloseError
        If a step does not converge.
    """
    turned = Collocation(system, edges, None).turned
    before: CollocatedMotion | None = None
    for _ in range(most):
        before = stepped(system, edges if before is None else before.edges, start, settled, before)
        yield before
        start = Beginning(before.q[-1, -1] - turned, before.v[-1, -1])


def stepped(
    system: System, edges: Reals, start: Beginning, settled: float, before: CollocatedMotion | None = None
) -> CollocatedMotion:
    """Integrate over all steps between the instants `edges` [s], subdividing steps if Newton's method fails.

    Parameters
    ----------
    settled
        Tolerance of Newton's method, relative to the largest deflection.
    before
        A nearby motion over the same interval, used as the initial guess.

    Raises
    ------
    DoesNotCloseError
        If the shortest step does not converge.
    """
    done: list[CollocatedMotion] = []
    left, together, shortest = list(edges), STEPS_PER_GROUP, np.diff(edges).min() / MAX_SUBDIVISION
    pulls = np.zeros(len(system.ties.conditions))
    while len(left) > 1:
        equations = Collocation(system, np.array(left[: together + 1]), start)
        moved, pulled = _expected(equations), np.broadcast_to(pulls, (len(equations.time), len(pulls)))
        if before is not None:
            known = before.at(equations.time) - equations.rigid
            moved, pulled = known + (start.q - before.at(equations.edges[:1])), before.pulls_at(equations.time)
        try:
            done.append(equations.solved((moved, pulled), settled))
        except DoesNotCloseError:
            if together == 1 and left[1] - left[0] < shortest:
                raise
            if together == 1:
                left.insert(1, (left[0] + left[1]) / 2)
            together = 1
            continue
        last = done[-1]
        left, start, pulls = left[together:], Beginning(last.q[-1, -1], last.v[-1, -1]), last.pulls[-1, -1]
        together = min(2 * together, STEPS_PER_GROUP)
    edges = np.concatenate([done[0].edges[:1], *(part.edges[1:] for part in done)])
    first, q, v, a, pulls = (
        np.concatenate(parts)
        for parts in zip(*((part.first, part.q, part.v, part.a, part.pulls) for part in done), strict=True)
    )
    return CollocatedMotion(edges, first, q, v, a, pulls, max(part.steps for part in done))


def _expected(equations: Collocation) -> Reals:
    """Extrapolate the displacements from the initial state, shape (instants, coordinates)."""
    assert equations.start is not None
    time = equations.time - equations.edges[0]
    near = np.concatenate([[0.0], time[:STAGES]])
    places = np.concatenate([equations.first[None], equations.rigid[:STAGES]])
    rigid_rate = np.linalg.solve(near[:, None] ** np.arange(STAGES + 1), places)[1]
    return equations.start.q - equations.first + time[:, None] * (equations.start.v - rigid_rate)
