"""Transmission angles of dyads, which measure how effectively one link drives the other."""

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns, Reals
from rigid.closures.closure import Closure
from rigid.joints import JointPlace
from rigid.kinematics import Motion
from rigid.plane import cross, dot


class Transmission(Struct, frozen=True, eq=False):
    """Transmission angle between two links of a dyad.

    Attributes
    ----------
    joint
        Name of the common joint.
    links
        Names of the links.
    angle
        Acute angle between the links [rad], shape (..., positions). Its sine is the magnitude of `Closure.sine`. At a
        slider, the normal to the line of the slider replaces the link.
    """

    joint: str
    links: tuple[str, str]
    angle: Reals


def transmission_angles(motion: Motion) -> list[Transmission]:
    """Return the transmission angles of all dyads, in the order of solution. For larger groups, see `Motion.sine`."""
    links = motion.mechanism.links
    angles = []
    for closed in motion.closures:
        if closed.group.dyad is not None and closed.group.free:
            one, other = _lines(closed)
            angle = np.arctan2(np.abs(cross(one, other)), np.abs(dot(one, other)))
            names = tuple(links[link].name for link in closed.group.links)
            angles.append(Transmission(closed.cut[0].joint.name, names, np.broadcast_to(angle, motion.columns)))  # type: ignore[arg-type]
    return angles


def _lines(closed: Closure) -> tuple[Columns, Columns]:
    """Return the two lines (links or slider normals) that form the transmission angle of a dyad."""
    inner, hinges = closed.cut[0], [closed.tree[number] for number in closed.group.free]
    if inner.turns:
        first, second = (_body_arm(closed, hinge) if hinge.turns else 1j * hinge.along for hinge in hinges)
        return first, second
    slides = [hinge for hinge in hinges if not hinge.turns]
    if slides:
        return 1j * inner.along, 1j * slides[0].along
    # links that slide on each other: the line through their outer pins, and the normal of the inner slider
    ends = [_body_arm(closed, hinge) for hinge in hinges]
    return ends[0] - ends[1], 1j * inner.along


def _body_arm(closed: Closure, hinge: JointPlace) -> Columns:
    """Return the vector from an outer joint of a dyad to the inner joint, across welded links [m]."""
    inner, body = closed.cut[0], {hinge.joint.child: hinge}
    for place in closed.tree:
        if place.joint.moved and place.joint.parent in body:
            body[place.joint.child] = place
    link = inner.joint.child if inner.joint.child in body else inner.joint.parent
    reach = inner.arm(link)
    while link != hinge.joint.child:
        reach = reach - body[link].arm_child + body[link].arm_parent
        link = body[link].joint.parent
    return reach - hinge.arm_child
