"""Force and motion of a joint over the cycle: mean force for life, swing, sense of rotation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rigid import JointForces, Motion
from rigid.arrays import Complexes, Integers, Numbers, Reals

CUBE = 3.0  # exponent of the life of ball bearings
WHOLE = 0.5  # turns from which on a joint turns on instead of swinging, in a run


@dataclass(frozen=True, eq=False)
class JointCourse:
    """Force and motion of a joint over a run.

    Attributes
    ----------
    force
        On the child in the ground's axes [N], complex, shape (..., positions).
    child, parent
        Directions of the links' x' axes, complex, of the same shape.
    rate
        Of the child against the parent [rad/s], or of a slider [m/s], of the same shape.
    weight
        Time for which each position stands [s], of the same shape.
    turns
        Whether the coordinate is an angle.
    across, moment
        Of a slider: force across its line [N] and moment about its point [N m] on the child, of the same shape.
    """

    force: Complexes
    child: Complexes
    parent: Complexes
    rate: Reals
    weight: Reals
    turns: bool
    across: Any = 0.0
    moment: Any = 0.0

    @cached_property
    def known(self) -> Reals:
        """1 where force and rate are known, else 0, shape (..., positions)."""
        return np.where(np.isfinite(self.force) & np.isfinite(self.rate) & (self.weight > 0.0), 1.0, 0.0)

    @cached_property
    def size(self) -> Reals:
        """Magnitude of the force [N], 0 where it is not known."""
        return np.nan_to_num(np.abs(self.force)) * self.known

    @cached_property
    def path(self) -> Reals:
        """Angle or way that is passed about each position [rad or m], shape (..., positions)."""
        path: Reals = np.nan_to_num(np.abs(self.rate)) * self.weight * self.known
        return path

    @property
    def travel(self) -> Reals:
        """Angle or way that is passed in the run, to and fro [rad or m], shape (...)."""
        return np.asarray(self.path.sum(axis=-1))

    def mean_force(self, exponent: float = CUBE) -> Reals:
        """Steady force of the same life [N], shape (...): the mean of a power over the angle that is passed.

        Over time where the joint does not move.

        References
        ----------
        ISO/TR 1281-1:2021 and Harris and Kotzalas, Essential Concepts of Bearing Technology, 5th ed. 2007, section
        11.9: equivalent load of one that varies, P_m^p = sum(P_i^p N_i) / sum(N_i).
        """
        weight = np.where(self.travel[..., None] > 0.0, self.path, self.weight * self.known)
        greatest = self.size.max(axis=-1, keepdims=True)
        scale = np.where(greatest > 0.0, greatest, 1.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = ((self.size / scale) ** exponent * weight).sum(axis=-1) / weight.sum(axis=-1)
        return np.asarray(scale[..., 0] * mean ** (1.0 / exponent))

    @cached_property
    def angle(self) -> Reals:
        """Angle of the child against the parent, counted on over the turns [rad], shape (..., positions)."""
        way = self.child * np.conj(self.parent)
        return np.unwrap(np.angle(np.where(np.isfinite(way), way, 1.0)), axis=-1)

    @property
    def swing(self) -> Reals:
        """Angle between the extreme positions, or that of its turns where it turns on [rad], shape (...)."""
        return np.asarray(np.maximum(np.ptp(self.angle, axis=-1), 2.0 * np.pi * np.abs(self.net_turns)))

    @property
    def net_turns(self) -> Reals:
        """Turns that are left at the end of the run, counter-clockwise, shape (...)."""
        return np.asarray(((self.rate * self.weight * self.known).sum(axis=-1)) / (2.0 * np.pi))

    @property
    def sense(self) -> Integers:
        """1 where the joint turns on counter-clockwise, -1 clockwise, 0 where it swings or stands, shape (...)."""
        turns = self.net_turns
        return np.where(np.abs(turns) >= WHOLE, np.sign(turns), 0.0).astype(int)

    def polar(self, of_child: bool) -> Complexes:
        """Force on a link in that link's axes [N], complex, shape (..., positions): its polar diagram."""
        force: Complexes = self.force * np.conj(self.child) if of_child else -self.force * np.conj(self.parent)
        return force

    def force_turns(self, of_child: bool) -> Reals:
        """Turns of the force's direction in a link's axes in a run, shape (...).

        About 0: the force stays on one side of that ring (a point load, which may be fitted loosely). About 1 or more:
        it goes round it (a load all around, which wants a tight fit).
        """
        way = self.polar(of_child)
        known = np.where(np.isfinite(way) & (np.abs(way) > 0.0), way, 1.0)
        angle = np.unwrap(np.angle(np.concatenate([known, known[..., :1]], axis=-1)), axis=-1)
        return np.asarray((angle[..., -1] - angle[..., 0]) / (2.0 * np.pi))


def joint_course(motion: Motion, forces: JointForces, number: int, weight: Reals) -> JointCourse:
    """Force and motion of a joint.

    Parameters
    ----------
    number
        Of the joint, in the order of `motion.structure.joints`.
    weight
        Time for which each position stands [s], shape (..., positions); 0 of one that does not count.
    """
    place = motion.places[number]

    def wide(value: Any) -> Numbers:
        return np.broadcast_to(value, np.shape(weight))

    return JointCourse(
        wide(forces.force[number]),
        wide(motion.direction[place.joint.child]),
        wide(motion.direction[place.joint.parent]),
        wide(np.asarray(place.rate(motion.velocity, motion.angular_velocity))),
        weight,
        place.turns,
        0.0 if place.turns else wide(place.pressing(forces.force[number], forces.moment[number], 2.0)[0]),
        wide(forces.moment[number]),
    )
