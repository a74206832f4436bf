"""Loads that depend on the direction of motion: pressure on a pump's piston, rubbing of a blade."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rigid.kinematics import Motion
from rigid.kinetostatics.friction import direction_of, speeds
from rigid.parts import Law, PointForce, PointLoad
from rigid.plane import dot
from rigid.points import velocity_of


@dataclass(frozen=True, eq=False)
class Resistance:
    """A load at a point that resists the motion of its point, as far as its power is negative.

    Attributes
    ----------
    load
        Force and moment while they resist.
    one_way
        Whether there is none while it would help the motion; else it is reversed then. At rest there is none.

    Examples
    --------
    A blade at the end of an arm that swings to and fro rubs with 3 N along the way, wherever it goes:

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
        """That is loaded."""
        return self.load.link

    @property
    def point(self) -> str:
        """Where it is."""
        return self.load.point

    @property
    def law(self) -> Law | None:
        """Of the load."""
        return self.load.law

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Where it acts."""
        return self.load.points

    def forces(self, motion: Motion) -> Iterable[PointForce]:
        """The force in the ground's axes and the moment at every position."""
        fastest, spin = speeds(motion)
        for link, point, force, moment in self.load.forces(motion):
            power = dot(np.asarray(force), velocity_of(motion, link, point))
            power = power + moment * motion.angular_velocity[motion.mechanism.index[link]]
            helps = direction_of(power, np.abs(force) * fastest + np.abs(moment) * spin)
            factor = np.where(helps < 0, 1.0, 0.0) if self.one_way else -helps
            yield link, point, force * factor, moment * factor
