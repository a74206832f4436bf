"""Rate of the momentum of displaced points, less the moments of the forces that go with them."""

from __future__ import annotations

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
"""Central differences of second derivatives, of the eighth and the sixth order; of the middle less twice their sum."""
WITHIN = 0.025
"""Step of the differences of a vibration, as a share of the element of time in which it is a polynomial."""

Transient = tuple[Callable[[Motion], Deflection], Reals]
"""Deflection of vibrating links at any positions, and the times between which it is smooth [s], shape (edges,)."""


def of_displacements(
    deflection: Deflection, masses: Masses, centre: complex, cycle: float, exact: bool
) -> tuple[Complexes, Reals]:
    """Rate of the momentum that vibration adds [N], and of the angular momentum less the moments that it adds [N m].

    A point displaced by s, moving with v, has m s' more momentum, and m (r x s' + s x (v + s')) more angular momentum,
    of which s x s' is of second order; a force f that goes with it has the moment s x f more.
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
    """The same by differences in time, nan at positions that they do not tell of.

    The angular momentum's rate is m (r x s'' + s x (a + s'')), with s x s'' of second order.
    """
    motion, (near, edges) = deflection.motion, transient
    count = len(EIGHTH)
    element = np.clip(np.searchsorted(edges, motion.time, side="right") - 1, 0, len(edges) - 2)
    step = WITHIN * np.diff(edges)[element]
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
    told = np.abs(momentum - resolved) <= granted / 10 * np.abs(momentum).max()
    force, moment = unknown.astype(complex), unknown.copy()
    force[inside] = np.where(told, momentum, np.nan)
    moment[inside] = turning
    return force, moment - shifted(deflection, masses, displacements(deflection)[0])


def rate_of(values: Numbers, cycle: float) -> Complexes:
    """Rate of a periodic function, complex, from even positions of its cycle; the last axis is time."""
    count = values.shape[-1]
    waves = np.fft.fftfreq(count, 1 / count)
    waves[np.abs(waves) == count / 2] = 0.0  # of the highest wave no phase is known
    return np.fft.ifft(2j * np.pi / cycle * waves * np.fft.fft(values))


def unresolved(values: Any) -> float:
    """Share of the waves among the highest third that positions tell of: too few positions leave much there."""
    waves = np.abs(np.fft.fft(values))
    count = len(waves)
    highest = np.abs(np.fft.fftfreq(count, 1 / count)) >= count / 3
    return float(waves[highest].max(initial=0.0) / (waves.max(initial=0.0) or 1.0))
