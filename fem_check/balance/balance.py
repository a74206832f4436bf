"""Newton's and Euler's laws for the whole mechanism, by finite differences in time.

The finite element check shares the motion and its accelerations with the answer. This check does not: joints must
close, velocities must equal the rates of the positions, and the momentum of all masses must change as gravity, the
given loads and the ground forces require. From `rigid` it reads only the mechanism, positions, velocities and ground
forces. Derivation: docs/validity.md, "Momentum".
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Deflection
from fem_check.balance.displaced import Transient, of_displacements, of_transient, unresolved
from fem_check.balance.forces import applied, ground_moment, openings
from fem_check.balance.masses import masses_of, places, velocities
from fem_check.balance.rates import GRANTED, MotionNear, rates_of, size_of
from rigid import Motion
from rigid.plane import cross


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
