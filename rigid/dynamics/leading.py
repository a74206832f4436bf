"""Choice of leading joints during integration: replace a drive that reaches a dead point.

A leading joint is a joint whose coordinate is integrated. By default, this is the joint of a drive with a given effort.
At a dead point, the drive is at rest while the links move, so that the drive coordinate does not determine the motion
of the links. The coordinate of another joint is then integrated instead. The effort of the drive is converted to an
effort at the new leading joint by virtual work. Derivation: docs/dynamics.md.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from rigid.arrays import Columns, Complexes, Reals
from rigid.decomposition.order import structure
from rigid.joints import Joint, Placed
from rigid.kinematics import Motion
from rigid.mechanism import Mechanism
from rigid.postures import joint_place

# A joint replaces a drive only if it moves faster than the drive by this factor. For this comparison, rates of slides
# are divided by the size of the mechanism.
MIN_GAIN = 3.0


class Lead(Struct, frozen=True, eq=False):
    """A mechanism and its current leading joints.

    Leading joints are the joints whose coordinates are integrated.

    Attributes
    ----------
    mechanism
        Original mechanism.
    variant
        The same mechanism with drives at the leading joints. If these are not the joints of the original drives, the
        variant has no loads.
    replaced
        Joints of the original drives that other leading joints currently replace, by drive index.
    """

    mechanism: Mechanism
    variant: Mechanism
    replaced: Mapping[int, Joint] = field(default_factory=dict)

    def rates(self, placed: Placed, velocity: Complexes, omega: Reals) -> dict[int, Reals]:
        """Return the rates of the replaced drives for given velocities of all links, by drive index."""
        return {
            number: joint.sense * joint_place(placed, joint).rate(velocity, omega)
            for number, joint in self.replaced.items()
        }

    def accelerations(self, motion: Motion) -> dict[int, Reals]:
        """Return the second time derivatives of the replaced drives' coordinates, by drive index."""
        accelerations = {}
        for number, joint in self.replaced.items():
            apart = joint_place(motion, joint).second_rate(motion.acceleration, motion.turning)
            accelerations[number] = joint.sense * apart
        return accelerations

    def rotors(self, coasting: Motion, twists: tuple[Complexes, Reals]) -> tuple[Reals, Reals]:
        """Reduce the rotor inertia of the replaced drives to the leading joints.

        Return the reduced inertia, shape (drives, drives), and the efforts at the leading joints that accelerate the
        rotors while the rates of the leading joints are constant, shape (drives,).

        Parameters
        ----------
        coasting
            Motion at constant rates of the leading joints, for one position.
        twists
            Velocities and angular velocities of the links per unit rate of each leading joint, shape (links, drives)
            each.
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
        """Convert a motion of `variant` to a motion of the original mechanism.

        The drive accelerations are not converted. `near` contains approximate coordinates of the replaced drives, by
        drive index. Their errors must be smaller than half a turn.
        """
        if not self.replaced:
            return motion
        drive, rate = motion.drive.copy(), motion.drive_rate.copy()
        rates = self.rates(motion, motion.velocity, motion.angular_velocity)
        for number, joint in self.replaced.items():
            drive[number], rate[number] = unwound(motion, joint, near[number]), rates[number]
        return replace(motion, mechanism=self.mechanism, drive=drive, drive_rate=rate)


def unwound(placed: Placed, joint: Joint, near: Columns) -> Reals:
    """Return the coordinate of a joint. An angle is shifted by full turns to the value closest to `near`."""
    value: Reals = joint.coordinate(placed)
    return value + 2 * np.pi * np.round((near - value) / (2 * np.pi)) if joint.turns else value


def better_leading_joints(
    lead: Lead, placed: Placed, twists: tuple[Complexes, Reals], free: Sequence[int], size: float
) -> Lead | None:
    """Replace a leading joint by the joint that moves fastest relative to this leading joint.

    Leading joints are the joints whose coordinates are integrated. Return the new choice, or None if no joint is faster
    than a leading joint by the factor `MIN_GAIN`.

    Parameters
    ----------
    lead
        Current leading joints.
    placed
        Current posture.
    twists
        Velocities and angular velocities of the links per unit rate of each leading joint, each of shape (links,
        drives).
    free
        Indices of the drives whose leading joints may be replaced.
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


class Stretch(Struct, frozen=True, eq=False):
    """Time interval of an integrated motion with the same leading joints.

    Attributes
    ----------
    lead
        Mechanism and leading joints, i.e. the joints whose coordinates are integrated.
    time
        Times of the integration steps, including the start [s], shape (steps,).
    origin, direction
        Posture of the links at the steps (complex), shape (links, steps).
    state
        Function of times, shape (n,). It returns the integrated coordinates, followed by their rates.
    replaced
        Coordinates at the steps of the drives that other leading joints replace, shape (steps,), by drive index.
    """

    lead: Lead
    time: Reals
    origin: Complexes
    direction: Complexes
    state: Callable[[Reals], Reals]
    replaced: Mapping[int, Reals]
