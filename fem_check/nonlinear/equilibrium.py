"""Equilibrium at an instant, and initial state of a motion."""

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from fem_check.nonlinear.collocation import InitialState
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import DriveStates, System
from rigid import Reals

Start = Literal["rigid", "quasi-static", "static"]
MAX_STEPS = 40
"""Maximum number of steps of Newton's method."""
TOLERANCE = 1e-9
"""Largest change in the last step of Newton's method, relative to the size of the mechanism, or [rad]."""
MAX_CHANGE = 0.3
"""Largest change of a coordinate in a step of Newton's method, relative to the size of the mechanism, or [rad]."""
POINTS = 7
"""Number of instants for numerical differentiation."""
Rates = Callable[[Reals], tuple[Reals, Reals, Reals]]
"""Function that returns coordinates, rates and accelerations for given coordinates."""


def slopes(step: float) -> Reals:
    """Return the differentiation matrix for instants at intervals of `step` [s], shape (POINTS, POINTS)."""
    from numpy.polynomial import polynomial

    places = np.arange(POINTS) - (POINTS - 1) / 2
    fit = np.linalg.inv(polynomial.polyvander(places, POINTS - 1))
    return polynomial.polyval(places, polynomial.polyder(fit), tensor=True).T / step


def start_of(system: System, step: float, begin: Start) -> InitialState:
    """Return the initial state.

    Parameters
    ----------
    step
        Step [s] of numerical differentiation. Successive instants are half a step apart.
    begin
        "rigid" for the positions and velocities of the rigid links. "quasi-static" for links that are deformed by the
        loads and the inertia of the rigid motion; the initial velocities include the rate of this deformation.
        "static" for links that are deformed by the loads and at rest.
    """
    q, v, _ = InstantEquilibrium(system).started(system.rigid.start, step, begin)
    return InitialState(q[0], v[0])


class InstantEquilibrium:
    """Newton's method for the equilibrium at one instant.

    It starts with the Lagrange multipliers of the previous solution.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        stiff = system.nodes.elements.stiffness
        self.energy_unit = (
            float(np.median(stiff[:, 2, 2])) if len(stiff) else max(float(system.nodes.masses.mass.sum()), 1e-9)
        )
        self.multipliers = np.zeros((1, len(system.constraint_unit)))

    def started(self, time: float, step: float, begin: Start) -> tuple[Reals, Reals, Reals]:
        """Return the initial coordinates, rates and accelerations, each of shape (1, coordinates).

        Rates and accelerations are computed by forward differences. For `step` and `begin` see `start_of`.
        """
        slope = slopes(step / 2)
        times = time + step / 2 * np.arange(POINTS, dtype=float)
        q = self.system.rigid_coordinates(self.system.rigid.at(times))
        self.system.prescribe(q, self.system.drives(times))
        v = slope @ q
        a = slope @ v
        if begin == "quasi-static":
            q = self._deformed(q, v, a, times)
            v = slope @ q
            a = slope @ v
        elif begin == "static":
            v = np.zeros_like(v)
            q = self._deformed(q[:1], v, np.zeros_like(a), times[:1])
        return q[:1], v[:1], a[:1]

    def _deformed(self, q: Reals, v: Reals, a: Reals, times: Reals) -> Reals:
        """Return the equilibrium positions for given rates and accelerations, shape (instants, coordinates)."""
        places = []
        for k, time in enumerate(times):
            rates = partial(_with, v[k : k + 1], a[k : k + 1])
            places.append(self.balanced(q[k : k + 1], rates, 0.0, 0.0, time)[0])
        return np.concatenate(places)

    def balanced(
        self, guess: Reals, rates: Rates, by_rate: float, by_acceleration: float, time: float
    ) -> tuple[Reals, Reals, Reals]:
        """Solve for the equilibrium at a time [s]. Return coordinates, rates and accelerations.

        The tangent is reused as long as convergence is fast.

        Parameters
        ----------
        guess
            Initial guess of the coordinates, shape (1, coordinates).
        rates
            Function that returns coordinates, rates and accelerations for given coordinates.
        by_rate, by_acceleration
            Derivatives of the rates [1/s] and of the accelerations [1/s^2] with respect to the coordinates.

        Raises
        ------
        DoesNotCloseError
            If Newton's method does not converge.
        """
        from scipy.linalg import lu_solve

        system, free, unit, gap = self.system, self.system.free, self.system.unit, self.system.constraint_unit
        instant = np.array([time])
        drives, factor = system.drives(instant), system.load_factors(instant)
        if not rates(guess)[1].any():  # at rest
            drives = DriveStates(drives.coordinates, np.zeros_like(drives.rates))
        place = guess.copy()
        system.prescribe(place, drives)
        known, before, assumed = None, np.inf, None
        for number in range(MAX_STEPS):
            q, v, a = rates(place)
            total, state, tangents = system.residual(q, v, a, self.multipliers, drives, factor, known is None, assumed)
            if tangents is not None:
                matrix = tangents.stiffness[0] + by_rate * tangents.damping[0] + by_acceleration * tangents.mass[0]
                rows = tangents.rows[0] * unit / gap[:, None]
                matrix = matrix * unit[:, None] * unit / self.energy_unit
                known = _factored(np.block([[matrix, rows.T], [rows, np.zeros((len(rows),) * 2)]]))
            residual = np.concatenate([total[0, free] * unit / self.energy_unit, state.violation[0] / gap])
            change = -lu_solve(known, residual, check_finite=False)
            moved = change[: len(free)]
            largest = np.abs(moved).max(initial=0.0)
            if not np.isfinite(largest):
                break
            share = min(1.0, MAX_CHANGE / max(largest, 1e-300))
            step = np.zeros_like(place)
            step[0, free] = share * moved * unit
            place, assumed = place + step, system.predicted(state, step, by_rate * step)
            self.multipliers = self.multipliers + share * change[len(free) :] * self.energy_unit / gap
            if largest < TOLERANCE:
                return rates(place)
            if largest > 1e-3 or (number and largest > 0.2 * before):
                known = None
            before = largest
        raise DoesNotCloseError(f"no equilibrium found at {time:.6g} s: last change of Newton's method {before:.1e}")


def _with(rate: Reals, acceleration: Reals, place: Reals) -> tuple[Reals, Reals, Reals]:
    return place, rate, acceleration


def _factored(matrix: Reals) -> Any:
    """Factorise a matrix. If the matrix is singular, the solutions contain inf or nan."""
    from scipy.linalg import LinAlgWarning, lu_factor

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)
        return lu_factor(matrix, check_finite=False)
