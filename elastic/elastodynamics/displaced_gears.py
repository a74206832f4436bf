"""Gear teeth with large displacement of the wheels: they stay in mesh about the displaced line of centres.

Let z' be the vector from the driving wheel's centre to the follower's, and z its rigid value. The follower turns by
Re(conj(c) log(z'/z)), and in the linear solution by Re(conj(c) (z' - z)/z). c contains the ratio and the slope of the
loaded flank. The tooth force is the transpose: its line of action turns with the line of centres. Derivation:
docs/theory.md.
"""

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
        Index of the follower's joint.
    turn
        Rotation of the follower's child relative to its parent, beyond the linear solution [rad].
    ends
        Link and point of both wheel centres: follower, driving wheel.
    force
        Tooth force on the follower in ground axes [N], complex; the opposite acts on the driving wheel.
    more
        Part of `force` beyond the linear solution.
    """

    joint: int
    turn: Reals
    ends: tuple[tuple[int, str], tuple[int, str]]
    force: Complexes
    more: Complexes


def displaced_gears(turned: Turned, moments: Reals) -> Iterator[DisplacedGear]:
    """Yield the toothed gears between two wheels.

    Parameters
    ----------
    turned
        Displacements at the nodes.
    moments
        Joint moments [N m], shape (nodes, joints).
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
