"""Linear second-order differential equations with time-dependent coefficients, solved by time elements.

Within an element, the acceleration is a polynomial through its values at Radau points. This is the collocation method
Radau IIA with STAGES stages and order 2 STAGES - 1, which damps unresolved oscillation (Hairer and Wanner, Solving
Ordinary Differential Equations II, section IV.5). All elements are solved at once, for each unit initial state and for
the load. The results are small matrices. Their products give the periodic solution, the Floquet multipliers, or the
solution from a given initial state.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, replace

from elastic.elastodynamics.time_grid import Grid, scheme
from rigid.arrays import Flags, Numbers, Reals

# the growth of a vibration is resolved if its growth rate times the duration of the element is at most this
MAX_GROWTH_EXPONENT = 2.0
MAX_STORED_ELEMENTS = 256  # matrices are stored only if there are at most this many elements
MAX_ENTRIES_AT_ONCE = 500_000  # approximate maximum number of matrix entries per batch of elements, to limit memory


class Equations(Struct, frozen=True, eq=False):
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


class Propagation(Struct, frozen=True, eq=False, dict=True):
    """Linear maps from the state (x, x') at the start of each element to its end, and to x'' at its s points.

    Attributes
    ----------
    states
        Matrix that maps (x, x', 1) at the start of an element to (x, x') at its end, shape (elements, 2 r, 2 r + 1).
    accelerations
        Matrix that maps (x, x', 1) at the start of an element to x'' at its points, shape (elements, s, r, 2 r + 1).
    matrix
        Matrix of the linear equations for x'' at the points of an element, shape (elements, s r, s r). It is None if
        there are more than MAX_STORED_ELEMENTS elements.
    """

    grid: Grid
    equations: Equations
    states: Reals
    accelerations: Reals
    matrix: Reals | None

    @cached_property
    def monodromy(self) -> tuple[Reals, Reals]:
        """Matrix A, shape (2 r, 2 r), and vector b, shape (2 r,): state at the end = A * state at the start + b."""
        size = self.states.shape[1]
        matrix, added = np.eye(size), np.zeros(size)
        for step in self.states:
            matrix, added = step[:, :-1] @ matrix, step[:, :-1] @ added + step[:, -1]
        return matrix, added

    @cached_property
    def multipliers(self) -> Numbers:
        """Floquet multipliers (factors by which free vibrations grow over the grid), complex, shape (2 r,).

        They are set to infinity if a vibration grows so fast that an element does not resolve it, see
        `growth_unresolved`, or that numbers overflow.
        """
        matrix = self.monodromy[0]
        if not np.isfinite(matrix).all() or growth_unresolved(self.grid.steps, self.equations).any():
            return np.full(len(matrix), np.inf, complex)
        return np.linalg.eigvals(matrix)

    @cached_property
    def inverse(self) -> Reals | None:
        """Inverse of `matrix`, or None if `matrix` is None.

        The inversion takes as long as the solution for four loads. It makes each further solution ten times faster.
        """
        return None if self.matrix is None else np.asarray(np.linalg.inv(self.matrix), float)

    def loaded(self, load: Reals, often: bool = False) -> Propagation:
        """Return the propagation under another load, shape (points, r).

        Set `often` if there will be many calls, so that it is worthwhile to invert `matrix`.
        """
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
            states[part, :, -1] = np.concatenate(
                (h**2 * (radau.double_integral[-1] @ x2), h * (radau.integral[-1] @ x2)), axis=1
            )
        return Propagation(self.grid, replace(self.equations, load=load), states, accelerations, self.matrix)

    def periodic_start(self) -> Reals:
        """Return the initial state x, x' of the periodic solution, shape (2 r,)."""
        matrix, added = self.monodromy
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
        x1 = rate + h * (radau.integral @ x2)
        x = at_start + h * radau.points[:, None] * rate + h**2 * (radau.double_integral @ x2)
        return x.reshape(-1, r), x1.reshape(-1, r), x2.reshape(-1, r)


def propagation(grid: Grid, equations: Equations) -> Propagation:
    """Solve the equations in all elements, for unit initial states and for the load."""
    count, r = len(grid.steps), equations.load.shape[-1]
    states, accelerations = np.empty((count, 2 * r, 2 * r + 1)), np.empty((count, grid.stages, r, 2 * r + 1))
    stored = np.empty((count, grid.stages * r, grid.stages * r)) if count <= MAX_STORED_ELEMENTS else None
    for part, steps, part_equations in _parts(grid, equations):
        matrix = _matrix(steps, part_equations)
        states[part], accelerations[part] = _elements(matrix, steps, part_equations)
        if stored is not None:
            stored[part] = matrix
    return Propagation(grid, equations, states, accelerations, stored)


def periodic_amplitudes(grid: Grid, equations: Equations) -> tuple[Numbers, Reals]:
    """Return the Floquet multipliers and the periodic solutions of several problems on the same grid.

    Parameters
    ----------
    equations
        Equations of all problems, one after another, in arrays of shape (problems * points, ...).

    Returns
    -------
    Multipliers, shape (problems, 2 r), and x at all points, shape (problems, points, r).
    """
    radau, r, count = scheme(grid.stages), equations.load.shape[-1], len(grid.steps)
    several = len(equations.load) // (count * grid.stages)
    steps = np.tile(grid.steps, several)
    states, accelerations = _elements(_matrix(steps, equations), steps, equations)
    states = states.reshape(several, count, 2 * r, 2 * r + 1)
    monodromy, added = np.broadcast_to(np.eye(2 * r), (several, 2 * r, 2 * r)), np.zeros((several, 2 * r, 1))
    for step in states.swapaxes(0, 1):
        monodromy, added = step[..., :-1] @ monodromy, step[..., :-1] @ added + step[..., -1:]
    state = np.linalg.solve(np.eye(2 * r) - monodromy, added)
    begin = np.ones((several, count, 2 * r + 1, 1))
    for element, step in enumerate(states.swapaxes(0, 1)):
        begin[:, element, :-1] = state
        state = step[..., :-1] @ state + step[..., -1:]
    shape = several, count, grid.stages, r
    x2 = (accelerations.reshape(several, count, -1, 2 * r + 1) @ begin).reshape(shape)
    h = grid.steps[:, None, None]
    at_start, rate = begin[..., None, :r, 0], begin[..., None, r : 2 * r, 0]
    x = at_start + h * radau.points[:, None] * rate + h**2 * (radau.double_integral @ x2)
    multipliers = np.linalg.eigvals(monodromy)
    multipliers[growth_unresolved(steps, equations).reshape(several, -1).any(axis=1)] = np.inf
    return multipliers, x.reshape(several, -1, r)


def growth_unresolved(steps: Reals, equations: Equations) -> Flags:
    """Return for each element whether a vibration grows too fast to be resolved, shape (elements,).

    This is the case if the product (growth rate * duration) exceeds `MAX_GROWTH_EXPONENT` at a point of the element.
    Growth rates are computed only at points with an indefinite stiffness matrix; elsewhere they are taken as 0.
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
    return np.asarray((rate.reshape(count, -1) * steps[:, None] > MAX_GROWTH_EXPONENT).any(axis=1), bool)


def _indefinite(matrices: Reals) -> Flags:
    """Return for each symmetric matrix whether it has a negative eigenvalue, shape (matrices,)."""
    try:
        np.linalg.cholesky(matrices)  # fails if one matrix is indefinite; this test is much faster than eigenvalues
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(matrices)[:, 0] < 0.0, bool)
    return np.zeros(len(matrices), bool)


def _parts(grid: Grid, equations: Equations) -> Iterator[tuple[slice, Any, Equations]]:
    """Yield batches of elements: the slice of the elements, their durations, and their equations."""
    size = max(1, grid.stages * equations.load.shape[-1])
    count = max(1, MAX_ENTRIES_AT_ONCE // size**2)
    for first in range(0, len(grid.steps), count):
        part = slice(first, first + count)
        points = slice(part.start * grid.stages, part.stop * grid.stages)
        yield part, grid.steps[part], Equations(*(values[points] for values in astuple(equations)))


def _matrix(steps: Reals, equations: Equations) -> Reals:
    """Return the matrix of the linear equations for x'' at the points of elements, shape (elements, s r, s r)."""
    count, r = len(steps), equations.load.shape[-1]
    s = len(equations.load) // count
    radau = scheme(s)
    mass, damping, stiffness = (
        part.reshape(count, s, r, r) for part in (equations.mass, equations.damping, equations.stiffness)
    )
    factors = np.stack(
        (steps[:, None, None] * radau.integral, np.square(steps)[:, None, None] * radau.double_integral), axis=-1
    )
    both = np.stack((damping, stiffness), axis=2).reshape(count, s, 2, r * r)
    blocks = (factors @ both).reshape(count, s, s, r, r)
    diagonal = np.arange(s)
    blocks[:, diagonal, diagonal] += mass
    return np.ascontiguousarray(blocks.swapaxes(2, 3)).reshape(count, s * r, s * r)


def _elements(matrix: Reals, steps: Reals, equations: Equations) -> tuple[Reals, Reals]:
    """Return `states` and `accelerations` of `Propagation`, for elements with the given durations."""
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
        h * np.tensordot(radau.integral[-1], accelerations, (0, 1)),
        h**2 * np.tensordot(radau.double_integral[-1], accelerations, (0, 1)),
    )
    unit = np.eye(r)
    x[:, :, :r] += unit
    x[:, :, r : 2 * r] += h * unit
    x1[:, :, r : 2 * r] += unit
    return np.concatenate((x, x1), axis=1), accelerations
