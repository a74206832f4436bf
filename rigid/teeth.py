"""Where the teeth of a gear push, and which way: pitch points and lines of action, theory.md, "Gears"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Columns
from rigid.plane import number

UNLOADED = 1e-12  # share of what its terms come to, below which an effort is round-off and no flank is loaded


def pitch_reach(hub: Columns, rate: Columns) -> Columns:
    """From a wheel's centre to its pitch point, of the centre of the wheel that drives it as seen from there [m]."""
    return hub / (1 - rate)


@dataclass(frozen=True, eq=False)
class Teeth:
    """The contact of a gear's follower, a wheel or a rack, with the body that drives it.

    Attributes
    ----------
    wheel
        Number of the link whose teeth follow: the child of the follower's joint, or its parent where the child is the
        carrier.
    sense
        +1 for the child, -1 for the parent.
    body
        Number of the link whose teeth drive.
    arm
        From the origin of that link's axes to the pitch point [m], complex.
    reach_body, reach
        From its point, and from the follower's point, at their joints to the pitch point [m], complex.
    along, apart
        Force on the follower per effort on it along the coordinate, complex, [1/m] for a wheel and pure for a rack: the
        part along the common tangent, and for a positive effort that which the pressure angle adds along the normal.
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
        """Force on the follower per effort on it, complex, along the line of action of a flank: +1, -1, 0 for neither.

        The flank is counted by the effort on the child of the follower's joint.
        """
        return self.along + self.sense * flank * self.apart


def wheel_push(reach: Columns, slope: float, ring: bool) -> tuple[Columns, Columns]:
    """`Teeth.along` and `apart` of a wheel, or a ring, with its pitch point at `reach` [m].

    `slope` is the tangent of the pressure angle.
    """
    per_length = 1.0 / np.conj(reach)
    return 1j * per_length, (slope if ring else -slope) * per_length


def loaded_flank(effort: Columns, size: Columns) -> Columns:
    """Sign of an effort, 0.0 where it is round-off beside the size of its terms."""
    effort, size = number(effort), number(size)
    return np.where(np.abs(effort) > UNLOADED * size, np.sign(effort), 0.0) if np.ndim(effort) or effort else 0.0
