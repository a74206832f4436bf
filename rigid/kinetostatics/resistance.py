"""Loads that depend on the direction of motion, such as pump pressure or blade friction."""

from collections.abc import Iterable

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import Reals
from rigid.closures.conditioning import extents
from rigid.kinematics import Motion, acceleration_of, velocity_of
from rigid.kinetostatics.friction import direction_of, speeds
from rigid.parts import Law, PointForce, PointLoad
from rigid.plane import dot


class Resistance(Struct, frozen=True, eq=False):
    """A load that opposes the motion of the point at which it acts.

    Attributes
    ----------
    load
        Force and moment that act when the motion is in the resisted direction, i.e. against the force.
    one_way
        If True, the load is zero while the motion is in the direction of the force. If False, the load then reverses.
        At the instant of a reversal, the load already has its value for the following motion. At rest the load is zero.

    Examples
    --------
    A blade at the end of an oscillating arm resists with 3 N against its motion:

    >>> from rigid import Link, Mechanism, PinDrive, motion
    >>> links = (Link("ground", {"O": 0}), Link("arm", {"O": 0, "A": 1.0}))
    >>> blade = Resistance(PointLoad("arm", "A", 3j, turning=True))
    >>> wiper = Mechanism(links, (PinDrive("arm", "O"),), {}, loads=(blade,))
    >>> next(iter(blade.forces(motion(wiper, np.zeros(3), [-2.0, 0.0, 2.0]))))[2].imag
    array([ 3.,  0., -3.])
    """

    load: PointLoad
    one_way: bool = False

    @property
    def link(self) -> str:
        """Link on which the load acts."""
        return self.load.link

    @property
    def point(self) -> str:
        """Point on which the load acts."""
        return self.load.point

    @property
    def law(self) -> Law | None:
        """Law of the load."""
        return self.load.law

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point on which the load acts."""
        return self.load.points

    def forces(self, motion: Motion) -> Iterable[PointForce]:
        """Yield the force in ground axes and the moment at each position."""
        law = 1.0 if self.law is None else self.law(motion)
        sign = np.sign(law) * self.direction(motion)
        factor = np.where(sign < 0, 1.0, 0.0) if self.one_way else -sign
        for link, point, force, moment in self.load.forces(motion):
            yield link, point, force * factor, moment * factor

    def direction(self, motion: Motion) -> Reals:
        """Return the sign of the load's power, ignoring its law, shape (..., positions); 0 at rest.

        At the instant of a reversal, the power is zero. The result is then the sign of its rate, which is the sign of
        the power just after the reversal.
        """
        [(link, point, force, moment)] = replace(self.load, law=None).forces(motion)
        at, force = motion.mechanism.index[link], np.asarray(force)
        spin, velocity = motion.angular_velocity[at], velocity_of(motion, link, point)
        (fastest, most_spin), (most_acceleration, most_turning) = speeds(motion), _largest_accelerations(motion)
        # at a reversal of the whole mechanism all speeds are zero, so accelerations must provide the reference for
        # round-off
        fastest = np.maximum(fastest, np.sqrt(most_acceleration * motion.mechanism.size))
        most_spin = np.maximum(most_spin, np.sqrt(most_turning))
        power = dot(force, velocity) + moment * spin
        sign = direction_of(power, np.abs(force) * fastest + np.abs(moment) * most_spin)
        if sign.all():
            return sign
        rate = dot(force, acceleration_of(motion, link, point)) + moment * motion.angular_acceleration[at]
        if self.load.turning:
            rate = rate + dot(1j * spin * force, velocity)
        scale = np.abs(force) * most_acceleration + np.abs(moment) * most_turning
        return np.where(sign == 0, direction_of(rate, scale), sign)


def _largest_accelerations(motion: Motion) -> tuple[Reals, Reals]:
    """Return bounds on the acceleration of all points [m/s^2], and on `Motion.turning` [rad/s^2], (..., positions)."""
    turning = np.abs(motion.turning)
    parts = [np.abs(motion.acceleration[at]) + turning[at] * size for at, size in enumerate(extents(motion.mechanism))]
    return np.max(parts, axis=0), turning.max(axis=0)
