"""Weld: a rigid joint of two links at a common point, modelled as a pin with a fixed angle.

A weld constrains x, y and rotation, and transmits a force and a moment. A weld that closes a ring of welds is
redundant. Its force and moment are indeterminate if the links are rigid, and determinate if the links are elastic.
"""

from typing import Any, ClassVar, Self

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Columns, Complex
from rigid.joints.pin import PinJoint
from rigid.joints.protocol import Body, Drawn, Placed, carried, first, point_of
from rigid.parts import Weld


class WeldJoint(PinJoint, frozen=True, kw_only=True):
    """Weld between two links.

    Attributes
    ----------
    weld
        Definition of the weld in the mechanism.
    """

    weld: Weld

    freedoms: ClassVar[int] = 0
    moved: ClassVar[bool] = True  # the weld prescribes the coordinate
    holds_rotation: ClassVar[bool] = True

    @property
    def turned(self) -> Complex:
        """See `Joint`."""
        return self.weld.turn

    def of_first_design(self) -> Self:
        """See `Joint`."""
        weld = replace(self.weld, turn=first(self.weld.turn))
        return replace(super().of_first_design(), weld=weld)

    def drawn(self, drawing: Drawn) -> float:
        """Return the angle of the weld, which does not depend on the drawing."""
        return float(np.angle(first(self.turned)))

    def child_place(self, placed: Placed, coordinate: Columns) -> tuple[Columns, Columns]:
        """See `Joint`. The coordinate is ignored."""
        direction = placed.direction[self.parent] * self.turn
        return point_of(placed, self.parent, self.at_parent) - carried(direction, self.at_child), direction

    def rotation_gap(self, placed: Placed) -> Columns:
        """See `Joint`."""
        return np.angle(placed.direction[self.child] * np.conj(placed.direction[self.parent] * self.turn))

    def closes(self, placed: Placed, angle: float, length: Columns) -> Any:
        """See `Joint`."""
        return super().closes(placed, angle, length) & (np.abs(self.rotation_gap(placed)) <= angle)

    def carry(self, parent: Body) -> Body:
        """See `Joint`."""
        turn = parent.turn * self.turn
        return Body(parent.link, parent.at(self.at_parent) - turn * self.at_child, turn)
