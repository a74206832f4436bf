"""Gears: what a driving joint's motion does to its follower, and what the follower's load asks of the driver."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rigid.joints import Columns, Joint, JointPlace
from rigid.plane import ZERO, dot


def gear_input(
    joint: Joint, rotation: Callable[[int], Columns], displacement: Callable[[Joint, int], Columns]
) -> Columns:
    """By how much a gear moves its follower, child from parent, when the links of its driver move.

    Parameters
    ----------
    joint
        The follower.
    rotation, displacement
        Of a link, and of its point at the given driving joint, complex.
    """
    assert joint.gear is not None
    ratio, driver = joint.sense * joint.gear.ratio, joint.gear.driver
    owner, link = joint.gear.ends
    if driver.turns:
        return ratio * (rotation(link) - rotation(owner))
    # Racks run on the ground: the line does not move.
    return ratio * dot(driver.line, displacement(driver, link))


def gear_loads(place: JointPlace, force: Columns, moment: Columns) -> Sequence[tuple[int, Columns, Columns]]:
    """Loads of a follower on the links of its driving joint: the transpose of `gear_input`.

    Parameters
    ----------
    place
        The follower.
    force, moment
        What moves it: from its gear on its child [N], complex, and [N m].

    Returns
    -------
    Link, force at its point of the driving joint and moment.
    """
    joint = place.joint
    assert joint.gear is not None
    driver = joint.gear.driver
    effort = -joint.sense * joint.gear.ratio * place.effort(force, moment)
    owner, link = joint.gear.ends
    if driver.turns:
        return (link, ZERO, effort), (owner, ZERO, -effort)
    return ((link, effort * driver.line, ZERO),)


def input_arm(driver: Joint) -> Columns:
    """From the origin of its link's axes to the point of a rack that drives a gear [m], complex; ZERO for a wheel."""
    return ZERO if driver.turns else driver.turn * driver.at_child
