"""Contact points of gear teeth, and the forces of a unit tooth effort on both wheels.

Pitch points and lines of action are computed independently, from pitch radii.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fem_check.linear.frame import Frame, FramePlace
from rigid import Gear, PinDrive, SliderDrive, position_of
from rigid.arrays import Columns, Complexes

Flanks = Mapping[int, Any]
"""Loaded flank of each gear, by number: sign of the effort along the follower's coordinate."""
End = PinDrive | SliderDrive
MeshParts = tuple[tuple[FramePlace | None, Any, Any], ...]


def tooth_forces(frame: Frame, gear: Gear, flank: Columns) -> MeshParts | None:
    """Tooth force on follower and driver per unit effort along the follower's coordinate.

    Returns place, force and moment for both, or None without a pitch point: no teeth, no common carrier, ratio 1,
    coincident axes, or no wheel.
    """
    mechanism = frame.motion.mechanism
    carriers = {*mechanism.ends(gear.follower)} & {*mechanism.ends(gear.driver)}
    if gear.pressure_angle is None or not carriers:
        return None
    (carrier,) = carriers
    follower, follows = _body(frame, gear.follower, carrier)
    driver, led = _body(frame, gear.driver, carrier)
    hubs = _point(frame, gear.driver, driver), _point(frame, gear.follower, follower)
    # motion of the follower per unit motion of the driver, relative to the carrier
    geometry = _pitch_point(frame, gear, gear.ratio * follows * led, *hubs)
    if geometry is None:
        return None
    pitch, tangent, away = geometry
    line = np.cos(gear.pressure_angle) * tangent + follows * flank * np.sin(gear.pressure_angle) * away
    arm = pitch - hubs[1]
    lever = (np.conj(arm) * line).imag if gear.follower.turns else np.cos(gear.pressure_angle)
    force = follows * line / lever
    return (
        (_place(frame, gear.follower, follower), force, (np.conj(arm) * force).imag),
        (_place(frame, gear.driver, driver), -force, -(np.conj(pitch - hubs[0]) * force).imag),
    )


def _pitch_point(
    frame: Frame, gear: Gear, rate: float, follower: Complexes, driver: Complexes
) -> tuple[Complexes, Complexes, Complexes] | None:
    """Pitch point [m], tangent of a positive effort on the follower, and flank normal."""
    racks = [end for end in (gear.driver, gear.follower) if not end.turns]
    if not racks:
        return _of_wheels(rate, follower, driver)
    line = frame.along(frame.motion.mechanism.slider(racks[0].joint))
    if gear.driver.turns:  # the wheel's rim moves with the rack
        radius = -1j * rate * line
        return follower + radius, line, radius / np.abs(radius)
    if gear.follower.turns:
        radius = -1j / rate * line
        return driver + radius, np.sign(rate) * line, -radius / np.abs(radius)
    return None


def _of_wheels(rate: float, follower: Complexes, driver: Complexes) -> tuple[Complexes, Complexes, Complexes] | None:
    distance = np.abs(driver - follower)
    if rate == 1 or not np.any(distance):
        return None
    towards = (driver - follower) / distance
    radius = distance / np.abs(1 - rate)  # radius of the follower's pitch circle
    if rate < 0:
        return driver - radius * towards, -1j * towards, towards
    if rate < 1:  # the follower is a ring: its flank normal is opposite
        return driver - radius * towards, -1j * towards, -towards
    return driver + radius * towards, 1j * towards, -towards


def _body(frame: Frame, end: End, carrier: int) -> tuple[int, int]:
    """Link that carries the teeth, and the sign of its motion relative to the coordinate."""
    on, link = frame.motion.mechanism.ends(end)
    return (link, 1) if on == carrier else (on, -1)


def _point(frame: Frame, end: End, body: int) -> Complexes:
    """Position of a body's joint [m], complex."""
    mechanism = frame.motion.mechanism
    if end.turns:
        return position_of(frame.motion, body, end.joint)
    slider = mechanism.slider(end.joint)
    return position_of(frame.motion, mechanism.index[slider.link], slider.point)


def _place(frame: Frame, end: End, body: int) -> FramePlace | None:
    if end.turns:
        return frame.place(body, end.joint)
    side = frame.sides[end.joint][frame.motion.mechanism.ends(end).index(body)]
    assert not isinstance(side, tuple)  # racks run on the ground
    return side
