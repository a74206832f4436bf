"""Periodic motion by Fourier collocation of all positions of the cycle at once.

Newton's method solves its linear systems by GMRES. The preconditioner uses second differences in time, which give a
cyclic block tridiagonal matrix with an exact factorisation. Differentiation matrices: Trefethen, Spectral Methods in
MATLAB, SIAM 2000, chapter 3. Preconditioning by differences: Canuto et al., Spectral Methods in Fluid Dynamics,
Springer 1988, chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_check.nonlinear.differences import Differences, Frames
from fem_check.nonlinear.krylov import flexible_gmres
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import State, System, Tangents
from rigid import Reals

Progress = Callable[[float, str], None]
TOLERANCE = 1e-6
"""Largest last change of Newton's method, relative to the largest deflection."""
MIN_DEFLECTION = 1e-3
"""Smallest reference deflection, relative to the mechanism's size."""
MAX_STEPS = 40
MAX_CHANGE = 0.5
MAX_DIRECTIONS = 120


@dataclass(frozen=True, eq=False)
class Period:
    """Period: instants [s], coordinates, rates, multipliers and element state."""

    time: Reals
    rigid: Reals
    q: Reals
    v: Reals
    a: Reals
    pulls: Reals
    state: State
    total: Reals
    steps: int


def fourier_matrices(count: int, period: float) -> tuple[Reals, Reals]:
    """First and second derivative of the trigonometric interpolant, (count, count).

    Examples
    --------
    >>> t = np.arange(6) / 6
    >>> first, second = fourier_matrices(6, 1.0)
    >>> bool(np.allclose(first @ np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)))
    True
    """
    order = np.fft.fftfreq(count, 1.0 / count)
    odd = np.where(2 * np.abs(order) == count, 0.0, order)
    unit = np.fft.fft(np.eye(count), axis=0)
    rate = 2 * np.pi / period
    first, second = (
        np.fft.ifft(factor[:, None] * unit, axis=0).real for factor in (1j * odd * rate, -((order * rate) ** 2))
    )
    return first, second


def cycle(system: System, period: float, count: int, progress: Progress | None = None) -> Period:
    """Compute the periodic motion of a system at `count` instants of a period.

    Raises
    ------
    DoesNotCloseError
        The rigid motion is not periodic, or Newton's method does not converge.
    """
    solver = PeriodicCollocation(system, period, count)
    return solver.solved(progress or (lambda share, words: None))


class PeriodicCollocation:
    """Equations of a whole period."""

    def __init__(self, system: System, period: float, count: int) -> None:
        self.system, self.period, self.count = system, period, count
        self.time = system.rigid.start + period * np.arange(count) / count
        places = system.rigid.at(np.append(self.time, system.rigid.start + period))
        system.rigid.require_period(places, period)
        everywhere = system.rigid_coordinates(places)
        self.rigid = everywhere[:-1]
        self.drives, self.factor = system.drives(self.time), system.load_factors(self.time)
        self.slope = np.where(system.turns, everywhere[-1] - everywhere[0], 0.0) / period
        self.first, self.second = fourier_matrices(count, period)
        self.drift = np.outer(self.time - self.time[0], self.slope)
        size, free = system.rigid.size, system.free
        self.unit = np.where(system.turns[free], 1.0, size)
        self.pulls = np.zeros((count, len(system.ties.conditions)))
        stiff = system.nodes.elements.stiffness
        self.energy = float(np.median(stiff[:, 2, 2])) if len(stiff) else 1.0
        self.frames = self._frames()
        kinds = [system.ties.couplings[own.parts[0][0]].kind for own in system.ties.conditions]
        self.gap = np.array([1.0 if kind == 2 else size for kind in kinds])

    def solved(self, progress: Progress) -> Period:
        """Solve by Newton's method from the rigid positions."""
        q = self.rigid.copy()
        self.system.prescribe(q, self.drives)
        free, fading = self.system.free, 1.0
        residual, tangents, state, total = self._equations(q, None)
        for step in range(MAX_STEPS):
            change = self._newton_step(tangents, residual, min(1e-2, max(1e-4, 0.1 * fading)))
            moved = change[:, : len(free)] * self.unit
            share = min(1.0, MAX_CHANGE / max(np.abs(moved / self.unit).max(initial=0.0), 1e-300))
            step_made = np.zeros_like(q)
            step_made[:, free] = share * moved
            assumed = self.system.predicted(state, step_made, self.first @ step_made)
            q = q + step_made
            self.pulls = self.pulls + share * change[:, len(free) :] * self.energy / self.gap
            residual, tangents, state, total = self._equations(q, assumed)
            largest = np.abs((q - self.rigid)[:, free] / self.unit).max(initial=0.0)
            fading = share * np.abs(moved / self.unit).max(initial=0.0) / max(largest, MIN_DEFLECTION)
            progress(min(0.99, (step + 1) / 10), f"Newton's step {step + 1}: changes {fading:.1e}")
            if not np.isfinite(fading):
                break
            if fading < TOLERANCE and share == 1.0:
                v, a = self._rates(q)
                return Period(self.time, self.rigid, q, v, a, self.pulls, state, total, step + 1)
        raise DoesNotCloseError(
            f"no periodic motion found in {MAX_STEPS} steps of Newton's method: the last changed {fading:.1e}"
        )

    def _frames(self) -> Frames:
        """Axes of the rigid links at all free positions."""
        number = np.full(len(self.system.prescribed), -1)
        number[self.system.free] = np.arange(len(self.system.free))
        pairs, nodes = np.unique(number[self.system.of_node[:, :2]], axis=0, return_index=True)
        nodes, pairs = nodes[pairs[:, 0] >= 0], pairs[pairs[:, 0] >= 0]
        turns = self.system.of_node[nodes, 2]
        turned = (self.rigid - self.drift)[:, turns]
        return Frames(
            pairs,
            np.exp(1j * self.rigid[:, turns]),
            self.first @ turned + self.slope[turns],
            self.second @ turned,
        )

    def _rates(self, q: Reals) -> tuple[Reals, Reals]:
        periodic = q - self.drift
        return self.first @ periodic + self.slope, self.second @ periodic

    def _equations(self, q: Reals, assumed: Reals | None) -> tuple[Reals, Tangents, State, Reals]:
        """Scaled residual, (count, free + constraints), and scaled tangents."""
        v, a = self._rates(q)
        total, state, tangents = self.system.residual(q, v, a, self.pulls, self.drives, self.factor, assumed=assumed)
        assert tangents is not None
        unit, energy = self.unit, self.energy
        residual = np.concatenate([total[:, self.system.free] * unit / energy, state.open / self.gap], axis=1)
        both = unit[:, None] * unit / energy
        K, C, M = (both * matrix for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        return residual, Tangents(K, C, M, tangents.rows * unit / self.gap[:, None]), state, total

    def _newton_step(self, tangents: Tangents, residual: Reals, tolerance: float) -> Reals:
        shape, free = residual.shape, len(self.unit)
        try:
            known = Differences(tangents, self.frames, self.period / self.count)
        except np.linalg.LinAlgError:
            raise DoesNotCloseError("the equations of the cycle are singular: a part is unconstrained") from None

        def applied(flat: Reals) -> Reals:
            x = flat.reshape(shape)
            moved, pulled = x[:, :free], x[:, free:]
            rate, acceleration = self.first @ moved, self.second @ moved
            out = np.empty(shape)
            forces = tangents.stiffness @ moved[..., None] + tangents.damping @ rate[..., None]
            forces += tangents.mass @ acceleration[..., None]
            out[:, :free] = forces[..., 0] + (pulled[:, None] @ tangents.rows)[:, 0]
            out[:, free:] = (tangents.rows @ moved[..., None])[..., 0]
            return out.ravel()

        def guessed(flat: Reals) -> Reals:
            return known.solved(flat.reshape(shape)).ravel()

        return flexible_gmres(applied, guessed, -residual.ravel(), tolerance, MAX_DIRECTIONS).reshape(shape)
