"""Pairs of links at pins and welds, determined from the points that links have in common."""

from collections.abc import Iterator

import numpy as np

from rigid import Mechanism, structure
from rigid.arrays import Complex


def pins(mechanism: Mechanism) -> Iterator[tuple[str, int, int, Complex | None]]:
    """Yield point, parent, child and direction of each pin or weld.

    For a weld, the direction is the unit vector of the child's x axis in axes of the parent. For a pin, it is None. If
    several links have a point in common, the first link is the parent of the other links. There is one exception: if a
    link is welded to an earlier link at this point, the earlier link is the parent.
    """
    weld_directions: dict[tuple[str, int, int], Complex] = {}
    for weld in mechanism.welds:
        one, other, direction = mechanism.index[weld.on], mechanism.index[weld.link], weld.turn
        weld_directions |= {(weld.point, one, other): direction, (weld.point, other, one): np.conj(direction)}
    shared: dict[str, list[int]] = {}
    for number, link in enumerate(mechanism.links):
        for point in link.points:
            shared.setdefault(point, []).append(number)
    for point, links in shared.items():
        for place, number in enumerate(links[1:], 1):
            welded = [other for other in links[:place] if (point, other, number) in weld_directions]
            parent = (welded or links)[0]
            yield point, parent, number, weld_directions.get((point, parent, number))


def gap_sense(mechanism: Mechanism, name: str, parent: int, child: int) -> float:
    """Return the sign of the misfit of a joint.

    A misfit is a displacement of the child relative to the parent. The joint in `structure(mechanism)` determines the
    parent and the child. The sign is -1 if the arguments `parent` and `child` are in the opposite order.
    """
    found = (joint for joint in structure(mechanism).joints if joint.name == name)
    return next(
        1.0 if joint.child == child else -1.0 for joint in found if {joint.parent, joint.child} == {parent, child}
    )
