"""Newton's and Euler's laws for the whole mechanism, by differences in time of where its masses are.

What the finite elements share with the answer that they check is the motion with its accelerations. Here neither is
believed: joints have to close, velocities have to be the rate of the places, and the momentum of all masses has to
change as gravity, the given loads and the ground make it. Of `rigid` only the mechanism, the places and velocities of
its links and the forces on the ground are read. Derivation: docs/validity.md, "Momentum".
"""

from __future__ import annotations

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
class Balance:
    """Residuals of the joints and of Newton's and Euler's laws, as shares of their largest part over the positions.

    Attributes
    ----------
    opening
        Largest distance of points that a joint holds together, of the mechanism's size.
    velocity
        Largest difference of velocities of masses from the rate of their places.
    force, moment
        Largest difference of the rate of momentum from the forces that act, of the force on the ground; likewise the
        moments about the origin of coordinates.
    compared
        Number of positions that differences in time tell of: none at a kink of a law, or where friction locks.
    granted
        Share up to which the balance is kept.
    """

    opening: float
    velocity: float
    force: float
    moment: float
    compared: int
    granted: float = GRANTED

    @property
    def largest(self) -> float:
        """The largest share."""
        return max(self.opening, self.velocity, self.force, self.moment)

    @property
    def passed(self) -> bool:
        """Whether positions were compared, and all shares are granted."""
        return self.compared > 0 and self.largest <= self.granted


def balance(
    deflection: Deflection,
    motion_near: MotionNear,
    span: tuple[float, float] = (-math.inf, math.inf),
    cycle: float | None = None,
    granted: float = GRANTED,
    exact: bool = False,
    transient: Transient | None = None,
) -> Balance:
    """Balance of the rate of momentum of all masses and the forces of an answer.

    Parameters
    ----------
    deflection
        The answer, at (positions,).
    motion_near
        The rigid motion at some times [s] where the links are near a given posture: differences are made of it.
    span
        Times between which there is a motion [s].
    cycle
        Its period [s] where the links vibrate: their displacement has momentum too, whose rate is found from even
        positions of a whole cycle; where these are too few, nothing is compared. None for a quasi-static answer, which
        leaves that momentum out.
    granted
        Where the links vibrate, as much as the answer may be off in time and in its coordinates.
    exact
        Displacements of any size are in the answer; else
        their products are left out, as linear elastodynamics leaves them out.
    transient
        Of links that vibrate and do not come back: the rate of what their displacement adds is found by differences
        in time too, at positions far enough from where it is not smooth.
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
        return Balance(
            _share(openings(motion), size_of(motion, known), known),
            _share(rates.velocity - velocities(motion, masses), _largest(rates.velocity, known), known),
            _share(out_of_force, _largest(forces, known), known),
            _share(out_of_moment, _largest(moments, known), known),
            int(known.sum()),
            granted,
        )


def _centre(motion: Motion) -> complex:
    """A place amid the links, about which moments are taken [m], complex."""
    return (
        complex(np.mean(motion.origin, where=np.isfinite(motion.origin))) if np.isfinite(motion.origin).any() else 0.0
    )


def _largest(values: Any, known: Any) -> float:
    """Largest magnitude at the known positions, the last axis."""
    return float(np.abs(values)[..., known].max(initial=0.0))


def _share(difference: Any, scale: float, known: Any) -> float:
    """Largest difference as a share of a scale; zero where there is no difference."""
    apart = _largest(difference, known)
    return apart / scale if apart else 0.0
