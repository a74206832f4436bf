"""Choice of leading joints during integration: replace a drive that reaches its limit.

A drive with a given effort is a coordinate of the motion. At a toggle position it is at rest while the links move, so
it does not determine their motion. Another joint replaces it; virtual work reduces the drive's effort to that joint.
Derivation: docs/dynamics.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rigid.arrays import Columns, Complexes, Reals
from rigid.decomposition.order import structure
from rigid.joint_places import joint_place
from rigid.joints import Joint, Placed
from rigid.kinematics import Motion
from rigid.mechanism import Mechanism

MIN_GAIN = 3.0  # smallest rate of a joint, relative to that of the drive it replaces


@dataclass(frozen=True, eq=False)
class Lead:
    """Mechanism with its leading joints.

    Attributes
    ----------
    mechanism
        Original mechanism.
    variant
        Mechanism driven at the leading joints; without loads if these differ from the original drives.
    own
        Original joints of the replaced drives, by drive number.
    """

    mechanism: Mechanism
    variant: Mechanism
    own: Mapping[int, Joint] = field(default_factory=dict)

    def rates(self, placed: Placed, velocity: Complexes, omega: Reals) -> dict[int, Reals]:
        """Rates of the replaced drives from the velocities of all links."""
        return {
            number: joint.sense * joint_place(placed, joint).rate(velocity, omega) for number, joint in self.own.items()
        }

    def accelerations(self, motion: Motion) -> dict[int, Reals]:
        """Second derivatives of the replaced drives' coordinates."""
        accelerations = {}
        for number, joint in self.own.items():
            apart = joint_place(motion, joint).second_rate(motion.acceleration, motion.turning)
            accelerations[number] = joint.sense * apart
        return accelerations

    def rotors(self, coasting: Motion, twists: tuple[Complexes, Reals]) -> tuple[Reals, Reals]:
        """Reduced rotor inertia of replaced drives, and its effort at constant rates.

        Shapes (drives, drives) and (drives,). `twists`: velocities and angular velocities of the links per unit rate
        of each drive, shape (links, drives).
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
        """Convert a motion of the variant to the mechanism; positions and velocities only.

        `near`: coordinates of the replaced drives, within half a turn.
        """
        if not self.own:
            return motion
        drive, rate = motion.drive.copy(), motion.drive_rate.copy()
        rates = self.rates(motion, motion.velocity, motion.angular_velocity)
        for number, joint in self.own.items():
            drive[number], rate[number] = unwound(motion, joint, near[number]), rates[number]
        return replace(motion, mechanism=self.mechanism, drive=drive, drive_rate=rate)


def unwound(placed: Placed, joint: Joint, near: Columns) -> Reals:
    """Joint coordinate; for an angle, the value nearest to a given one."""
    value: Reals = joint.coordinate(placed)
    return value + 2 * np.pi * np.round((near - value) / (2 * np.pi)) if joint.turns else value


def better_leading_joints(
    lead: Lead, placed: Placed, twists: tuple[Complexes, Reals], free: Sequence[int], size: float
) -> Lead | None:
    """Replace a drive by the joint that moves fastest relative to it, or return None.

    Parameters
    ----------
    placed
        Current posture.
    twists
        Velocities and angular velocities of the links per unit rate of each drive, shape (links, drives).
    free
        Numbers of the replaceable drives.
    size
        Size of the mechanism [m].
    """
    best: tuple[float, int, Joint] | None = None
    for joint in structure(lead.variant).joints:
        if joint.moved:
            continue
        rates = np.abs(joint_place(placed, joint).rate(*twists)) / (1.0 if joint.turns else size)
        for number in free:
            gain = float(np.ravel(rates)[number]) * (1.0 if lead.variant.drives[number].turns else size)
            if gain > max(MIN_GAIN, best[0] if best else 0.0):
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
    """Part of an integrated motion with the same leading joints.

    Attributes
    ----------
    lead
        Mechanism with its leading joints.
    time
        Integration steps including the start [s], shape (steps,).
    origin, direction
        Posture of the links at the steps, complex, shape (links, steps).
    state
        Interpolant from times of shape (n,) to the coordinates, then rates, of the integrated joints.
    own
        Coordinates of the replaced drives at the steps, shape (steps,), by drive number.
    """

    lead: Lead
    time: Reals
    origin: Complexes
    direction: Complexes
    state: Callable[[Reals], Reals]
    own: Mapping[int, Reals]
