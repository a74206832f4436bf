"""Newton's and Euler's laws for the whole mechanism, by finite differences in time.

The finite element check shares the motion and its accelerations with the answer. This check does not: joints must
close, velocities must equal the rates of the positions, and the momentum of all masses must change as gravity, the
given loads and the ground forces require. From `rigid` it reads only the mechanism, positions, velocities and ground
forces. Derivation: docs/validity.md, "Momentum".
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Deflection
from fem_check.balance.forces import applied, ground_moment, openings, shifted
from fem_check.balance.masses import (
    EIGHTH,
    GRANTED,
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
"""Central differences for second derivatives, of orders eight and six, without the weight of the middle point."""
STEP_SHARE = 0.025
"""Difference step for a vibration, relative to the time element, in which it is a polynomial."""

Transient = tuple[Callable[[Motion], Deflection], Reals]
"""Deflection of vibrating links at any positions; boundaries of its smooth intervals [s], (edges,)."""


@dataclass(frozen=True)
class MomentumBalance:
    """Relative residuals of the joints and of Newton's and Euler's laws.

    Each is relative to the largest contribution over the positions.

    Attributes
    ----------
    opening
        Largest gap of a joint, relative to the mechanism's size.
    velocity
        Largest difference between the velocities of the masses and the rates of their positions.
    force, moment
        Largest difference between the rate of momentum and the acting forces including the ground force; the same for
        moments about the centre of the links.
    compared
        Number of compared positions. Kinks of a law and positions where friction locks are excluded.
    granted
        Largest accepted residual.
    """

    opening: float
    velocity: float
    force: float
    moment: float
    compared: int
    granted: float = GRANTED

    @property
    def largest(self) -> float:
        """Largest residual."""
        return max(self.opening, self.velocity, self.force, self.moment)

    @property
    def passed(self) -> bool:
        """Whether positions were compared and no residual exceeds `granted`."""
        return self.compared > 0 and self.largest <= self.granted


def balance(
    deflection: Deflection,
    motion_near: MotionNear,
    span: tuple[float, float] = (-math.inf, math.inf),
    cycle: float | None = None,
    granted: float = GRANTED,
    exact: bool = False,
    transient: Transient | None = None,
) -> MomentumBalance:
    """Compare the rate of momentum of all masses with the forces of an answer.

    Parameters
    ----------
    deflection
        The answer, columns (positions,).
    motion_near
        Rigid motion at some times [s] near a given posture, for the finite differences.
    span
        Time interval over which the motion is known [s].
    cycle
        Period of the vibration of the links [s]. Their displacement adds momentum, which is differentiated over equally
        spaced positions of the whole cycle. If there are too few positions, none is compared. None for a quasi-static
        answer, which has no such momentum.
    granted
        Largest accepted residual; for vibrating links, the error of the answer in time and in its coordinates.
    exact
        Whether the answer holds for large displacements. If not, products of displacements are omitted, as in linear
        elastodynamics.
    transient
        Vibrating links without a periodic state: their momentum is also differentiated in time, at positions far enough
        from discontinuities.
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
            if unresolved(further[0]) > granted:
                out_of_force = np.full(motion.columns, np.nan)
        elif transient is not None:
            further = of_transient(deflection, masses, centre, rates, motion_near, transient, granted, exact)
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
            granted,
        )


def _centre(motion: Motion) -> complex:
    """Mean position of the links, the reference point of moments [m], complex."""
    return (
        complex(np.mean(motion.origin, where=np.isfinite(motion.origin))) if np.isfinite(motion.origin).any() else 0.0
    )


def _largest(values: Any, known: Any) -> float:
    """Largest magnitude over the known positions (last axis)."""
    return float(np.abs(values)[..., known].max(initial=0.0))


def _share(difference: Any, scale: float, known: Any) -> float:
    """Largest difference relative to a scale; zero if there is no difference."""
    apart = _largest(difference, known)
    return apart / scale if apart else 0.0


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
