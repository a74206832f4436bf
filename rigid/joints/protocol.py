"""The questions that every joint answers, before and after its links are placed: `Joint` and `JointPlace`.

A joint has one coordinate: that of its block seen from its owner. Which of its links is placed first, its parent, has
nothing to do with that.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from rigid.arrays import Columns, Complex, Complexes, Real
from rigid.mechanism import Mechanism
from rigid.parts import PinDrive, SliderDrive
from rigid.plane import ZERO
from rigid.teeth import Teeth


class Placed(Protocol):
    """Links that have a place: a `Motion`, a `Posture`, or a mechanism that is being placed."""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the links."""

    @property
    def origin(self) -> Sequence[Columns] | Complexes:
        """Of every link's axes [m], complex."""

    @property
    def direction(self) -> Sequence[Columns] | Complexes:
        """Unit vector of every link's x' axis, complex."""


class Drawn(Protocol):
    """A mechanism as drawn: a `rigid.drawing.Drawing`."""

    @property
    def mechanism(self) -> Mechanism:
        """The drawn mechanism."""

    def at(self, point: str) -> Columns:
        """Drawn place of a point [m]."""

    def direction(self, link: int) -> Columns:
        """Unit vector of a link's axes as drawn."""


@dataclass(frozen=True, eq=False)
class Body:
    """A link that is welded to another, or is it: `shift` [m] and `turn` of its axes in those of that `link`."""

    link: int
    shift: Complex = 0.0
    turn: Complex = 1.0

    def at(self, local: Complex) -> Complex:
        """A point of the welded link in the axes of the other [m]."""
        return self.shift + self.turn * local


@dataclass(frozen=True, eq=False)
class Coupling:
    """A gear as its follower sees it: the ratio, and the driving joint.

    `pressure_angle` of its teeth [rad]; None where it has none. `law`: of a follower whose driver is between links of
    its own group, factors and joints between links placed before, whose changes from the drawing add up to its own.
    """

    ratio: float
    driver: Joint
    pressure_angle: float | None = None
    law: tuple[tuple[float, Joint], ...] = ()

    @property
    def sources(self) -> tuple[tuple[float, Joint], ...]:
        """Factors and joints between links placed before: their changes from the drawing add up to the follower's."""
        return self.law or ((self.ratio, self.driver),)

    @property
    def ends(self) -> tuple[int, int]:
        """The links of the driving joint, the one that it names as moving last."""
        return self.driver.parent, self.driver.child


@dataclass(frozen=True, eq=False)
class Joint(ABC):
    """A joint between two links, as used in the solution.

    Parameters
    ----------
    name
        The point's or the slider's name.
    parent, child
        Numbers of the links; the parent's place is found first.
    at_parent, at_child
        The joint's point in the axes of either [m]. For a slider that of the line's owner is the line's origin.
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
    sense: int = 1
    drive: int | None = None
    gear: Coupling | None = None

    turns: ClassVar[bool]
    """Whether its coordinate is an angle; else it is a slide, and the joint holds the links against turning."""
    letter: ClassVar[str]
    """Of the pair in the names of groups: R revolute, P prismatic."""

    freedoms: ClassVar[int] = 1
    """Coordinates that it leaves its links: without any they are one body as long as they are rigid."""

    def at(self, link: int) -> Complex:
        """Its point in the axes of one of its links."""
        return self.at_child if self.child == link else self.at_parent

    @cached_property
    def moved(self) -> bool:
        """Whether a drive or a gear prescribes its coordinate."""
        return self.drive is not None or self.gear is not None

    @property
    def holds_rotation(self) -> bool:
        """Whether it holds its links against turning while the drives stand; a gear holds them by its ratio alone."""
        return not self.turns or self.drive is not None

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
        """Unit vector of the line that it slides along, in the axes of its owner; 1 where there is none."""
        return 1.0

    @property
    def turned(self) -> Complex:
        """Unit vector of the block's axes in those of its owner, where the joint holds them so; 1 where it does not."""
        return 1.0

    @property
    def turn(self) -> Complex:
        """The same of the child's axes in those of its parent."""
        return self.turned if self.ordered else np.conj(self.turned)

    def along(self, placed: Placed) -> Columns:
        """Unit vector of the line that it slides along, complex."""
        return placed.direction[self.owner] * self.line

    @abstractmethod
    def point(self, link: int) -> str | None:
        """Name of a link's point at the joint; None for a slider's line."""

    @abstractmethod
    def on_bodies(self, bodies: Mapping[int, Body]) -> Self:
        """The same joint between the links that carry its own, by these."""

    @abstractmethod
    def exchanged(self) -> Self:
        """The same joint with parent and child exchanged."""

    @abstractmethod
    def of_first_design(self) -> Self:
        """The same with scalar lengths: those of the first design."""

    @abstractmethod
    def mover(self, links: Sequence[str]) -> PinDrive | SliderDrive:
        """A drive that moves it, of links of these names."""

    @abstractmethod
    def coordinate(self, placed: Placed) -> Columns:
        """Coordinate of the joint of placed links: an angle in (-pi, pi] or a slide [m]."""

    @abstractmethod
    def drawn(self, drawing: Drawn) -> float:
        """Coordinate as drawn [rad or m], of designs that of the first."""

    @abstractmethod
    def gap(self, placed: Placed) -> Columns:
        """Opening of any size when cut, child from parent, as `JointPlace.row` gives it for a small one."""

    @abstractmethod
    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """Whether a gap of the cut joint is within an angle [rad] and a length [m]."""

    def closes(self, placed: Placed, angle: float, length: Columns) -> Any:
        """Whether the joint of placed links is closed within an angle [rad] and a length [m]."""
        return self.within(self.gap(placed), angle, length)

    def drawn_along(self, drawing: Drawn) -> Any:
        """Unit vector of the line that it slides along as drawn, of all designs of the drawing; 1 without a line."""
        return 1.0

    def rotation_gap(self, placed: Placed) -> Columns:
        """Rotation by which it is open beyond its `gap`, child from parent [rad]; 0 where it does not hold that."""
        return 0.0

    def carry(self, parent: Body) -> Body:
        """The child's body: its own, or where the child is on the body that carries the parent."""
        return Body(self.child)

    @abstractmethod
    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """Origin and direction of the child, the parent being placed, at a coordinate [rad or m]."""

    @abstractmethod
    def place(self, placed: Placed, teeth: Teeth | None) -> JointPlace:
        """The joint of two placed links; `teeth` move it where it follows a gear with teeth."""


@dataclass(frozen=True, eq=False)
class JointPlace(ABC):
    """A joint where it is now.

    Two constraints of a cut joint, and the multipliers that hold them, are one complex number.

    Attributes
    ----------
    joint
        What it joins.
    arm_parent, arm_child
        From the origin of either link's axes to the joint's point [m], complex. A slider's point is its block's.
    teeth
        What moves it where it follows a gear with teeth, else None.
    along
        Unit vector of the line that it slides along; None where it turns.
    """

    joint: Joint
    arm_parent: Columns
    arm_child: Columns
    teeth: Teeth | None = None
    along: Columns = None

    turns: ClassVar[bool]
    """Whether its coordinate is an angle."""

    def arm(self, link: int) -> Columns:
        """From the origin of one of its links' axes to the joint's point."""
        return self.arm_child if self.joint.child == link else self.arm_parent

    @abstractmethod
    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """The two constraints of a cut joint on a relative displacement and rotation, as one complex number."""

    @abstractmethod
    def per_displacement(self, dual: Columns) -> Columns:
        """The part of a dual of both constraints, one complex number, that answers a displacement alone."""

    @abstractmethod
    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Force [N], complex, and moment [N m] on the child from the multipliers of those constraints."""

    @abstractmethod
    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Displacement at `reach` from the joint, and rotation, when the child moves freely by an amount."""

    @abstractmethod
    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Displacement of the child's point and rotation of the child from the parent, (gap, turn): the free motion.

        Force and moment on the child as well, for an effort along it.
        """

    @abstractmethod
    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Rate of the child from the parent along the free motion [rad/s or m/s], from all links' velocities."""

    @abstractmethod
    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """The same of all links' accelerations and their i eps - w^2 [rad/s^2 or m/s^2]."""

    @abstractmethod
    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Component of a force and moment on the child along the free motion: moment [N m] or force [N]."""

    @abstractmethod
    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Two forces that press its surfaces together [N], of its force and moment; `length` guides a block [m]."""

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """Gap [m/s^2] that Coriolis' acceleration opens, from the links' velocities and i times their angular ones."""
        return ZERO


def point_of(placed: Placed, link: int, local: Any) -> Columns:
    """Place of a point given in a link's axes [m], complex."""
    return placed.origin[link] + carried(placed.direction[link], local)


def carried(direction: Columns, local: Any) -> Columns:
    """A vector of a link's axes in the ground's; ZERO for the origin."""
    return ZERO if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def opening_of(placed: Placed, joint: Joint) -> Columns:
    """From the owner's point to the block's [m], complex."""
    owner, block = joint.owner, joint.block
    return point_of(placed, block, joint.at(block)) - point_of(placed, owner, joint.at(owner))


def first(value: Any) -> complex:
    """The value of the first design."""
    return complex(np.ravel(value)[0])
