"""Coordinates of a motion and their rates: link angles, slides, point positions, distances."""

from typing import Protocol

import numpy as np
from msgspec import Struct

from rigid.arrays import Complexes, Real, Reals
from rigid.joints import Joint
from rigid.kinematics import Motion, position_of, velocity_of
from rigid.parts import GROUND, MechanismError
from rigid.plane import dot


class Rated(Protocol):
    """A quantity with a known rate."""

    def rate(self, motion: Motion) -> Reals:
        """Return the time derivative, shape (..., positions)."""
        ...


class Coordinate(Rated, Protocol):
    """A quantity with a known value and rate."""

    def value(self, motion: Motion) -> Reals:
        """Return the value, shape (..., positions)."""
        ...

    def difference(self, motion: Motion, value: Real) -> Reals:
        """Return the difference from a value, shape (..., positions). Differences of angles are in (-pi, pi]."""
        ...


class LinkAngle(Struct, frozen=True):
    """Angle of a link relative to another link [rad], positive counter-clockwise, unwrapped over the positions."""

    link: str
    on: str = GROUND

    def value(self, motion: Motion) -> Reals:
        """Return the angle, which starts in (-pi, pi]."""
        return np.unwrap(np.angle(self._direction(motion)), axis=-1)

    def rate(self, motion: Motion) -> Reals:
        """Return the angular velocity [rad/s]."""
        index = motion.mechanism.index
        return motion.angular_velocity[index[self.link]] - motion.angular_velocity[index[self.on]]

    def difference(self, motion: Motion, value: Real) -> Reals:
        """Return the difference from a value, in (-pi, pi]."""
        return np.angle(self._direction(motion) * np.exp(-1j * np.asarray(value)))

    def _direction(self, motion: Motion) -> Complexes:
        one, other = (motion.direction[motion.mechanism.index[link]] for link in (self.link, self.on))
        return one * np.conj(other)


class _Plain:
    """A coordinate that is not an angle."""

    def value(self, motion: Motion) -> Reals:
        raise NotImplementedError

    def difference(self, motion: Motion, value: Real) -> Reals:
        """Return the difference from a value."""
        return self.value(motion) - value


class Slide(_Plain, Struct, frozen=True):
    """Slide of a slider along its line [m]."""

    slider: str

    def value(self, motion: Motion) -> Reals:
        """Return the slide [m]."""
        return self._joint(motion).coordinate(motion)

    def rate(self, motion: Motion) -> Reals:
        """Return the rate [m/s]."""
        joint = self._joint(motion)
        block = velocity_of(motion, joint.block, joint.at(joint.block))
        arm = position_of(motion, joint.block, joint.at(joint.block)) - motion.origin[joint.owner]
        carried = motion.velocity[joint.owner] + 1j * motion.angular_velocity[joint.owner] * arm
        return dot(joint.along(motion), block - carried)

    def _joint(self, motion: Motion) -> Joint:
        for joint in motion.structure.joints:
            if joint.name == self.slider and not joint.turns:
                return joint
        raise MechanismError(f'there is no slider "{self.slider}"', joints=(self.slider,))


class PointCoordinate(_Plain, Struct, frozen=True):
    """Component of a point's position along a unit vector [m]: x, or y with `along = 1j`."""

    link: str
    point: str
    along: complex = 1.0

    def value(self, motion: Motion) -> Reals:
        """Return the component [m]."""
        return dot(self.along, position_of(motion, self.link, self.point))

    def rate(self, motion: Motion) -> Reals:
        """Return the rate [m/s]."""
        return dot(self.along, velocity_of(motion, self.link, self.point))


class Offset(_Plain, Struct, frozen=True):
    """Offset of `point` from `other_point` along the unit vector `along` [m]; upwards by default."""

    link: str
    point: str
    other_link: str
    other_point: str
    along: complex = 1j

    def value(self, motion: Motion) -> Reals:
        """Return the offset [m]."""
        one, other = self._ends
        return one.value(motion) - other.value(motion)

    def rate(self, motion: Motion) -> Reals:
        """Return the rate [m/s]."""
        one, other = self._ends
        return one.rate(motion) - other.rate(motion)

    @property
    def _ends(self) -> tuple[PointCoordinate, PointCoordinate]:
        return (
            PointCoordinate(self.link, self.point, self.along),
            PointCoordinate(self.other_link, self.other_point, self.along),
        )


class Distance(_Plain, Struct, frozen=True):
    """Distance between two points [m]."""

    link: str
    point: str
    other_link: str
    other_point: str

    def value(self, motion: Motion) -> Reals:
        """Return the distance [m]."""
        return np.abs(self._vector(motion))

    def rate(self, motion: Motion) -> Reals:
        """Return the rate [m/s]; nan if the points coincide."""
        opening = velocity_of(motion, self.link, self.point) - velocity_of(motion, self.other_link, self.other_point)
        vector = self._vector(motion)
        with np.errstate(invalid="ignore", divide="ignore"):
            return dot(vector, opening) / np.abs(vector)

    def _vector(self, motion: Motion) -> Complexes:
        return position_of(motion, self.link, self.point) - position_of(motion, self.other_link, self.other_point)


class PathLength(Struct, frozen=True):
    """Length of a point's path [m]. Only its rate, the speed [m/s], is available."""

    link: str
    point: str

    def rate(self, motion: Motion) -> Reals:
        """Return the speed of the point [m/s]."""
        return np.abs(velocity_of(motion, self.link, self.point))
