"""Additional loads on the links due to vibration or displacement of the links."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from elastic.arrays import VectorCoefficients
from rigid.arrays import Columns


@dataclass(frozen=True, eq=False)
class AddedLoads:
    """Loads applied on top of the loads of the rigid motion.

    Attributes
    ----------
    q
        Distributed load q_x + i q_y on each beam in beam axes, in powers of xi [N/m], shape (n, beams, ..., positions).
    points
        Point loads: link index, point name, force in ground axes [N], complex, and moment [N m].
    blocks
        Loads of sliding blocks: joint index, force on the beam in ground axes [N], complex, and moment [N m].
    gaps, turns
        Additional gap of each joint: displacement of the child's point from the parent's point [m], complex, and
        rotation [rad].
    strain
        Free strains d(u + i w)/dx and dphi/dx [1/m] of each beam in powers of xi, complex, shape (2, n, beams, ...,
        positions), or None.
    section
        N + i V [N] and M [N m] in the rotated sections, minus the values that are in equilibrium at the rigid
        positions; complex, shape of `strain`, or None.
    sliding
        For joints with friction: joint index, rate due to vibration and creep rate [rad/s or m/s], see
        `rigid.kinetostatics.with_friction`.
    slides
        For sliders on beams: joint index, displacement of the block along its line [m], and moment [N m] of the force
        at the block on the link of the beam, about the undisplaced position of the block.
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
    """Apply a function to the corresponding values of several loads that act at the same locations.

    Positions are the last axis of the values. Except for `q`, a value that does not depend on it may be a scalar.
    """

    def along_beams(name: str) -> Any:
        values = [getattr(load, name) for load in loads]
        return None if values[0] is None else change(*values)

    def per_joint(name: str) -> Any:
        return tuple(change(*gaps) for gaps in zip(*(getattr(load, name) for load in loads), strict=True))

    def per_place(name: str) -> Any:
        """Apply the function to the last two entries of each item; the entries before them identify its location."""
        items = zip(*(getattr(load, name) for load in loads), strict=True)
        return tuple((*same[0][:-2], *map(change, *(item[-2:] for item in same))) for same in items)

    return AddedLoads(
        **{name: along_beams(name) for name in ("q", "strain", "section")},
        **{name: per_joint(name) for name in ("gaps", "turns")},
        **{name: per_place(name) for name in ("points", "blocks", "sliding", "slides")},
    )
