"""Loads on a mechanism's links besides its own: what vibration and the displaced axial forces add."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.links.free_body import Contact, Nodes, Stance, put
from rigid import Motion
from rigid.plane import cross


@dataclass(frozen=True, eq=False)
class AddedLoads:
    """Loads besides those of the mechanism.

    Attributes
    ----------
    q
        q_x + i q_y along every beam in its own axes [N/m], complex, shape (n, beams, ..., positions).
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

    def on_links(self, motion: Motion, stance: Stance) -> Iterator[tuple[int, Any, Any]]:
        """The loads reduced to the origins of the links' axes: link's number, force [N], complex, moment [N m]."""
        mechanism = motion.mechanism
        once, twice = (np.tensordot(1.0 / np.arange(more, len(self.q) + more), self.q, 1) for more in (1, 2))
        for k, (at, beam) in enumerate(mechanism.beams):
            length = stance.length[k]
            arm = stance.link[at] * mechanism.links[at].points[beam.start]
            force = length * stance.beam[k] * once[k]
            yield at, force, cross(arm, force) + length**2 * twice[k].imag
        for at, point, force, moment in self.points:
            arm = stance.link[at] * mechanism.links[at].points[point]
            yield at, force, cross(arm, force) + moment
        for number, force, moment in self.blocks:
            place = motion.places[number]
            owner = place.joint.owner
            yield owner, force, cross(place.arm(owner), force) + moment

    def at_blocks(self, moving: tuple[Contact, ...], rails: Mapping[int, int], stance: Stance) -> tuple[Contact, ...]:
        """Loads of blocks on beams with those of `blocks` added."""
        found = dict(zip(rails, moving, strict=True))
        for number, force, moment in self.blocks:
            own = found[number]
            pull = stance.back[own.beam] * force
            found[number] = replace(own, force=own.force + pull, moment=own.moment + moment)
        return tuple(found.values())

    def at_nodes(self, nodes: Nodes, stance: Stance) -> Nodes:
        """Loads at nodes with those at points added."""
        nodes = dict(nodes)
        for at, point, force, moment in self.points:
            if (at, point) in stance.frame.tips:
                put(nodes, (at, point), force, moment)
        return nodes
