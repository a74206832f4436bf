"""What gears do to bent links: they load the links that drive them, and follow how these bend."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from elastic.links.configuration import NodeDisplacements
from rigid import JointForces, Motion
from rigid.gears import gear_input, gear_loads
from rigid.joints import JointPlace
from rigid.plane import ZERO

STILL = (ZERO, ZERO)


def driver_loads(motion: Motion, forces: JointForces) -> Iterator[tuple[int, str, Any, Any]]:
    """What followers ask of the links that drive them, at the driving joints.

    Yields
    ------
    Link's number, point's name, force in the ground's axes [N], complex, and moment [N m].
    """
    for place, force, moment in zip(motion.places, forces.force, forces.moment, strict=True):
        if place.joint.gear is not None:
            driver = place.joint.gear.driver
            for link, pull, couple in gear_loads(place, force, moment):
                yield link, driver.point(link) or "", pull, couple


def follower_displacement(place: JointPlace, nodes: NodeDisplacements) -> tuple[Any, Any]:
    """Displacement [m], complex, and rotation [rad] that a gear adds to its follower because its driving links bend."""
    gear = place.joint.gear
    if gear is None:
        return STILL
    moved = gear_input(
        place.joint,
        lambda link: nodes.get((link, gear.driver.name), STILL)[1],
        lambda driver, link: nodes.get((link, driver.point(link) or ""), STILL)[0],
    )
    return place.driven(moved)
