"""Rate of the momentum of displaced masses, minus the moments of the displaced forces."""

from collections.abc import Callable
from typing import Any

import numpy as np

from elastic import Deflection
from fem_check.balance.forces import shifted
from fem_check.balance.masses import Masses, displacements, places, velocities
from fem_check.balance.rates import EIGHTH, MotionNear, Rates
from rigid import Motion, posture
from rigid.arrays import Complexes, Numbers, Reals
from rigid.plane import cross

SECOND_EIGHTH = (8 / 5, -1 / 5, 8 / 315, -1 / 560)
SECOND_SIXTH = (3 / 2, -3 / 20, 1 / 90, 0.0)
"""Central differences for second derivatives, of orders eight and six, without the weight of the middle point."""
STEP_SHARE = 0.025
"""Difference step for a vibration, relative to the time element, in which it is a polynomial."""

Transient = tuple[Callable[[Motion], Deflection], Reals]
"""Deflection of vibrating links at any positions; boundaries of its smooth intervals [s], (edges,)."""


def of_displacements(
    deflection: Deflection, masses: Masses, centre: complex, cycle: float, exact: bool
) -> tuple[Complexes, Reals]:
    """Rates of momentum [N] and angular momentum [N m] that vibration adds.

    A point displaced by s that moves with v has the additional momentum m s' and angular momentum
    m (r x s' + s x (v + s')), with s x s' of second order. Its force f adds the moment s x f, subtracted here.
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
    granted: float,
    exact: bool,
) -> tuple[Complexes, Reals]:
    """Rates of the added momentum by finite differences; nan if unresolved.

    The rate of angular momentum is m (r x s'' + s x (a + s'')), with s x s'' of second order.
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
    converged = np.abs(momentum - resolved) <= granted / 10 * np.abs(momentum).max()
    force, moment = unknown.astype(complex), unknown.copy()
    force[inside] = np.where(converged, momentum, np.nan)
    moment[inside] = turning
    return force, moment - shifted(deflection, masses, displacements(deflection)[0])


def rate_of(values: Numbers, cycle: float) -> Complexes:
    """Rate of a periodic function, complex, from equally spaced positions; last axis: time."""
    count = values.shape[-1]
    waves = np.fft.fftfreq(count, 1 / count)
    waves[np.abs(waves) == count / 2] = 0.0  # the phase of the highest wave is unknown
    return np.fft.ifft(2j * np.pi / cycle * waves * np.fft.fft(values))


def unresolved(values: Any) -> float:
    """Share of the highest third of the spectrum, large if positions are too few."""
    waves = np.abs(np.fft.fft(values))
    count = len(waves)
    highest = np.abs(np.fft.fftfreq(count, 1 / count)) >= count / 3
    return float(waves[highest].max(initial=0.0) / (waves.max(initial=0.0) or 1.0))
