"""Cache of the postures of a mechanism with one drive, as piecewise polynomials of the drive coordinate.

A posture consists of the positions and angles of all links. The cache also contains the terms of the equation of
motion that depend only on the posture. The drive coordinate is divided into intervals, called cells. In the next turn
of a crank, a cell is reused if the links have the same posture there.
"""

import math
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Complexes, Reals
from rigid.constants import mass_constants
from rigid.dynamics.tracking import Tracker
from rigid.kinematics import Motion
from rigid.plane import cross, dot

CELLS_PER_TURN = 16  # number of cells per turn of a pin drive, or per mechanism size for a slider drive
NODES = 16  # number of Chebyshev nodes of a polynomial
SUBDIVISIONS = (1, 2, 4)  # a cell has one of these numbers of polynomials; they are tried in this order
TAIL_LENGTH = 3  # number of highest-order coefficients in the convergence test
TAIL_TOLERANCE = 2e-13  # upper bound of the highest-order coefficients, relative to the largest coefficient
# Two postures count as equal if two differences are smaller than this for each link: the distance between the origins
# relative to the mechanism size, and the difference between the unit vectors.
POSTURE_TOLERANCE = 1e-8
ORDERS = np.arange(NODES)
ANGLES = (2 * ORDERS + 1) * (np.pi / (2 * NODES))
# Chebyshev coefficients = TO_COEFFICIENTS @ values at the nodes
TO_COEFFICIENTS = np.cos(np.outer(ORDERS, ANGLES)) * np.where(ORDERS == 0, 1.0, 2.0)[:, None] / NODES


class ChartedPosture(Struct, frozen=True, eq=False):
    """Posture of all links at a drive coordinate, and their motion at unit drive rate. Arrays have shape (links, 1).

    Attributes
    ----------
    origin
        Origins of the links (complex) [m].
    angle
        Angles of the links [rad], modulo full turns.
    velocity, omega
        Velocities (complex) and angular velocities at unit drive rate.
    acceleration, epsilon
        Accelerations (complex) and angular accelerations at constant unit drive rate.
    inertia
        Inertia reduced to the drive.
    bias
        Drive effort that the inertia of the links requires at constant unit drive rate.
    weight
        Effort that gravity exerts on the drive.
    """

    origin: Complexes
    angle: Reals
    velocity: Complexes
    omega: Reals
    acceleration: Complexes
    epsilon: Reals
    inertia: float
    bias: float
    weight: float

    def coasting(self, tracker: Tracker, time: float, drive: Reals, rate: Reals) -> Motion:
        """Return the motion at a given drive rate and zero drive acceleration, for one position."""
        squared = rate[0] * rate[0]
        omega = self.omega * rate[0]
        return Motion(
            tracker.mechanism,
            np.array([time]),
            drive[:, None],
            rate[:, None],
            np.zeros((1, 1)),
            self.origin,
            np.exp(1j * self.angle),
            self.velocity * rate[0],
            self.acceleration * squared,
            omega,
            1j * (self.epsilon * squared) - omega * omega,
            (),
        )


class PostureChart:
    """Intervals (cells) of the drive coordinate that the motion has visited, with polynomials for each.

    A cell is None if its polynomials do not converge, or if a posture in it is nearly singular or cannot be reached.
    The cells are numbered along the drive coordinate, over any number of turns.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._links = len(tracker.mechanism.links)
        self._turns = tracker.turns(0)
        self._width = (2 * math.pi if self._turns else tracker.size) / CELLS_PER_TURN
        self._cells: dict[int, Reals | None] = {}
        count = self._links
        # lower bounds of the reference values for round-off: mechanism size for positions, and 1 rad for angles
        self._least = np.zeros(9 * count + 3)
        self._least[: 2 * count], self._least[6 * count : 7 * count] = tracker.size, 1.0

    def at(self, coordinate: float) -> ChartedPosture | None:
        """Return the posture at a drive coordinate, or None if its cell has no polynomials.

        If the coordinate is in a new cell, this cell is added first.
        """
        if not math.isfinite(coordinate):  # the integrator retries an overflowing step with a shorter one
            return None
        number = math.floor(coordinate / self._width)
        cell = self._cells[number] if number in self._cells else self._entered(number)
        if cell is None:
            return None
        place = (coordinate / self._width - number) * len(cell)
        part = min(int(place), len(cell) - 1)
        return self._read(cell[part], 2 * (place - part) - 1)

    def is_consistent(self, coordinate: float) -> bool:
        """Return whether the tracker has the same posture as the cache at `coordinate`.

        `coordinate` is the drive coordinate of the tracker. If the cache has no posture there, discard all polynomials
        and return True.
        """
        here = self.at(coordinate)
        if here is None:
            self._cells = {number: cell for number, cell in self._cells.items() if cell is None}
            return True
        tracker = self._tracker
        away = np.abs(tracker.origin - here.origin).max() / tracker.size
        return bool(max(away, np.abs(tracker.direction - np.exp(1j * here.angle)).max()) < POSTURE_TOLERANCE)

    def _read(self, polynomials: Reals, place: float) -> ChartedPosture:
        """Evaluate polynomials at `place`, which runs from -1 to 1 over their interval of the drive coordinate."""
        values = np.cos(ORDERS * math.acos(min(max(place, -1.0), 1.0))) @ polynomials
        count = self._links
        origin, velocity, acceleration = values[: 6 * count].view(complex).reshape(3, count, 1)
        angle, omega, epsilon = values[6 * count : 9 * count].reshape(3, count, 1)
        sums = values[9 * count :].tolist()
        return ChartedPosture(origin, angle, velocity, omega, acceleration, epsilon, *sums)

    def _entered(self, number: int) -> Reals | None:
        """Add a cell and return it.

        The cell of the previous or next turn is reused if it has the same posture; otherwise, a new cell is built.
        """
        for neighbour, edge in ((number - 1, 1.0), (number + 1, -1.0)):
            near = self._cells.get(neighbour)
            for turn in (-CELLS_PER_TURN, CELLS_PER_TURN) if self._turns else ():
                if number + turn not in self._cells:
                    continue
                other = self._cells[number + turn]
                if other is None or (near is not None and self._meet(near, other, edge)):
                    self._cells[number] = other
                    return other
        cell = self._cells[number] = self._built(number)
        return cell

    def _meet(self, near: Reals, other: Reals, edge: float) -> bool:
        """Return whether two cells have equal postures at their common boundary.

        If `edge` is 1.0, the boundary is the end of `near` and the start of `other`. If `edge` is -1.0, the boundary is
        the start of `near` and the end of `other`.
        """
        here, there = self._read(near[-1 if edge > 0 else 0], edge), self._read(other[0 if edge > 0 else -1], -edge)
        away = np.abs(here.origin - there.origin).max() / self._tracker.size
        return bool(max(away, np.abs(np.exp(1j * here.angle) - np.exp(1j * there.angle)).max()) < POSTURE_TOLERANCE)

    def _built(self, number: int) -> Reals | None:
        """Build a cell by moving the tracker through it, and restore the tracker's posture."""
        tracker = self._tracker
        with tracker.returning():
            for parts in SUBDIVISIONS:
                cell = []
                for part in range(parts):
                    low = (number + part / parts) * self._width
                    values = self._sampled(low, self._width / parts)
                    if values is None:
                        return None
                    polynomials = TO_COEFFICIENTS @ values
                    if not self._converged(polynomials):
                        break
                    cell.append(polynomials)
                if len(cell) == parts:
                    return np.array(cell)
        return None

    def _sampled(self, low: float, width: float) -> Reals | None:
        """Return the values of `_values` at the Chebyshev nodes of an interval, shape (nodes, values).

        The interval of the drive coordinate begins at `low`.
        Return None if the tracker cannot reach a node, or if the posture there is nearly singular.
        """
        tracker = self._tracker
        values = np.empty((NODES, 9 * self._links + 3))
        places = low + width * 0.5 * (1 + np.cos(ANGLES))
        inward = ORDERS if tracker.drive[0] > low else ORDERS[::-1]
        for node in inward:
            if not tracker.step_to(places[node : node + 1]) or tracker.near_singular:
                return None
            values[node] = self._values()
        return values

    def _values(self) -> Reals:
        """Return the values to be interpolated at the current posture.

        These are positions, rates and terms of the equation of motion, see `ChartedPosture`.
        """
        tracker = self._tracker
        (v, w), (a, e) = tracker.unit_twists, tracker.unit_coasting
        mass, first, second = mass_constants(tracker.mechanism, 1)
        arm, gravity = tracker.direction * first, tracker.mechanism.gravity
        turning = 1j * e - w * w
        inertia = dot(v, mass * v + 1j * w * arm) + w * (cross(arm, v) + second * w)
        inertia[0] += tracker.mechanism.drives[0].inertia
        bias = dot(v, mass * a + turning * arm) + w * (cross(arm, a) + second * e)
        weight = dot(v, mass * gravity) + w * cross(arm, gravity + 0j)
        plane = np.concatenate([tracker.origin, v, a])[:, 0].view(float)
        sums = [[part.sum()] for part in (inertia, bias, weight)]
        return np.concatenate([plane, tracker.angle[:, 0], w[:, 0], e[:, 0], *sums])

    def _converged(self, polynomials: Reals) -> bool:
        """Return whether the highest-order coefficients are as small as round-off."""
        size, count = np.abs(polynomials).max(axis=0), self._links
        for low, high in ((2, 4), (4, 6), (7, 8), (8, 9)):
            size[low * count : high * count] = size[low * count : high * count].max()
        size[-2:] = np.maximum(size[-2:], size[-3])
        tail: Any = np.abs(polynomials[-TAIL_LENGTH:]).max(axis=0)
        return bool((tail <= TAIL_TOLERANCE * np.maximum(size, self._least)).all())
