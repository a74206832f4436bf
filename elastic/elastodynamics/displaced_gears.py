"""Teeth of displaced wheels: they stay together about the line through the centres, displaced by any amount.

Rotations are compatible by the ratio as seen from the line through the centres. With z' the vector from the driving
wheel's centre to the follower's, z that of the rigid motion, the follower is turned by Re(conj(c) log(z'/z)) where the
linear solution has Re(conj(c) (z' - z)/z); c holds the ratio and the slope of the loaded flank. The teeth push by the
transpose: along a line of action that turns with the line of centres. Derivation: docs/theory.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastic.elastodynamics.displaced_points import Turned
from rigid.arrays import Complexes, Reals
from rigid.joints import JointPlace
from rigid.plane import dot


@dataclass(frozen=True, eq=False)
class DisplacedGear:
    """Teeth of two wheels, at the points of a grid.

    Attributes
    ----------
    joint
        Number of the follower's.
    turn
        Rotation of the follower's child from its parent that the linear solution has not [rad].
    ends
        Link and point of the two wheels' centres: of the follower, and of the driving wheel.
    force
        Of the teeth on the follower in the ground's axes [N], complex: on the other its opposite.
    more
        Of this force what the linear solution has not.
    """

    joint: int
    turn: Reals
    ends: tuple[tuple[int, str], tuple[int, str]]
    force: Complexes
    more: Complexes


def displaced_gears(turned: Turned, moments: Reals) -> Iterator[DisplacedGear]:
    """Gears with teeth between two wheels of which a centre may move.

    Parameters
    ----------
    turned
        Displacements at the nodes.
    moments
        In the joints [N m], shape (nodes, joints).
    """
    for number, place in enumerate(turned.motion.places):
        if place.teeth is not None and place.joint.gear is not None and place.turns and place.joint.gear.driver.turns:
            yield _displaced(turned, number, place, moments[:, number])


def _displaced(turned: Turned, number: int, place: JointPlace, moment: Reals) -> DisplacedGear:
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    assert teeth is not None
    wheel, body = (teeth.wheel, joint.point(teeth.wheel) or ""), (teeth.body, joint.gear.driver.point(teeth.body) or "")
    between = np.broadcast_to(teeth.reach_body - teeth.reach, turned.motion.columns)
    apart, linear = (moved(*wheel) - moved(*body) for moved in (turned.displacement, turned.linear_displacement))
    push = teeth.push(np.sign(moment))
    share = push * np.conj(between)
    after = 1 + apart / between
    opened = dot(share, np.log(after)) - dot(push, linear)
    effort = teeth.sense * moment
    force = effort * push / np.conj(after)
    return DisplacedGear(number, -teeth.sense * opened[1:], (wheel, body), force[1:], (force - effort * push)[1:])
