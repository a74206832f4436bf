"""Radau collocation over many time steps, for a period or for a motion from an initial state.

The equations of motion and the constraints are satisfied at three instants of each step, the last of which is its end.
The coordinates are cubic polynomials in time (Radau IIA: Hairer and Wanner, Solving Ordinary Differential Equations II,
Springer 1996, section IV.5, and section VII.4 for constraints on positions). Vibrations that the steps do not resolve
are damped. Newton's method solves for all instants together. Its linear systems are condensed to the positions and
velocities between the steps and solved exactly (Ascher, Mattheij and Russell, Numerical Solution of Boundary Value
Problems, SIAM 1995, section 7.2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import State, System, Tangents
from rigid import Reals

Progress = Callable[[float, str], None]
TOLERANCE = 1e-6
"""Largest change in the last step of Newton's method, relative to the largest deflection."""
MIN_DEFLECTION = 1e-3
"""Smallest reference deflection, relative to the size of the mechanism."""
MAX_STEPS = 30
MIN_STEPS, MAX_LATE_CHANGE = 12, 0.05
"""Newton's method stops after MIN_STEPS if the relative change exceeds MAX_LATE_CHANGE."""
MAX_CHANGE = 0.5
STAGES = 3


def radau(stages: int) -> tuple[Reals, Reals]:
    """Return the Radau instants on [0, 1], and the matrix that converts differences from the start to rates.

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


PLACES, RATES = radau(STAGES)
NODES = np.concatenate([[0.0], PLACES])


@dataclass(frozen=True, eq=False)
class Beginning:
    """Initial coordinates and rates, shape (coordinates,)."""

    q: Reals
    v: Reals


@dataclass(frozen=True, eq=False)
class CollocatedMotion:
    """Motion over the steps between `edges` [s].

    Attributes
    ----------
    first
        Coordinates at the start of each step, shape (steps, coordinates).
    q, v, a, pulls
        Coordinates, rates, accelerations and multipliers at the instants of each step, shape (steps, stages, ...).
    """

    edges: Reals
    first: Reals
    q: Reals
    v: Reals
    a: Reals
    pulls: Reals
    steps: int

    def at(self, time: Reals) -> Reals:
        """Interpolate the coordinates at any instants, shape (instants, coordinates)."""
        return _between(self.edges, np.concatenate([self.first[:, None], self.q], axis=1), NODES, time)

    def pulls_at(self, time: Reals) -> Reals:
        """Interpolate the multipliers at any instants, shape (instants, constraints)."""
        return _between(self.edges, self.pulls, PLACES, time)


def _between(edges: Reals, values: Reals, nodes: Reals, time: Reals) -> Reals:
    """Interpolate values by the polynomials of the steps."""
    step = np.clip(np.searchsorted(edges, time, side="left") - 1, 0, len(edges) - 2)
    share = (time - edges[step]) / np.diff(edges)[step]
    power = np.arange(len(nodes))
    weights = share[:, None] ** power @ np.linalg.inv(nodes[:, None] ** power)
    return np.einsum("pi,pij->pj", weights, values[step])


class Collocation:
    """Equations of all steps between given instants `edges` [s]."""

    def __init__(self, system: System, edges: Reals, start: Beginning | None) -> None:
        self.system, self.edges, self.start = system, edges, start
        self.h = np.diff(edges)
        self.time = (edges[:-1, None] + self.h[:, None] * PLACES).ravel()
        places = system.rigid.at(np.concatenate([edges[:1], self.time]))
        everywhere = system.rigid_coordinates(places)
        if start is None:
            system.rigid.require_period(places, edges[-1] - edges[0])
        self.shape = (len(self.h), STAGES)
        self.first, self.rigid = everywhere[0], everywhere[1:]
        self.turned = np.where(system.turns, np.round((everywhere[-1] - everywhere[0]) / (2 * np.pi)), 0) * 2 * np.pi
        self.drives, self.factor = system.drives(self.time), system.load_factors(self.time)
        self.unit, self.gap = system.unit, system.gap
        stiff = system.nodes.elements.stiffness
        self.energy = float(np.median(stiff[:, 2, 2])) if len(stiff) else 1.0

    def solved(
        self, guess: tuple[Reals, Reals] | None = None, settled: float = TOLERANCE, progress: Progress | None = None
    ) -> CollocatedMotion:
        """Solve the equations by Newton's method.

        `guess` contains displacements from the rigid positions and multipliers, shape (instants, ...). `settled` is the
        largest accepted change in the last step, relative to the largest deflection.

        Raises
        ------
        DoesNotCloseError
            If Newton's method does not converge.
        """
        system, free = self.system, self.system.free
        q, pulls = self.rigid.copy(), np.zeros((len(self.time), len(self.gap)))
        if guess is not None:
            q[:, free] += guess[0][:, free]
            pulls = guess[1].copy()
        system.prescribe(q, self.drives)
        fading, assumed, before = 1.0, None, np.inf
        for step in range(MAX_STEPS):
            first, v, a = self.rates(q)
            residual, tangents, state = self._equations(q, v, a, pulls, assumed)
            change = self._newton_step(tangents, residual)
            moved = change[:, : len(free)]
            share = min(1.0, MAX_CHANGE / max(np.abs(moved).max(initial=0.0), 1e-300))
            made = np.zeros_like(q)
            made[:, free] = share * moved * self.unit
            assumed = system.predicted(state, made, self._rates_of_change(made))
            q = q + made
            pulls = pulls + share * change[:, len(free) :] * self.energy / self.gap
            largest = np.abs((q - self.rigid)[:, free] / self.unit).max(initial=0.0)
            fading = share * np.abs(moved).max(initial=0.0) / max(largest, MIN_DEFLECTION)
            if progress:
                progress(min(0.99, (step + 1) / 10), f"Newton's step {step + 1}: changes {fading:.1e}")
            if not np.isfinite(fading) or largest > 1e3 or (step >= MIN_STEPS and fading > MAX_LATE_CHANGE):
                break
            if share == 1.0 and (fading < settled or (before < 1.0 and fading**2 < settled * before and fading < 1e-2)):
                first, v, a = self.rates(q)
                known = [values.reshape(*self.shape, -1) for values in (q, v, a, pulls)]
                return CollocatedMotion(self.edges, first, known[0], known[1], known[2], known[3], step + 1)
            before = fading
        raise DoesNotCloseError(
            f"Newton's method does not converge in {step + 1} steps: last relative change {fading:.1e}"
        )

    def rates(self, q: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the coordinates at the starts of the steps, and the rates and accelerations at all instants."""
        if self.start is None:
            first = q[-1] - self.turned
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
        v = (RATES @ (values - starts[:, None])) / self.h[:, None, None]
        speeds = np.concatenate([v[-1:, -1] if speed is None else speed[None], v[:-1, -1]])
        a = (RATES @ (v - speeds[:, None])) / self.h[:, None, None]
        return starts, v.reshape(q.shape), a.reshape(q.shape)

    def _equations(
        self, q: Reals, v: Reals, a: Reals, pulls: Reals, assumed: Reals | None
    ) -> tuple[Reals, Tangents, State]:
        """Return the scaled residual, shape (instants, free + constraints), and the scaled tangents."""
        total, state, tangents = self.system.residual(q, v, a, pulls, self.drives, self.factor, assumed=assumed)
        assert tangents is not None
        unit, energy = self.unit, self.energy
        residual = np.concatenate([total[:, self.system.free] * unit / energy, state.open / self.gap], axis=1)
        both = unit[:, None] * unit / energy
        K, C, M = (both * matrix for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        return residual, Tangents(K, C, M, tangents.rows * unit / self.gap[:, None]), state

    def _newton_step(self, tangents: Tangents, residual: Reals) -> Reals:
        """Solve for the changes of scaled coordinates and multipliers, shape (instants, free + constraints)."""
        count, free = self.shape[0], len(self.unit)
        size = residual.shape[1]
        known = np.empty((count, STAGES * size, 1 + 2 * free))
        for few in np.array_split(np.arange(count), max(1, count * (STAGES * size) ** 2 // 2_000_000)):
            known[few] = self._step_responses(tangents, residual, few)
        last = known[:, (STAGES - 1) * size : (STAGES - 1) * size + free]
        stages = known.reshape(count, STAGES, size, -1)[:, :, :free]
        # velocity at the end of a step from the positions at its instants and at its start
        speed = np.einsum("j,kjmc->kmc", RATES[-1], stages)
        speed[:, :, 1 : 1 + free] -= RATES[-1].sum() * np.eye(free)
        speed /= self.h[:, None, None]
        passed = np.concatenate([last, speed], axis=1)
        starts = self._starts(passed)
        change = known[:, :, 0] + (known[:, :, 1:] @ starts[:, :, None])[:, :, 0]
        return change.reshape(count * STAGES, size)

    def _step_responses(self, tangents: Tangents, residual: Reals, few: Any) -> Reals:
        """Return the changes within steps due to the residual and due to changes at the starts of the steps."""
        free, size = len(self.unit), residual.shape[1]
        rows = (few[:, None] * STAGES + np.arange(STAGES)).ravel()
        K, C, M, G = (
            part[rows].reshape(len(few), STAGES, *part.shape[1:])
            for part in (tangents.stiffness, tangents.damping, tangents.mass, tangents.rows)
        )
        h = self.h[few][:, None, None, None]
        twice = RATES @ RATES
        table = np.zeros((len(few), STAGES, size, STAGES, size))
        right = np.zeros((len(few), STAGES, size, 1 + 2 * free))
        for i in range(STAGES):
            for j in range(STAGES):
                table[:, i, :free, j, :free] = RATES[i, j] / h[:, 0] * C[:, i] + twice[i, j] / h[:, 0] ** 2 * M[:, i]
            table[:, i, :free, i, :free] += K[:, i]
            table[:, i, free:, i, :free] = G[:, i]
            table[:, i, :free, i, free:] = np.swapaxes(G[:, i], 1, 2)
            by_place = RATES[i].sum() / h[:, 0] * C[:, i] + twice[i].sum() / h[:, 0] ** 2 * M[:, i]
            right[:, i, :free, 1 : 1 + free] = by_place
            right[:, i, :free, 1 + free :] = RATES[i].sum() / h[:, 0] * M[:, i]
        right[..., 0] = -residual[rows].reshape(len(few), STAGES, size)
        flat = STAGES * size
        try:
            return np.asarray(
                np.linalg.solve(table.reshape(-1, flat, flat), right.reshape(-1, flat, 1 + 2 * free)), float
            )
        except np.linalg.LinAlgError:
            raise DoesNotCloseError("the equations of a step are singular: a part is unconstrained") from None

    def _starts(self, passed: Reals) -> Reals:
        """Solve for the changes of positions and velocities at the starts of all steps, shape (steps, 2 free)."""
        count, both = passed.shape[:2]
        here = np.zeros(both)
        if self.start is None:
            through, gathered = np.eye(both), np.zeros(both)
            for step in passed:
                gathered = step[:, 0] + step[:, 1:] @ gathered
                through = step[:, 1:] @ through
            try:
                here = np.asarray(np.linalg.solve(np.eye(both) - through, gathered), float)
            except np.linalg.LinAlgError:
                raise DoesNotCloseError("the equations of the cycle are singular: a part is unconstrained") from None
        starts = np.empty((count, both))
        for k, step in enumerate(passed):
            starts[k] = here
            here = step[:, 0] + step[:, 1:] @ here
        return starts
