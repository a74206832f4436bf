"""Interface of all joints: `Joint`, and `JointPlace` for a joint between links with known positions.

A joint connects two links, the owner and the block. The joint coordinate is the position of the block relative to the
owner. When positions are computed, one of the two links (the parent) is placed before the other link (the child). The
coordinate does not depend on this order, with one exception: for a pin without a drive or gear, the coordinate is the
angle of the child relative to the parent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

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
        """Return the unit vector of a link's x axis as drawn (complex)."""


class Body(Struct, frozen=True, eq=False):
    """Position of a link in its body. A body is a rigid group of links that welds connect.

    One link of the group, `link`, defines the axes of the body. In these axes, `shift` is the origin of the welded link
    [m] and `turn` the unit vector of its x axis (complex).
    """

    link: int
    shift: Complex = 0.0
    turn: Complex = 1.0

    def at(self, local: Complex) -> Complex:
        """Convert a point of the welded link to the axes of the body [m]."""
        return self.shift + self.turn * local


class Coupling(Struct, frozen=True, eq=False):
    """A gear that moves a joint, the follower, in proportion to another joint, the driver.

    Attributes
    ----------
    ratio, driver
        Gear ratio, and the driver. The coordinates satisfy `follower - follower_0 = ratio * (driver - driver_0)`. The
        index 0 denotes coordinates in the drawing.
    pressure_angle
        Pressure angle of the teeth [rad]; None for a gear without teeth.
    law
        Pairs (factor, joint) that replace `ratio` and `driver` if the driver is in the same group as the follower.
        These joints are driven or belong to earlier groups. The coordinates satisfy `follower - follower_0 = sum(factor
        * (joint - joint_0))`, summed over the pairs.
    """

    ratio: float
    driver: Joint
    pressure_angle: float | None = None
    law: tuple[tuple[float, Joint], ...] = ()

    @property
    def sources(self) -> tuple[tuple[float, Joint], ...]:
        """Pairs (factor, joint) that prescribe the coordinate of the follower: `law`, or else `ratio` and `driver`."""
        return self.law or ((self.ratio, self.driver),)

    @property
    def ends(self) -> tuple[int, int]:
        """Links of the driver: its parent, relative to which it moves, and its child."""
        return self.driver.parent, self.driver.child


class Joint(Struct, frozen=True, eq=False, dict=True):
    """A joint between two links.

    Attributes
    ----------
    name
        Name of the point or slider.
    parent, child
        Link indices. The parent is placed first.
    at_parent, at_child
        Position of the joint in the axes of the parent and of the child [m]. In the axes of the owner of a slider, this
        is the origin of the line.
    sense
        +1 if the child is the block (the driven or sliding link), -1 if the child is the owner (the reference link).
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
        """Return the position of the joint in the axes of a link."""
        return self.at_child if self.child == link else self.at_parent

    @cached_property
    def moved(self) -> bool:
        """Whether a drive, a gear or a weld prescribes the coordinate."""
        return self.drive is not None or self.gear is not None

    @property
    def holds_rotation(self) -> bool:
        """Whether the joint prevents relative rotation if drives are locked.

        This is False for a pin with a gear, because a gear only couples rotations.
        """
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
        """Name of the parent's point at the joint; None if the parent is the owner of a slider."""
        return self.point(self.parent)

    @cached_property
    def child_point(self) -> str | None:
        """Name of the child's point at the joint; None if the child is the owner of a slider."""
        return self.point(self.child)

    @property
    def line(self) -> Complex:
        """Unit vector of the slider's line in owner axes; 1 for a pin."""
        return 1.0

    @property
    def turned(self) -> Complex:
        """Rotation of the block axes relative to the owner axes, exp(i angle), if it is constant; else 1."""
        return 1.0

    @property
    def turn(self) -> Complex:
        """Rotation of the child axes relative to the parent axes, exp(i angle), if it is constant; else 1."""
        return self.turned if self.ordered else np.conj(self.turned)

    def along(self, placed: Placed) -> Columns:
        """Return the unit vector of the slider's line in ground axes (complex)."""
        return placed.direction[self.owner] * self.line

    def point(self, link: int) -> str | None:
        """Return the name of a link's point at the joint; None for the owner of a slider."""
        raise NotImplementedError

    def on_bodies(self, bodies: Mapping[int, Body]) -> Self:
        """Return the same joint between the bodies to which its links belong (see `Body`).

        The coordinate of the result is the position of one body relative to the other.
        """
        parent, child = bodies[self.parent], bodies[self.child]
        ends = parent.at(self.at_parent), child.at(self.at_child)
        return replace(self, parent=parent.link, child=child.link, at_parent=ends[0], at_child=ends[1])

    def exchanged(self) -> Self:
        """Return the same joint with parent and child exchanged."""
        ends = {"parent": self.child, "child": self.parent, "at_parent": self.at_child, "at_child": self.at_parent}
        return replace(self, **ends, sense=-self.sense)

    def of_first_design(self) -> Self:
        """Return the same joint for the first design only, with scalar dimensions."""
        return replace(self, at_parent=first(self.at_parent), at_child=first(self.at_child))

    def mover(self, links: Sequence[str]) -> PinDrive | SliderDrive:
        """Create a drive that moves this joint. `links` are the names of all links."""
        raise NotImplementedError

    def coordinate(self, placed: Placed) -> Columns:
        """Return the joint coordinate for given positions of the links: an angle in (-pi, pi] or a slide [m]."""
        raise NotImplementedError

    def drawn(self, drawing: Drawn) -> float:
        """Return the joint coordinate as drawn, for the first design [rad or m]."""
        raise NotImplementedError

    def gap(self, placed: Placed) -> Columns:
        """Return the gap of a cut joint (child relative to parent), with components as in `JointPlace.row`."""
        raise NotImplementedError

    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """Return whether the rotation in a gap is at most `angle` [rad], and the displacement at most `length` [m]."""
        raise NotImplementedError

    def closes(self, placed: Placed, angle: float, length: Columns) -> Any:
        """Return whether the joint is closed to within `angle` [rad] and `length` [m]."""
        return self.within(self.gap(placed), angle, length)

    def drawn_along(self, drawing: Drawn) -> Any:
        """Return the unit vector of the slider's line as drawn, for all designs; 1 for a pin."""
        return 1.0

    def rotation_gap(self, placed: Placed) -> Columns:
        """Return the angle by which a weld is open (child relative to parent) [rad]; 0 for other joints."""
        return 0.0

    def carry(self, parent: Body) -> Body:
        """Return the position of the child in its body.

        A weld joins the child to the body of the parent. Any other joint starts a new body.
        """
        return Body(self.child)

    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """Return the origin and direction of the child for a given coordinate [rad or m] and position of the parent."""
        raise NotImplementedError

    def place(self, placed: Placed, teeth: Teeth | None) -> JointPlace:
        """Return the joint for given positions of both links. `teeth` is the tooth contact that drives it, or None."""
        raise NotImplementedError


class JointPlace(Struct, frozen=True, eq=False, dict=True):
    """A joint between links with known positions.

    The free motion of the joint is the relative motion that the joint allows: the rotation of a pin or the slide of a
    slider, child relative to parent. The two constraints of a cut joint are the components of one complex number. The
    Lagrange multipliers of the two constraints are the components of another complex number.

    Attributes
    ----------
    joint
        Joint.
    arm_parent, arm_child
        Vectors from the origin of the parent and of the child to the joint (for a slider, to the point of the block),
        in ground axes (complex) [m].
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
        """Return the vector from the origin of a link to the joint in ground axes (complex) [m], see `arm_parent`."""
        return self.arm_child if self.joint.child == link else self.arm_parent

    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """Return the constrained components of a relative displacement and rotation, as one complex number."""
        raise NotImplementedError

    def per_displacement(self, dual: Columns) -> Columns:
        """Return the part of a complex multiplier that belongs to constraints on displacements (not rotation)."""
        raise NotImplementedError

    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Return the force (complex) [N] and the moment [N m] on the child for given multipliers of the constraints."""
        raise NotImplementedError

    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Return the displacement of a point, and the rotation, due to a free motion of the child by `amount`.

        `reach` is the vector from the joint to the point (complex) [m].
        """
        raise NotImplementedError

    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Return the displacement of the joint, and the rotation, due to a free motion of the child by `amount`.

        If `amount` is an effort along the free motion, the result is the force and the moment on the child.
        """
        raise NotImplementedError

    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Return the rate of the free motion (child relative to parent) for given link velocities [rad/s or m/s]."""
        raise NotImplementedError

    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """Return the second rate of the free motion for given accelerations and `Motion.turning` [rad/s^2 or m/s^2]."""
        raise NotImplementedError

    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Return the effort that a force and a moment on the child have along the free motion [N m or N]."""
        raise NotImplementedError

    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Return the two components of the contact force due to a force and a moment of the joint [N].

        `length` is the guided length of the block of a slider.
        """
        raise NotImplementedError

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """Return the Coriolis term in the relative acceleration of the links at the joint (complex) [m/s^2].

        `rotation` contains the angular velocities of the links, multiplied by i.
        """
        return ZERO


def point_of(placed: Placed, link: int, local: Any) -> Columns:
    """Return the position of a point with coordinates `local` in a link's axes (complex) [m]."""
    return placed.origin[link] + carried(placed.direction[link], local)


def carried(direction: Columns, local: Any) -> Columns:
    """Convert a vector from link axes to ground axes. If `local` is the scalar 0, return ZERO."""
    return ZERO if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def opening_of(placed: Placed, joint: Joint) -> Columns:
    """Return the vector from the joint on the owner to the joint on the block in ground axes (complex) [m]."""
    owner, block = joint.owner, joint.block
    return point_of(placed, block, joint.at(block)) - point_of(placed, owner, joint.at(owner))


def first(value: Any) -> complex:
    """Return the value of the first design."""
    return complex(np.ravel(value)[0])
