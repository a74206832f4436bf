"""Gears of a scene: ratios between the coordinates of joints, and teeth."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

from kinelast.scene.drives import moved_joint
from kinelast.scene.error import fault
from kinelast.scene.format import SceneTable
from kinelast.scene.format_motion import GearTable
from rigid import Gear, Link, Slider

UNITS = {(True, True): "rad/rad", (True, False): "m/rad", (False, True): "rad/m", (False, False): "rad/rad"}


def build_gears(scene: SceneTable, links: Mapping[str, Link], sliders: Mapping[str, Slider]) -> tuple[Gear, ...]:
    """All gears, in the order of the file."""
    gears = []
    for number, table in enumerate(scene.gears, 1):
        where = f"gears[{number}]"
        driver = moved_joint(where, "driver.", table.driver, links, sliders)
        follower = moved_joint(where, "follower.", table.follower, links, sliders)
        unit = UNITS[driver.turns, follower.turns]
        if table.ratio.unit not in ("", unit):
            expected = {"rad/rad": "a number", "m/rad": 'as in "20 mm/rad"', "rad/m": 'as in "50 rad/m"'}[unit]
            raise fault(where, "ratio", f"expected {expected}, got {float(table.ratio):g} {table.ratio.unit}")
        if not table.ratio:
            raise fault(where, "ratio", "expected a number that is not zero")
        gears.append(Gear(driver, follower, float(table.ratio), _pressure_angle(where, table)))
    return tuple(gears)


def _pressure_angle(where: str, table: GearTable) -> float | None:
    """Of a gear's teeth [rad]; None where it has none."""
    if not table.teeth:
        if table.pressure_angle is not None:
            raise fault(where, "pressure_angle", "belongs to teeth: leave it out, or teeth = false")
        return None
    if table.pressure_angle is None:
        return Gear.pressure_angle
    angle = float(table.pressure_angle)
    if not 0 <= angle < pi / 2:
        expected = 'expected an angle from 0 to less than 90 deg, as in "20 deg"'
        raise fault(where, "pressure_angle", f"{expected}, got {angle:g} rad")
    return angle
