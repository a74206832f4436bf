"""Time stepping by the generalised-alpha method with constraints; equilibrium at an instant.

Chung and Hulbert, Journal of Applied Mechanics 60 (1993) 371-375; with multipliers and position constraints (index 3):
Arnold and Bruels, Convergence of the generalized-alpha scheme for constrained mechanical systems, Multibody System
Dynamics 18 (2007) 185-202. The order is two.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import System
from rigid import Reals

Start = Literal["rigid", "quasi-static", "static"]
MAX_STEPS = 40
TOLERANCE = 1e-9
"""Largest last change of Newton's method, relative to the mechanism's size, or [rad]."""
MAX_CHANGE = 0.3
POINTS = 7
Rates = Callable[[Reals], tuple[Reals, Reals, Reals]]


def slopes(step: float) -> Reals:
    """Differentiation matrix for equally spaced instants, shape (POINTS, POINTS)."""
    from numpy.polynomial import polynomial

    places = np.arange(POINTS) - (POINTS - 1) / 2
    fit = np.linalg.inv(polynomial.polyvander(places, POINTS - 1))
    rates: Reals = polynomial.polyval(places, polynomial.polyder(fit), tensor=True).T / step
    return rates


class Marcher:
    """State at one instant, each of shape (1, coordinates), advanced step by step."""

    def __init__(self, system: System, radius: float) -> None:
        self.system = system
        self.am, self.af = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
        self.gamma = 0.5 + self.af - self.am
        self.beta = (self.gamma + 0.5) ** 2 / 4
        free, size = system.free, system.rigid.size
        self.unit = np.where(system.turns[free], 1.0, size)
        stiff = system.nodes.elements.stiffness
        self.energy = (
            float(np.median(stiff[:, 2, 2])) if len(stiff) else max(float(system.nodes.masses.mass.sum()), 1e-9)
        )
        kinds = [system.ties.couplings[own.parts[0][0]].kind for own in system.ties.conditions]
        self.gap = np.array([1.0 if kind == 2 else size for kind in kinds])
        self.q = self.v = self.a = self.pseudo = np.zeros((1, len(system.prescribed)))
        self.pulls = np.zeros((1, len(kinds)))

    def copy(self) -> tuple[Reals, Reals, Reals, Reals]:
        """Copy coordinates, rates, accelerations and multipliers."""
        return self.q.copy(), self.v.copy(), self.a.copy(), self.pulls.copy()

    def start(self, time: float, step: float, begin: Start) -> None:
        """Set initial positions, and rates from the positions of the next instants."""
        slope = slopes(step / 2)
        times = time + step / 2 * np.arange(POINTS, dtype=float)
        q = self.system.rigid_coordinates(self.system.rigid.at(times))
        self.system.prescribe(q, self.system.drives(times))
        v = slope @ q
        a = slope @ v
        if begin == "quasi-static":
            q = self._bent(q, v, a, times)
            v = slope @ q
            a = slope @ v
        elif begin == "static":
            v = np.zeros_like(v)
            q = self._bent(q[:1], v, np.zeros_like(a), times[:1])
        self.q, self.v, self.a = q[:1], v[:1], a[:1]
        self.a = self._accelerated(times[:1])
        self.pseudo = self.a.copy()

    def _accelerated(self, instant: Reals) -> Reals:
        """Accelerations for a zero residual and constant constraints; zero for massless parts."""
        system, free, count = self.system, self.system.free, len(self.gap)
        given = self.q, self.v, self.a, self.pulls, system.drives(instant), system.load_factors(instant)
        total, _, tangents = system.residual(*given)
        assert tangents is not None
        rows = tangents.rows[0] / self.gap[:, None]
        mass = tangents.mass[0] / np.abs(tangents.mass).max()
        right = np.concatenate([-total[0, free] / np.abs(tangents.mass).max(), np.zeros(count)])
        table = np.block([[mass, rows.T], [rows, np.zeros((count, count))]])
        a = self.a.copy()
        a[0, free] += np.linalg.lstsq(table, right, rcond=1e-12)[0][: len(free)]
        return a

    def _bent(self, q: Reals, v: Reals, a: Reals, times: Reals) -> Reals:
        """Equilibrium positions under the loads and given accelerations."""
        places = []
        for k, time in enumerate(times):
            rates = partial(_with, v[k : k + 1], a[k : k + 1])
            places.append(self.balanced(q[k : k + 1], rates, 0.0, 0.0, time)[0])
        return np.concatenate(places)

    def advance(self, time: float, h: float) -> None:
        """Advance one step to a time."""
        q, v, a, pseudo = self.q, self.v, self.a, self.pseudo
        am, af, beta, gamma = self.am, self.af, self.beta, self.gamma

        def rates(place: Reals) -> tuple[Reals, Reals, Reals]:
            new = (place - q - h * v - h**2 * (0.5 - beta) * pseudo) / (beta * h**2)
            return (
                place,
                v + h * ((1 - gamma) * pseudo + gamma * new),
                ((1 - am) * new + am * pseudo - af * a) / (1 - af),
            )

        guess = q + h * v + h**2 * pseudo / 2
        place, rate, acceleration = self.balanced(
            guess, rates, gamma / (beta * h), (1 - am) / (beta * h**2 * (1 - af)), time
        )
        self.pseudo = (place - q - h * v - h**2 * (0.5 - beta) * pseudo) / (beta * h**2)
        self.q, self.v, self.a = place, rate, acceleration

    def balanced(
        self, guess: Reals, rates: Rates, by_rate: float, by_acceleration: float, time: float
    ) -> tuple[Reals, Reals, Reals]:
        """Newton's method at one instant; the tangent is reused while it converges."""
        from scipy.linalg import lu_solve

        system, free, unit = self.system, self.system.free, self.unit
        instant = np.array([time])
        drives, factor = system.drives(instant), system.load_factors(instant)
        place = guess.copy()
        system.prescribe(place, drives)
        known, before, assumed = None, np.inf, None
        for number in range(MAX_STEPS):
            q, v, a = rates(place)
            total, state, tangents = system.residual(q, v, a, self.pulls, drives, factor, known is None, assumed)
            if tangents is not None:
                matrix = tangents.stiffness[0] + by_rate * tangents.damping[0] + by_acceleration * tangents.mass[0]
                rows = tangents.rows[0] * unit / self.gap[:, None]
                matrix = matrix * unit[:, None] * unit / self.energy
                known = _factored(np.block([[matrix, rows.T], [rows, np.zeros((len(rows),) * 2)]]))
            lacking = np.concatenate([total[0, free] * unit / self.energy, state.open[0] / self.gap])
            change = -lu_solve(known, lacking, check_finite=False)
            moved = change[: len(free)]
            largest = np.abs(moved).max(initial=0.0)
            if not np.isfinite(largest):
                break
            share = min(1.0, MAX_CHANGE / max(largest, 1e-300))
            step = np.zeros_like(place)
            step[0, free] = share * moved * unit
            place, assumed = place + step, system.predicted(state, step, by_rate * step)
            self.pulls = self.pulls + share * change[len(free) :] * self.energy / self.gap
            if largest < TOLERANCE:
                return rates(place)
            if largest > 1e-3 or (number and largest > 0.2 * before):
                known = None
            before = largest
        raise DoesNotCloseError(f"no balance found at {time:.6g} s: Newton's method last changed {before:.1e}")


def _with(rate: Reals, acceleration: Reals, place: Reals) -> tuple[Reals, Reals, Reals]:
    return place, rate, acceleration


def _factored(matrix: Reals) -> Any:
    """Factorise a matrix; solutions of a singular one are not finite."""
    from scipy.linalg import LinAlgWarning, lu_factor

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)
        return lu_factor(matrix, check_finite=False)
