"""Gears: the motion of a follower due to the driving links, and the loads of a gear on the links.

`gear_loads` (forces) is the transpose of `gear_input` (small displacements).
"""

from collections.abc import Callable, Sequence

from msgspec import Struct

from rigid.arrays import Columns
from rigid.joints import Joint, JointPlace
from rigid.plane import ZERO, cross, dot

Moved = Callable[[Joint, int], tuple[Columns, Columns]]
"""Function that returns the displacement (complex) [m] and the rotation [rad] of a link at a joint."""


class GearLoad(Struct, frozen=True, eq=False):
    """Load of a gear on a link, in addition to the force and moment of the follower's joint.

    Attributes
    ----------
    link
        Index of the link.
    joint, arm
        Joint at which the load acts, and vector from the link's origin to the joint's point (complex) [m].
    force, moment
        Force (complex) [N], and moment about the joint's point [N m].
    """

    link: int
    joint: Joint
    arm: Columns
    force: Columns
    moment: Columns


def gear_input(place: JointPlace, moved: Moved, flank: Columns | None = None) -> Columns:
    """Return the motion that a gear imposes on its follower (child relative to parent) when links move.

    Parameters
    ----------
    place
        Joint of the follower.
    moved
        Function that returns the displacements of the links.
    flank
        Loaded flank, +1 or -1: the teeth stay in contact along the line of action even if the wheels are displaced.
        None: the gear ratio holds, as in a motion without joint gaps.
    """
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    driver = joint.gear.driver
    owner, link = joint.gear.ends
    if teeth is None or flank is None:
        ratio = joint.sense * joint.gear.ratio
        if driver.turns:
            return ratio * (moved(driver, link)[1] - moved(driver, owner)[1])
        # a rack slides on the ground, so its line does not move
        return ratio * dot(driver.line, moved(driver, link)[0])
    push = teeth.push(flank)
    carrier = joint.parent if teeth.wheel == joint.child else joint.child
    led, led_turn = moved(driver, teeth.body)
    follower, follower_turn = moved(joint, teeth.wheel)
    at_carrier, carrier_turn = moved(joint, carrier)
    # along the joint coordinate, the wheel first moves with its carrier; the motion of the gear is added later
    if place.turns:
        follower_turn = carrier_turn
    else:
        follower = follower + dot(place.along, at_carrier - follower) * place.along
    opened = dot(push, follower) - dot(push, led) - led_turn * cross(teeth.reach_body, push)
    return -teeth.sense * (opened + follower_turn * cross(teeth.reach, push))


def gear_loads(place: JointPlace, force: Columns, moment: Columns, flank: Columns = 0.0) -> Sequence[GearLoad]:
    """Return the loads of a gear on all links, in addition to the force of the follower's joint.

    Parameters
    ----------
    place
        Joint of the follower.
    force, moment
        Force (complex) [N] and moment [N m] of this joint on its child. The component along the joint coordinate is
        the effort of the gear.
    flank
        Loaded flank, +1 or -1.
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
    # the effort acts between the teeth, not on the carrier
    ends = (joint.child, place.arm_child), (joint.parent, place.arm_parent)
    (wheel, arm), (carrier, arm_carrier) = ends if teeth.wheel == joint.child else ends[::-1]
    if place.turns:
        return GearLoad(wheel, joint, arm, tooth, ZERO), led, GearLoad(carrier, joint, arm_carrier, ZERO, effort)
    pull = effort * place.along
    on_follower = GearLoad(wheel, joint, arm, tooth - pull, cross(teeth.reach, tooth))
    return on_follower, led, GearLoad(carrier, joint, arm_carrier, pull, ZERO)


def _without_teeth(joint: Joint, driver: Joint, effort: Columns) -> Sequence[GearLoad]:
    """Return the loads of a gear without teeth due to an effort along the driver's coordinate."""
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
    """Return the vector from the link's origin to the point of a driving rack (complex) [m]; ZERO for a wheel."""
    return ZERO if driver.turns else driver.turn * driver.at_child
