"""Tooth forces of gears: pitch points and lines of action, theory.md, "Gears"."""

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Columns
from rigid.plane import number

MIN_EFFORT = 1e-12  # largest effort that loads no flank, relative to its terms


def pitch_reach(hub: Columns, rate: Columns) -> Columns:
    """Vector from a wheel's centre to its pitch point, from the driving centre [m]."""
    return hub / (1 - rate)


@dataclass(frozen=True, eq=False)
class Teeth:
    """Contact of a gear's follower, a wheel or a rack, with the driving body.

    Attributes
    ----------
    wheel
        Number of the link with the driven teeth: the child of the follower's joint, or its parent if the child is the
        carrier.
    sense
        +1 for the child, -1 for the parent.
    body
        Number of the link with the driving teeth.
    arm
        From that link's origin to the pitch point [m], complex.
    reach_body, reach
        From the driving and from the follower's point, at their joints, to the pitch point [m], complex.
    along, apart
        Force on the follower per effort along its coordinate, complex; [1/m] for a wheel, dimensionless for a rack.
        `along` is the component along the common tangent, and `apart` the normal component due to the pressure angle
        for a positive effort.
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
        """Force on the follower per effort, complex, along the line of action of a flank.

        `flank`: +1, -1, or 0 for neither, signed as the effort on the child of the follower's joint.
        """
        return self.along + self.sense * flank * self.apart


def wheel_push(reach: Columns, slope: float, ring: bool) -> tuple[Columns, Columns]:
    """`Teeth.along` and `apart` of a wheel, or a ring, with its pitch point at `reach` [m].

    `slope` is the tangent of the pressure angle.
    """
    per_length = 1.0 / np.conj(reach)
    return 1j * per_length, (slope if ring else -slope) * per_length


def loaded_flank(effort: Columns, size: Columns) -> Columns:
    """Sign of an effort, 0.0 if it is round-off relative to its terms."""
    effort, size = number(effort), number(size)
    return np.where(np.abs(effort) > MIN_EFFORT * size, np.sign(effort), 0.0) if np.ndim(effort) or effort else 0.0
