"""Periodic motion by Fourier collocation of all positions of the cycle at once.

Newton's method solves its linear systems by GMRES. The preconditioner uses second differences in time, which give a
cyclic block tridiagonal matrix with an exact factorisation. Differentiation matrices: Trefethen, Spectral Methods in
MATLAB, SIAM 2000, chapter 3. Preconditioning by differences: Canuto et al., Spectral Methods in Fluid Dynamics,
Springer 1988, chapter 5.
"""

from collections import namedtuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, gcrotmk

from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import Tangents, system_of

from .results import Instants, solution_of

TOLERANCE = 1e-6
"""Largest last change of Newton's method, relative to the largest deflection."""
MIN_DEFLECTION = 1e-3
"""Smallest reference deflection, relative to the mechanism's size."""
MAX_STEPS = 40
MAX_CHANGE = 0.5
MAX_DIRECTIONS = 120


def fourier_matrices(count, period):
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


def nonlinear_steady_state(
    mechanism, sections, laws, period, positions=256, elements=8, joints=None, damping=0.0, start=0.0
):
    """Periodic motion of a mechanism of elastic beams with inertia and large displacements.

    Input are geometry, masses, sections, loads and drive coordinates. Positions, velocities and accelerations are
    computed independently of `rigid` and `elastic`.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`. Links with infinite rigidities are rigid bodies.
    laws
        Per drive, a function from times [s] to coordinate, rate and acceleration; only the coordinate is used.
    period
        Period of drives and loads, up to full turns [s].
    positions
        Number of equally spaced positions from `start` [s], also the collocation points.
    elements
        Number of elements per beam.
    joints
        Compliance and misfit of joints, by name.
    damping
        beta of the Kelvin-Voigt law, stress = E (strain + beta d strain/dt) [s], one value or one per beam.

    Raises
    ------
    NotCheckedError
        The check does not support part of the mechanism; the message names it.
    DoesNotCloseError
        Joints do not close, the motion is not periodic, or no periodic motion is found.
    ValueError
        Invalid number of sections, laws, elements or positions.
    """
    if positions < 8:
        raise ValueError(f"{positions} positions: a cycle takes 8 or more")
    system = system_of(mechanism, sections, laws, start, elements, joints, damping)
    return solution_of(system, elements, PeriodicCollocation(system, period, positions).solved())


class PeriodicCollocation:
    """Equations of a whole period."""

    def __init__(self, system, period, count):
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
        self.multipliers = np.zeros((count, len(system.ties.constraints)))
        stiff = system.nodes.elements.stiffness
        self.energy = float(np.median(stiff[:, 2, 2])) if len(stiff) else 1.0
        self.frames = self._frames()
        kinds = [system.ties.couplings[own.parts[0][0]].kind for own in system.ties.constraints]
        self.gap = np.array([1.0 if kind == 2 else size for kind in kinds])

    def solved(self):
        """Solve by Newton's method from the rigid positions."""
        q = self.rigid.copy()
        self.system.prescribe(q, self.drives)
        free, relative_change = self.system.free, 1.0
        residual, tangents, state = self._equations(q, None)
        for _ in range(MAX_STEPS):
            change = self._newton_step(tangents, residual, min(1e-2, max(1e-4, 0.1 * relative_change)))
            moved = change[:, : len(free)] * self.unit
            share = min(1.0, MAX_CHANGE / max(np.abs(moved / self.unit).max(initial=0.0), 1e-300))
            step_made = np.zeros_like(q)
            step_made[:, free] = share * moved
            assumed = self.system.predicted(state, step_made, self.first @ step_made)
            q = q + step_made
            self.multipliers = self.multipliers + share * change[:, len(free) :] * self.energy / self.gap
            residual, tangents, state = self._equations(q, assumed)
            largest = np.abs((q - self.rigid)[:, free] / self.unit).max(initial=0.0)
            relative_change = share * np.abs(moved / self.unit).max(initial=0.0) / max(largest, MIN_DEFLECTION)
            if not np.isfinite(relative_change):
                break
            if relative_change < TOLERANCE and share == 1.0:
                v, a = self._rates(q)
                return Instants(self.time, self.rigid, q, v, a, self.multipliers, state)
        raise DoesNotCloseError(
            f"no periodic motion found in {MAX_STEPS} steps of Newton's method: the last changed {relative_change:.1e}"
        )

    def _frames(self):
        """Axes of the rigid links at all free positions."""
        number = np.full(len(self.system.prescribed), -1)
        number[self.system.free] = np.arange(len(self.system.free))
        pairs, nodes = np.unique(number[self.system.of_node[:, :2]], axis=0, return_index=True)
        nodes, pairs = nodes[pairs[:, 0] >= 0], pairs[pairs[:, 0] >= 0]
        turns = self.system.of_node[nodes, 2]
        turned = (self.rigid - self.drift)[:, turns]
        return Frames(
            pairs, np.exp(1j * self.rigid[:, turns]), self.first @ turned + self.slope[turns], self.second @ turned
        )

    def _rates(self, q):
        periodic = q - self.drift
        return self.first @ periodic + self.slope, self.second @ periodic

    def _equations(self, q, assumed):
        """Scaled residual, (count, free + constraints), and scaled tangents."""
        v, a = self._rates(q)
        total, state, tangents = self.system.residual(
            q, v, a, self.multipliers, self.drives, self.factor, assumed=assumed
        )
        unit, energy = self.unit, self.energy
        residual = np.concatenate([total[:, self.system.free] * unit / energy, state.violation / self.gap], axis=1)
        both = unit[:, None] * unit / energy
        K, C, M = (both * matrix for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        return residual, Tangents(K, C, M, tangents.rows * unit / self.gap[:, None]), state

    def _newton_step(self, tangents, residual, tolerance):
        shape, free = residual.shape, len(self.unit)
        try:
            known = Differences(tangents, self.frames, self.period / self.count)
        except np.linalg.LinAlgError:
            raise DoesNotCloseError("the equations of the cycle are singular: a part is unconstrained") from None

        def applied(flat):
            x = flat.reshape(shape)
            moved, pulled = x[:, :free], x[:, free:]
            rate, acceleration = self.first @ moved, self.second @ moved
            out = np.empty(shape)
            forces = tangents.stiffness @ moved[..., None] + tangents.damping @ rate[..., None]
            forces += tangents.mass @ acceleration[..., None]
            out[:, :free] = forces[..., 0] + (pulled[:, None] @ tangents.rows)[:, 0]
            out[:, free:] = (tangents.rows @ moved[..., None])[..., 0]
            return out.ravel()

        def guessed(flat):
            return known.solved(flat.reshape(shape)).ravel()

        linear, inverse = (LinearOperator((residual.size,) * 2, each, dtype=float) for each in (applied, guessed))
        change, _ = gcrotmk(linear, -residual.ravel(), rtol=tolerance, maxiter=1, M=inverse, m=MAX_DIRECTIONS)
        return change.reshape(shape)


class Frames(namedtuple("Frames", "pairs direction speed acceleration")):
    """Rotating axes for free positions, in which the equations of motion vary little over the cycle.

    Attributes
    ----------
    pairs
        Free numbers of x and y, shape (places, 2).
    direction, speed, acceleration
        Unit vector of the axes, and its first and second rate, shape (instants, places).
    """

    def turned(self, values, back=False):
        """Transform values per free number, (instants, numbers, ...), to ground axes or `back`."""
        x, y = self.pairs.T
        result = values.copy()
        shape = (*self.direction.shape, *[1] * (values.ndim - 2))
        c, s = self.direction.real.reshape(shape), self.direction.imag.reshape(shape) * (-1.0 if back else 1.0)
        result[:, x], result[:, y] = c * values[:, x] - s * values[:, y], s * values[:, x] + c * values[:, y]
        return result

    def seen(self, tangents):
        """Transform tangents to the axes, including the terms of their rotation."""
        K, C, M = (self._both(matrix) for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        rows = self._columns(tangents.rows)
        square, zero = self.speed**2, 0 * self.speed
        K = K + self._spun(C, zero, self.speed) + self._spun(M, -square, self.acceleration)
        C = C + self._spun(M, zero, 2 * self.speed)
        return Tangents(K, C, M, rows)

    def _columns(self, matrix):
        return np.swapaxes(self.turned(np.swapaxes(matrix, 1, 2), back=True), 1, 2)

    def _both(self, matrix):
        return self._columns(self.turned(matrix, back=True))

    def _spun(self, matrix, along, across):
        """Multiply a matrix by `along` + i `across` of each position."""
        x, y = self.pairs.T
        result = np.zeros_like(matrix)
        p, q = along[:, None], across[:, None]
        result[:, :, x] = matrix[:, :, x] * p + matrix[:, :, y] * q
        result[:, :, y] = matrix[:, :, y] * p - matrix[:, :, x] * q
        return result


class Differences:
    """Factorised linear system with fourth-order (Numerov) differences in time.

    The equations of an instant and its neighbours are combined with weights 1/12, 10/12, 1/12, which makes second
    differences of the coordinates fourth-order accurate. The matrix is block tridiagonal with two corners. The last
    instant is split off and solved by its Schur complement.
    """

    def __init__(self, tangents, frames, step):
        tangents = frames.seen(tangents)
        count, free = tangents.mass.shape[:2]
        size = free + tangents.rows.shape[1]
        held = np.concatenate([tangents.stiffness, np.swapaxes(tangents.rows, 1, 2)], axis=2)
        next_, last_ = (np.roll(held, shift, axis=0) / 12 for shift in (-1, 1))
        C = tangents.damping / (24 * step)
        later, sooner = np.roll(C, -1, axis=0), np.roll(C, 1, axis=0)
        next_[:, :, :free] += tangents.mass / step**2 + 10 * C + 3 * later - sooner
        last_[:, :, :free] += tangents.mass / step**2 - 10 * C + later - 3 * sooner
        middle = np.zeros((count, size, size))
        middle[:, :free] = 10 * held / 12
        middle[:, :free, :free] += 4 * (sooner - later) - 2 * tangents.mass / step**2
        middle[:, free:, :free] = tangents.rows
        ahead, behind = next_, last_
        self.frames, self.free, self.behind = frames, free, behind
        self.inverse, self.up, self.corner = np.zeros((3, count - 1, size, size))
        for k in range(count - 1):
            diagonal, right = middle[k], np.zeros((size, size))
            if k:
                diagonal[:free] -= behind[k] @ self.up[k - 1]
                right[:free] = -(behind[k] @ self.corner[k - 1])
            else:
                right[:free] = behind[0]
            if k == count - 2:
                right[:free] += ahead[k]
            self.inverse[k] = np.linalg.inv(diagonal)
            if k < count - 2:
                self.up[k] = self.inverse[k][:, :free] @ ahead[k]
            self.corner[k] = self.inverse[k][:, :free] @ right[:free]
        for k in range(count - 3, -1, -1):
            self.corner[k] -= self.up[k] @ self.corner[k + 1]
        last = middle[-1]
        last[:free] -= behind[-1] @ self.corner[-1] + ahead[-1] @ self.corner[0]
        self.last, self.ahead = np.linalg.inv(last), ahead[-1]

    def solved(self, right):
        """Solve for a right-hand side of shape (count, size)."""
        free, right = self.free, self.frames.turned(right, back=True)
        given = right.copy()
        given[:, :free] = (10 * right + np.roll(right, 1, axis=0) + np.roll(right, -1, axis=0))[:, :free] / 12
        x = np.empty_like(given)
        for k in range(len(given) - 1):
            rest = given[k]
            if k:
                rest[:free] -= self.behind[k] @ x[k - 1]
            x[k] = self.inverse[k] @ rest
        for k in range(len(given) - 3, -1, -1):
            x[k] -= self.up[k] @ x[k + 1]
        rest = given[-1]
        rest[:free] -= self.behind[-1] @ x[-2] + self.ahead @ x[0]
        x[-1] = self.last @ rest
        x[:-1] -= self.corner @ x[-1]
        return self.frames.turned(x)
