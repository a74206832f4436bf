"""Gears: the motion of a follower by that of the driving links, and the loads on these by that on the follower.

The one is the transpose of the other: `gear_input` of small displacements, `gear_loads` of forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rigid.arrays import Columns
from rigid.joints import Joint, JointPlace
from rigid.plane import ZERO, cross, dot

Moved = Callable[[Joint, int], tuple[Columns, Columns]]
"""Displacement [m], complex, of a link's point at a joint, and rotation [rad] of the link there."""


@dataclass(frozen=True, eq=False)
class GearLoad:
    """Load of a gear on a link, besides the follower's own force and moment.

    Attributes
    ----------
    link
        Its number.
    joint, arm
        At whose point it acts, and from the origin of the link's axes to there [m], complex.
    force, moment
        Complex [N], and about that point [N m].
    """

    link: int
    joint: Joint
    arm: Columns
    force: Columns
    moment: Columns


def gear_input(place: JointPlace, moved: Moved, flank: Columns | None = None) -> Columns:
    """By how much a gear moves its follower, child from parent, when links move.

    Parameters
    ----------
    place
        The follower.
    moved
        Displacements of the links at their joints.
    flank
        The loaded one, +1 or -1, so that the teeth stay together along their line of action however the wheels are
        displaced. None for a motion without gaps in the joints: the ratio tells all.
    """
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    driver = joint.gear.driver
    owner, link = joint.gear.ends
    if teeth is None or flank is None:
        ratio = joint.sense * joint.gear.ratio
        if driver.turns:
            return ratio * (moved(driver, link)[1] - moved(driver, owner)[1])
        # Racks run on the ground: the line does not move.
        return ratio * dot(driver.line, moved(driver, link)[0])
    push = teeth.push(flank)
    carrier = joint.parent if teeth.wheel == joint.child else joint.child
    led, led_turn = moved(driver, teeth.body)
    follower, follower_turn = moved(joint, teeth.wheel)
    at_carrier, carrier_turn = moved(joint, carrier)
    # Along the joint's coordinate the wheel goes with its carrier, so that the gear's motion comes on top.
    if place.turns:
        follower_turn = carrier_turn
    else:
        follower = follower + dot(place.along, at_carrier - follower) * place.along
    opened = dot(push, follower) - dot(push, led) - led_turn * cross(teeth.reach_body, push)
    return -teeth.sense * (opened + follower_turn * cross(teeth.reach, push))


def gear_loads(place: JointPlace, force: Columns, moment: Columns, flank: Columns = 0.0) -> Sequence[GearLoad]:
    """Loads of a gear on all links, besides the force and moment on its follower's child and their opposite.

    Parameters
    ----------
    place
        The follower.
    force, moment
        On its child, complex [N] and [N m]; along its coordinate they are the effort of the gear.
    flank
        The loaded one, +1 or -1.
    """
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    effort, driver = place.effort(force, moment), joint.gear.driver
    if teeth is None:
        return _without_teeth(joint, driver, -joint.sense * joint.gear.ratio * effort)
    effort = teeth.sense * effort
    tooth = effort * teeth.push(flank)
    hub = teeth.arm - teeth.reach_body
    led = GearLoad(teeth.body, driver, hub, -tooth, -cross(teeth.reach_body, tooth))
    # The effort is between the teeth: the carrier does not feel it.
    ends = (joint.child, place.arm_child), (joint.parent, place.arm_parent)
    (wheel, arm), (carrier, arm_carrier) = ends if teeth.wheel == joint.child else ends[::-1]
    if place.turns:
        return GearLoad(wheel, joint, arm, tooth, ZERO), led, GearLoad(carrier, joint, arm_carrier, ZERO, effort)
    pull = effort * place.along
    on_follower = GearLoad(wheel, joint, arm, tooth - pull, cross(teeth.reach, tooth))
    return on_follower, led, GearLoad(carrier, joint, arm_carrier, pull, ZERO)


def _without_teeth(joint: Joint, driver: Joint, effort: Columns) -> Sequence[GearLoad]:
    """An effort along the driver's coordinate."""
    assert joint.gear is not None
    owner, link = joint.gear.ends
    if driver.turns:
        return GearLoad(link, driver, ZERO, ZERO, effort), GearLoad(owner, driver, ZERO, ZERO, -effort)
    pull = effort * driver.line
    return (
        GearLoad(link, driver, rack_arm(driver), pull, ZERO),
        GearLoad(owner, driver, driver.at_parent, -pull, ZERO),
    )


def rack_arm(driver: Joint) -> Columns:
    """From the origin of its link's axes to the point of a rack that drives a gear [m], complex; ZERO for a wheel."""
    return ZERO if driver.turns else driver.turn * driver.at_child
