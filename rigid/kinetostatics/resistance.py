"""Loads that depend on the direction of motion: pump pressure, blade friction."""

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
    """Load at a point that opposes the motion of its point.

    Attributes
    ----------
    load
        Force and moment for the resisting direction.
    one_way
        If True, the load is zero while it would assist the motion; otherwise it is reversed. At rest it is zero.

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
        """The loaded link."""
        return self.load.link

    @property
    def point(self) -> str:
        """The loaded point."""
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
        """Force in the ground's axes and moment at every position."""
        for link, point, force, moment in self.load.forces(motion):
            helps = _helps(motion, link, point, force, moment)
            factor = np.where(helps < 0, 1.0, 0.0) if self.one_way else -helps
            yield link, point, force * factor, moment * factor

    def direction(self, motion: Motion) -> Reals:
        """Sign of the power of the load without its law, shape (..., positions); 0 at rest."""
        [force] = replace(self.load, law=None).forces(motion)
        return _helps(motion, *force)


def _helps(motion: Motion, link: str, point: str, force: Columns, moment: Columns) -> Reals:
    """Sign of the power of a force [N], complex, and moment [N m]; 0.0 at rest."""
    fastest, spin = speeds(motion)
    power = dot(np.asarray(force), velocity_of(motion, link, point))
    power = power + moment * motion.angular_velocity[motion.mechanism.index[link]]
    return direction_of(power, np.abs(force) * fastest + np.abs(moment) * spin)
