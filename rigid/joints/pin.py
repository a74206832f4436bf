"""Pin: two links rotate about a common point. The coordinate is an angle; displacements in x and y are constrained."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Columns, Real
from rigid.joints.protocol import Drawn, Joint, JointPlace, Placed, carried, first, opening_of, point_of
from rigid.parts import PinDrive
from rigid.plane import ZERO, unit
from rigid.teeth import Teeth


class PinJoint(Joint, frozen=True):
    """Pin between two links. The coordinate is the angle of `block` relative to `owner` [rad] (see `Joint`)."""

    turns: ClassVar[bool] = True
    letter: ClassVar[str] = "R"

    def point(self, link: int) -> str | None:
        """Return the name of the common point of the links."""
        return self.name

    def exchanged(self) -> Self:
        """See `Joint`. Without a drive or gear, the coordinate changes sign, as it is relative to the new parent."""
        exchanged = super().exchanged()
        return exchanged if self.moved else replace(exchanged, sense=self.sense)

    def mover(self, links: Sequence[str]) -> PinDrive:
        """Create a drive that turns the child relative to the parent."""
        return PinDrive(links[self.child], self.name, links[self.parent])

    def coordinate(self, placed: Placed) -> Columns:
        """See `Joint`."""
        return np.angle(placed.direction[self.block] * np.conj(placed.direction[self.owner]))

    def drawn(self, drawing: Drawn) -> float:
        """See `Joint`."""
        return float(np.angle(first(drawing.direction(self.block)) / first(drawing.direction(self.owner))))

    def gap(self, placed: Placed) -> Columns:
        """Return the vector from the parent's point to the child's point [m]."""
        return self.sense * opening_of(placed, self)

    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """See `Joint`."""
        return np.abs(gap) <= length

    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """See `Joint`."""
        direction = placed.direction[self.parent] * unit(self.sense * coordinate)
        at_parent = point_of(placed, self.parent, self.at_parent)
        return at_parent - carried(direction, self.at_child), direction

    def place(self, placed: Placed, teeth: Teeth | None) -> PinPlace:
        """See `Joint`."""
        arm_parent = carried(placed.direction[self.parent], self.at_parent)
        return PinPlace(self, arm_parent, carried(placed.direction[self.child], self.at_child), teeth)


class PinPlace(JointPlace, frozen=True):
    """Pin at a posture: displacements in x and y are constrained, and the rotation is free."""

    turns: ClassVar[bool] = True

    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """Return the displacement."""
        return displacement

    def per_displacement(self, dual: Columns) -> Columns:
        """Return the whole multiplier, because both constraints are on displacements."""
        return dual

    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Return the force, and a moment of zero."""
        return multiplier, ZERO

    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Return the displacement and the rotation due to a rotation about the pin."""
        return reach * (1j * amount), amount

    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Return a displacement (or force) of zero, and the rotation (or moment) `amount`."""
        return ZERO, amount

    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Return the relative angular velocity [rad/s]."""
        return omega[self.joint.child] - omega[self.joint.parent]

    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """Return the relative angular acceleration [rad/s^2]."""
        return turning[self.joint.child].imag - turning[self.joint.parent].imag

    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Return the moment."""
        return moment

    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Return the x and y components of the force."""
        return np.real(force), np.imag(force)
