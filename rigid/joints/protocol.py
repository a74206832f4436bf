"""Interface of all joints: `Joint`, and `JointPlace` for a joint of placed links.

The coordinate of a joint is the position of one link (the block) relative to the other (the owner). The parent is the
link that is placed first, and the child the other one. Coordinates do not depend on this order, except for a free pin,
whose coordinate is the angle of the child relative to the parent.
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
    """Links with known positions: a `Motion`, a `Posture`, or a mechanism during placement."""

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the links."""

    @property
    def origin(self) -> Sequence[Columns] | Complexes:
        """Origin of each link's axes (complex) [m]."""

    @property
    def direction(self) -> Sequence[Columns] | Complexes:
        """Unit vector of each link's x axis (complex)."""


class Drawn(Protocol):
    """A drawn mechanism (see `rigid.drawing.Drawing`)."""

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism."""

    def at(self, point: str) -> Columns:
        """Return the drawn position of a point [m]."""

    def direction(self, link: int) -> Columns:
        """Return the unit vector of a link's axes as drawn."""


@dataclass(frozen=True, eq=False)
class Body:
    """Position of a welded link in its body: origin `shift` [m] and unit vector `turn`, in the axes of `link`."""

    link: int
    shift: Complex = 0.0
    turn: Complex = 1.0

    def at(self, local: Complex) -> Complex:
        """Convert a point of the welded link to the axes of the body [m]."""
        return self.shift + self.turn * local


@dataclass(frozen=True, eq=False)
class Coupling:
    """A gear, from the view of the joint that follows it.

    Attributes
    ----------
    ratio, driver
        Gear ratio and driving joint.
    pressure_angle
        Pressure angle of the teeth [rad]; None without teeth.
    law
        If the driver is in the same group as the follower: pairs (factor, joint) of driven or earlier joints that
        replace ratio and driver. The change of the follower's coordinate from the drawing is the sum of each factor
        times the change of the joint's coordinate.
    """

    ratio: float
    driver: Joint
    pressure_angle: float | None = None
    law: tuple[tuple[float, Joint], ...] = ()

    @property
    def sources(self) -> tuple[tuple[float, Joint], ...]:
        """Pairs (factor, joint) that prescribe the change of the follower's coordinate."""
        return self.law or ((self.ratio, self.driver),)

    @property
    def ends(self) -> tuple[int, int]:
        """Reference link and moving link of the driving joint."""
        return self.driver.parent, self.driver.child


@dataclass(frozen=True, eq=False)
class Joint(ABC):
    """A joint between two links.

    Parameters
    ----------
    name
        Name of the point or slider.
    parent, child
        Link indices. The parent is placed first.
    at_parent, at_child
        Joint point in the axes of each link [m]. For the owner of a slider's line, this is the line's origin.
    sense
        +1 if the child is the driven or sliding link, -1 if it is the reference link.
    drive
        Index of the drive of the joint, or None.
    gear
        Gear that the joint follows, or None.
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
    """Whether the coordinate is an angle (otherwise a slide, without relative rotation)."""
    letter: ClassVar[str]
    """Letter in group names: R for revolute, P for prismatic."""

    freedoms: ClassVar[int] = 1
    """Number of relative freedoms; 0 for a weld."""

    def at(self, link: int) -> Complex:
        """Return the joint point in the axes of a link."""
        return self.at_child if self.child == link else self.at_parent

    @cached_property
    def moved(self) -> bool:
        """Whether a drive or a gear prescribes the coordinate."""
        return self.drive is not None or self.gear is not None

    @property
    def holds_rotation(self) -> bool:
        """Whether the joint prevents relative rotation if its drive is locked (a gear only couples rotations)."""
        return not self.turns or self.drive is not None

    @property
    def ordered(self) -> bool:
        """Whether the parent is the owner and the child is the block."""
        return self.sense > 0

    @cached_property
    def owner(self) -> int:
        """Reference link of the coordinate (for a slider, the link with the line)."""
        return self.parent if self.ordered else self.child

    @cached_property
    def block(self) -> int:
        """Link that the coordinate moves (for a slider, the sliding link)."""
        return self.child if self.ordered else self.parent

    @cached_property
    def parent_point(self) -> str | None:
        """Name of the parent's point at the joint; None for a slider's line."""
        return self.point(self.parent)

    @cached_property
    def child_point(self) -> str | None:
        """Name of the child's point at the joint; None for a slider's line."""
        return self.point(self.child)

    @property
    def line(self) -> Complex:
        """Unit vector of the slider's line in owner axes; 1 for a pin."""
        return 1.0

    @property
    def turned(self) -> Complex:
        """Unit vector of the block's axes in owner axes if the relative angle is constant, else 1."""
        return 1.0

    @property
    def turn(self) -> Complex:
        """Unit vector of the child's axes in parent axes if the relative angle is constant, else 1."""
        return self.turned if self.ordered else np.conj(self.turned)

    def along(self, placed: Placed) -> Columns:
        """Return the unit vector of the slider's line (complex)."""
        return placed.direction[self.owner] * self.line

    @abstractmethod
    def point(self, link: int) -> str | None:
        """Return the name of a link's point at the joint; None for a slider's line."""

    @abstractmethod
    def on_bodies(self, bodies: Mapping[int, Body]) -> Self:
        """Return the same joint between the bodies that its links belong to."""

    @abstractmethod
    def exchanged(self) -> Self:
        """Return the same joint with parent and child exchanged."""

    @abstractmethod
    def of_first_design(self) -> Self:
        """Return the same joint with the scalar lengths of the first design."""

    @abstractmethod
    def mover(self, links: Sequence[str]) -> PinDrive | SliderDrive:
        """Return a drive of this joint. `links` are the names of all links."""

    @abstractmethod
    def coordinate(self, placed: Placed) -> Columns:
        """Return the joint coordinate of placed links: an angle in (-pi, pi] or a slide [m]."""

    @abstractmethod
    def drawn(self, drawing: Drawn) -> float:
        """Return the joint coordinate as drawn, for the first design [rad or m]."""

    @abstractmethod
    def gap(self, placed: Placed) -> Columns:
        """Return the gap of a cut joint (child relative to parent) in the components of `JointPlace.row`."""

    @abstractmethod
    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """Return whether a gap of a cut joint is within an angle [rad] and a length [m]."""

    def closes(self, placed: Placed, angle: float, length: Columns) -> Any:
        """Return whether the joint is closed to within an angle [rad] and a length [m]."""
        return self.within(self.gap(placed), angle, length)

    def drawn_along(self, drawing: Drawn) -> Any:
        """Return the unit vector of the slider's line as drawn, for all designs; 1 for a pin."""
        return 1.0

    def rotation_gap(self, placed: Placed) -> Columns:
        """Return the rotation gap of a weld (child relative to parent), which `gap` leaves out [rad]; else 0."""
        return 0.0

    def carry(self, parent: Body) -> Body:
        """Return the body of the child: its own, or that of the parent for a weld."""
        return Body(self.child)

    @abstractmethod
    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """Return origin and direction of the child for a placed parent and a coordinate [rad or m]."""

    @abstractmethod
    def place(self, placed: Placed, teeth: Teeth | None) -> JointPlace:
        """Return the joint of two placed links. `teeth` is the tooth contact that drives it, or None."""


@dataclass(frozen=True, eq=False)
class JointPlace(ABC):
    """A joint of placed links.

    The two constraints of a cut joint form one complex number. Their two multipliers form another one.

    Attributes
    ----------
    joint
        Joint.
    arm_parent, arm_child
        Vectors from the origin of each link to the joint's point (for a slider, the block's point) (complex) [m].
    teeth
        Tooth contact that drives the joint, or None.
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
        """Return the vector from a link's origin to the joint's point (complex) [m]."""
        return self.arm_child if self.joint.child == link else self.arm_parent

    @abstractmethod
    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """Return the constrained components of a relative displacement and rotation, as one complex number."""

    @abstractmethod
    def per_displacement(self, dual: Columns) -> Columns:
        """Return the part of a complex multiplier that acts on displacements."""

    @abstractmethod
    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Return the force (complex) [N] and moment [N m] on the child for given constraint multipliers."""

    @abstractmethod
    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Return the displacement at `reach` from the joint, and the rotation, for a free motion of the child."""

    @abstractmethod
    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Return the displacement of the child's point and the rotation, (gap, turn), for a free motion.

        If `amount` is an effort along the free motion, return the force and moment on the child.
        """

    @abstractmethod
    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Return the rate of the free motion, child relative to parent, for given link velocities [rad/s or m/s]."""

    @abstractmethod
    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """Return the acceleration of the free motion from accelerations and `Motion.turning` [rad/s^2 or m/s^2]."""

    @abstractmethod
    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Return the component of a force and moment on the child along the free motion [N m or N]."""

    @abstractmethod
    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Return the two contact force components for a force and moment [N]. `length` is a block's guided length."""

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """Return the Coriolis part of the acceleration gap [m/s^2]. `rotation` is i times the angular velocities."""
        return ZERO


def point_of(placed: Placed, link: int, local: Any) -> Columns:
    """Return the position of a point with coordinates `local` in a link's axes (complex) [m]."""
    return placed.origin[link] + carried(placed.direction[link], local)


def carried(direction: Columns, local: Any) -> Columns:
    """Convert a vector from link axes to ground axes. Return ZERO for the scalar 0."""
    return ZERO if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def opening_of(placed: Placed, joint: Joint) -> Columns:
    """Return the vector from the owner's point to the block's point (complex) [m]."""
    owner, block = joint.owner, joint.block
    return point_of(placed, block, joint.at(block)) - point_of(placed, owner, joint.at(owner))


def first(value: Any) -> complex:
    """Return the value of the first design."""
    return complex(np.ravel(value)[0])
