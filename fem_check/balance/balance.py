"""Balance of momentum and angular momentum of the whole mechanism, by finite differences in time.

The finite element check takes velocities and accelerations from the solution that it checks. This check computes them
by finite differences. It tests that the joints are closed, that the velocities equal the rates of
the positions, and that the rates of momentum and angular momentum of all masses equal the sums of gravity, given loads
and ground forces. From `rigid` it uses only the mechanism, positions, velocities and ground forces. The derivation is
in docs/validity.md, "Momentum".
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import Deflection
from fem_check.balance.forces import applied, ground_moment, openings, shifted
from fem_check.balance.masses import (
    EIGHTH,
    TOLERANCE,
    Masses,
    MotionNear,
    Rates,
    displacements,
    masses_of,
    places,
    rates_of,
    size_of,
    velocities,
)
from rigid import Motion, posture
from rigid.arrays import Complexes, Numbers, Reals
from rigid.plane import cross

SECOND_EIGHTH = (8 / 5, -1 / 5, 8 / 315, -1 / 560)
SECOND_SIXTH = (3 / 2, -3 / 20, 1 / 90, 0.0)
"""Weights of central differences of orders eight and six for second derivatives.

Entry k is the weight of the points k + 1 steps before and after the middle point. The weight of the middle point
follows from these.
"""
STEP_SHARE = 0.025
"""Time step of the differences for a vibration, relative to the time element in which it is a polynomial."""

Transient = tuple[Callable[[Motion], Deflection], Reals]
"""Function that returns the deflection for a motion, and the times between which it is smooth [s], shape (edges,)."""


class MomentumBalance(Struct, frozen=True):
    """Residuals of the joints and of the balance of momentum, each relative to a reference value over all positions.

    Attributes
    ----------
    opening
        Largest gap of a joint, relative to the size of the mechanism.
    velocity
        Largest difference between the velocity of a mass and the rate of its position, relative to the largest rate.
    force
        Largest difference between the rate of momentum and the sum of all forces including the ground force. The
        difference is relative to the largest sum, at one position, of the magnitudes of inertia forces and given
        forces.
    moment
        Largest difference between the rate of angular momentum and the sum of all moments, about the mean position of
        the links. The difference is relative to the largest sum, at one position, of the magnitudes of these moments.
    compared
        Number of compared positions. Positions at corners of a motion law, and positions locked by friction, are
        excluded.
    tolerance
        Largest accepted residual.
    """

    opening: float
    velocity: float
    force: float
    moment: float
    compared: int
    tolerance: float = TOLERANCE

    @property
    def largest(self) -> float:
        """Largest residual."""
        return max(self.opening, self.velocity, self.force, self.moment)

    @property
    def passed(self) -> bool:
        """Whether positions were compared and no residual exceeds `tolerance`."""
        return self.compared > 0 and self.largest <= self.tolerance


def balance(
    deflection: Deflection,
    motion_near: MotionNear,
    span: tuple[float, float] = (-math.inf, math.inf),
    cycle: float | None = None,
    tolerance: float = TOLERANCE,
    exact: bool = False,
    transient: Transient | None = None,
) -> MomentumBalance:
    """Compare the rate of momentum of all masses with the forces of a solution.

    Parameters
    ----------
    deflection
        The solution for one design, with columns (positions,).
    motion_near
        Function that returns the rigid motion at given times [s], for the finite differences. Its second argument is
        the posture at the nearest positions of `deflection`.
    span
        First and last time at which the motion is known [s].
    cycle
        Period of links in periodic vibration [s], otherwise None. The displacements of vibrating links add momentum.
        This momentum is differentiated by a Fourier series through equally spaced positions of the whole cycle. If
        there are too few positions, no position is compared.
    tolerance
        Largest accepted residual. For vibrating links, give the discretization error of the solution.
    exact
        True for a solution with large displacements. If False, products of displacements are omitted, as in linear
        elastodynamics.
    transient
        See `Transient`. Required if links vibrate and the vibration is not periodic; otherwise None. The momentum of
        the links is differentiated by finite differences, at positions that are far enough from discontinuities.
    """
    motion = deflection.motion
    masses = masses_of(motion.mechanism)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = _centre(motion)
        arm = places(motion, masses) - centre
        rates = rates_of(motion, masses, motion_near, span)
        inertia = masses.mass * rates.acceleration
        rotary = masses.inertia * rates.rotation
        force, moment = applied(motion, masses, centre)
        out_of_force = inertia.sum(axis=0) - force + deflection.forces.ground_force
        out_of_moment = (cross(arm, inertia) + rotary).sum(axis=0) - moment + ground_moment(deflection, centre)
        if cycle is not None:
            further = of_displacements(deflection, masses, centre, cycle, exact)
            out_of_force, out_of_moment = out_of_force + further[0], out_of_moment + further[1]
            if unresolved(further[0]) > tolerance:
                out_of_force = np.full(motion.columns, np.nan)
        elif transient is not None:
            further = of_transient(deflection, masses, centre, rates, motion_near, transient, tolerance, exact)
            out_of_force, out_of_moment = out_of_force + further[0], out_of_moment + further[1]
        known = rates.known & np.isfinite(out_of_force) & np.isfinite(out_of_moment)
        forces = np.abs(inertia).sum(axis=0) + np.abs(force)
        moments = (np.abs(arm * inertia) + np.abs(rotary)).sum(axis=0) + np.abs(moment)
        return MomentumBalance(
            _share(openings(motion), size_of(motion, known), known),
            _share(rates.velocity - velocities(motion, masses), _largest(rates.velocity, known), known),
            _share(out_of_force, _largest(forces, known), known),
            _share(out_of_moment, _largest(moments, known), known),
            int(known.sum()),
            tolerance,
        )


def _centre(motion: Motion) -> complex:
    """Return the mean of all link origins (complex) [m], which is the reference point of moments."""
    return (
        complex(np.mean(motion.origin, where=np.isfinite(motion.origin))) if np.isfinite(motion.origin).any() else 0.0
    )


def _largest(values: Any, known: Any) -> float:
    """Return the largest magnitude over the known positions (last axis)."""
    return float(np.abs(values)[..., known].max(initial=0.0))


def _share(difference: Any, scale: float, known: Any) -> float:
    """Return the largest difference relative to `scale`, or zero if there is no difference."""
    apart = _largest(difference, known)
    return apart / scale if apart else 0.0


def of_displacements(
    deflection: Deflection, masses: Masses, centre: complex, cycle: float, exact: bool
) -> tuple[Complexes, Reals]:
    """Return the rates of momentum [N] and angular momentum [N m] that a periodic vibration adds.

    Let a mass m have the position r and the velocity v in the rigid motion, and the displacement s with the rate s'.
    The displacement adds the momentum m s' and the angular momentum m (r x s' + s x (v + s')). The term s x s' is of
    second order, and is only included if `exact` is True. A force f on the mass adds the moment s x f, which is
    subtracted here.
    """
    motion = deflection.motion
    arm, velocity = places(motion, masses) - centre, velocities(motion, masses)
    moved, turned = displacements(deflection)
    speed = rate_of(moved, cycle)
    spin = masses.mass * (cross(arm, speed) + cross(moved, velocity + exact * speed))
    spin = spin + masses.inertia * rate_of(turned, cycle).real
    rate = rate_of((masses.mass * speed).sum(axis=0), cycle)
    return rate, rate_of(spin.sum(axis=0), cycle).real - shifted(deflection, masses, moved)


def of_transient(
    deflection: Deflection,
    masses: Masses,
    centre: complex,
    rates: Rates,
    motion_near: MotionNear,
    transient: Transient,
    tolerance: float,
    exact: bool,
) -> tuple[Complexes, Reals]:
    """Return the rates of momentum and angular momentum that a vibration adds, by finite differences in time.

    Both rates are nan at positions that are too close to the times at which the motion is not smooth. The rate of
    momentum is also nan at positions at which the differences of orders six and eight disagree. With the symbols of
    `of_displacements` and the acceleration a in the rigid motion, the rate of angular momentum is `m (r x s'' + s x (a
    + s''))`. The term s x s'' is of second order, and is only included if `exact` is True.
    """
    motion, (near, edges) = deflection.motion, transient
    count = len(EIGHTH)
    element = np.clip(np.searchsorted(edges, motion.time, side="right") - 1, 0, len(edges) - 2)
    step = STEP_SHARE * np.diff(edges)[element]
    inside = (motion.time - count * step >= edges[element]) & (motion.time + count * step <= edges[element + 1])
    unknown = np.full(motion.columns, np.nan)
    if not inside.any():
        return unknown, unknown
    time, step, here = motion.time[inside], step[inside], posture(motion, inside)

    def carried(k: int) -> Complexes:
        return np.array(displacements(near(motion_near(time + k * step, here))), complex)

    middle = carried(0)
    sums = np.array([carried(k) + carried(-k) - 2 * middle for k in range(1, count + 1)])
    good, rough = (np.tensordot(weights, sums, 1) / step**2 for weights in (SECOND_EIGHTH, SECOND_SIXTH))
    arm, acceleration = (places(motion, masses) - centre)[:, inside], rates.acceleration[:, inside]
    momentum, resolved = ((masses.mass * change[0]).sum(axis=0) for change in (good, rough))
    spin = cross(arm, good[0]) + cross(middle[0], acceleration + exact * good[0])
    turning = (masses.mass * spin + masses.inertia * good[1].real).sum(axis=0)
    converged = np.abs(momentum - resolved) <= tolerance / 10 * np.abs(momentum).max()
    force, moment = unknown.astype(complex), unknown.copy()
    force[inside] = np.where(converged, momentum, np.nan)
    moment[inside] = turning
    return force, moment - shifted(deflection, masses, displacements(deflection)[0])


def rate_of(values: Numbers, cycle: float) -> Complexes:
    """Return the time derivative (complex) of a periodic function, with values at equal time steps on the last axis."""
    count = values.shape[-1]
    waves = np.fft.fftfreq(count, 1 / count)
    waves[np.abs(waves) == count / 2] = 0.0  # the phase of the highest wave is unknown
    return np.fft.ifft(2j * np.pi / cycle * waves * np.fft.fft(values))


def unresolved(values: Any) -> float:
    """Return the largest amplitude in the highest third of the spectrum, relative to the largest of all amplitudes.

    The ratio is large if there are too few positions.
    """
    waves = np.abs(np.fft.fft(values))
    count = len(waves)
    highest = np.abs(np.fft.fftfreq(count, 1 / count)) >= count / 3
    return float(waves[highest].max(initial=0.0) / (waves.max(initial=0.0) or 1.0))
