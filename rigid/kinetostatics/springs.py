"""Springs and dampers between two links (as `Mechanism.loads`), and the energy of a motion."""

from collections.abc import Iterable

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns, Complexes, Real, Reals
from rigid.constants import mass_constants
from rigid.drawing import Drawing
from rigid.kinematics import Motion, position_of, velocity_of
from rigid.kinetostatics.loads import given_loads
from rigid.mechanism import Mechanism
from rigid.parts import GROUND, PointForce
from rigid.plane import dot

ROUND_OFF = 1e-9  # [rad] largest round-off of an angle in a drawing


class Spring(Struct, frozen=True, eq=False):
    """A straight spring and damper between points of two links.

    The tension is `preload + stiffness (L - length) + damping dL/dt`, where L is the distance between the points.

    Attributes
    ----------
    link, point
        Link and point at the first end.
    on, anchor
        Link (default: ground) and point at the other end.
    stiffness
        Stiffness [N/m].
    length
        Distance at which the tension is `preload` [m]. If it and `preload` are 0, the tension is proportional to the
        distance.
    damping
        Damping coefficient [N s/m].
    preload
        Preload, positive in tension [N].

    Examples
    --------
    A spring of 100 N/m with a free length of 1 m, stretched to 3 m along x, pulls its end back with 200 N:

    >>> from rigid import Link, Mechanism, PinDrive, Spring, motion
    >>> links = (Link("ground", {"O": 0}), Link("arm", {"O": 0, "A": 3.0}))
    >>> spring = Spring("arm", "A", anchor="O", stiffness=100.0, length=1.0)
    >>> stretched = motion(Mechanism(links, (PinDrive("arm", "O"),), {}, loads=(spring,)), [0.0])
    >>> next(iter(spring.forces(stretched)))[2].real
    array([-200.])
    """

    link: str
    point: str
    on: str = GROUND
    anchor: str = ""
    stiffness: Real = 0.0
    length: Real = 0.0
    damping: Real = 0.0
    preload: Real = 0.0

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point of both ends."""
        return (self.link, self.point), (self.on, self.anchor)

    def forces(self, motion: Motion) -> Iterable[PointForce]:
        """Return the forces on both ends.

        They are nan if the ends coincide under tension, because the tension then has no direction.
        """
        vector = self._vector(motion)
        reach = np.abs(vector)
        tension = self.preload + self.stiffness * (reach - self.length)
        with np.errstate(invalid="ignore", divide="ignore"):
            unit = np.where((reach == 0.0) & (tension == 0.0), 0.0, vector / reach)
            if np.any(self.damping):
                tension = tension + self.damping * dot(unit, self._opening(motion))
            pull = tension * unit
        return (self.link, self.point, -pull, 0.0), (self.on, self.anchor, pull, 0.0)

    def energy(self, motion: Motion) -> Reals:
        """Return the stored energy [J], shape (..., positions). It is 0 if the distance is `length`."""
        stretch = np.abs(self._vector(motion)) - self.length
        return self.preload * stretch + self.stiffness * stretch**2 / 2

    def dissipation(self, motion: Motion) -> Reals:
        """Return the power that the damper dissipates [W], shape (..., positions)."""
        vector = self._vector(motion)
        return self.damping * (dot(vector, self._opening(motion)) / np.abs(vector)) ** 2

    def _vector(self, motion: Motion) -> Complexes:
        return position_of(motion, self.link, self.point) - position_of(motion, self.on, self.anchor)

    def _opening(self, motion: Motion) -> Complexes:
        return velocity_of(motion, self.link, self.point) - velocity_of(motion, self.on, self.anchor)


class TorsionSpring(Struct, frozen=True, eq=False):
    """A torsion spring and damper between two links at a pin.

    The moment on `link` is `-(preload + stiffness (theta - angle) + damping dtheta/dt)`, and the opposite moment acts
    on `on`. theta is the angle of `link` relative to `on`. If a drive moves `link` relative to `on` at the pin, theta
    is the drive coordinate, including full turns. Otherwise theta is the angle that differs by at most half a turn from
    the angle in the drawing, which is between -180 and 180 degrees. So a spring may be wound by several turns.

    Attributes
    ----------
    link, at, on
        Link, common pin, and other link (default: ground).
    stiffness
        Stiffness [N m/rad].
    angle
        Angle theta at which the moment on `link` is -`preload`, if there is no damping [rad].
    damping, preload
        Damping coefficient [N m s/rad], and preload [N m].
    """

    link: str
    at: str
    on: str = GROUND
    stiffness: Real = 0.0
    angle: Real = 0.0
    damping: Real = 0.0
    preload: Real = 0.0

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Pin on both links."""
        return (self.link, self.at), (self.on, self.at)

    def forces(self, motion: Motion) -> Iterable[PointForce]:
        """Return the moments on both links."""
        moment = self.preload + self.stiffness * self.winding(motion) + self.damping * self._rate(motion)
        return (self.link, self.at, 0.0, -moment), (self.on, self.at, 0.0, moment)

    def energy(self, motion: Motion) -> Reals:
        """Return the stored energy [J], shape (..., positions). It is 0 if theta is `angle`."""
        winding = self.winding(motion)
        return self.preload * winding + self.stiffness * winding**2 / 2

    def dissipation(self, motion: Motion) -> Reals:
        """Return the power that the damper dissipates [W], shape (..., positions)."""
        return self.damping * self._rate(motion) ** 2

    def winding(self, motion: Motion) -> Reals:
        """Return theta - angle [rad], shape (..., positions)."""
        for number, drive in enumerate(motion.mechanism.drives):
            if drive.joint == self.at and set(drive.links) == {self.link, self.on}:
                return motion.drive[number] * (1.0 if drive.links[0] == self.link else -1.0) - self.angle
        one, other = (motion.direction[motion.mechanism.index[link]] for link in (self.link, self.on))
        drawn = self.drawn(motion.mechanism)
        return drawn + np.angle(one * np.conj(other) * np.exp(-1j * drawn)) - self.angle

    def drawn(self, mechanism: Mechanism) -> Reals:
        """Return theta in the drawing [rad], between -pi and pi; round-off does not change pi to -pi."""
        drawing = Drawing(mechanism)
        one, other = (drawing.direction(mechanism.index[link]) for link in (self.link, self.on))
        return np.asarray(np.angle(one * np.conj(other) * np.exp(-1j * ROUND_OFF)) + ROUND_OFF)

    def _rate(self, motion: Motion) -> Reals:
        one, other = (motion.mechanism.index[link] for link in (self.link, self.on))
        return motion.angular_velocity[one] - motion.angular_velocity[other]


def kinetic_energy(motion: Motion) -> Reals:
    """Return the kinetic energy of all links and rotors [J], shape (..., positions)."""
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    omega = motion.angular_velocity
    momentum = mass * motion.velocity / 2 + 1j * omega * motion.direction * first
    energy: Reals = (dot(motion.velocity, momentum) + second * omega**2 / 2)[1:].sum(axis=0)
    for drive, rate in zip(motion.mechanism.drives, motion.drive_rate, strict=True):
        energy = energy + drive.inertia * rate**2 / 2
    return energy


def potential_energy(motion: Motion) -> Reals:
    """Return the potential energy of gravity and springs [J], shape (..., positions).

    The potential energy of gravity is 0 for a mass at the origin.
    """
    mass, first, _ = mass_constants(motion.mechanism, len(motion.columns))
    height = dot(motion.mechanism.gravity, mass * motion.origin + motion.direction * first)
    return -height[1:].sum(axis=0) + _sum(motion, "energy")


def dissipated_power(motion: Motion) -> Reals:
    """Return the power that dampers dissipate [W], shape (..., positions)."""
    return np.zeros(motion.columns) + _sum(motion, "dissipation")


def load_power(motion: Motion) -> Reals:
    """Return the power of all loads, including springs and dampers but not weight [W], shape (..., positions)."""
    power = np.zeros(motion.columns)
    for at, pull, couple in given_loads(motion):
        power += dot(motion.velocity[at], pull) + motion.angular_velocity[at] * couple
    return power


def _sum(motion: Motion, quantity: str) -> Columns:
    """Return the sum of a method's results over all loads that have this method."""
    known = (getattr(load, quantity, None) for load in motion.mechanism.loads)
    return sum((each(motion) for each in known if each is not None), start=0.0)
