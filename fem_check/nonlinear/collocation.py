"""Solution of the equations of motion by Radau collocation, for a period or for a motion from an initial state.

The equations of motion and the constraints are satisfied at three instants of each step. The last of them is the end of
the step. Within a step, the coordinates are cubic polynomials in time (Radau IIA: Hairer and Wanner, Solving Ordinary
Differential Equations II, Springer 1996, section IV.5, and section VII.4 for constraints on positions). Vibrations that
are too fast for the step size are damped.

Newton's method solves for all instants together. Each of its linear systems is reduced to the changes of positions and
velocities at the step boundaries, and solved by a recursion from one boundary to the next (Ascher, Mattheij and
Russell, Numerical Solution of Boundary Value Problems, SIAM 1995, section 7.2).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import State, System, Tangents
from rigid import Reals

Progress = Callable[[float, str], None]
TOLERANCE = 1e-6
"""Default tolerance of Newton's method, see `Collocation.solved`."""
MIN_DEFLECTION = 1e-3
"""Smallest reference for relative changes: a displacement over the size of the mechanism, or a rotation [rad]."""
MAX_STEPS = 30
"""Maximum number of steps of Newton's method."""
MIN_STEPS, MAX_LATE_CHANGE = 12, 0.05
"""Newton's method gives up if the relative change exceeds MAX_LATE_CHANGE in any step after the first MIN_STEPS."""
MAX_CHANGE = 0.5
"""Largest change of a coordinate in a step of Newton's method, relative to the size of the mechanism, or [rad]."""
MAX_DISPLACEMENT = 1e3
"""Newton's method gives up beyond this displacement, relative to the size of the mechanism, or [rad]."""
MAX_LAST_CHANGE = 1e-2
"""Largest relative change in the last step of Newton's method if the next change is predicted from two changes."""
STAGES = 3
"""Number of instants in a time step at which the equations are satisfied."""


def radau(stages: int) -> tuple[Reals, Reals]:
    """Return the Radau instants and their differentiation matrix for a time step of length 1.

    The matrix is defined by: rates at the instants = matrix @ changes since the start of the step.

    Returns
    -------
    places
        Instants in (0, 1], shape (stages,). The last is 1.
    rates
        Differentiation matrix, shape (stages, stages).

    Examples
    --------
    >>> places, rates = radau(3)
    >>> bool(np.allclose(rates @ places**3, 3 * places**2))
    True
    """
    polynomial = np.poly1d([0.0] * (stages - 1), r=True) * np.poly1d([1.0] * stages, r=True)
    places = np.sort(np.roots(np.polyder(polynomial, stages - 1)).real)
    powers = np.arange(1, stages + 1)
    integrals = (places[:, None] ** powers / powers) @ np.linalg.inv(places[:, None] ** (powers - 1))
    return places, np.asarray(np.linalg.inv(integrals), float)


STAGE_TIMES, DIFFERENTIATION = radau(STAGES)
NODES = np.concatenate([[0.0], STAGE_TIMES])


class InitialState(Struct, frozen=True, eq=False):
    """Initial coordinates and rates, shape (coordinates,)."""

    q: Reals
    v: Reals


class CollocatedMotion(Struct, frozen=True, eq=False):
    """Motion over the steps between `edges` [s].

    Attributes
    ----------
    first
        Coordinates at the start of each step, shape (steps, coordinates).
    q, v, a
        Coordinates, rates and accelerations at the instants of each step, each of shape (steps, stages, coordinates).
    multipliers
        Lagrange multipliers of the constraints at these instants, shape (steps, stages, constraints).
    steps
        Number of iterations of Newton's method (not of time steps).
    """

    edges: Reals
    first: Reals
    q: Reals
    v: Reals
    a: Reals
    multipliers: Reals
    steps: int

    def at(self, time: Reals) -> Reals:
        """Interpolate the coordinates at given times [s], shape (times, coordinates)."""
        return _between(self.edges, np.concatenate([self.first[:, None], self.q], axis=1), NODES, time)

    def multipliers_at(self, time: Reals) -> Reals:
        """Interpolate the multipliers at given times [s], shape (times, constraints)."""
        return _between(self.edges, self.multipliers, STAGE_TIMES, time)


def _between(edges: Reals, values: Reals, nodes: Reals, time: Reals) -> Reals:
    """Interpolate values, shape (steps, nodes, n), by a polynomial in each step. `nodes` are in step lengths."""
    step = np.clip(np.searchsorted(edges, time, side="left") - 1, 0, len(edges) - 2)
    share = (time - edges[step]) / np.diff(edges)[step]
    power = np.arange(len(nodes))
    weights = share[:, None] ** power @ np.linalg.inv(nodes[:, None] ** power)
    return np.einsum("pi,pij->pj", weights, values[step])


class Collocation:
    """Equations of all time steps between the step boundaries `edges` [s].

    `start` is the initial state, or None for a periodic motion.
    """

    def __init__(self, system: System, edges: Reals, start: InitialState | None) -> None:
        self.system, self.edges, self.start = system, edges, start
        self.h = np.diff(edges)
        self.time = (edges[:-1, None] + self.h[:, None] * STAGE_TIMES).ravel()
        places = system.rigid.at(np.concatenate([edges[:1], self.time]))
        everywhere = system.rigid_coordinates(places)
        if start is None:
            system.rigid.require_period(places, edges[-1] - edges[0])
        self.shape = (len(self.h), STAGES)
        self.first, self.rigid = everywhere[0], everywhere[1:]
        self.full_turns = (
            np.where(system.turns, np.round((everywhere[-1] - everywhere[0]) / (2 * np.pi)), 0) * 2 * np.pi
        )
        self.drives, self.factor = system.drives(self.time), system.load_factors(self.time)
        self.unit, self.constraint_unit = system.unit, system.constraint_unit
        stiff = system.nodes.elements.stiffness
        self.energy_unit = float(np.median(stiff[:, 2, 2])) if len(stiff) else 1.0

    def solved(
        self, guess: tuple[Reals, Reals] | None = None, tolerance: float = TOLERANCE, progress: Progress | None = None
    ) -> CollocatedMotion:
        """Solve the equations by Newton's method.

        Parameters
        ----------
        guess
            Initial displacements from the rigid positions, shape (instants, coordinates), and initial multipliers,
            shape (instants, constraints). By default, all are zero.
        tolerance
            Tolerance of changes relative to the largest displacement from the rigid positions, or to `MIN_DEFLECTION`
            if this is larger. The solution is accepted if the last change is below the tolerance. It is also accepted
            if the last change is below `MAX_LAST_CHANGE` and the predicted next change, (last change)^2 / (previous
            change), is below the tolerance.
        progress
            Function that is called after each step of Newton's method with a share of the work and a message.

        Raises
        ------
        DoesNotCloseError
            If Newton's method does not converge.
        """
        system, free = self.system, self.system.free
        q, multipliers = self.rigid.copy(), np.zeros((len(self.time), len(self.constraint_unit)))
        if guess is not None:
            q[:, free] += guess[0][:, free]
            multipliers = guess[1].copy()
        system.prescribe(q, self.drives)
        relative_change, assumed, before = 1.0, None, np.inf
        for step in range(MAX_STEPS):
            first, v, a = self.rates(q)
            residual, tangents, state = self._equations(q, v, a, multipliers, assumed)
            change = self._newton_step(tangents, residual)
            moved = change[:, : len(free)]
            share = min(1.0, MAX_CHANGE / max(np.abs(moved).max(initial=0.0), 1e-300))
            change_of_q = np.zeros_like(q)
            change_of_q[:, free] = share * moved * self.unit
            assumed = system.predicted(state, change_of_q, self._rates_of_change(change_of_q))
            q = q + change_of_q
            multipliers = multipliers + share * change[:, len(free) :] * self.energy_unit / self.constraint_unit
            largest = np.abs((q - self.rigid)[:, free] / self.unit).max(initial=0.0)
            relative_change = share * np.abs(moved).max(initial=0.0) / max(largest, MIN_DEFLECTION)
            if progress:
                progress(min(0.99, (step + 1) / 10), f"Newton's step {step + 1}: changes {relative_change:.1e}")
            too_late = step >= MIN_STEPS and relative_change > MAX_LATE_CHANGE
            if not np.isfinite(relative_change) or largest > MAX_DISPLACEMENT or too_late:
                break
            next_is_small = before < 1.0 and relative_change**2 < tolerance * before
            next_is_small = next_is_small and relative_change < MAX_LAST_CHANGE
            if share == 1.0 and (relative_change < tolerance or next_is_small):
                first, v, a = self.rates(q)
                known = [values.reshape(*self.shape, -1) for values in (q, v, a, multipliers)]
                return CollocatedMotion(self.edges, first, known[0], known[1], known[2], known[3], step + 1)
            before = relative_change
        raise DoesNotCloseError(
            f"Newton's method does not converge in {step + 1} steps: last relative change {relative_change:.1e}"
        )

    def rates(self, q: Reals) -> tuple[Reals, Reals, Reals]:
        """Return coordinates at the starts of the steps, shape (steps, coordinates), and rates and accelerations.

        The rates and accelerations are those at all instants, shape (instants, coordinates).
        """
        if self.start is None:
            first = q[-1] - self.full_turns
            return self._derivatives(q, first, None)
        return self._derivatives(q, self.start.q, self.start.v)

    def _rates_of_change(self, change: Reals) -> Reals:
        nothing = np.zeros(change.shape[1])
        if self.start is None:
            return self._derivatives(change, change[-1], None)[1]
        return self._derivatives(change, nothing, nothing)[1]

    def _derivatives(self, q: Reals, first: Reals, speed: Reals | None) -> tuple[Reals, Reals, Reals]:
        values = q.reshape(*self.shape, -1)
        starts = np.concatenate([first[None], values[:-1, -1]])
        v = (DIFFERENTIATION @ (values - starts[:, None])) / self.h[:, None, None]
        speeds = np.concatenate([v[-1:, -1] if speed is None else speed[None], v[:-1, -1]])
        a = (DIFFERENTIATION @ (v - speeds[:, None])) / self.h[:, None, None]
        return starts, v.reshape(q.shape), a.reshape(q.shape)

    def _equations(
        self, q: Reals, v: Reals, a: Reals, multipliers: Reals, assumed: Reals | None
    ) -> tuple[Reals, Tangents, State]:
        """Return the scaled residual, shape (instants, free + constraints), the scaled tangents, and the state."""
        total, state, tangents = self.system.residual(q, v, a, multipliers, self.drives, self.factor, assumed=assumed)
        assert tangents is not None
        unit, energy = self.unit, self.energy_unit
        residual = np.concatenate(
            [total[:, self.system.free] * unit / energy, state.violation / self.constraint_unit], axis=1
        )
        both = unit[:, None] * unit / energy
        K, C, M = (both * matrix for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        return residual, Tangents(K, C, M, tangents.rows * unit / self.constraint_unit[:, None]), state

    def _newton_step(self, tangents: Tangents, residual: Reals) -> Reals:
        """Solve for the changes of the scaled coordinates and multipliers, shape (instants, free + constraints)."""
        count, free = self.shape[0], len(self.unit)
        size = residual.shape[1]
        known = np.empty((count, STAGES * size, 1 + 2 * free))
        for selected in np.array_split(np.arange(count), max(1, count * (STAGES * size) ** 2 // 2_000_000)):
            known[selected] = self._step_responses(tangents, residual, selected)
        last = known[:, (STAGES - 1) * size : (STAGES - 1) * size + free]
        stages = known.reshape(count, STAGES, size, -1)[:, :, :free]
        # the velocity at the end of a step follows from the positions at its instants and at its start
        speed = np.einsum("j,kjmc->kmc", DIFFERENTIATION[-1], stages)
        speed[:, :, 1 : 1 + free] -= DIFFERENTIATION[-1].sum() * np.eye(free)
        speed /= self.h[:, None, None]
        transfer = np.concatenate([last, speed], axis=1)
        starts = self._boundary_changes(transfer)
        change = known[:, :, 0] + (known[:, :, 1:] @ starts[:, :, None])[:, :, 0]
        return change.reshape(count * STAGES, size)

    def _step_responses(self, tangents: Tangents, residual: Reals, selected: Any) -> Reals:
        """Return the changes at the instants of the steps `selected`, shape (steps, stages x size, 1 + 2 free).

        The first column is due to the residual. The other columns are due to unit changes of the positions and then of
        the velocities at the start of the step. `size` is the number of free coordinates and constraints.
        """
        free, size = len(self.unit), residual.shape[1]
        rows = (selected[:, None] * STAGES + np.arange(STAGES)).ravel()
        K, C, M, G = (
            part[rows].reshape(len(selected), STAGES, *part.shape[1:])
            for part in (tangents.stiffness, tangents.damping, tangents.mass, tangents.rows)
        )
        h = self.h[selected][:, None, None, None]
        twice = DIFFERENTIATION @ DIFFERENTIATION
        table = np.zeros((len(selected), STAGES, size, STAGES, size))
        right = np.zeros((len(selected), STAGES, size, 1 + 2 * free))
        for i in range(STAGES):
            for j in range(STAGES):
                table[:, i, :free, j, :free] = (
                    DIFFERENTIATION[i, j] / h[:, 0] * C[:, i] + twice[i, j] / h[:, 0] ** 2 * M[:, i]
                )
            table[:, i, :free, i, :free] += K[:, i]
            table[:, i, free:, i, :free] = G[:, i]
            table[:, i, :free, i, free:] = np.swapaxes(G[:, i], 1, 2)
            by_place = DIFFERENTIATION[i].sum() / h[:, 0] * C[:, i] + twice[i].sum() / h[:, 0] ** 2 * M[:, i]
            right[:, i, :free, 1 : 1 + free] = by_place
            right[:, i, :free, 1 + free :] = DIFFERENTIATION[i].sum() / h[:, 0] * M[:, i]
        right[..., 0] = -residual[rows].reshape(len(selected), STAGES, size)
        flat = STAGES * size
        try:
            return np.asarray(
                np.linalg.solve(table.reshape(-1, flat, flat), right.reshape(-1, flat, 1 + 2 * free)), float
            )
        except np.linalg.LinAlgError:
            raise DoesNotCloseError(
                "the equations of a step are singular: a part without mass is unconstrained, or constraints are "
                "redundant"
            ) from None

    def _boundary_changes(self, transfer: Reals) -> Reals:
        """Solve for the changes of positions and velocities at the starts of all steps, shape (steps, 2 free).

        Column 0 of `transfer`, shape (steps, 2 free, 1 + 2 free), is the change at the end of each step due to the
        residual. The other columns are due to unit changes at the start of the step.
        """
        count, both = transfer.shape[:2]
        here = np.zeros(both)
        if self.start is None:
            through, accumulated = np.eye(both), np.zeros(both)
            for step in transfer:
                accumulated = step[:, 0] + step[:, 1:] @ accumulated
                through = step[:, 1:] @ through
            try:
                here = np.asarray(np.linalg.solve(np.eye(both) - through, accumulated), float)
            except np.linalg.LinAlgError:
                raise DoesNotCloseError(
                    "the equations of the cycle are singular: a part is unconstrained, or the cycle excites an "
                    "undamped resonance"
                ) from None
        starts = np.empty((count, both))
        for k, step in enumerate(transfer):
            starts[k] = here
            here = step[:, 0] + step[:, 1:] @ here
        return starts
