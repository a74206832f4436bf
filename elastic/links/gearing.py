"""What gears do to bent links: they load the links that drive them, and follow how these bend."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from elastic.links.configuration import NodeDisplacements
from rigid import JointForces, JointPlace, Motion, dot

STILL = (0.0, 0.0)


def gear_loads(motion: Motion, forces: JointForces) -> Iterator[tuple[int, str, Any, Any]]:
    """What followers ask of the links that drive them, at the driving joints.

    Yields
    ------
    Link's number, point's name, force in the ground's axes [N], complex, and moment [N m].
    """
    for place, force, moment in zip(motion.places, forces.force, forces.moment, strict=True):
        gear = place.joint.gear
        if gear is None:
            continue
        effort = -place.joint.sense * gear.ratio * (moment if place.along is None else dot(place.along, force))
        on, link = gear.ends
        slider = gear.driver.slider
        if slider is None:
            yield link, gear.driver.name, 0.0, effort
            yield on, gear.driver.name, 0.0, -effort
        else:
            yield link, slider.point, effort * slider.direction, 0.0


def follower_displacement(place: JointPlace, nodes: NodeDisplacements) -> tuple[Any, Any]:
    """Displacement [m], complex, and rotation [rad] that a gear adds to its follower because its driving links bend."""
    gear = place.joint.gear
    if gear is None:
        return STILL
    on, link = gear.ends
    slider = gear.driver.slider
    if slider is None:
        name = gear.driver.name
        moved = nodes.get((link, name), STILL)[1] - nodes.get((on, name), STILL)[1]
    else:
        moved = dot(slider.direction, np.asarray(nodes.get((link, slider.point), STILL)[0]))
    moved = place.joint.sense * gear.ratio * moved
    return (0.0, moved) if place.along is None else (moved * place.along, 0.0)
