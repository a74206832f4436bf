"""Gears on bent links: their loads on the driving links, and the motion of followers by the bending of these."""

from __future__ import annotations

from collections.abc import Iterator

from elastic.links.configuration import NodeDisplacements
from rigid import JointForces, Motion
from rigid.arrays import Columns
from rigid.closures import gear_input, gear_loads
from rigid.joints import JointPlace
from rigid.plane import ZERO

STILL = (ZERO, ZERO)


def gear_node_loads(motion: Motion, forces: JointForces) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Loads of gears on the links besides the joint forces, at the points of driving joints and of followers.

    Yields
    ------
    Link's number, point's name, force in the ground's axes [N], complex, and moment [N m].
    """
    for number, place in enumerate(motion.places):
        if place.joint.gear is not None:
            for load in gear_loads(place, *forces.without_friction(number), forces.flank.get(number, 0.0)):
                yield load.link, load.joint.point(load.link) or "", load.force, load.moment


def follower_displacement(
    place: JointPlace, nodes: NodeDisplacements, flank: Columns | None
) -> tuple[Columns, Columns]:
    """Displacement [m], complex, and rotation [rad] that a gear adds to its follower because the links bend.

    `flank` of its teeth that is loaded, as in `JointForces`; None where it has none.
    """
    return place.driven(gear_input(place, lambda joint, link: nodes.get((link, joint.point(link) or ""), STILL), flank))
