"""Linear second-order differential equations with time-dependent coefficients, solved by time elements.

Within an element, the acceleration is a polynomial through Radau points. This is the collocation method Radau IIA with
STAGES stages and order 2 STAGES - 1, which damps unresolved oscillation (Hairer and Wanner, Solving Ordinary
Differential Equations II, section IV.5). All elements are solved at once for unit initial states. Products of the
resulting small matrices give the periodic solution, the Floquet multipliers, or the solution from a given initial
state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.time_grid import Grid, scheme
from rigid.arrays import Flags, Numbers, Reals

RESOLVED = 2.0  # largest exponent of growth within an element that the method resolves
KEPT = 256  # matrices are stored for at most this many elements
TOGETHER = 500_000  # number of matrix entries that are solved at once, to limit memory


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations M x'' + C x' + K x = g at all points of a grid except the start.

    Attributes
    ----------
    mass, damping, stiffness
        M, C and K, shape (points, r, r).
    load
        g, shape (points, r).
    """

    mass: Reals
    damping: Reals
    stiffness: Reals
    load: Reals


@dataclass(frozen=True, eq=False)
class Propagation:
    """Propagation of the state x, x' over every element, from its start to its points and its end.

    Attributes
    ----------
    states
        Matrix that maps the state at the start of an element, extended by 1, to the state at its end, shape (elements,
        2 r, 2 r + 1).
    accelerations
        Matrix that maps the same vector to x'' at the points of the element, shape (elements, s, r, 2 r + 1).
    matrix
        Matrix of the equations for x'' at all points of an element, shape (elements, s r, s r), or None for large
        grids.
    """

    grid: Grid
    equations: Equations
    states: Reals
    accelerations: Reals
    matrix: Reals | None

    @cached_property
    def whole(self) -> tuple[Reals, Reals]:
        """Propagation over all elements: matrix, shape (2 r, 2 r), and additive state, shape (2 r,)."""
        size = self.states.shape[1]
        matrix, added = np.eye(size), np.zeros(size)
        for step in self.states:
            matrix, added = step[:, :-1] @ matrix, step[:, :-1] @ added + step[:, -1]
        return matrix, added

    @cached_property
    def multipliers(self) -> Numbers:
        """Floquet multipliers, i.e. the growth of free vibrations over the grid, complex, shape (2 r,).

        They are infinite if growth within an element is so fast that the method would damp it, see `outgrown`.
        """
        found = np.linalg.eigvals(self.whole[0])
        return np.full_like(found, np.inf) if outgrown(self.grid.steps, self.equations).any() else found

    @cached_property
    def inverse(self) -> Reals | None:
        """Inverse of `matrix`. It takes as long as solving four loads, and makes each load ten times faster."""
        return None if self.matrix is None else np.asarray(np.linalg.inv(self.matrix), float)

    def loaded(self, load: Reals, often: bool = False) -> Propagation:
        """Return the propagation under another load, shape (points, r); `often` prepares for many loads."""
        radau, count = scheme(self.grid.stages), len(self.grid.steps)
        states, accelerations = self.states.copy(), self.accelerations.copy()
        right = load.reshape(count, -1, 1)
        for part, steps, equations in _parts(self.grid, self.equations):
            x2: Any
            if often and self.inverse is not None:
                x2 = self.inverse[part] @ right[part]
            else:
                matrix = _matrix(steps, equations) if self.matrix is None else self.matrix[part]
                x2 = np.linalg.solve(matrix, right[part])
            x2 = x2.reshape(len(steps), self.grid.stages, -1)
            h = steps[:, None]
            accelerations[part, ..., -1] = x2
            states[part, :, -1] = np.concatenate((h**2 * (radau.twice[-1] @ x2), h * (radau.once[-1] @ x2)), axis=1)
        return Propagation(self.grid, replace(self.equations, load=load), states, accelerations, self.matrix)

    def periodic_start(self) -> Reals:
        """Return the initial state x, x' of the periodic solution, shape (2 r,)."""
        matrix, added = self.whole
        return np.asarray(np.linalg.solve(np.eye(len(added)) - matrix, added), float)

    def history(self, start: Reals) -> tuple[Reals, Reals, Reals]:
        """Return x, x', x'' at all points except the start, shape (points, r), for an initial state."""
        radau, r = scheme(self.grid.stages), len(start) // 2
        states = [start]
        for step in self.states[:-1]:
            states.append(step[:, :-1] @ states[-1] + step[:, -1])
        begin = np.append(np.array(states), np.ones((len(states), 1)), axis=1)
        x2 = (self.accelerations @ begin[:, None, :, None])[..., 0]
        h = self.grid.steps[:, None, None]
        at_start, rate = begin[:, None, :r], begin[:, None, r : 2 * r]
        x1 = rate + h * (radau.once @ x2)
        x = at_start + h * radau.points[:, None] * rate + h**2 * (radau.twice @ x2)
        return x.reshape(-1, r), x1.reshape(-1, r), x2.reshape(-1, r)


def propagation(grid: Grid, equations: Equations) -> Propagation:
    """Solve all elements for unit initial states and for the load."""
    count, r = len(grid.steps), equations.load.shape[-1]
    states, accelerations = np.empty((count, 2 * r, 2 * r + 1)), np.empty((count, grid.stages, r, 2 * r + 1))
    kept = np.empty((count, grid.stages * r, grid.stages * r)) if count <= KEPT else None
    for part, steps, own in _parts(grid, equations):
        matrix = _matrix(steps, own)
        states[part], accelerations[part] = _elements(matrix, steps, own)
        if kept is not None:
            kept[part] = matrix
    return Propagation(grid, equations, states, accelerations, kept)


def periodic_amplitudes(grid: Grid, equations: Equations) -> tuple[Numbers, Reals]:
    """Return the Floquet multipliers and periodic solutions of several problems on one grid.

    Parameters
    ----------
    equations
        Equations of all problems in sequence, in arrays of shape (problems * points, ...).

    Returns
    -------
    Multipliers, shape (problems, 2 r), and x at all points, shape (problems, points, r).
    """
    radau, r, count = scheme(grid.stages), equations.load.shape[-1], len(grid.steps)
    several = len(equations.load) // (count * grid.stages)
    steps = np.tile(grid.steps, several)
    states, accelerations = _elements(_matrix(steps, equations), steps, equations)
    states = states.reshape(several, count, 2 * r, 2 * r + 1)
    whole, added = np.broadcast_to(np.eye(2 * r), (several, 2 * r, 2 * r)), np.zeros((several, 2 * r, 1))
    for step in states.swapaxes(0, 1):
        whole, added = step[..., :-1] @ whole, step[..., :-1] @ added + step[..., -1:]
    state = np.linalg.solve(np.eye(2 * r) - whole, added)
    begin = np.ones((several, count, 2 * r + 1, 1))
    for element, step in enumerate(states.swapaxes(0, 1)):
        begin[:, element, :-1] = state
        state = step[..., :-1] @ state + step[..., -1:]
    shape = several, count, grid.stages, r
    x2 = (accelerations.reshape(several, count, -1, 2 * r + 1) @ begin).reshape(shape)
    h = grid.steps[:, None, None]
    at_start, rate = begin[..., None, :r, 0], begin[..., None, r : 2 * r, 0]
    x = at_start + h * radau.points[:, None] * rate + h**2 * (radau.twice @ x2)
    multipliers = np.linalg.eigvals(whole)
    multipliers[outgrown(steps, equations).reshape(several, -1).any(axis=1)] = np.inf
    return multipliers, x.reshape(several, -1, r)


def outgrown(steps: Reals, equations: Equations) -> Flags:
    """Return whether free vibrations grow by an exponent above `RESOLVED` in an element, shape (elements,).

    The growth is computed from the equations at each point. It occurs only if the stiffness is indefinite.
    """
    count, r = len(steps), equations.load.shape[-1]
    stiffness = equations.stiffness
    soft = _indefinite(stiffness + stiffness.swapaxes(-1, -2))
    rate = np.zeros(len(stiffness))
    if soft.any():
        mass, part = equations.mass[soft], np.zeros((np.count_nonzero(soft), 2 * r, 2 * r))
        scale = 1e-12 * np.trace(mass, axis1=-2, axis2=-1)[:, None, None] / r  # regularise massless coordinates
        inverse = np.linalg.inv(mass + scale * np.eye(r))
        part[:, :r, r:] = np.eye(r)
        part[:, r:, :r], part[:, r:, r:] = -inverse @ stiffness[soft], -inverse @ equations.damping[soft]
        rate[soft] = np.linalg.eigvals(part).real.max(axis=-1)
    return np.asarray((rate.reshape(count, -1) * steps[:, None] > RESOLVED).any(axis=1), bool)


def _indefinite(matrices: Reals) -> Flags:
    """True if a symmetric matrix has a negative eigenvalue, shape (matrices,)."""
    try:
        np.linalg.cholesky(matrices)  # fails if any is indefinite, and is much faster than eigenvalues
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(matrices)[:, 0] < 0.0, bool)
    return np.zeros(len(matrices), bool)


def _parts(grid: Grid, equations: Equations) -> Iterator[tuple[slice, Any, Equations]]:
    """Yield batches of elements: slice, durations, and equations."""
    size = max(1, grid.stages * equations.load.shape[-1])
    count = max(1, TOGETHER // size**2)
    for first in range(0, len(grid.steps), count):
        part = slice(first, first + count)
        points = slice(part.start * grid.stages, part.stop * grid.stages)
        yield part, grid.steps[part], Equations(*(values[points] for values in vars(equations).values()))


def _matrix(steps: Reals, equations: Equations) -> Reals:
    """Return the matrix of the equations for x'' at the points of elements, shape (elements, s r, s r)."""
    count, r = len(steps), equations.load.shape[-1]
    s = len(equations.load) // count
    radau = scheme(s)
    mass, damping, stiffness = (
        part.reshape(count, s, r, r) for part in (equations.mass, equations.damping, equations.stiffness)
    )
    ways = np.stack((steps[:, None, None] * radau.once, np.square(steps)[:, None, None] * radau.twice), axis=-1)
    both = np.stack((damping, stiffness), axis=2).reshape(count, s, 2, r * r)
    blocks = (ways @ both).reshape(count, s, s, r, r)
    diagonal = np.arange(s)
    blocks[:, diagonal, diagonal] += mass
    return np.ascontiguousarray(blocks.swapaxes(2, 3)).reshape(count, s * r, s * r)


def _elements(matrix: Reals, steps: Reals, equations: Equations) -> tuple[Reals, Reals]:
    """Return the states at the ends of elements and x'' at their points per initial state, extended by 1."""
    count, r = len(steps), equations.load.shape[-1]
    s = len(equations.load) // count
    radau = scheme(s)
    damping, stiffness = (part.reshape(count, s, r, r) for part in (equations.damping, equations.stiffness))
    h = steps[:, None, None, None]
    rate = -(stiffness * (h * radau.points[:, None, None]) + damping)
    right = np.concatenate((-stiffness, rate, equations.load.reshape(count, s, r, 1)), axis=-1)
    accelerations: Any = np.linalg.solve(matrix, right.reshape(count, s * r, -1))
    accelerations = accelerations.reshape(count, s, r, -1)
    h = h[..., 0]
    x1, x = (
        h * np.tensordot(radau.once[-1], accelerations, (0, 1)),
        h**2 * np.tensordot(radau.twice[-1], accelerations, (0, 1)),
    )
    unit = np.eye(r)
    x[:, :, :r] += unit
    x[:, :, r : 2 * r] += h * unit
    x1[:, :, r : 2 * r] += unit
    return np.concatenate((x, x1), axis=1), accelerations
