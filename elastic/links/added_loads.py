"""Loads on a mechanism's links besides its own: those of vibration, and of forces on displaced links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from elastic.arrays import VectorCoefficients
from rigid.arrays import Columns, Numbers


@dataclass(frozen=True, eq=False)
class AddedLoads:
    """Loads besides those of the mechanism.

    Attributes
    ----------
    q
        q_x + i q_y along every beam in its own axes, in powers of xi [N/m], complex, shape (n, beams, ..., positions).
    points
        Link's number, point's name, force in the ground's axes [N], complex, and moment [N m].
    blocks
        Of sliders on beams: joint's number, force on the beam in the ground's axes [N], complex, and moment [N m].
    gaps, turns
        Per joint, what opens it besides: displacement of the child's point from the parent's [m], complex, and
        rotation [rad].
    strain
        What no force makes, in powers of xi: d(u + i w)/dx and dphi/dx [1/m] of every beam, complex, shape (2, n,
        beams, ..., positions); None without.
    section
        By how much N + i V [N] and M [N m] of the turned sections differ from those that balance the loads about the
        rigid places, complex, shape of `strain`; None where they do not.
    sliding
        Of joints with friction: joint's number, rate that vibration adds to that of the motion, and creep, both [rad/s
        or m/s], as for `rigid.kinetostatics.with_friction`.
    slides
        Of sliders on beams: joint's number, by how much farther along its line than in the motion the block is [m], and
        the moment on the beam's link about the place in the motion of the force where the block is [N m].
    """

    q: VectorCoefficients
    points: tuple[tuple[int, str, Columns, Columns], ...]
    blocks: tuple[tuple[int, Columns, Columns], ...]
    gaps: tuple[Columns, ...]
    turns: tuple[Columns, ...]
    strain: VectorCoefficients | None = None
    section: VectorCoefficients | None = None
    sliding: tuple[tuple[int, Columns, Columns], ...] = ()
    slides: tuple[tuple[int, Columns, Columns], ...] = ()


def map_loads(change: Callable[..., Any], *loads: AddedLoads) -> AddedLoads:
    """Loads with values computed from those of one or several loads in the same places; positions are the last axis.

    A value that is the same at all positions may be a scalar, but of `q`.
    """

    def each(lists: tuple[Any, ...]) -> tuple[Any, ...]:
        same = zip(*lists, strict=True)
        return tuple(
            (*items[0][:-2], *(change(*parts) for parts in zip(*(item[-2:] for item in items), strict=True)))
            for items in same
        )

    def every(lists: tuple[Any, ...]) -> tuple[Numbers, ...]:
        return tuple(change(*parts) for parts in zip(*lists, strict=True))

    return AddedLoads(
        change(*(load.q for load in loads)),
        each(tuple(load.points for load in loads)),
        each(tuple(load.blocks for load in loads)),
        every(tuple(load.gaps for load in loads)),
        every(tuple(load.turns for load in loads)),
        None if loads[0].strain is None else change(*(load.strain for load in loads)),
        None if loads[0].section is None else change(*(load.section for load in loads)),
        each(tuple(load.sliding for load in loads)),
        each(tuple(load.slides for load in loads)),
    )
