"""Interface of all joints, before and after placement: `Joint` and `JointPlace`.

A joint has one coordinate: the position of one of its links, the block, relative to the other, the owner. The parent
is the link placed first. Coordinates do not depend on this order, except that of a free pin: the angle of the child
from the parent.
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
    """Placed links: a `Motion`, a `Posture`, or a mechanism during placement."""

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the links."""

    @property
    def origin(self) -> Sequence[Columns] | Complexes:
        """Origin of each link's axes [m], complex."""

    @property
    def direction(self) -> Sequence[Columns] | Complexes:
        """Unit vector of each link's x' axis, complex."""


class Drawn(Protocol):
    """Drawn mechanism: a `rigid.drawing.Drawing`."""

    @property
    def mechanism(self) -> Mechanism:
        """The drawn mechanism."""

    def at(self, point: str) -> Columns:
        """Drawn position of a point [m]."""

    def direction(self, link: int) -> Columns:
        """Unit vector of a link's axes as drawn."""


@dataclass(frozen=True, eq=False)
class Body:
    """Place of a welded link's axes in its body's axes, which are those of `link`: `shift` [m] and `turn`."""

    link: int
    shift: Complex = 0.0
    turn: Complex = 1.0

    def at(self, local: Complex) -> Complex:
        """Convert a point of the welded link to the axes of the body [m]."""
        return self.shift + self.turn * local


@dataclass(frozen=True, eq=False)
class Coupling:
    """Gear as seen by its follower: ratio and driving joint.

    `pressure_angle` of the teeth [rad]; None without teeth. If the driver is in the follower's own group, `law`
    replaces ratio and driver by pairs (factor, joint) of driven or earlier joints. The follower's coordinate changes
    from the drawing by the sum of factor * change of the joint's coordinate.
    """

    ratio: float
    driver: Joint
    pressure_angle: float | None = None
    law: tuple[tuple[float, Joint], ...] = ()

    @property
    def sources(self) -> tuple[tuple[float, Joint], ...]:
        """Factors and joints between placed links that prescribe the follower's change."""
        return self.law or ((self.ratio, self.driver),)

    @property
    def ends(self) -> tuple[int, int]:
        """Links of the driving joint, the moving one last."""
        return self.driver.parent, self.driver.child


@dataclass(frozen=True, eq=False)
class Joint(ABC):
    """Joint between two links, as used in the solution.

    Parameters
    ----------
    name
        Name of the point or slider.
    parent, child
        Link numbers; the parent is placed first.
    at_parent, at_child
        Joint point in the axes of each link [m]. For the owner of a slider's line, it is the line's origin.
    sense
        +1 if the child is the driven or sliding link, -1 if it is the reference link.
    drive
        Number of the drive of the joint, or None.
    gear
        Gear coupling to another joint's coordinate, or None.
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
    """Whether the coordinate is an angle; otherwise a slide, without relative rotation."""
    letter: ClassVar[str]
    """Letter of the pair in group names: R revolute, P prismatic."""

    freedoms: ClassVar[int] = 1
    """Number of relative freedoms; 0 for a weld, which joins rigid links to one body."""

    def at(self, link: int) -> Complex:
        """Joint point in the axes of a link."""
        return self.at_child if self.child == link else self.at_parent

    @cached_property
    def moved(self) -> bool:
        """Whether a drive or a gear prescribes the coordinate."""
        return self.drive is not None or self.gear is not None

    @property
    def holds_rotation(self) -> bool:
        """Whether the joint prevents relative rotation with locked drives; a gear only couples the rotation."""
        return not self.turns or self.drive is not None

    @property
    def ordered(self) -> bool:
        """Whether the parent is the owner and the child the block."""
        return self.sense > 0

    @cached_property
    def owner(self) -> int:
        """Reference link of the coordinate: the link with a slider's line."""
        return self.parent if self.ordered else self.child

    @cached_property
    def block(self) -> int:
        """Link moved by the coordinate: the sliding link."""
        return self.child if self.ordered else self.parent

    @cached_property
    def parent_point(self) -> str | None:
        """Name of the parent's point at the joint, or None for a slider's line."""
        return self.point(self.parent)

    @cached_property
    def child_point(self) -> str | None:
        """Name of the child's point at the joint, or None for a slider's line."""
        return self.point(self.child)

    @property
    def line(self) -> Complex:
        """Unit vector of the slider's line in owner axes; 1 for a pin."""
        return 1.0

    @property
    def turned(self) -> Complex:
        """Unit vector of the block's axes in owner axes if constant, else 1."""
        return 1.0

    @property
    def turn(self) -> Complex:
        """Unit vector of the child's axes in parent axes if constant, else 1."""
        return self.turned if self.ordered else np.conj(self.turned)

    def along(self, placed: Placed) -> Columns:
        """Unit vector of the slider's line, complex."""
        return placed.direction[self.owner] * self.line

    @abstractmethod
    def point(self, link: int) -> str | None:
        """Name of a link's point at the joint, or None for a slider's line."""

    @abstractmethod
    def on_bodies(self, bodies: Mapping[int, Body]) -> Self:
        """Same joint between the bodies that carry its links."""

    @abstractmethod
    def exchanged(self) -> Self:
        """Same joint with parent and child exchanged."""

    @abstractmethod
    def of_first_design(self) -> Self:
        """Same joint with the scalar lengths of the first design."""

    @abstractmethod
    def mover(self, links: Sequence[str]) -> PinDrive | SliderDrive:
        """Drive of this joint, for given link names."""

    @abstractmethod
    def coordinate(self, placed: Placed) -> Columns:
        """Joint coordinate in a given configuration: an angle in (-pi, pi] or a slide [m]."""

    @abstractmethod
    def drawn(self, drawing: Drawn) -> float:
        """Coordinate as drawn [rad or m], for the first design."""

    @abstractmethod
    def gap(self, placed: Placed) -> Columns:
        """Finite gap of the cut joint, child from parent, in the components of `JointPlace.row`."""

    @abstractmethod
    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """Whether a gap of the cut joint is within an angle [rad] and a length [m]."""

    def closes(self, placed: Placed, angle: float, length: Columns) -> Any:
        """Whether the joint is closed to within an angle [rad] and a length [m]."""
        return self.within(self.gap(placed), angle, length)

    def drawn_along(self, drawing: Drawn) -> Any:
        """Unit vector of the slider's line as drawn, for all designs; 1 for a pin."""
        return 1.0

    def rotation_gap(self, placed: Placed) -> Columns:
        """Rotation gap that `gap` leaves out, child from parent [rad]; 0 except for welds."""
        return 0.0

    def carry(self, parent: Body) -> Body:
        """Body of the child: its own, or the parent's if welded."""
        return Body(self.child)

    @abstractmethod
    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """Origin and direction of the child from the placed parent and a coordinate [rad or m]."""

    @abstractmethod
    def place(self, placed: Placed, teeth: Teeth | None) -> JointPlace:
        """Joint of two placed links; `teeth` drive it if it follows a gear with teeth."""


@dataclass(frozen=True, eq=False)
class JointPlace(ABC):
    """Joint at a posture.

    The two constraints of a cut joint form one complex number, and so do their two multipliers.

    Attributes
    ----------
    joint
        The joint.
    arm_parent, arm_child
        From the origin of each link's axes to the joint's point [m], complex; for a slider, the block's point.
    teeth
        Teeth that drive it if it follows a gear with teeth, otherwise None.
    along
        Unit vector of the slider's line; None for a pin.
    """

    joint: Joint
    arm_parent: Columns
    arm_child: Columns
    teeth: Teeth | None = None
    along: Columns = None

    turns: ClassVar[bool]
    """Whether the coordinate is an angle."""

    def arm(self, link: int) -> Columns:
        """Vector from a link's origin to the joint's point."""
        return self.arm_child if self.joint.child == link else self.arm_parent

    @abstractmethod
    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """Constrained part of a relative displacement and rotation at a cut joint, as one complex number."""

    @abstractmethod
    def per_displacement(self, dual: Columns) -> Columns:
        """Part of a complex multiplier that acts on displacements."""

    @abstractmethod
    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Force [N], complex, and moment [N m] on the child from the constraint multipliers."""

    @abstractmethod
    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Displacement at `reach` from the joint, and rotation, due to the child's free motion."""

    @abstractmethod
    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Displacement of the child's point and rotation, (gap, turn), due to the free motion.

        If `amount` is an effort along the free motion, the result is the force and moment on the child.
        """

    @abstractmethod
    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Rate of the free motion, child from parent [rad/s or m/s], from link velocities."""

    @abstractmethod
    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """Second rate of the free motion from accelerations and `Motion.turning` [rad/s^2 or m/s^2]."""

    @abstractmethod
    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Component of a force and moment on the child along the free motion [N m or N]."""

    @abstractmethod
    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Contact force components [N] from force and moment; `length`: guided length of a block [m]."""

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """Coriolis part of the acceleration gap [m/s^2], from velocities and i times angular velocities."""
        return ZERO


def point_of(placed: Placed, link: int, local: Any) -> Columns:
    """Position of a point given in a link's axes [m], complex."""
    return placed.origin[link] + carried(placed.direction[link], local)


def carried(direction: Columns, local: Any) -> Columns:
    """Convert a vector of a link's axes to the ground's; ZERO for the origin."""
    return ZERO if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def opening_of(placed: Placed, joint: Joint) -> Columns:
    """Vector from the owner's point to the block's [m], complex."""
    owner, block = joint.owner, joint.block
    return point_of(placed, block, joint.at(block)) - point_of(placed, owner, joint.at(owner))


def first(value: Any) -> complex:
    """Value of the first design."""
    return complex(np.ravel(value)[0])
