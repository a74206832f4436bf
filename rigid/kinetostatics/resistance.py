"""Loads that depend on the direction of motion, such as pump pressure or blade friction."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.kinematics import Motion, velocity_of
from rigid.kinetostatics.friction import direction_of, speeds
from rigid.parts import Law, PointForce, PointLoad
from rigid.plane import dot


@dataclass(frozen=True, eq=False)
class Resistance:
    """A load that opposes the motion of the point at which it acts.

    Attributes
    ----------
    load
        Force and moment against the resisted motion.
    one_way
        Whether the load vanishes when the motion reverses. Otherwise the load reverses with the motion. At rest the
        load is zero.

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
        """Link and point of the load."""
        return self.load.points

    def forces(self, motion: Motion) -> Iterable[PointForce]:
        """Yield the force in ground axes and the moment at each position."""
        for link, point, force, moment in self.load.forces(motion):
            sign = _power_sign(motion, link, point, force, moment)
            factor = np.where(sign < 0, 1.0, 0.0) if self.one_way else -sign
            yield link, point, force * factor, moment * factor

    def direction(self, motion: Motion) -> Reals:
        """Return the sign of the load's power, ignoring its law, shape (..., positions); 0 at rest."""
        [force] = replace(self.load, law=None).forces(motion)
        return _power_sign(motion, *force)


def _power_sign(motion: Motion, link: str, point: str, force: Columns, moment: Columns) -> Reals:
    """Return the sign of the power of a force (complex) [N] and moment [N m]; 0.0 at rest."""
    fastest, spin = speeds(motion)
    power = dot(np.asarray(force), velocity_of(motion, link, point))
    power = power + moment * motion.angular_velocity[motion.mechanism.index[link]]
    return direction_of(power, np.abs(force) * fastest + np.abs(moment) * spin)
