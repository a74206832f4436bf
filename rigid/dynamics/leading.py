"""Choice of leading joints during integration: replace a drive that reaches a dead point.

The coordinate of a drive with a given effort is integrated. At a dead point this drive is at rest while the links move,
so that its coordinate does not determine their motion. Another joint then takes its place as leading joint. Virtual
work reduces the drive's effort to this joint. Derivation: docs/dynamics.md.
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

MIN_GAIN = 3.0  # smallest rate of a joint / rate of the drive that it replaces


@dataclass(frozen=True, eq=False)
class Lead:
    """A mechanism and its current leading joints.

    Attributes
    ----------
    mechanism
        Original mechanism.
    variant
        Mechanism driven at the leading joints. It has no loads if these differ from the original drives.
    replaced
        Original joints of the replaced drives, by drive index.
    """

    mechanism: Mechanism
    variant: Mechanism
    replaced: Mapping[int, Joint] = field(default_factory=dict)

    def rates(self, placed: Placed, velocity: Complexes, omega: Reals) -> dict[int, Reals]:
        """Return the rates of the replaced drives for given velocities of all links."""
        return {
            number: joint.sense * joint_place(placed, joint).rate(velocity, omega)
            for number, joint in self.replaced.items()
        }

    def accelerations(self, motion: Motion) -> dict[int, Reals]:
        """Return the second time derivatives of the replaced drives' coordinates."""
        accelerations = {}
        for number, joint in self.replaced.items():
            apart = joint_place(motion, joint).second_rate(motion.acceleration, motion.turning)
            accelerations[number] = joint.sense * apart
        return accelerations

    def rotors(self, coasting: Motion, twists: tuple[Complexes, Reals]) -> tuple[Reals, Reals]:
        """Return the reduced rotor inertia of replaced drives, and the inertial effort at constant rates.

        The shapes are (drives, drives) and (drives,). `twists` are the velocities and angular velocities of the links
        per unit rate of each drive, shape (links, drives) each.
        """
        count = len(self.mechanism.drives)
        inertia, bias = np.zeros((count, count)), np.zeros(count)
        heavy = [number for number in self.replaced if self.mechanism.drives[number].inertia]
        rates, second = (self.rates(coasting, *twists), self.accelerations(coasting)) if heavy else ({}, {})
        for number in heavy:
            rate = np.ravel(rates[number])
            inertia += self.mechanism.drives[number].inertia * np.outer(rate, rate)
            bias += self.mechanism.drives[number].inertia * rate * np.ravel(second[number])
        return inertia, bias

    def original_motion(self, motion: Motion, near: Mapping[int, Columns]) -> Motion:
        """Convert positions and velocities of the variant to a motion of the original mechanism.

        `near` are the coordinates of the replaced drives to within half a turn.
        """
        if not self.replaced:
            return motion
        drive, rate = motion.drive.copy(), motion.drive_rate.copy()
        rates = self.rates(motion, motion.velocity, motion.angular_velocity)
        for number, joint in self.replaced.items():
            drive[number], rate[number] = unwound(motion, joint, near[number]), rates[number]
        return replace(motion, mechanism=self.mechanism, drive=drive, drive_rate=rate)


def unwound(placed: Placed, joint: Joint, near: Columns) -> Reals:
    """Return a joint coordinate. An angle is shifted by full turns to the value closest to `near`."""
    value: Reals = joint.coordinate(placed)
    return value + 2 * np.pi * np.round((near - value) / (2 * np.pi)) if joint.turns else value


def better_leading_joints(
    lead: Lead, placed: Placed, twists: tuple[Complexes, Reals], free: Sequence[int], size: float
) -> Lead | None:
    """Replace a drive by the joint that moves fastest relative to this drive, or return None.

    Parameters
    ----------
    placed
        Current posture.
    twists
        Velocities and angular velocities of the links per unit rate of each drive, shape (links, drives) each.
    free
        Indices of the drives that may be replaced.
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
    is_original = (joint.name, {joint.parent, joint.child}) == (
        driven[number].name,
        {driven[number].parent, driven[number].child},
    )
    movers = list(lead.variant.drives)
    movers[number] = lead.mechanism.drives[number] if is_original else joint.mover(names)
    led = {**lead.replaced, number: driven[number]}
    if is_original:
        del led[number]
    return Lead(lead.mechanism, replace(lead.mechanism, drives=tuple(movers), loads=()) if led else lead.mechanism, led)


@dataclass(frozen=True, eq=False)
class Stretch:
    """Part of an integrated motion without a change of leading joints.

    Attributes
    ----------
    lead
        Mechanism and leading joints.
    time
        Times of the integration steps, including the start [s], shape (steps,).
    origin, direction
        Posture of the links at the steps (complex), shape (links, steps).
    state
        Interpolant from times of shape (n,) to the coordinates and then the rates of the integrated joints.
    replaced
        Coordinates of the replaced drives at the steps, shape (steps,), by drive index.
    """

    lead: Lead
    time: Reals
    origin: Complexes
    direction: Complexes
    state: Callable[[Reals], Reals]
    replaced: Mapping[int, Reals]
