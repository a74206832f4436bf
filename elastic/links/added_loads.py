"""Loads on a mechanism's links besides its own: what vibration and the forces on displaced links add."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
    """

    q: Any
    points: tuple[tuple[int, str, Any, Any], ...]
    blocks: tuple[tuple[int, Any, Any], ...]
    gaps: tuple[Any, ...]
    turns: tuple[Any, ...]
