"""Contact points of gear teeth, and the tooth forces on both wheels.

Pitch points and lines of action are computed from pitch radii, independently of `rigid`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fem_check.linear.frame import Frame, FramePlace, Side
from rigid import Gear, PinDrive, SliderDrive, position_of
from rigid.arrays import Columns, Complexes

Flanks = Mapping[int, Any]
"""Loaded flank by gear index: the sign of the effort along the coordinate of the follower."""
MeshParts = tuple[tuple[FramePlace | None, Any, Any], ...]


@dataclass(frozen=True, eq=False)
class Wheel:
    """Toothed wheel or rack, with the joint that connects it to the carrier.

    Attributes
    ----------
    place
        Place of the joint on the wheel or rack.
    hub
        Position of the joint [m], complex.
    sign
        1 if the coordinate of the joint is that of the wheel or rack relative to the carrier, -1 if it is the opposite.
    """

    place: Side
    hub: Complexes
    sign: int


class Pitch(NamedTuple):
    """Pitch point [m], direction of a positive effort on the follower, and normal of its flanks, complex."""

    point: Complexes
    tangent: Complexes
    normal: Complexes


def tooth_forces(frame: Frame, gear: Gear, flank: Columns) -> MeshParts | None:
    """Compute the tooth forces on follower and driver for a unit effort along the coordinate of the follower.

    The force acts at the pitch point. The line of action is the tangent, rotated by the pressure angle.

    Returns
    -------
    Place, force and moment on the follower and on the driver. The result is None if there is no pitch point, i.e. for a
    gear without teeth or without a common carrier, a ratio of 1, coincident axes, or two racks.
    """
    mechanism = frame.motion.mechanism
    carriers = {*mechanism.ends(gear.follower)} & {*mechanism.ends(gear.driver)}
    if gear.pressure_angle is None or not carriers:
        return None
    (carrier,) = carriers
    follower, driver = (_wheel(frame, end, carrier) for end in (gear.follower, gear.driver))
    # the third argument is the follower's motion per unit motion of the driver, relative to the carrier
    pitch = _pitch(frame, gear, gear.ratio * follower.sign * driver.sign, driver.hub, follower.hub)
    if pitch is None:
        return None
    action = (
        np.cos(gear.pressure_angle) * pitch.tangent + follower.sign * flank * np.sin(gear.pressure_angle) * pitch.normal
    )
    arm, driver_arm = pitch.point - follower.hub, pitch.point - driver.hub
    lever = (np.conj(arm) * action).imag if gear.follower.turns else np.cos(gear.pressure_angle)
    force = follower.sign * action / lever
    assert not isinstance(follower.place, tuple)  # racks run on the ground
    assert not isinstance(driver.place, tuple)
    return (
        (follower.place, force, (np.conj(arm) * force).imag),
        (driver.place, -force, -(np.conj(driver_arm) * force).imag),
    )


def _pitch(frame: Frame, gear: Gear, rate: float, driver: Complexes, follower: Complexes) -> Pitch | None:
    """Compute the pitch from both hubs and the ratio of the speeds relative to the carrier (None for two racks)."""
    racks = [end for end in (gear.driver, gear.follower) if not end.turns]
    if not racks:
        return _pitch_of_wheels(rate, driver, follower)
    line = frame.along(frame.motion.mechanism.slider(racks[0].joint))
    if gear.driver.turns:  # the rim of the wheel moves with the rack
        radius = -1j * rate * line
        return Pitch(driver + radius, line, radius / np.abs(radius))
    if gear.follower.turns:
        radius = -1j / rate * line
        return Pitch(follower + radius, np.sign(rate) * line, -radius / np.abs(radius))
    return None


def _pitch_of_wheels(rate: float, driver: Complexes, follower: Complexes) -> Pitch | None:
    """Compute the pitch of two wheels: the instantaneous centre of the relative motion, on the line of the hubs."""
    distance = np.abs(follower - driver)
    if rate == 1 or not np.any(distance):
        return None
    towards = (follower - driver) / distance
    radius = distance / np.abs(1 - rate)  # pitch radius of the follower
    if rate < 0:
        return Pitch(follower - radius * towards, -1j * towards, towards)
    if rate < 1:  # the follower is a ring gear, with the opposite flank normal
        return Pitch(follower - radius * towards, -1j * towards, -towards)
    return Pitch(follower + radius * towards, 1j * towards, -towards)


def _wheel(frame: Frame, end: PinDrive | SliderDrive, carrier: int) -> Wheel:
    """Return the wheel or rack at one end of a gear, i.e. the link of the joint that is not the carrier."""
    motion, mechanism = frame.motion, frame.motion.mechanism
    on, link = mechanism.ends(end)
    body, sign = (link, 1) if on == carrier else (on, -1)
    if end.turns:
        return Wheel(frame.place(body, end.joint), position_of(motion, body, end.joint), sign)
    slider = mechanism.slider(end.joint)
    side = frame.sides[end.joint][(on, link).index(body)]
    return Wheel(side, position_of(motion, mechanism.index[slider.link], slider.point), sign)
