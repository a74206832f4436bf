"""Force and motion of a joint over the cycle: mean force for life, swing, sense of rotation."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rigid import JointForces, Motion
from rigid.arrays import Complexes, Integers, Numbers, Reals

CUBE = 3.0  # life exponent of ball bearings
MIN_TURNS = 0.5  # net turns in a run; a joint with fewer only swings


@dataclass(frozen=True, eq=False)
class JointCourse:
    """Force and motion of a joint over a run.

    Attributes
    ----------
    force
        Force on the child in ground axes [N], complex, shape (..., positions).
    child, parent
        Directions of the links' x' axes, complex, same shape.
    rate
        Rate of the child relative to the parent [rad/s], or of a slider [m/s], same shape.
    weight
        Time weight of each position [s], same shape.
    turns
        True if the coordinate is an angle.
    across, moment
        For a slider: transverse force [N] and moment about its point [N m] on the child, same shape.
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
        """1 if force and rate are known, otherwise 0; shape (..., positions)."""
        return np.where(np.isfinite(self.force) & np.isfinite(self.rate) & (self.weight > 0.0), 1.0, 0.0)

    @cached_property
    def size(self) -> Reals:
        """Magnitude of the force [N]; 0 if unknown."""
        return np.nan_to_num(np.abs(self.force)) * self.known

    @cached_property
    def path(self) -> Reals:
        """Distance covered around each position [rad or m], shape (..., positions)."""
        return np.nan_to_num(np.abs(self.rate)) * self.weight * self.known

    @property
    def travel(self) -> Reals:
        """Distance covered in the run, back and forth [rad or m], shape (...)."""
        return np.asarray(self.path.sum(axis=-1))

    def mean_force(self, exponent: float = CUBE) -> Reals:
        """Constant force that gives the same life [N], shape (...): power mean over the distance covered.

        For a joint at rest it is the power mean over time.

        References
        ----------
        ISO/TR 1281-1:2021 and Harris and Kotzalas, Essential Concepts of Bearing Technology, 5th ed. 2007, section
        11.9: equivalent load of a varying load, P_m^p = sum(P_i^p N_i) / sum(N_i).
        """
        weight = np.where(self.travel[..., None] > 0.0, self.path, self.weight * self.known)
        greatest = self.size.max(axis=-1, keepdims=True)
        scale = np.where(greatest > 0.0, greatest, 1.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = ((self.size / scale) ** exponent * weight).sum(axis=-1) / weight.sum(axis=-1)
        return np.asarray(scale[..., 0] * mean ** (1.0 / exponent))

    @cached_property
    def angle(self) -> Reals:
        """Angle of the child relative to the parent, continuous over turns [rad], shape (..., positions)."""
        way = self.child * np.conj(self.parent)
        return np.unwrap(np.angle(np.where(np.isfinite(way), way, 1.0)), axis=-1)

    @property
    def swing(self) -> Reals:
        """Angle between the extreme positions, or net angle if the joint keeps turning [rad], shape (...)."""
        return np.asarray(np.maximum(np.ptp(self.angle, axis=-1), 2.0 * np.pi * np.abs(self.net_turns)))

    @property
    def net_turns(self) -> Reals:
        """Net turns in the run, counter-clockwise, shape (...)."""
        return np.asarray(((self.rate * self.weight * self.known).sum(axis=-1)) / (2.0 * np.pi))

    @property
    def sense(self) -> Integers:
        """Sense of rotation, shape (...): 1 counter-clockwise, -1 clockwise, 0 if the joint swings or rests."""
        turns = self.net_turns
        return np.where(np.abs(turns) >= MIN_TURNS, np.sign(turns), 0.0).astype(int)

    def polar(self, of_child: bool) -> Complexes:
        """Polar diagram: force on a link in its own axes [N], complex, shape (..., positions)."""
        return self.force * np.conj(self.child) if of_child else -self.force * np.conj(self.parent)

    def force_turns(self, of_child: bool) -> Reals:
        """Number of turns of the force direction in a link's axes during a run, shape (...).

        About 0, the force stays on one side of the ring: a point load, which allows a loose fit. At 1 or more, it moves
        around the ring: a circumferential load, which needs a tight fit.
        """
        way = self.polar(of_child)
        known = np.where(np.isfinite(way) & (np.abs(way) > 0.0), way, 1.0)
        angle = np.unwrap(np.angle(np.concatenate([known, known[..., :1]], axis=-1)), axis=-1)
        return np.asarray((angle[..., -1] - angle[..., 0]) / (2.0 * np.pi))


def joint_course(motion: Motion, forces: JointForces, number: int, weight: Reals) -> JointCourse:
    """Return force and motion of a joint.

    Parameters
    ----------
    number
        Number of the joint in the order of `motion.structure.joints`.
    weight
        Time weight of each position [s], shape (..., positions); 0 if the position does not count.
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
