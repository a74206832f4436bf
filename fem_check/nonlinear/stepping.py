"""Integration of a motion a few time steps at a time, over a run or over periods until the motion is periodic.

If links bend much or vibrate near resonance, Newton's method for all steps of a cycle starts too far from the solution
and fails. Here only a few steps are solved together, starting from the solution of the previous steps, so that each
group of steps starts close to its solution.
"""

from collections.abc import Iterator

import numpy as np

from fem_check.nonlinear.collocation import STAGES, CollocatedMotion, Collocation, InitialState
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import System
from rigid import Reals

STEPS_PER_GROUP = 4
"""Largest number of steps that are solved together."""
MAX_SUBDIVISION = 32.0
"""A step that fails is halved, unless it is shorter than the shortest requested step divided by this number."""


def slowest_vibration(system: System) -> float:
    """Return the lowest natural frequency of the unloaded mechanism at the start with locked drives [rad/s]."""
    from scipy.linalg import eigh, null_space

    begin = np.array([system.rigid.start])
    q = system.rigid_coordinates(system.rigid.at(begin))
    system.prescribe(q, system.drives(begin))
    multipliers, rates = np.zeros((1, len(system.ties.constraints))), np.zeros_like(q)
    tangents = system.residual(q, rates, rates, multipliers, system.drives(begin), 0 * system.load_factors(begin))[2]
    assert tangents is not None
    free = null_space(tangents.rows[0]) if len(system.ties.constraints) else np.eye(len(system.free))
    if not free.size:
        return 0.0
    K, M = (free.T @ (matrix + matrix.T) @ free for matrix in (tangents.stiffness[0], tangents.mass[0]))
    slowness = eigh(M, K + 1e-12 * np.trace(K) * np.eye(len(K)), eigvals_only=True)[-1]
    return float(slowness**-0.5) if slowness > 0 else 0.0


def periods(
    system: System, edges: Reals, start: InitialState, tolerance: float, max_periods: int
) -> Iterator[CollocatedMotion]:
    """Integrate periods one after another, and yield the motion over each.

    Each period starts from the state at the end of the previous one. Full turns of rotations are subtracted.

    Parameters
    ----------
    edges
        Step boundaries of the first period [s].
    tolerance
        Tolerance of Newton's method, see `Collocation.solved`.

    Raises
    ------
    DoesNotCloseError
        If a step does not converge.
    """
    turned = Collocation(system, edges, None).full_turns
    before: CollocatedMotion | None = None
    for _ in range(max_periods):
        before = stepped(system, edges if before is None else before.edges, start, tolerance, before)
        yield before
        start = InitialState(before.q[-1, -1] - turned, before.v[-1, -1])


def stepped(
    system: System, edges: Reals, start: InitialState, tolerance: float, before: CollocatedMotion | None = None
) -> CollocatedMotion:
    """Integrate over all time steps, subdividing steps if Newton's method fails.

    Parameters
    ----------
    edges
        Step boundaries [s].
    tolerance
        Tolerance of Newton's method, see `Collocation.solved`.
    before
        Similar motion over the same interval, used as the initial guess.

    Raises
    ------
    DoesNotCloseError
        If Newton's method fails for a step shorter than 1/`MAX_SUBDIVISION` of the shortest requested step.
    """
    done: list[CollocatedMotion] = []
    remaining_edges, group_size, shortest = list(edges), STEPS_PER_GROUP, np.diff(edges).min() / MAX_SUBDIVISION
    multipliers = np.zeros(len(system.ties.constraints))
    while len(remaining_edges) > 1:
        equations = Collocation(system, np.array(remaining_edges[: group_size + 1]), start)
        moved, pulled = _extrapolated(equations), np.broadcast_to(multipliers, (len(equations.time), len(multipliers)))
        if before is not None:
            known = before.at(equations.time) - equations.rigid
            moved, pulled = known + (start.q - before.at(equations.edges[:1])), before.multipliers_at(equations.time)
        try:
            done.append(equations.solved((moved, pulled), tolerance))
        except DoesNotCloseError:
            if group_size == 1 and remaining_edges[1] - remaining_edges[0] < shortest:
                raise
            if group_size == 1:
                remaining_edges.insert(1, (remaining_edges[0] + remaining_edges[1]) / 2)
            group_size = 1
            continue
        last = done[-1]
        remaining_edges, multipliers = remaining_edges[group_size:], last.multipliers[-1, -1]
        start = InitialState(last.q[-1, -1], last.v[-1, -1])
        group_size = min(2 * group_size, STEPS_PER_GROUP)
    edges = np.concatenate([done[0].edges[:1], *(part.edges[1:] for part in done)])
    first, q, v, a, multipliers = (
        np.concatenate(parts)
        for parts in zip(*((part.first, part.q, part.v, part.a, part.multipliers) for part in done), strict=True)
    )
    return CollocatedMotion(edges, first, q, v, a, multipliers, max(part.steps for part in done))


def _extrapolated(equations: Collocation) -> Reals:
    """Extrapolate the initial displacements from the rigid positions, at a constant rate.

    The shape is (instants, coordinates).
    """
    assert equations.start is not None
    time = equations.time - equations.edges[0]
    near = np.concatenate([[0.0], time[:STAGES]])
    places = np.concatenate([equations.first[None], equations.rigid[:STAGES]])
    rigid_rate = np.linalg.solve(near[:, None] ** np.arange(STAGES + 1), places)[1]
    return equations.start.q - equations.first + time[:, None] * (equations.start.v - rigid_rate)
