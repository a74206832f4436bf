"""Additional loads on the links, from vibration or displaced links."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from elastic.arrays import VectorCoefficients
from rigid.arrays import Columns


@dataclass(frozen=True, eq=False)
class AddedLoads:
    """Loads in addition to the loads of the rigid motion.

    Attributes
    ----------
    q
        q_x + i q_y on each beam in beam axes, in powers of xi [N/m], shape (n, beams, ..., positions).
    points
        Per load: link index, point name, force in ground axes [N], complex, moment [N m].
    blocks
        Per sliding block: joint index, force on the beam in ground axes [N], complex, moment [N m].
    gaps, turns
        Additional gap of each joint: displacement of the child's point from the parent's [m], complex; rotation [rad].
    strain
        Free strains d(u + i w)/dx and dphi/dx [1/m] of each beam in powers of xi, complex, shape (2, n, beams, ...,
        positions); or None.
    section
        N + i V [N] and M [N m] of the rotated sections, minus the values in equilibrium at the rigid positions;
        complex, shape of `strain`; or None.
    sliding
        Per joint with friction: joint index, rate due to vibration, creep [rad/s or m/s]; see
        `rigid.kinetostatics.with_friction`.
    slides
        Per slider on beams: joint index, displacement of the block along its line [m], moment [N m] on the beam's link
        of the force at the block, about the block's undisplaced position.
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
    """Combine loads at the same locations by a function of their values; positions are the last axis.

    Except for `q`, a value that is equal at all positions may be a scalar.
    """

    def along_beams(name: str) -> Any:
        values = [getattr(load, name) for load in loads]
        return None if values[0] is None else change(*values)

    def per_joint(name: str) -> Any:
        return tuple(change(*gaps) for gaps in zip(*(getattr(load, name) for load in loads), strict=True))

    def per_place(name: str) -> Any:
        """Change the last two entries of each item; the entries before them name its place."""
        items = zip(*(getattr(load, name) for load in loads), strict=True)
        return tuple((*same[0][:-2], *map(change, *(item[-2:] for item in same))) for same in items)

    return AddedLoads(
        **{name: along_beams(name) for name in ("q", "strain", "section")},
        **{name: per_joint(name) for name in ("gaps", "turns")},
        **{name: per_place(name) for name in ("points", "blocks", "sliding", "slides")},
    )
