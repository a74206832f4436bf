"""Pairs of links at pins and welds, derived from the points that the links share."""

from collections.abc import Iterator

import numpy as np

from rigid import Mechanism, structure
from rigid.arrays import Complex


def pins(mechanism: Mechanism) -> Iterator[tuple[str, int, int, Complex | None]]:
    """Yield the point, parent and child of each pin or weld, and the direction of a weld (None for a pin).

    Links that share a point are attached to the first of them, or to an earlier one to which they are welded.
    """
    turns: dict[tuple[str, int, int], Complex] = {}
    for weld in mechanism.welds:
        one, other, turn = mechanism.index[weld.on], mechanism.index[weld.link], weld.turn
        turns |= {(weld.point, one, other): turn, (weld.point, other, one): np.conj(turn)}
    shared: dict[str, list[int]] = {}
    for number, link in enumerate(mechanism.links):
        for point in link.points:
            shared.setdefault(point, []).append(number)
    for point, links in shared.items():
        for place, number in enumerate(links[1:], 1):
            fast = [other for other in links[:place] if (point, other, number) in turns]
            parent = (fast or links)[0]
            yield point, parent, number, turns.get((point, parent, number))


def gap_sense(mechanism: Mechanism, name: str, parent: int, child: int) -> float:
    """Return the sign of gaps: -1 if parent and child are swapped in the structure of the mechanism."""
    found = (joint for joint in structure(mechanism).joints if joint.name == name)
    return next(
        1.0 if joint.child == child else -1.0 for joint in found if {joint.parent, joint.child} == {parent, child}
    )
