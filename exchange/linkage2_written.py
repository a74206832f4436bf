"""Mechanisms written for Linkage, version 3."""

from collections.abc import Mapping
from xml.etree import ElementTree

from exchange.drawing import GROUND, Drive, ExchangeError, ForeignGear, ForeignMechanism, Slot
from exchange.linkage2 import SOURCE

WRITTEN = {"mm": ("Millimeters", 1.0), "cm": ("Millimeters", 10.0), "m": ("Millimeters", 1e3), "in": ("Inches", 1.0)}
MARGIN = 0.05  # extra length of a slot at each end / travel of the pin


def linkage2_text(drawing: ForeignMechanism) -> str:
    """Return the mechanism as a file of Linkage: connectors, links, slots between two connectors, inputs, ratios.

    Raises
    ------
    ExchangeError
        Linkage does not support some part, and the mechanism would move differently without it.
    """
    drives = _drives(drawing)
    if drawing.slides:
        raise ExchangeError(f"{SOURCE} has no place for a link that slides without turning")
    units, scale = WRITTEN[drawing.unit]
    root = ElementTree.Element("linkage2")
    look = {"zoom": "1", "xoffset": "0", "yoffset": "0", "scalefactor": "1", "units": units}
    ElementTree.SubElement(root, "program", look)
    members = {name: list(body.points) for name, body in drawing.links.items()}
    places, fixed = dict(drawing.points), {*drawing.ground}
    for joint in (joint for gear in drawing.gears for joint in (gear.driver, gear.follower)):
        axle, points = joint.get("at", ""), members.get(joint.get("link", ""), [])
        if axle in points:  # a wheel of Linkage turns about its first connector
            members[joint["link"]] = [axle, *(point for point in points if point != axle)]
    suns = _fixed_wheels(drawing, members)
    limits = _slot_limits(drawing, members, places, fixed)
    used = [name for name in places if any(name in points for points in members.values())]
    number = {name: str(at) for at, name in enumerate(used)}
    drive_of = {drive.joint["at"]: drive for drive in drives}
    for name, key in number.items():
        place = scale * places[name]
        keys = {"id": key, "x": _decimal(place.real), "y": _decimal(place.imag), "layer": "0"}
        flags = {"anchor": name in fixed, "draw": name == drawing.traced, "slider": name in limits}
        keys |= {"name": name} if name in drawing.points else {}
        keys |= {flag: "true" for flag, on in flags.items() if on}
        keys |= _input(drive_of[name]) if name in drive_of else {}
        connector = ElementTree.SubElement(root, "connector", keys)
        for limit in limits.get(name, ()):
            ElementTree.SubElement(connector, "slidelimit", {"id": number[limit]})
    first = {drive.joint["link"] for drive in drives}  # the driven link of a connector is the first there
    key_of = {name: str(at) for at, name in enumerate(sorted(members, key=lambda link: link not in first), 1)}
    for name, key in key_of.items():
        fastened = {"fastenconnector": number[suns[name]]} if name in suns else {}
        link = ElementTree.SubElement(root, "Link", {"id": key, "layer": "0", "name": name, **fastened})
        for point in members[name]:
            ElementTree.SubElement(link, "connector", {"id": number[point]})
    if drawing.gears:
        ratios = ElementTree.SubElement(root, "ratios")
        for gear in drawing.gears:
            _write_gear(ratios, gear, key_of)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _decimal(value: float) -> str:
    return f"{round(value, 9) + 0.0:.12g}"


def _rolls_on_ground(gear: ForeignGear) -> bool:
    """True if the driver of a gear is the carrier of its follower, which rolls on a fixed wheel."""
    return gear.driver.get("on", GROUND) == GROUND and gear.follower.get("on") == gear.driver.get("link")


def _fixed_wheels(drawing: ForeignMechanism, members: dict[str, list[str]]) -> dict[str, str]:
    """Add a link for each fixed wheel to the members. Return the fixed points to which they are fastened, by name."""
    anchors = {}
    for axle in (gear.driver["at"] for gear in drawing.gears if _rolls_on_ground(gear)):
        anchor = next((point for point in drawing.ground if point != axle), axle)
        members |= {f"{axle} wheel": [axle], f"{axle} anchor": [anchor]}
        anchors[f"{axle} wheel"] = anchor
    return anchors


def _slot_limits(
    drawing: ForeignMechanism, members: dict[str, list[str]], places: dict[str, complex], fixed: set[str]
) -> dict[str, list[str]]:
    """Ends of every slot, by its pin. Adds them to the members, places and fixed points."""
    limits: dict[str, list[str]] = {}
    for name, slot in drawing.slots.items():
        if slot.point in limits:
            raise ExchangeError(f'{SOURCE} has no place for a pin, "{slot.point}", in two slots')
        ends = limits[slot.point] = [f"{name} {number}" for number in (1, 2)]
        places.update(zip(ends, _slot_ends(drawing, slot), strict=True))
        members.setdefault(f"{name} ground" if slot.on == GROUND else slot.on, []).extend(ends)
        fixed |= {*ends} if slot.on == GROUND else set()
        if not any(slot.point in points for points in members.values()):
            members[f"{name} pin"] = [slot.point]  # a fixed pin in a moving slot is a link there
    return limits


def _slot_ends(drawing: ForeignMechanism, slot: Slot) -> tuple[complex, complex]:
    """Positions at which to draw a slot's two ends, a little beyond the pin's travel."""
    low, high = slot.travel
    if low == high:
        spans = [abs(one - other) for one in drawing.points.values() for other in drawing.points.values()]
        low, high = -max(spans), max(spans)
    beyond, along = MARGIN * (high - low), slot.direction / abs(slot.direction)
    here = drawing.points[slot.point]
    return here + (low - beyond) * along, here + (high + beyond) * along


def _write_gear(ratios: ElementTree.Element, gear: ForeignGear, key_of: Mapping[str, str]) -> None:
    names, teeth = (gear.driver.get("link", ""), gear.follower.get("link", "")), gear.teeth
    if _rolls_on_ground(gear):  # relative to its carrier, a wheel on a fixed one turns the other way
        names, teeth = (f"{gear.driver['at']} wheel", names[1]), gear.ratio > 0
    elif not {*names} <= key_of.keys() or (gear.ratio < 0) != gear.teeth:
        raise ExchangeError(f"{SOURCE} has no place for a rack, or for teeth that mesh from within")
    ratio = ElementTree.SubElement(ratios, "ratio", {"type": "gears" if teeth else "chain"})
    for name, size in zip(names, (abs(gear.ratio), 1.0), strict=True):
        ElementTree.SubElement(ratio, "link", {"id": key_of[name], "size": f"{size:.12g}"})


def _input(drive: Drive) -> dict[str, str]:
    """Attributes of an input connector; clockwise speeds are positive."""
    keys = {"input": "true", "rpm": f"{-drive.mean_speed:.12g}"}
    if not drive.law:
        return keys
    swing = max(map(abs, drive.strokes))
    return keys | {"limitangle": f"{swing:.12g}", "startoffset": f"{swing - abs(drive.strokes[0]):.12g}"}


def _drives(drawing: ForeignMechanism) -> tuple[Drive, ...]:
    """Return the drives: Linkage has constant speeds and swings about fixed pins."""
    if not drawing.drives:
        raise ExchangeError(f"{SOURCE} wants a drive")
    for drive in drawing.drives:
        joint = drive.joint
        if "at" not in joint or joint.get("on", GROUND) != GROUND or (drive.speed is None and not drive.law):
            name = joint.get("slider") or joint.get("link")
            raise ExchangeError(
                f'{SOURCE} has constant speeds and swings about fixed pins, and "{name}" is driven otherwise'
            )
        pin = joint["at"]
        other = next((name for name, body in drawing.links.items() if pin in body.points and name != joint["link"]), "")
        if other:
            raise ExchangeError(f'{SOURCE} drives all links at a pin, but "{other}" turns freely at "{pin}"')
    return drawing.drives
