"""Joint coordinates to which drives, gears and end stops refer."""

from collections.abc import Mapping
from typing import Any

from kinelast.scene.tables import JointNameTable
from kinelast.values.error import fault, known_name, likely
from kinelast.values.numbers import require_unit
from kinelast.values.quantities import AngleOrLength
from rigid import GROUND, Link, PinDrive, Slider, SliderDrive

Drive = PinDrive | SliderDrive


def moved_joint(
    where: str, inside: str, table: JointNameTable, links: Mapping[str, Link], sliders: Mapping[str, Slider]
) -> Drive:
    """Return the joint to which a table refers. In messages, `inside` precedes the names of keys."""
    if not table.unique:
        raise fault(where, f"{inside}link", "expected either link or slider")
    if table.turns:
        return _pin(where, inside, table, links)
    for key in ("at", "on"):
        if getattr(table, key) not in (None, GROUND):
            raise fault(where, inside + key, "belongs to a link: [sliders] already names the link that guides a slider")
    known_name(where, f"{inside}slider", table.name, sliders, "slider")
    return SliderDrive(table.name)


def _pin(where: str, inside: str, table: JointNameTable, links: Mapping[str, Link]) -> PinDrive:
    """Return the pin of a rotating link: the pin `at` or, by default, the only pin that the two links share."""
    link = table.name
    known_name(where, f"{inside}link", link, links)
    known_name(where, f"{inside}on", table.on, links)
    if link == GROUND:
        problem = "the ground cannot be moved: give the moving link here, and ground under on"
        raise fault(where, f"{inside}link", problem)
    if link == table.on:
        raise fault(where, f"{inside}on", f'the link "{link}" cannot turn on itself')
    shared = [point for point in links[link].points if point in links[table.on].points]
    both = f'the links "{link}" and "{table.on}" share'
    if not shared:
        raise fault(where, f"{inside}on", f"{both} no point: no pin to turn about")
    if table.at is None and len(shared) > 1:
        pins = ", ".join(f'"{point}"' for point in shared)
        raise fault(where, f"{inside}at", f"{both} {pins}: name one of them")
    if table.at is not None and table.at not in shared:
        raise fault(where, f"{inside}at", f'{both} no point "{table.at}"{likely(table.at, shared)}')
    return PinDrive(link, table.at or shared[0], table.on)


def coordinate(where: str, key: str, value: AngleOrLength, unit: str) -> Any:
    """Return a coordinate in SI units, rad or m."""
    require_unit(where, key, value, unit)
    return value.within(unit)
