"""Postures of a mechanism of one drive as polynomials of its coordinate, cell by cell along the way that it goes.

Everything that the equation of motion asks of the links' places is a function of that coordinate alone, and a crank
comes by them turn after turn. A cell is taken over from the turn before where the links stand there as they did.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Complexes, Reals
from rigid.constants import mass_constants
from rigid.dynamics.tracking import Tracker
from rigid.kinematics import Motion
from rigid.plane import cross, dot

CELLS = 16  # in a turn of the drive, or in the size of the mechanism
NODES = 16  # of a polynomial
PARTS = (1, 2, 4)  # into which a cell is divided before it is given up
TAIL = 3  # last coefficients, by which a polynomial is judged
CONVERGED = 2e-13  # their size over that of the polynomial
SAME = 1e-8  # of places, over the size, and of unit vectors: links that stand alike
ORDERS = np.arange(NODES)
ANGLES = (2 * ORDERS + 1) * (np.pi / (2 * NODES))
TO_COEFFICIENTS = np.cos(np.outer(ORDERS, ANGLES)) * np.where(ORDERS == 0, 1.0, 2.0)[:, None] / NODES


@dataclass(frozen=True, eq=False)
class ChartedPosture:
    """Links at a coordinate of the drive, for a unit rate of it; of `Tracker` in shape: (links, 1).

    Attributes
    ----------
    origin, angle
        [m], complex, and [rad], but for whole turns.
    velocity, omega
        For a unit rate.
    acceleration, epsilon
        For a unit rate that does not change.
    inertia, bias, weight
        Reduced to the drive: mass, what it takes to go on at a unit rate, and gravity.
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
        """The motion at a rate without acceleration."""
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


class Chart:
    """Cells of the coordinate of a tracked mechanism's drive that were passed; None where postures are no polynomials.

    Cells are numbered along the way, over any number of turns.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._links = len(tracker.mechanism.links)
        self._turns = tracker.turns(0)
        self._width = (2 * math.pi if self._turns else tracker.size) / CELLS
        self._cells: dict[int, Reals | None] = {}
        count = self._links
        # What round-off of places and angles is measured by; of rates it is the greatest of them.
        self._least = np.zeros(9 * count + 3)
        self._least[: 2 * count], self._least[6 * count : 7 * count] = tracker.size, 1.0

    def at(self, coordinate: float) -> ChartedPosture | None:
        """Links at a coordinate of the drive; None where that has to be found from near by."""
        if not math.isfinite(coordinate):  # a step that overflows is taken again, shorter
            return None
        number = math.floor(coordinate / self._width)
        cell = self._cells[number] if number in self._cells else self._entered(number)
        if cell is None:
            return None
        place = (coordinate / self._width - number) * len(cell)
        part = min(int(place), len(cell) - 1)
        return self._read(cell[part], 2 * (place - part) - 1)

    def passed(self, coordinate: float) -> bool:
        """Whether the tracked links stand as their cell says; where they have none, cells behind them are forgotten."""
        here = self.at(coordinate)
        if here is None:
            self._cells = {number: cell for number, cell in self._cells.items() if cell is None}
            return True
        tracker = self._tracker
        away = np.abs(tracker.origin - here.origin).max() / tracker.size
        return bool(max(away, np.abs(tracker.direction - np.exp(1j * here.angle)).max()) < SAME)

    def _read(self, polynomials: Reals, place: float) -> ChartedPosture:
        """Values at a place from -1 to 1."""
        values = np.cos(ORDERS * math.acos(min(max(place, -1.0), 1.0))) @ polynomials
        count = self._links
        origin, velocity, acceleration = values[: 6 * count].view(complex).reshape(3, count, 1)
        angle, omega, epsilon = values[6 * count : 9 * count].reshape(3, count, 1)
        sums = values[9 * count :].tolist()
        return ChartedPosture(origin, angle, velocity, omega, acceleration, epsilon, *sums)

    def _entered(self, number: int) -> Reals | None:
        """A cell that is entered: that of a turn before or after, where the links stand alike at its edge; else new."""
        for beside, edge in ((number - 1, 1.0), (number + 1, -1.0)):
            near = self._cells.get(beside)
            for turn in (-CELLS, CELLS) if self._turns else ():
                if number + turn not in self._cells:
                    continue
                other = self._cells[number + turn]
                if other is None or (near is not None and self._meet(near, other, edge)):
                    self._cells[number] = other
                    return other
        cell = self._cells[number] = self._built(number)
        return cell

    def _meet(self, near: Reals, other: Reals, edge: float) -> bool:
        """Whether a cell goes on where another ends, 1.0, or begins, -1.0."""
        here, there = self._read(near[-1 if edge > 0 else 0], edge), self._read(other[0 if edge > 0 else -1], -edge)
        away = np.abs(here.origin - there.origin).max() / self._tracker.size
        return bool(max(away, np.abs(np.exp(1j * here.angle) - np.exp(1j * there.angle)).max()) < SAME)

    def _built(self, number: int) -> Reals | None:
        """A cell from where the tracker is, which stays there."""
        tracker = self._tracker
        with tracker.returning():
            for parts in PARTS:
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
        """Values of a cell at its nodes, shape (nodes, values), from a coordinate on; None where one is singular."""
        tracker = self._tracker
        values = np.empty((NODES, 9 * self._links + 3))
        places = low + width * 0.5 * (1 + np.cos(ANGLES))
        inward = ORDERS if tracker.drive[0] > low else ORDERS[::-1]
        for node in inward:
            if not tracker.step_to(places[node : node + 1]) or tracker.narrow:
                return None
            values[node] = self._values()
        return values

    def _values(self) -> Reals:
        """Values of a cell for the links as they are placed: places, rates, their sums in the equation of motion."""
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
        """Whether the last coefficients are round-off."""
        size, count = np.abs(polynomials).max(axis=0), self._links
        for low, high in ((2, 4), (4, 6), (7, 8), (8, 9)):
            size[low * count : high * count] = size[low * count : high * count].max()
        size[-2:] = np.maximum(size[-2:], size[-3])
        tail: Any = np.abs(polynomials[-TAIL:]).max(axis=0)
        return bool((tail <= CONVERGED * np.maximum(size, self._least)).all())
