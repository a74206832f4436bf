"""Gears: motion of a follower from the driving links, and loads of a gear on the links.

`gear_input` (small displacements) and `gear_loads` (forces) are transposes of one another.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rigid.arrays import Columns
from rigid.joints import Joint, JointPlace
from rigid.plane import ZERO, cross, dot

Moved = Callable[[Joint, int], tuple[Columns, Columns]]
"""Function that returns displacement [m], complex, and rotation [rad] of a link at a joint."""


@dataclass(frozen=True, eq=False)
class GearLoad:
    """Load of a gear on a link, in addition to the follower's own force and moment.

    Attributes
    ----------
    link
        Index of the link.
    joint, arm
        Joint at whose point the load acts; vector to it from the origin of the link's axes [m], complex.
    force, moment
        Force, complex [N]; moment about the joint's point [N m].
    """

    link: int
    joint: Joint
    arm: Columns
    force: Columns
    moment: Columns


def gear_input(place: JointPlace, moved: Moved, flank: Columns | None = None) -> Columns:
    """Motion that a gear imposes on its follower, child from parent, when links move.

    Parameters
    ----------
    place
        Follower's joint.
    moved
        Displacements of the links at their joints.
    flank
        Loaded flank, +1 or -1: teeth stay in contact along their line of action even if the wheels are displaced. None
        for a motion without joint gaps: the gear ratio holds.
    """
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    driver = joint.gear.driver
    owner, link = joint.gear.ends
    if teeth is None or flank is None:
        ratio = joint.sense * joint.gear.ratio
        if driver.turns:
            return ratio * (moved(driver, link)[1] - moved(driver, owner)[1])
        # racks slide on the ground, so the line does not move
        return ratio * dot(driver.line, moved(driver, link)[0])
    push = teeth.push(flank)
    carrier = joint.parent if teeth.wheel == joint.child else joint.child
    led, led_turn = moved(driver, teeth.body)
    follower, follower_turn = moved(joint, teeth.wheel)
    at_carrier, carrier_turn = moved(joint, carrier)
    # along the joint's coordinate the wheel moves with its carrier; the gear's motion is added
    if place.turns:
        follower_turn = carrier_turn
    else:
        follower = follower + dot(place.along, at_carrier - follower) * place.along
    opened = dot(push, follower) - dot(push, led) - led_turn * cross(teeth.reach_body, push)
    return -teeth.sense * (opened + follower_turn * cross(teeth.reach, push))


def gear_loads(place: JointPlace, force: Columns, moment: Columns, flank: Columns = 0.0) -> Sequence[GearLoad]:
    """Loads of a gear on all links, in addition to the force on its follower's child and its opposite.

    Parameters
    ----------
    place
        Follower's joint.
    force, moment
        Force, complex [N], and moment [N m] on its child; the component along its coordinate is the gear's effort.
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
    # the effort acts between the teeth and does not load the carrier
    ends = (joint.child, place.arm_child), (joint.parent, place.arm_parent)
    (wheel, arm), (carrier, arm_carrier) = ends if teeth.wheel == joint.child else ends[::-1]
    if place.turns:
        return GearLoad(wheel, joint, arm, tooth, ZERO), led, GearLoad(carrier, joint, arm_carrier, ZERO, effort)
    pull = effort * place.along
    on_follower = GearLoad(wheel, joint, arm, tooth - pull, cross(teeth.reach, tooth))
    return on_follower, led, GearLoad(carrier, joint, arm_carrier, pull, ZERO)


def _without_teeth(joint: Joint, driver: Joint, effort: Columns) -> Sequence[GearLoad]:
    """Loads due to an effort along the driver's coordinate, for gears without teeth."""
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
    """Vector from the link's origin to the point of a rack that drives a gear [m], complex; ZERO for a wheel."""
    return ZERO if driver.turns else driver.turn * driver.at_child
