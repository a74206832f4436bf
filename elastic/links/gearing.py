"""Gears on bent links: loads on their links, and displacement of the followers."""

from collections.abc import Iterator

from elastic.links.configuration import NodeDisplacements
from rigid import JointForces, Motion
from rigid.arrays import Columns
from rigid.closures import gear_input, gear_loads
from rigid.joints import JointPlace
from rigid.plane import ZERO

NO_DISPLACEMENT = (ZERO, ZERO)


def gear_node_loads(motion: Motion, forces: JointForces) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Yield the loads of gears at the points of driving joints and followers, without the joint forces.

    Yields
    ------
    Link index, point name, force in ground axes [N], complex, moment [N m].
    """
    for number, place in enumerate(motion.places):
        if place.joint.gear is not None:
            for load in gear_loads(place, *forces.without_friction(number), forces.flank.get(number, 0.0)):
                yield load.link, load.joint.point(load.link) or "", load.force, load.moment


def follower_displacement(
    place: JointPlace, nodes: NodeDisplacements, flank: Columns | None
) -> tuple[Columns, Columns]:
    """Return the displacement [m], complex, and rotation [rad] of a gear's follower due to bent links.

    `flank` is the loaded tooth flank, see `JointForces`; None for a gear without teeth.
    """
    return place.driven(
        gear_input(place, lambda joint, link: nodes.get((link, joint.point(link) or ""), NO_DISPLACEMENT), flank)
    )
