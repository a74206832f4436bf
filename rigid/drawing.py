"""Drawing of a mechanism: the point positions that select the assembly branch."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns, Integers, Real
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError

COLLINEAR_TOLERANCE = 1e-9  # largest distance of collinear joints from a line, relative to the size of the drawing


class Drawing(Struct, frozen=True, eq=False, dict=True):
    """Positions, directions and branch signs as drawn; arrays if they differ between designs.

    `rows` are the indices of the designs for which `side` returns signs (default: all).
    """

    mechanism: Mechanism
    rows: Integers | None = None

    def at(self, point: str) -> Columns:
        """Return the drawn position of a point, or of a slider's point [m]."""
        if point not in self.mechanism.drawing:
            point = self.mechanism.slider_points.get(point, point)
        if point not in self.mechanism.drawing:
            message = f'the point "{point}" is not drawn: give its position under [points]'
            raise MechanismError(message, kind="drawing", joints=(point,))
        place = self.mechanism.drawing[point]
        return place if isinstance(place, np.ndarray) else complex(place)

    @cached_property
    def _directions(self) -> dict[int, Columns]:
        """Directions of links with two drawn points, and of links at a fixed angle to these (sliders and welds)."""
        index = self.mechanism.index
        directions: dict[int, Any] = {0: 1.0 + 0j}
        directions |= {at: seen for at in range(1, len(index)) if (seen := self._seen(at)) is not None}
        pairs: list[tuple[int, int, Any]] = [
            (index[each.on], index[each.link], each.turn) for each in self.mechanism.fixed_angles
        ]
        pairs += [(link, on, np.conj(turn)) for on, link, turn in pairs]
        while further := [pair for pair in pairs if pair[0] in directions and pair[1] not in directions]:
            one, other, turn = further[0]
            directions[other] = directions[one] * turn
        return directions

    def _seen(self, link: int) -> Columns | None:
        """Return the unit vector of a link's x axis (complex) from two drawn points, or None."""
        body = self.mechanism.links[link]
        drawn = [point for point in body.points if point in self.mechanism.drawing]
        if len(drawn) < 2:
            return None
        seen = self.at(drawn[1]) - self.at(drawn[0])
        local: Any = body.points[drawn[1]] - body.points[drawn[0]]
        if np.any(abs(seen) == 0) or np.any(abs(local) == 0):
            message = f'link "{body.name}": points "{drawn[0]}" and "{drawn[1]}" coincide'
            raise MechanismError(message, links=(body.name,))
        return seen / local * abs(local) / abs(seen)

    def direction(self, link: int) -> Columns:
        """Return the unit vector of a link's x axis as drawn (complex); 1 if unknown."""
        return self._directions.get(link, 1.0 + 0j)

    def along(self, joint: Joint) -> Columns:
        """Return the unit vector of a slider's line as drawn."""
        return joint.drawn_along(self)

    def side(self, distance: Columns, joints: Sequence[str]) -> Real:
        """Return the sign of a drawn distance [m], which selects the branch of a dyad."""
        size: Any = sum(abs(self.at(joint) - self.at(joints[0])) for joint in joints)
        if np.any(abs(distance) <= COLLINEAR_TOLERANCE * np.where(size, size, 1.0)):
            names = ", ".join(f'"{joint}"' for joint in joints)
            raise MechanismError(
                f"the joints {names} are drawn in line, so the side on which they fold is ambiguous: move the drawing",
                kind="drawing",
                joints=joints,
            )
        if not isinstance(distance, np.ndarray) or not distance.ndim:
            return 1.0 if distance > 0 else -1.0
        sign = np.where(distance > 0, 1.0, -1.0)
        return sign if self.rows is None else sign[self.rows]

    def coordinate(self, joint: Joint) -> float:
        """Return the coordinate of a joint as drawn, for the first design [rad or m]."""
        return joint.drawn(self)
