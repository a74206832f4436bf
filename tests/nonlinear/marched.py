"""Transient motion by the generalised-alpha method, and static equilibrium along a path.

Chung and Hulbert, Journal of Applied Mechanics 60 (1993) 371-375; with multipliers and position constraints (index 3):
Arnold and Bruels, Convergence of the generalized-alpha scheme for constrained mechanical systems, Multibody System
Dynamics 18 (2007) 185-202. The order is two.
"""

from itertools import pairwise

import numpy as np

from fem_check.nonlinear.equilibrium import InstantEquilibrium
from fem_check.nonlinear.system import system_of

from .results import Instants, solution_of


class Marcher(InstantEquilibrium):
    """State at one instant, each of shape (1, coordinates), advanced step by step."""

    def __init__(self, system, radius, time, step, begin):
        super().__init__(system)
        self.am, self.af = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
        self.gamma = 0.5 + self.af - self.am
        self.beta = (self.gamma + 0.5) ** 2 / 4
        self.q, self.v, self.a = self.started(time, step, begin)
        self.a = self._accelerated(np.array([time]))
        self.pseudo = self.a.copy()

    def copy(self):
        """Copy coordinates, rates, accelerations and multipliers."""
        return self.q.copy(), self.v.copy(), self.a.copy(), self.multipliers.copy()

    def _accelerated(self, instant):
        """Accelerations for a zero residual and constant constraints; zero for massless parts."""
        system, free, count = self.system, self.system.free, len(self.system.constraint_unit)
        given = self.q, self.v, self.a, self.multipliers, system.drives(instant), system.load_factors(instant)
        total, _, tangents = system.residual(*given)
        rows = tangents.rows[0] / system.constraint_unit[:, None]
        mass = tangents.mass[0] / np.abs(tangents.mass).max()
        right = np.concatenate([-total[0, free] / np.abs(tangents.mass).max(), np.zeros(count)])
        table = np.block([[mass, rows.T], [rows, np.zeros((count, count))]])
        a = self.a.copy()
        a[0, free] += np.linalg.lstsq(table, right, rcond=1e-12)[0][: len(free)]
        return a

    def advance(self, time, h):
        """Advance one step to a time."""
        q, v, a, pseudo = self.q, self.v, self.a, self.pseudo
        am, af, beta, gamma = self.am, self.af, self.beta, self.gamma

        def rates(place):
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


def nonlinear_transient(
    mechanism, sections, laws, times, step, elements=8, joints=None, damping=0.0, begin="rigid", dissipation=0.2
):
    """Motion of a mechanism of elastic beams from a start, with large displacements.

    Parameters
    ----------
    laws
        Per drive, a function from times [s] to coordinate, rate and acceleration; only the coordinate is used.
    times
        Requested times [s], increasing; the first is the start.
    step
        Largest time step [s]; the interval between two requested times is divided evenly.
    begin
        "rigid": positions and velocities of the rigid links; "quasi-static": deformed by the loads and the inertia of
        the rigid motion, with the rate of this deformation; "static": at rest, deformed by the loads.
    dissipation
        Numerical damping of the highest frequencies, 0 to 1; low frequencies are undamped to second order.
    mechanism, sections, elements, joints, damping
        See `nonlinear_steady_state`.

    Raises
    ------
    NotCheckedError
        The check does not support part of the mechanism; the message names it.
    DoesNotCloseError
        Joints do not close, or a step does not converge.
    ValueError
        Invalid numbers.
    """
    times = np.asarray(times, float)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0).all():
        raise ValueError("expected two times or more, growing")
    if not step > 0 or not 0 <= dissipation <= 1:
        raise ValueError(f"step {step:g} s and dissipation {dissipation:g}: expected more than 0, and 0 to 1")
    system = system_of(mechanism, sections, laws, float(times[0]), elements, joints, damping)
    marcher = Marcher(system, 1.0 - dissipation, float(times[0]), step, begin)
    kept = [marcher.copy()]
    for last, now in pairwise(times):
        count = max(1, int(np.ceil((now - last) / step * (1 - 1e-12))))
        for k in range(count):
            marcher.advance(last + (now - last) * (k + 1) / count, (now - last) / count)
        kept.append(marcher.copy())
    q, v, a, multipliers = (np.concatenate(values) for values in zip(*kept, strict=True))
    rigid = system.rigid_coordinates(system.rigid.at(times))
    _, state, _ = system.residual(q, v, a, multipliers, system.drives(times), system.load_factors(times), tangent=False)
    return solution_of(system, elements, Instants(times, rigid, q, v, a, multipliers, state))


def nonlinear_equilibrium(mechanism, sections, laws, times, elements=8, joints=None):
    """Static equilibrium at given times [s], with drives and loads from their laws.

    Each solution starts from the previous one, so laws of time can lead to large displacements in increments. See
    `nonlinear_transient` for parameters and errors.
    """
    times = np.asarray(times, float)
    system = system_of(mechanism, sections, laws, float(times[0]), elements, joints, 0.0)
    equilibrium = InstantEquilibrium(system)
    rigid = system.rigid_coordinates(system.rigid.at(times))
    rest = np.zeros((1, rigid.shape[1]))
    kept, moved = [], rest
    for k, time in enumerate(times):
        here = equilibrium.balanced(rigid[k : k + 1] + moved, lambda place: (place, rest, rest), 0.0, 0.0, float(time))[
            0
        ]
        moved = here - rigid[k : k + 1]
        kept.append((here, equilibrium.multipliers.copy()))
    q, multipliers = (np.concatenate(values) for values in zip(*kept, strict=True))
    still = np.zeros_like(q)
    given = q, still, still, multipliers, system.drives(times), system.load_factors(times)
    _, state, _ = system.residual(*given, tangent=False)
    return solution_of(system, elements, Instants(times, rigid, q, still, still, multipliers, state))
