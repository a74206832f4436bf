"""Tooth contacts of gears: pitch points and lines of action (theory.md, "Gears")."""

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns
from rigid.plane import number

MIN_EFFORT = 1e-12  # a smaller effort loads no flank, relative to the magnitudes of the terms that it is computed from


def pitch_reach(hub: Columns, rate: Columns) -> Columns:
    """Return the vector from a driven wheel's centre to the pitch point [m].

    `hub` is the vector from the same centre to the centre of the driving wheel. `rate` is the speed of the driven wheel
    / speed of the driving wheel, both relative to the carrier.
    """
    return hub / (1 - rate)


class Teeth(Struct, frozen=True, eq=False):
    """Contact between the driven wheel or rack of a gear and the driving body.

    Attributes
    ----------
    wheel
        Index of the link with the driven teeth. It is the child of the follower's joint, or the parent if the child is
        the carrier.
    sense
        +1 if `wheel` is the child of the joint, -1 if it is the parent.
    body
        Index of the link with the driving teeth.
    arm
        Vector from the origin of `body` to the pitch point (complex) [m].
    reach_body, reach
        Vectors from the driving and from the driven joint's point to the pitch point (complex) [m].
    along, apart
        The two parts of the force on the follower per unit of effort along the coordinate of the follower (complex), in
        1/m for a wheel and dimensionless for a rack. `along` is along the common tangent. `apart` is normal to the
        tangent, due to the pressure angle, for a positive effort.
    """

    wheel: int
    sense: int
    body: int
    arm: Columns
    reach_body: Columns
    reach: Columns
    along: Columns
    apart: Columns

    def push(self, flank: Columns) -> Columns:
        """Return the force on the follower per unit of effort, along the line of action of a flank (complex).

        `flank` is +1 or -1, the sign of the effort on the child of the follower's joint, or 0 for no normal component.
        """
        return self.along + self.sense * flank * self.apart


def wheel_push(reach: Columns, slope: float, ring: bool) -> tuple[Columns, Columns]:
    """Return `Teeth.along` and `apart` of a wheel or ring with the pitch point at `reach` [m] from its centre.

    `slope` is the tangent of the pressure angle.
    """
    per_length = 1.0 / np.conj(reach)
    return 1j * per_length, (slope if ring else -slope) * per_length


def loaded_flank(effort: Columns, size: Columns) -> Columns:
    """Return the sign of an effort, or 0.0 if the effort is round-off.

    `size` is the sum of the magnitudes of the terms from which the effort is computed.
    """
    effort, size = number(effort), number(size)
    return np.where(np.abs(effort) > MIN_EFFORT * size, np.sign(effort), 0.0) if np.ndim(effort) or effort else 0.0
