"""Contact points of gear teeth, and the tooth forces on both wheels.

Pitch points and lines of action are computed from the pitch radii of the wheels, independently of `rigid`.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from msgspec import Struct

from fem_check.linear.frame import Frame, FramePlace, Side
from rigid import Gear, PinDrive, SliderDrive, position_of
from rigid.arrays import Columns, Complexes

Flanks = Mapping[int, Any]
"""Loaded flank of each gear, by gear index: the sign of the effort along the coordinate of the follower."""
MeshParts = tuple[tuple[FramePlace | None, Any, Any], ...]
"""Place, force (complex) and moment on the follower, and then on the driver."""


class Wheel(Struct, frozen=True, eq=False):
    """Toothed wheel or rack, with the joint that connects it to the carrier.

    Attributes
    ----------
    place
        Place of the joint on the wheel or rack.
    hub
        Position of the joint (complex) [m].
    sign
        1 if the coordinate of the joint is the motion of the wheel or rack relative to the carrier, and -1 if it is the
        motion of the carrier relative to the wheel or rack.
    """

    place: Side
    hub: Complexes
    sign: int


class Pitch(NamedTuple):
    """Contact of two wheels, or of a wheel and a rack. All attributes are complex.

    Attributes
    ----------
    point
        Pitch point [m].
    tangent
        Unit vector of a force on the follower that turns a wheel counter-clockwise, or moves a rack forward.
    normal
        Unit vector of the additional force component due to the pressure angle, for the positive flank of a wheel.
    """

    point: Complexes
    tangent: Complexes
    normal: Complexes


def tooth_forces(frame: Frame, gear: Gear, flank: Columns) -> MeshParts | None:
    """Compute the tooth forces on follower and driver for a unit effort along the coordinate of the follower.

    The force acts at the pitch point. Its direction is the tangent, rotated by the pressure angle.

    Returns
    -------
    Place, force and moment on the follower and on the driver. None if there is no pitch point. This is the case if the
    gear has no pressure angle or no common carrier, the ratio is 1, the axes coincide, or there are two racks.
    """
    mechanism = frame.motion.mechanism
    carriers = {*mechanism.ends(gear.follower)} & {*mechanism.ends(gear.driver)}
    if gear.pressure_angle is None or not carriers:
        return None
    (carrier,) = carriers
    follower, driver = (_wheel(frame, end, carrier) for end in (gear.follower, gear.driver))
    # the third argument is the ratio of the follower's motion to the driver's motion, both relative to the carrier
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
    """Return the contact of follower and driver, or None for two racks.

    `rate` is the ratio of the follower's to the driver's speed, both relative to the carrier. `driver` and `follower`
    are the positions of the hubs.
    """
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
    """Return the contact of two wheels. The pitch point is the instantaneous centre of their relative motion."""
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
