"""Force and motion of a joint over a run: mean force, swing, sense of rotation, and effects of clearance."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import JointForces, Motion
from rigid.arrays import Complexes, Flags, Integers, Numbers, Reals
from rigid.closures import displacements
from rigid.plane import ZERO

BALL_EXPONENT = 3.0  # life exponent of ball bearings
MIN_TURNS = 0.5  # a joint with fewer than MIN_TURNS net turns per run counts as swinging (oscillating)
MIN_FORCE = 0.01  # contact counts as lost if the force is below MIN_FORCE * (largest force of the run)
DIRECTIONS = 180  # number of directions in the search for the largest displacement of a point


class JointHistory(Struct, frozen=True, eq=False, dict=True):
    """Force and motion of a joint over a run. All arrays have the shape (..., positions).

    Attributes
    ----------
    force
        Force on the child link in ground axes (complex) [N].
    child, parent
        Directions of the x' axes of the child link and the parent link (complex).
    rate
        Angular velocity of the child relative to the parent [rad/s], or sliding velocity [m/s].
    weight
        Weight of each position in time averages [s].
    turns
        True if the joint coordinate is an angle, False if it is a distance.
    across, moment
        For a slider: transverse force on the child [N], and moment on the child about the slider's point [N m].
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
        """1 if force and rate are known and the weight is positive, else 0; shape (..., positions)."""
        return np.where(np.isfinite(self.force) & np.isfinite(self.rate) & (self.weight > 0.0), 1.0, 0.0)

    @cached_property
    def size(self) -> Reals:
        """Magnitude of the force [N]; 0 if unknown."""
        return np.nan_to_num(np.abs(self.force)) * self.known

    @cached_property
    def path(self) -> Reals:
        """Angle or distance covered during the time weight of each position [rad or m], shape (..., positions)."""
        return np.nan_to_num(np.abs(self.rate)) * self.weight * self.known

    def mean(self, values: Reals) -> Reals:
        """Return the time average over the known positions, shape (...). `values` must be 0 at unknown positions."""
        return np.asarray((values * self.weight).sum(axis=-1) / (self.weight * self.known).sum(axis=-1))

    @property
    def travel(self) -> Reals:
        """Total angle or distance covered in the run, forth plus back [rad or m], shape (...)."""
        return np.asarray(self.path.sum(axis=-1))

    def mean_force(self, exponent: float = BALL_EXPONENT) -> Reals:
        """Return the constant force [N] that would give a bearing the same life as the varying force, shape (...).

        This force is the power mean over the covered angle or distance, or over time for a joint at rest.

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
        """Angle of the child relative to the parent, unwrapped [rad], shape (..., positions)."""
        turned = self.child * np.conj(self.parent)
        return np.unwrap(np.angle(np.where(np.isfinite(turned), turned, 1.0)), axis=-1)

    @property
    def swing(self) -> Reals:
        """Angle between the extreme positions, or net angle of rotation, whichever is larger [rad], shape (...)."""
        return np.asarray(np.maximum(np.ptp(self.angle, axis=-1), 2.0 * np.pi * np.abs(self.net_turns)))

    @property
    def net_turns(self) -> Reals:
        """Net number of turns in the run, positive counter-clockwise, shape (...)."""
        return np.asarray(((self.rate * self.weight * self.known).sum(axis=-1)) / (2.0 * np.pi))

    @property
    def sense(self) -> Integers:
        """Sense of rotation, shape (...): 1 counter-clockwise, -1 clockwise, 0 if the joint swings or rests."""
        turns = self.net_turns
        return np.where(np.abs(turns) >= MIN_TURNS, np.sign(turns), 0.0).astype(int)

    def polar(self, of_child: bool) -> Complexes:
        """Return the polar load diagram: force on a link in link axes (complex) [N], shape (..., positions)."""
        return self.force * np.conj(self.child) if of_child else -self.force * np.conj(self.parent)

    def force_turns(self, of_child: bool) -> Reals:
        """Return how many turns the force makes during a run, seen in the axes of the child or parent, shape (...).

        If the number is about 0, the force stays on one side of the ring: a point load, which allows a loose fit. If
        the number is 1 or more, the force moves around the ring: a circumferential load, which needs a tight fit.
        """
        force = self.polar(of_child)
        known = np.where(np.isfinite(force) & (np.abs(force) > 0.0), force, 1.0)
        angle = np.unwrap(np.angle(np.concatenate([known, known[..., :1]], axis=-1)), axis=-1)
        return np.asarray((angle[..., -1] - angle[..., 0]) / (2.0 * np.pi))


def joint_history(motion: Motion, forces: JointForces, number: int, weight: Reals) -> JointHistory:
    """Return the force and motion of a joint.

    Parameters
    ----------
    number
        Index of the joint in `motion.structure.joints`.
    weight
        Time weight of each position [s], shape (..., positions); 0 excludes a position.
    """
    place = motion.places[number]
    force, moment = forces.in_joints[number]

    def wide(value: Any) -> Numbers:
        return np.broadcast_to(value, np.shape(weight))

    return JointHistory(
        wide(force),
        wide(motion.direction[place.joint.child]),
        wide(motion.direction[place.joint.parent]),
        wide(np.asarray(place.rate(motion.velocity, motion.angular_velocity))),
        weight,
        place.turns,
        0.0 if place.turns else wide(place.pressing(force, moment, 2.0)[0]),
        wide(moment),
    )


def contact_losses(history: JointHistory, closed: bool) -> Flags:
    """Return whether contact is lost between each position and the next, shape (..., positions).

    The force is interpolated linearly between positions. Contact is lost if the force falls below (`MIN_FORCE` *
    maximum force), or if the force direction changes by more than a right angle between the two positions. The pin then
    moves to the other side of the hole and knocks. The force direction is in ground axes, so a link that rotates under
    a constant force does not lose contact. If `closed` is True, the first position follows the last one, because the
    motion repeats.
    """
    now = history.force
    after = np.roll(now, -1, axis=-1)
    step = after - now
    share = np.divide(-np.real(np.conj(step) * now), np.abs(step) ** 2, out=np.zeros(now.shape), where=np.abs(step) > 0)
    nearest = np.abs(now + np.clip(share, 0.0, 1.0) * step)
    greatest = history.size.max(axis=-1, keepdims=True)
    lost = (nearest < MIN_FORCE * greatest) | (np.real(np.conj(now) * after) < 0.0)
    if not closed:
        lost[..., -1] = False
    return np.asarray(lost & np.isfinite(now) & np.isfinite(after))


def knocks(lost: Flags, closed: bool) -> Integers:
    """Return the number of contact losses, shape (...).

    Losses at successive positions count as one loss. `lost` is the result of `contact_losses`.
    """
    before = np.roll(lost, 1, axis=-1)
    if not closed:
        before[..., 0] = False
    return np.asarray((lost & ~before).sum(axis=-1))


def clearance_effects(
    motion: Motion, clearances: Mapping[int, Reals], forces: Mapping[int, Complexes], link: int, point: complex | None
) -> tuple[Reals, Reals]:
    """Return the displacement of a point [m], or the change of a link's angle [rad], due to joint clearances.

    The links are rigid. The result is of first order in the clearances: each pin displaces the output by (offset of the
    pin in its hole) * (displacement of the output per unit joint gap). Range: clearances and displacements are small
    compared with the links, and the mechanism is not near a dead point.

    Parameters
    ----------
    clearances
        Hole diameter minus pin diameter [m], by joint index. The pin can move by half of this difference from the
        centre of its hole.
    forces
        Force on the child link at each joint with clearance, in ground axes [N], by joint index.
    link, point
        Output link, and output point in the axes of this link. If `point` is None, the output is the angle of the link.

    Returns
    -------
    Two arrays of shape (..., positions). The first array is the largest possible displacement. For each direction, the
    largest contributions of all pins are added; the largest of these sums is the result. The second array is the
    displacement if the joint forces press all pins against their holes.
    """
    rows, pressed = [], np.zeros(motion.columns, complex)
    for number, clearance in clearances.items():
        across, up = (_influence(motion, number, gap, link, point) for gap in (1.0, 1j))
        half = np.asarray(clearance) / 2.0
        rows.append((half * across, half * up))
        force = forces[number]
        with np.errstate(invalid="ignore", divide="ignore"):
            direction = np.where(np.abs(force) > 0.0, force / np.abs(force), 0.0)
        pressed = pressed - half * (
            np.real(direction) * across + np.imag(direction) * up
        )  # the child moves in the direction opposite to the force on the child
    worst = np.zeros(motion.columns)
    for toward in np.exp(1j * np.pi * np.arange(DIRECTIONS if point is not None else 1) / DIRECTIONS):
        parts = (np.hypot(np.real(np.conj(toward) * x), np.real(np.conj(toward) * y)) for x, y in rows)
        worst = np.maximum(worst, sum(parts, start=np.zeros(motion.columns)))
    return worst, np.abs(pressed)


def _influence(motion: Motion, number: int, gap: complex, link: int, point: complex | None) -> Complexes:
    """Return the displacement of a point (complex), or the rotation of a link, due to a joint gap in ground axes."""
    none = [ZERO] * len(motion.places)
    gaps = [*none[:number], np.asarray(gap), *none[number + 1 :]]
    shift, turning, _ = displacements(motion.closures, gaps, none, [ZERO] * len(motion.mechanism.links))
    moved = turning[link].imag if point is None else shift[link] + turning[link] * motion.direction[link] * point
    return np.broadcast_to(np.asarray(moved, complex), motion.columns)
