"""Which joints lead a motion that is integrated: another one where a drive comes to its limit and the links move on.

A drive given as an effort is a coordinate of the motion. At a toggle the links move while it stands, so that it tells
no more how they move on; some other joint does, and what the drive's effort does to that is told by virtual work.
Derivation: docs/dynamics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rigid.arrays import Columns, Complexes, Reals
from rigid.decomposition.order import structure
from rigid.joint_places import joint_place
from rigid.joints import Joint, Placed
from rigid.kinematics import Motion
from rigid.mechanism import Mechanism

GAIN = 3.0  # by how much faster another joint has to move than the drive, both measured by the mechanism's size


@dataclass(frozen=True, eq=False)
class Lead:
    """A mechanism, and the joints that lead it.

    Attributes
    ----------
    mechanism
        The mechanism in question.
    variant
        The same, led by the joints that its drives name; where these are others than the mechanism's, without loads.
    own
        By the number of every drive that another joint leads: its own joint.
    """

    mechanism: Mechanism
    variant: Mechanism
    own: Mapping[int, Joint] = field(default_factory=dict)

    def rates(self, placed: Placed, velocity: Complexes, omega: Reals) -> dict[int, Reals]:
        """Rates of the drives that others lead, from the velocities of all links."""
        return {
            number: joint.sense * joint_place(placed, joint).rate(velocity, omega) for number, joint in self.own.items()
        }

    def accelerations(self, motion: Motion) -> dict[int, Reals]:
        """Second derivatives of the coordinates of the drives that others lead."""
        accelerations = {}
        for number, joint in self.own.items():
            apart = joint_place(motion, joint).second_rate(motion.acceleration, motion.turning)
            accelerations[number] = joint.sense * apart
        return accelerations

    def rotors(self, coasting: Motion, twists: tuple[Complexes, Reals]) -> tuple[Reals, Reals]:
        """Inertia of rotors of drives that others lead, reduced to these, and the efforts that coasting takes of it.

        Shapes (drives, drives) and (drives,). `twists`: velocities and angular velocities of the links for a unit rate
        of every drive, shape (links, drives).
        """
        count = len(self.mechanism.drives)
        inertia, taken = np.zeros((count, count)), np.zeros(count)
        heavy = [number for number in self.own if self.mechanism.drives[number].inertia]
        rates, second = (self.rates(coasting, *twists), self.accelerations(coasting)) if heavy else ({}, {})
        for number in heavy:
            rate = np.ravel(rates[number])
            inertia += self.mechanism.drives[number].inertia * np.outer(rate, rate)
            taken += self.mechanism.drives[number].inertia * rate * np.ravel(second[number])
        return inertia, taken

    def seen(self, motion: Motion, near: Mapping[int, Columns]) -> Motion:
        """A motion of the variant as one of the mechanism; places and velocities alone.

        `near`: coordinates of the drives that others lead, to half a turn.
        """
        if not self.own:
            return motion
        drive, rate = motion.drive.copy(), motion.drive_rate.copy()
        rates = self.rates(motion, motion.velocity, motion.angular_velocity)
        for number, joint in self.own.items():
            drive[number], rate[number] = unwound(motion, joint, near[number]), rates[number]
        return replace(motion, mechanism=self.mechanism, drive=drive, drive_rate=rate)


def unwound(placed: Placed, joint: Joint, near: Columns) -> Reals:
    """Coordinate of a joint, of an angle the one next to a given one."""
    value: Reals = joint.coordinate(placed)
    return value + 2 * np.pi * np.round((near - value) / (2 * np.pi)) if joint.turns else value


def better_leading_joints(
    lead: Lead, placed: Placed, twists: tuple[Complexes, Reals], free: Sequence[int], size: float
) -> Lead | None:
    """The mechanism led by the joint that moves fastest in the place of the drive that moves it; None where none does.

    Parameters
    ----------
    placed
        Where the links are.
    twists
        Velocities and angular velocities of the links for a unit rate of every drive, shape (links, drives).
    free
        Numbers of the drives that may be led.
    size
        Of the mechanism [m].
    """
    best: tuple[float, int, Joint] | None = None
    for joint in structure(lead.variant).joints:
        if joint.moved:
            continue
        rates = np.abs(joint_place(placed, joint).rate(*twists)) / (1.0 if joint.turns else size)
        for number in free:
            gain = float(np.ravel(rates)[number]) * (1.0 if lead.variant.drives[number].turns else size)
            if gain > max(GAIN, best[0] if best else 0.0):
                best = gain, number, joint
    if best is None:
        return None
    _, number, joint = best
    driven = {joint.drive: joint for joint in structure(lead.mechanism).joints if joint.drive is not None}
    names = [link.name for link in lead.variant.links]
    back = (joint.name, {joint.parent, joint.child}) == (
        driven[number].name,
        {driven[number].parent, driven[number].child},
    )
    movers = list(lead.variant.drives)
    movers[number] = lead.mechanism.drives[number] if back else joint.mover(names)
    led = {**lead.own, number: driven[number]}
    if back:
        del led[number]
    return Lead(lead.mechanism, replace(lead.mechanism, drives=tuple(movers), loads=()) if led else lead.mechanism, led)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of an integrated motion that is led by the same joints.

    Attributes
    ----------
    lead
        The mechanism with its leading joints.
    time
        The integrator's steps and its start [s], shape (steps,).
    origin, direction
        Of the links at the steps, complex, shape (links, steps).
    state
        Times of shape (n,) to coordinates and then rates of what leads in the place of the drives given as efforts.
    own
        Coordinates of the drives that others lead at the steps, shape (steps,), by the drive's number.
    """

    lead: Lead
    time: Reals
    origin: Complexes
    direction: Complexes
    state: Callable[[Reals], Reals]
    own: Mapping[int, Reals]
