"""Loads on the links, and gaps at the joints, that are due to vibration or displacement of the links."""

from collections.abc import Callable
from typing import Any

from msgspec import Struct

from elastic.arrays import VectorCoefficients
from rigid.arrays import Columns


class AddedLoads(Struct, frozen=True, eq=False):
    """Loads that act in addition to the loads of the rigid motion.

    Attributes
    ----------
    q
        Distributed load q_x + i q_y on each beam in beam axes, in powers of xi [N/m], shape (n, beams, ..., positions).
    points
        Point loads: link index, point name, force in ground axes [N], complex, and moment [N m].
    blocks
        Loads of sliding blocks: joint index, force on the beam in ground axes [N], complex, and moment [N m].
    gaps, turns
        Additional gap of each joint: displacement of the child's point relative to the parent's point [m], complex, and
        rotation [rad].
    strain
        Free strains d(u + i w)/dx and dphi/dx [1/m] of each beam in powers of xi, complex, shape (2, n, beams, ...,
        positions), or None.
    section
        N + i V [N] and M [N m] in the rotated sections, minus the values that equilibrium at the rigid positions gives;
        complex, same shape as `strain`, or None.
    sliding
        For joints with friction: joint index, rate due to vibration, and creep rate [rad/s or m/s], see
        `rigid.kinetostatics.forces_with_friction`.
    slides
        For sliders on beams: joint index, displacement of the block along its line [m], and additional moment [N m] on
        the link of the beam. The moment is that of the force of the displaced block about the undisplaced position of
        the block.
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

    The last axis of a value runs over the positions. Except for `q`, a value may be a scalar if it is the same at all
    positions.
    """

    def along_beams(name: str) -> Any:
        values = [getattr(load, name) for load in loads]
        return None if values[0] is None else change(*values)

    def per_joint(name: str) -> Any:
        return tuple(change(*gaps) for gaps in zip(*(getattr(load, name) for load in loads), strict=True))

    def per_place(name: str) -> Any:
        """Apply the function to the last two entries of each item. The entries before them identify where it acts."""
        items = zip(*(getattr(load, name) for load in loads), strict=True)
        return tuple((*same[0][:-2], *map(change, *(item[-2:] for item in same))) for same in items)

    return AddedLoads(
        **{name: along_beams(name) for name in ("q", "strain", "section")},
        **{name: per_joint(name) for name in ("gaps", "turns")},
        **{name: per_place(name) for name in ("points", "blocks", "sliding", "slides")},
    )
