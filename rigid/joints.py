"""Pins and sliders: coordinate, place, gap, constraints, force and effect of each, written once.

A joint has one coordinate: the angle of its block from its owner at a pin [rad], the slide of the block along the
owner's line at a slider [m]. Which of its links is placed first, its parent, has nothing to do with that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from rigid.arrays import Columns
from rigid.mechanism import Mechanism
from rigid.parts import Complex, Slider
from rigid.plane import ZERO, cross, dot, unit
from rigid.teeth import Teeth


class Placed(Protocol):
    """Links that have a place: a `Motion`, a `Posture`, or a mechanism that is being placed."""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the links."""

    @property
    def origin(self) -> Any:
        """Of every link's axes [m], complex."""

    @property
    def direction(self) -> Any:
        """Unit vector of every link's x' axis, complex."""


@dataclass(frozen=True, eq=False)
class Coupling:
    """A gear as its follower sees it: the ratio, and the driving joint between two links placed before.

    `pressure_angle` of its teeth [rad]; None where it has none.
    """

    ratio: float
    driver: Joint
    pressure_angle: float | None = None

    @property
    def ends(self) -> tuple[int, int]:
        """The links of the driving joint, the one that it names as moving last."""
        return self.driver.parent, self.driver.child


@dataclass(frozen=True, eq=False)
class Joint:
    """A pin or a slider between two links, as used in the solution.

    Parameters
    ----------
    name
        The point's or the slider's name.
    parent, child
        Numbers of the links; the parent's place is found first.
    at_parent, at_child
        The joint's point in the axes of either [m]. For a slider that of the line's owner is the line's origin.
    slider
        None for a pin.
    sense
        +1 where the child is the driven or sliding link, -1 where it is the one driven or slid upon.
    drive
        Number of the drive that moves it, or None.
    gear
        What couples its coordinate to that of another joint, or None.
    """

    name: str
    parent: int
    child: int
    at_parent: Complex
    at_child: Complex
    slider: Slider | None = None
    sense: int = 1
    drive: int | None = None
    gear: Coupling | None = None

    def at(self, link: int) -> Complex:
        """Its point in the axes of one of its links."""
        return self.at_child if self.child == link else self.at_parent

    @cached_property
    def moved(self) -> bool:
        """Whether a drive or a gear prescribes its coordinate."""
        return self.drive is not None or self.gear is not None

    @cached_property
    def turns(self) -> bool:
        """Whether its coordinate is an angle: that of a pin; else a slide, and it holds the links against turning."""
        return self.slider is None

    @property
    def ordered(self) -> bool:
        """Whether the parent is the owner and the child the block, not the other way round."""
        return self.sense > 0

    @cached_property
    def owner(self) -> int:
        """The link that its coordinate is counted from: that with a slider's line."""
        return self.parent if self.ordered else self.child

    @cached_property
    def block(self) -> int:
        """The link that its coordinate moves: the one that slides."""
        return self.child if self.ordered else self.parent

    def point(self, link: int) -> str | None:
        """Name of a link's point at the joint; None for a slider's line."""
        if self.slider is None:
            return self.name
        return self.slider.point if link == self.block else None

    @property
    def letter(self) -> str:
        """R for a revolute pair, P for a prismatic one."""
        return "R" if self.turns else "P"

    @cached_property
    def parent_point(self) -> str | None:
        """Name of the parent's point at the joint; None for a slider's line, which passes its owner's points."""
        return self.point(self.parent)

    @cached_property
    def child_point(self) -> str | None:
        """Name of the child's point at the joint; None for a slider's line."""
        return self.point(self.child)

    @property
    def line(self) -> Complex:
        """Unit vector of a slider's line in the axes of its owner."""
        assert self.slider is not None
        return self.slider.direction

    @property
    def turn(self) -> Complex:
        """Unit vector of a slider's child's axes in those of its parent."""
        assert self.slider is not None
        return self.slider.turn if self.ordered else np.conj(self.slider.turn)


def point_of(placed: Placed, link: int, local: Any) -> Columns:
    """Place of a point given in a link's axes [m], complex."""
    return placed.origin[link] + carried(placed.direction[link], local)


def carried(direction: Columns, local: Any) -> Columns:
    """A vector of a link's axes in the ground's; ZERO for the origin."""
    return ZERO if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def along_of(placed: Placed, joint: Joint) -> Columns:
    """Unit vector of a slider's line, complex."""
    return placed.direction[joint.owner] * joint.line


def opening_of(placed: Placed, joint: Joint) -> Columns:
    """From the owner's point to the block's [m], complex."""
    owner, block = joint.owner, joint.block
    return point_of(placed, block, joint.at(block)) - point_of(placed, owner, joint.at(owner))


def coordinate_of(placed: Placed, joint: Joint) -> Columns:
    """Coordinate of a joint of placed links: an angle in (-pi, pi] or a slide [m]."""
    if joint.turns:
        return np.angle(placed.direction[joint.block] * np.conj(placed.direction[joint.owner]))
    return dot(along_of(placed, joint), opening_of(placed, joint))


def gap_of(placed: Placed, joint: Joint) -> Columns:
    """Opening of a cut joint of any size, child from parent, as `JointPlace.row` gives it for a small one."""
    opened = joint.sense * opening_of(placed, joint)
    if joint.slider is None:
        return opened
    turned = placed.direction[joint.block] * np.conj(placed.direction[joint.owner] * joint.slider.turn)
    return joint.sense * np.angle(turned) + 1j * cross(along_of(placed, joint), opened)


def within(joint: Joint, gap: Columns, angle: float, length: Columns) -> Any:
    """Whether a gap of a cut joint, as of `gap_of`, is within an angle [rad] and a length [m]."""
    if joint.turns:
        return np.abs(gap) <= length
    return (np.abs(np.real(gap)) <= angle) & (np.abs(np.imag(gap)) <= length)


def child_place(placed: Placed, joint: Joint, coordinate: Columns) -> tuple[Columns, Columns]:
    """Origin and direction of a joint's child, its parent being placed, at a coordinate of the joint [rad or m]."""
    parent = joint.parent
    slide: Columns = ZERO
    if joint.turns:
        direction = placed.direction[parent] * unit(joint.sense * coordinate)
    else:
        direction = placed.direction[parent] * joint.turn
        owner = placed.direction[parent] if joint.ordered else direction
        slide = joint.sense * coordinate * (owner * joint.line)
    at_parent = point_of(placed, parent, joint.at_parent)
    return at_parent - carried(direction, joint.at_child) + slide, direction


@dataclass(frozen=True, eq=False)
class JointPlace:
    """A joint where it is now.

    Attributes
    ----------
    joint
        What it joins.
    arm_parent, arm_child
        From the origin of either link's axes to the joint's point [m], complex. A slider's point is its block's.
    along
        Unit vector of a slider's line; None for a pin.
    teeth
        What moves it where it follows a gear with teeth, else None.
    """

    joint: Joint
    arm_parent: Columns
    arm_child: Columns
    along: Columns = None
    teeth: Teeth | None = None

    def arm(self, link: int) -> Columns:
        """From the origin of one of its links' axes to the joint's point."""
        return self.arm_child if self.joint.child == link else self.arm_parent

    @property
    def turns(self) -> bool:
        """Whether its coordinate is an angle."""
        return self.along is None

    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """The two constraints of a cut joint on a relative displacement and rotation, as one complex number.

        A pin: the displacement. A slider: rotation + i (displacement across its line).
        """
        return displacement if self.along is None else rotation + 1j * cross(self.along, displacement)

    def per_displacement(self, dual: Columns) -> Columns:
        """The part of a dual of both constraints, one complex number, that answers a displacement alone."""
        return dual if self.along is None else dual.real

    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Force [N], complex, and moment [N m] on the child from the multipliers of those constraints."""
        if self.along is None:
            return multiplier, ZERO
        return multiplier.imag * (1j * self.along), multiplier.real

    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Displacement at `reach` from the joint, and rotation, when the child moves freely by an amount."""
        return (reach * (1j * amount), amount) if self.along is None else (self.along * amount, ZERO)

    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Displacement of the child's point and rotation of the child from the parent, (gap, turn): the free motion.

        Force and moment on the child as well, for an effort along it.
        """
        return (ZERO, amount) if self.along is None else (amount * self.along, ZERO)

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """Gap [m/s^2] that Coriolis' acceleration opens, from the links' velocities and i times their angular ones."""
        parent, child = self.joint.parent, self.joint.child
        if self.along is None or rotation[child] is ZERO:
            return ZERO
        opened = velocity[child] + rotation[child] * self.arm_child - velocity[parent]
        opened = opened - rotation[parent] * self.arm_parent
        return 2 * rotation[child] * (dot(self.along, opened) * self.along)

    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Rate of the child from the parent along the free motion [rad/s or m/s], from all links' velocities."""
        parent, child = self.joint.parent, self.joint.child
        if self.along is None:
            return omega[child] - omega[parent]
        opened = velocity[child] + 1j * omega[child] * self.arm_child
        return dot(self.along, opened - velocity[parent] - 1j * omega[parent] * self.arm_parent)

    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Component of a force and moment on the child along the free motion: moment [N m] or force [N]."""
        return moment if self.along is None else dot(self.along, force)
