"""Export of mechanisms to Linkage, version 3."""

from collections.abc import Mapping
from xml.etree import ElementTree

from exchange.foreign_mechanism import GROUND, Drive, ExchangeError, ForeignGear, ForeignMechanism, Slot
from exchange.linkage2 import SOURCE

# maps the unit of the mechanism to the unit of the exported file, and to the factor for the conversion of lengths
WRITTEN = {"mm": ("Millimeters", 1.0), "cm": ("Millimeters", 10.0), "m": ("Millimeters", 1e3), "in": ("Inches", 1.0)}
MARGIN = 0.05  # each end of a slot is MARGIN * (travel of the pin) beyond the travel of the pin


def linkage2_text(drawing: ForeignMechanism) -> str:
    """Return the text of a Linkage file with the connectors, links, slots, inputs and ratios of the mechanism.

    Raises
    ------
    ExchangeError
        If the mechanism has no drive, or if Linkage does not support a part that affects the motion.
    """
    drives = _drives(drawing)
    if drawing.slides:
        raise ExchangeError(f"{SOURCE} does not support links that slide without turning")
    units, scale = WRITTEN[drawing.unit]
    root = ElementTree.Element("linkage2")
    look = {"zoom": "1", "xoffset": "0", "yoffset": "0", "scalefactor": "1", "units": units}
    ElementTree.SubElement(root, "program", look)
    members = {name: list(body.points) for name, body in drawing.links.items()}
    places, fixed = dict(drawing.points), {*drawing.ground}
    for joint in (joint for gear in drawing.gears for joint in (gear.driver, gear.follower)):
        axle, points = joint.get("at", ""), members.get(joint.get("link", ""), [])
        if axle in points:  # the axle is the first point, because in Linkage a wheel turns about its first connector
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
    # driven links come first in the file, because an input of Linkage drives the first listed link at the pin of the
    # input
    first = {drive.joint["link"] for drive in drives}
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
    """Return whether the follower of a gear rolls on a fixed wheel. The driver is then the carrier of the follower."""
    return gear.driver.get("on", GROUND) == GROUND and gear.follower.get("on") == gear.driver.get("link")


def _fixed_wheels(drawing: ForeignMechanism, members: dict[str, list[str]]) -> dict[str, str]:
    """Add two links to `members` for each fixed wheel: the wheel, and an anchor at a fixed point.

    Return this point for each wheel, by the name of the wheel.
    """
    anchors = {}
    for axle in (gear.driver["at"] for gear in drawing.gears if _rolls_on_ground(gear)):
        anchor = next((point for point in drawing.ground if point != axle), axle)
        members |= {f"{axle} wheel": [axle], f"{axle} anchor": [anchor]}
        anchors[f"{axle} wheel"] = anchor
    return anchors


def _slot_limits(
    drawing: ForeignMechanism, members: dict[str, list[str]], places: dict[str, complex], fixed: set[str]
) -> dict[str, list[str]]:
    """Return the names of both ends of each slot, by pin name. Add the ends to `members`, `places` and `fixed`."""
    limits: dict[str, list[str]] = {}
    for name, slot in drawing.slots.items():
        if slot.point in limits:
            raise ExchangeError(f'{SOURCE} does not support a pin in two slots, such as "{slot.point}"')
        ends = limits[slot.point] = [f"{name} {number}" for number in (1, 2)]
        places.update(zip(ends, _slot_ends(drawing, slot), strict=True))
        members.setdefault(f"{name} ground" if slot.on == GROUND else slot.on, []).extend(ends)
        fixed |= {*ends} if slot.on == GROUND else set()
        if not any(slot.point in points for points in members.values()):
            # In Linkage, a fixed pin in a moving slot needs a link that contains only this pin.
            members[f"{name} pin"] = [slot.point]
    return limits


def _slot_ends(drawing: ForeignMechanism, slot: Slot) -> tuple[complex, complex]:
    """Return the positions of both ends of a slot that is slightly longer than the travel of its pin.

    If the travel is unknown, the pin may move by the size of the drawing in both directions.
    """
    low, high = slot.travel
    if low == high:
        spans = [abs(one - other) for one in drawing.points.values() for other in drawing.points.values()]
        low, high = -max(spans), max(spans)
    beyond, along = MARGIN * (high - low), slot.direction / abs(slot.direction)
    here = drawing.points[slot.point]
    return here + (low - beyond) * along, here + (high + beyond) * along


def _write_gear(ratios: ElementTree.Element, gear: ForeignGear, key_of: Mapping[str, str]) -> None:
    names, teeth = (gear.driver.get("link", ""), gear.follower.get("link", "")), gear.teeth
    if _rolls_on_ground(gear):  # In Linkage, the driver is the fixed wheel, whereas `gear.driver` is the carrier.
        names, teeth = (f"{gear.driver['at']} wheel", names[1]), gear.ratio > 0
    elif not {*names} <= key_of.keys() or (gear.ratio < 0) != gear.teeth:
        raise ExchangeError(f"{SOURCE} does not support racks and internal gears")
    ratio = ElementTree.SubElement(ratios, "ratio", {"type": "gears" if teeth else "chain"})
    for name, size in zip(names, (abs(gear.ratio), 1.0), strict=True):
        ElementTree.SubElement(ratio, "link", {"id": key_of[name], "size": f"{size:.12g}"})


def _input(drive: Drive) -> dict[str, str]:
    """Return the attributes of an input (driven connector). In Linkage, clockwise speeds are positive."""
    keys = {"input": "true", "rpm": f"{-drive.mean_speed:.12g}"}
    if not drive.strokes:
        return keys
    swing = max(map(abs, drive.strokes))
    return keys | {"limitangle": f"{swing:.12g}", "startoffset": f"{swing - abs(drive.strokes[0]):.12g}"}


def _drives(drawing: ForeignMechanism) -> tuple[Drive, ...]:
    """Return the drives, or raise ExchangeError if Linkage does not support them."""
    if not drawing.drives:
        raise ExchangeError(f"{SOURCE} needs a drive")
    for drive in drawing.drives:
        joint = drive.joint
        if "at" not in joint or joint.get("on", GROUND) != GROUND or (drive.speed is None and not drive.law):
            name = joint.get("slider") or joint.get("link")
            raise ExchangeError(
                f'{SOURCE} supports only constant speeds and swings about fixed pins, but "{name}" is driven otherwise'
            )
        pin = joint["at"]
        other = next((name for name, body in drawing.links.items() if pin in body.points and name != joint["link"]), "")
        if other:
            raise ExchangeError(f'{SOURCE} drives all links at a pin, but "{other}" turns freely at "{pin}"')
    return drawing.drives
