"""Preconditioner of GMRES: factorised equations of a period with finite differences.

In the rotating axes of the rigid links the equations vary little in time, and only the deflection is differenced.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_check.nonlinear.system import Tangents
from rigid import Reals
from rigid.arrays import Complexes, Integers


@dataclass(frozen=True, eq=False)
class Frames:
    """Rotating axes for free positions.

    Attributes
    ----------
    pairs
        Free numbers of x and y, shape (places, 2).
    direction, speed, acceleration
        Unit vector of the axes, and its first and second rate, shape (instants, places).
    """

    pairs: Integers
    direction: Complexes
    speed: Reals
    acceleration: Reals

    def turned(self, values: Reals, back: bool = False) -> Reals:
        """Transform values per free number, (instants, numbers, ...), to ground axes or `back`."""
        x, y = self.pairs.T
        result = values.copy()
        shape = (*self.direction.shape, *[1] * (values.ndim - 2))
        c, s = self.direction.real.reshape(shape), self.direction.imag.reshape(shape) * (-1.0 if back else 1.0)
        result[:, x], result[:, y] = c * values[:, x] - s * values[:, y], s * values[:, x] + c * values[:, y]
        return result

    def seen(self, tangents: Tangents) -> Tangents:
        """Transform tangents to the axes, including the terms of their rotation."""
        K, C, M = (self._both(matrix) for matrix in (tangents.stiffness, tangents.damping, tangents.mass))
        rows = self._columns(tangents.rows)
        square, zero = self.speed**2, 0 * self.speed
        K = K + self._spun(C, zero, self.speed) + self._spun(M, -square, self.acceleration)
        C = C + self._spun(M, zero, 2 * self.speed)
        return Tangents(K, C, M, rows)

    def _columns(self, matrix: Reals) -> Reals:
        return np.swapaxes(self.turned(np.swapaxes(matrix, 1, 2), back=True), 1, 2)

    def _both(self, matrix: Reals) -> Reals:
        return self._columns(self.turned(matrix, back=True))

    def _spun(self, matrix: Reals, along: Reals, across: Reals) -> Reals:
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

    def __init__(self, tangents: Tangents, frames: Frames, step: float) -> None:
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

    def solved(self, right: Reals) -> Reals:
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
