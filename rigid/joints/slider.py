"""Slider: one link, the block, slides without rotation along a line of another link, the owner.

The coordinate is the slide [m]. The constrained components are the relative rotation and the relative displacement
normal to the line. They form one complex number: rotation + i times displacement normal to the line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Columns, Complex, Real
from rigid.joints.protocol import Body, Drawn, Joint, JointPlace, Placed, carried, first, opening_of, point_of
from rigid.parts import Slider, SliderDrive
from rigid.plane import ZERO, cross, dot
from rigid.teeth import Teeth


class SliderJoint(Joint, frozen=True, kw_only=True):
    """Slider between two links. The coordinate is the slide of the block along the owner's line [m].

    Attributes
    ----------
    slider
        Definition of the slider, in the axes of the links, or in the axes of their bodies after `on_bodies`.
    """

    slider: Slider

    turns: ClassVar[bool] = False
    letter: ClassVar[str] = "P"

    def point(self, link: int) -> str | None:
        """Return the name of the point of the block; None for the owner."""
        return self.slider.point if link == self.block else None

    @property
    def line(self) -> Complex:
        """See `Joint`."""
        return self.slider.direction

    @property
    def turned(self) -> Complex:
        """See `Joint`."""
        return self.slider.turn

    def on_bodies(self, bodies: Mapping[int, Body]) -> Self:
        """See `Joint`."""
        owner, block = bodies[self.owner], bodies[self.block]
        turn = owner.turn * self.slider.turn * np.conj(block.turn)
        slider = replace(
            self.slider, origin=owner.at(self.slider.origin), direction=owner.turn * self.slider.direction, turn=turn
        )
        return replace(super().on_bodies(bodies), slider=slider)

    def drawn_along(self, drawing: Drawn) -> Any:
        """See `Joint`.

        The line is read from the mechanism, because `slider` may contain only some designs, or refer to the axes of
        bodies.
        """
        mechanism = drawing.mechanism
        slider = mechanism.slider(self.name)
        return drawing.direction(mechanism.index[slider.on]) * slider.direction

    def of_first_design(self) -> Self:
        """See `Joint`."""
        origin, direction, turn = (first(getattr(self.slider, name)) for name in ("origin", "direction", "turn"))
        slider = replace(self.slider, origin=origin, direction=direction, turn=turn)
        return replace(super().of_first_design(), slider=slider)

    def mover(self, links: Sequence[str]) -> SliderDrive:
        """Create a drive along the line."""
        return SliderDrive(self.name)

    def coordinate(self, placed: Placed) -> Columns:
        """See `Joint`."""
        return dot(self.along(placed), opening_of(placed, self))

    def drawn(self, drawing: Drawn) -> float:
        """See `Joint`."""
        body = drawing.mechanism.links[self.owner]
        anchor = next((point for point in body.points if point in drawing.mechanism.drawing), None)
        turned = first(drawing.direction(self.owner))
        base = first(drawing.at(anchor)) - turned * first(body.points[anchor]) if self.owner and anchor else 0.0
        foot = base + turned * first(self.at(self.owner))
        return float(dot(turned * first(self.line), first(drawing.at(self.slider.point)) - foot))

    def gap(self, placed: Placed) -> Columns:
        """Return rotation [rad] + i times displacement normal to the line [m]."""
        opened = self.sense * opening_of(placed, self)
        turned = placed.direction[self.block] * np.conj(placed.direction[self.owner] * self.slider.turn)
        return self.sense * np.angle(turned) + 1j * cross(self.along(placed), opened)

    def within(self, gap: Columns, angle: float, length: Columns) -> Columns:
        """See `Joint`."""
        return (np.abs(np.real(gap)) <= angle) & (np.abs(np.imag(gap)) <= length)

    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """See `Joint`."""
        parent = self.parent
        direction = placed.direction[parent] * self.turn
        owner = placed.direction[parent] if self.ordered else direction
        slide = self.sense * coordinate * (owner * self.line)
        at_parent = point_of(placed, parent, self.at_parent)
        return at_parent - carried(direction, self.at_child) + slide, direction

    def place(self, placed: Placed, teeth: Teeth | None) -> SliderPlace:
        """See `Joint`."""
        parent, child = self.parent, self.child
        arm_parent = carried(placed.direction[parent], self.at_parent)
        arm_child = carried(placed.direction[child], self.at_child)
        if self.ordered:
            arm_parent = placed.origin[child] + arm_child - placed.origin[parent]
        else:
            arm_child = placed.origin[parent] + arm_parent - placed.origin[child]
        return SliderPlace(self, arm_parent, arm_child, teeth, self.along(placed))


class SliderPlace(JointPlace, frozen=True):
    """Slider in a posture of the mechanism: rotation and normal displacement are constrained, and the slide is free."""

    turns: ClassVar[bool] = False

    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """Return rotation + i times displacement normal to the line."""
        return rotation + 1j * cross(self.along, displacement)

    def per_displacement(self, dual: Columns) -> Columns:
        """Return the real part of `dual`.

        This part belongs to the displacement: in Im(dual * row), it is multiplied by the imaginary part of `row`.
        """
        return dual.real

    def force(self, multiplier: Columns) -> tuple[Columns, Columns]:
        """Return the force normal to the line in ground axes, and the moment."""
        return multiplier.imag * (1j * self.along), multiplier.real

    def effect(self, reach: Columns, amount: float) -> tuple[Columns, Columns]:
        """Return a displacement along the line, and a rotation of zero."""
        return self.along * amount, ZERO

    def driven(self, amount: Columns) -> tuple[Columns, Columns]:
        """Return the displacement (or force) `amount` along the line, and a rotation (or moment) of zero."""
        return amount * self.along, ZERO

    def rate(self, velocity: Any, omega: Any) -> Columns:
        """Return the velocity along the line [m/s]."""
        parent, child = self.joint.parent, self.joint.child
        opened = velocity[child] + 1j * omega[child] * self.arm_child
        return dot(self.along, opened - velocity[parent] - 1j * omega[parent] * self.arm_parent)

    def second_rate(self, acceleration: Any, turning: Any) -> Columns:
        """Return the acceleration along the line [m/s^2]."""
        parent, child = self.joint.parent, self.joint.child
        opened = acceleration[child] + turning[child] * self.arm_child
        opened = opened - acceleration[parent] - turning[parent] * self.arm_parent
        return (np.conj(self.along) * opened).real

    def effort(self, force: Columns, moment: Columns) -> Columns:
        """Return the force along the line."""
        return dot(self.along, force)

    def pressing(self, force: Columns, moment: Columns, length: Real) -> tuple[Columns, Columns]:
        """Return the force normal to the line, and twice the moment divided by the guided length."""
        return cross(self.along, force), 2 * moment / length

    def coriolis(self, velocity: Sequence[Columns], rotation: Sequence[Columns]) -> Columns:
        """See `JointPlace`."""
        parent, child = self.joint.parent, self.joint.child
        if rotation[child] is ZERO:
            return ZERO
        opened = velocity[child] + rotation[child] * self.arm_child - velocity[parent]
        opened = opened - rotation[parent] * self.arm_parent
        return 2 * rotation[child] * (dot(self.along, opened) * self.along)
