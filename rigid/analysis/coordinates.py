"""Quantities read off a motion that have a rate: angles of links, slides, places and distances of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rigid.arrays import Complexes, Real, Reals
from rigid.joints import Joint
from rigid.kinematics import Motion
from rigid.parts import GROUND, MechanismError
from rigid.plane import dot
from rigid.points import position_of, velocity_of


class Rated(Protocol):
    """A quantity that changes at a known rate."""

    def rate(self, motion: Motion) -> Reals:
        """Its derivative in time, shape (..., positions)."""
        ...


class Coordinate(Rated, Protocol):
    """A quantity with a value and a rate."""

    def value(self, motion: Motion) -> Reals:
        """The quantity, shape (..., positions)."""
        ...

    def difference(self, motion: Motion, value: Real) -> Reals:
        """How far the quantity is beyond a value; angles by less than half a turn. Shape (..., positions)."""
        ...


@dataclass(frozen=True)
class LinkAngle:
    """Angle of the axes of a link from those of another [rad], counter-clockwise, without jumps along the positions."""

    link: str
    on: str = GROUND

    def value(self, motion: Motion) -> Reals:
        """The angle, the first one in (-pi, pi]."""
        return np.unwrap(np.angle(self._direction(motion)), axis=-1)

    def rate(self, motion: Motion) -> Reals:
        """Angular velocity [rad/s]."""
        index = motion.mechanism.index
        rate: Reals = motion.angular_velocity[index[self.link]] - motion.angular_velocity[index[self.on]]
        return rate

    def difference(self, motion: Motion, value: Real) -> Reals:
        """Angle beyond a value, in (-pi, pi]."""
        return np.angle(self._direction(motion) * np.exp(-1j * np.asarray(value)))

    def _direction(self, motion: Motion) -> Complexes:
        one, other = (motion.direction[motion.mechanism.index[link]] for link in (self.link, self.on))
        turned: Complexes = one * np.conj(other)
        return turned


class _Plain:
    """A coordinate that is a number, not an angle."""

    def value(self, motion: Motion) -> Reals:
        raise NotImplementedError

    def difference(self, motion: Motion, value: Real) -> Reals:
        """How far it is beyond a value."""
        beyond: Reals = self.value(motion) - value
        return beyond


@dataclass(frozen=True)
class Slide(_Plain):
    """Slide of a slider along its line [m]."""

    slider: str

    def value(self, motion: Motion) -> Reals:
        """The slide."""
        slide: Reals = self._joint(motion).coordinate(motion)
        return slide

    def rate(self, motion: Motion) -> Reals:
        """Its rate [m/s]."""
        joint = self._joint(motion)
        block = velocity_of(motion, joint.block, joint.at(joint.block))
        arm = position_of(motion, joint.block, joint.at(joint.block)) - motion.origin[joint.owner]
        carried = motion.velocity[joint.owner] + 1j * motion.angular_velocity[joint.owner] * arm
        rate: Reals = dot(joint.along(motion), block - carried)
        return rate

    def _joint(self, motion: Motion) -> Joint:
        for joint in motion.structure.joints:
            if joint.name == self.slider and not joint.turns:
                return joint
        raise MechanismError(f'there is no slider "{self.slider}"', joints=(self.slider,))


@dataclass(frozen=True)
class PointCoordinate(_Plain):
    """Coordinate of a point along a unit vector of the ground's axes [m]: x as it stands, y with `along = 1j`."""

    link: str
    point: str
    along: complex = 1.0

    def value(self, motion: Motion) -> Reals:
        """The coordinate."""
        coordinate: Reals = dot(self.along, position_of(motion, self.link, self.point))
        return coordinate

    def rate(self, motion: Motion) -> Reals:
        """Its rate [m/s]."""
        rate: Reals = dot(self.along, velocity_of(motion, self.link, self.point))
        return rate


@dataclass(frozen=True)
class Offset(_Plain):
    """Distance of a point beyond another along a unit vector of the ground's axes [m]: in height as it stands."""

    link: str
    point: str
    other_link: str
    other_point: str
    along: complex = 1j

    def value(self, motion: Motion) -> Reals:
        """The difference."""
        one, other = self._ends
        return one.value(motion) - other.value(motion)

    def rate(self, motion: Motion) -> Reals:
        """Its rate [m/s]."""
        one, other = self._ends
        return one.rate(motion) - other.rate(motion)

    @property
    def _ends(self) -> tuple[PointCoordinate, PointCoordinate]:
        return (
            PointCoordinate(self.link, self.point, self.along),
            PointCoordinate(self.other_link, self.other_point, self.along),
        )


@dataclass(frozen=True)
class Distance(_Plain):
    """Distance of two points [m]."""

    link: str
    point: str
    other_link: str
    other_point: str

    def value(self, motion: Motion) -> Reals:
        """The distance."""
        return np.abs(self._vector(motion))

    def rate(self, motion: Motion) -> Reals:
        """Its rate [m/s]; nan where the points meet."""
        opening = velocity_of(motion, self.link, self.point) - velocity_of(motion, self.other_link, self.other_point)
        vector = self._vector(motion)
        with np.errstate(invalid="ignore", divide="ignore"):
            rate: Reals = dot(vector, opening) / np.abs(vector)
            return rate

    def _vector(self, motion: Motion) -> Complexes:
        return position_of(motion, self.link, self.point) - position_of(motion, self.other_link, self.other_point)


@dataclass(frozen=True)
class PathLength:
    """Length of the path of a point [m]: it has a rate, the point's speed [m/s], and no value of its own."""

    link: str
    point: str

    def rate(self, motion: Motion) -> Reals:
        """Speed of the point."""
        return np.abs(velocity_of(motion, self.link, self.point))
