"""Files of Linkage, version 2 and 3 (.linkage2): XML of connectors, links and ratios."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from xml.etree import ElementTree

from exchange.drawing import GROUND, Body, Drawing, Drive, ExchangeError, Gear, Names, Slide, Slot, link_with, turns_of

SOURCE = "Linkage"
UNITS = {"inches": "in", "millimeters": "mm"}
BESIDE = 1 << 0  # layer of what is drawn beside the mechanism
WRITTEN = {"mm": ("Millimeters", 1.0), "cm": ("Millimeters", 10.0), "m": ("Millimeters", 1e3), "in": ("Inches", 1.0)}
BEYOND = 0.05  # of a slot's travel: how much longer the slot is at either end
TURNS = 15.0  # rpm, Linkage's own default
NEAR = 1e-3  # of a slot's length: how far from its line a pin may be drawn


@dataclass(frozen=True)
class Connector:
    """A connector: its name in the scene, place, whether it is fixed, driven, traced, and between which it slides."""

    name: str
    place: complex
    fixed: bool
    turns: float | None
    traced: bool
    limits: tuple[str, ...]
    arc: float


@dataclass
class _Reading:
    """Parts of the scene read so far: connectors by their numbers, links of the file by a key."""

    connectors: dict[str, Connector]
    unit: str
    called: Names = field(default_factory=lambda: Names(["ground"]))
    members: dict[str, tuple[str, ...]] = field(default_factory=dict)
    link_of: dict[str, str] = field(default_factory=dict)
    points: dict[str, complex] = field(default_factory=dict)
    links: dict[str, Body] = field(default_factory=dict)
    slots: dict[str, Slot] = field(default_factory=dict)
    slides: dict[str, Slide] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def of_linkage2(text: str, title: str) -> Drawing:
    """The mechanism in a file of Linkage.

    Raises
    ------
    ExchangeError
        It is none.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ExchangeError("a document type in it, which files of Linkage have not")
    try:
        return _drawing(ElementTree.fromstring(text), title)
    except (ElementTree.ParseError, KeyError, ValueError, StopIteration) as error:
        raise ExchangeError(f"no file of Linkage that can be read: {error!r}") from None


def _drawing(root: ElementTree.Element, title: str) -> Drawing:
    program = root.find("program")
    names = Names()
    read = _Reading(
        {each.attrib["id"]: _connector(each, names) for each in root.findall("connector") if _moves(each)},
        UNITS.get("" if program is None else program.get("units", "").lower(), "mm"),
    )
    read.points.update({each.name: each.place for each in read.connectors.values()})
    fixed = tuple(each.name for each in read.connectors.values() if each.fixed)
    wheels = {each.attrib["id"] for each in root.iterfind("ratios/ratio/link")}
    actuators = _read_links(read, root, wheels)
    for key in read.connectors:
        _read_slot(read, key)
    drives = [*_turning(read), *(_cylinder(read, key, each) for key, each in actuators.items())]
    gears = tuple(_gears(read, root, fixed))
    used = {name for body in read.links.values() for name in body.points} | {*fixed}
    traced = next(
        (each.name for each in read.connectors.values() if each.traced and each.name in used and not each.fixed), ""
    )
    places = {name: place for name, place in read.points.items() if name in used}
    return Drawing(
        title, SOURCE, read.unit, places, fixed, read.links, read.slots, read.slides, tuple(drives), gears, traced,
        tuple(read.notes),
    )  # fmt: skip


def _moves(each: ElementTree.Element) -> bool:
    """Whether a connector is of the mechanism, not of the drawings and measures beside it."""
    return not int(each.get("layer") or 0) & BESIDE and each.get("measurementelement") != "true"


def _connector(each: ElementTree.Element, names: Names) -> Connector:
    limits = tuple(limit.attrib["id"] for limit in each.findall("slidelimit")) if each.get("slider") == "true" else ()
    return Connector(
        names(each.attrib["id"], each.get("name") or f"P{each.attrib['id']}"),
        complex(float(each.attrib["x"]), float(each.attrib["y"])),
        each.get("anchor") == "true",
        float(each.get("rpm") or TURNS) if each.get("input") == "true" else None,
        each.get("draw") == "true",
        limits[:2],
        float(each.get("slideradius") or 0),
    )


def _read_links(read: _Reading, root: ElementTree.Element, wheels: set[str]) -> dict[str, ElementTree.Element]:
    """Read the links; those of fixed connectors alone are of the ground. The actuators, by their keys."""
    actuators = {}
    for number, each in enumerate((*root.findall("Link"), *root.findall("element"))):
        connectors = tuple(c.attrib["id"] for c in each.findall("connector") if c.attrib["id"] in read.connectors)
        if not connectors or not _moves(each):
            continue
        key = f"{each.get('id')} {number}"  # the files give a number twice now and then
        read.members[key] = connectors
        if each.get("fastenlink") or each.find("fastenconnector") is not None:
            read.notes.append(
                f"link {each.get('id')} is fastened to another, which is left out: a [welds] table does it"
            )
        if each.get("actuator") == "true":
            actuators[key] = each
        elif all(read.connectors[c].fixed for c in connectors) and not (
            len(connectors) == 1 and each.get("id") in wheels
        ):
            read.link_of[key] = "ground"
        else:
            name = read.link_of[key] = read.called(key, each.get("name") or f"link_{each.get('id')}")
            read.links[name] = Body(tuple(read.connectors[c].name for c in connectors))
    return actuators


def _read_slot(read: _Reading, key: str) -> None:
    """Read where a connector slides: a fixed one in the moving link of its limits, any other as the pin of its link."""
    pin = read.connectors[key]
    if len(pin.limits) != 2:
        return
    start, end = (read.connectors[limit] for limit in pin.limits)
    on = next(
        (
            read.link_of[link]
            for link, members in read.members.items()
            if {*pin.limits} <= {*members} and link in read.link_of
        ),
        "",
    )
    if not on and start.fixed and end.fixed:
        on = "ground"
    mine = [read.link_of[link] for link, members in read.members.items() if key in members and link in read.link_of]
    link = "ground" if pin.fixed else next((name for name in mine if name not in (on, "ground")), "")
    along = end.place - start.place
    across = ((pin.place - start.place) * along.conjugate()).imag / abs(along) ** 2 if along else 1.0
    for wrong, why in (
        (pin.arc, "along an arc: a link from the arc's centre does it"),
        (not on or not link or link == on, "between points of two links"),
        (abs(across) > NEAR, "beside its line"),
    ):
        if wrong:
            read.notes.append(f"{pin.name} slides {why}, which is left out")
            return
    read.points[pin.name] -= 1j * across * along
    read.slots[f"slot_{pin.name}"] = Slot(pin.name, link, on, along)
    if on != "ground":
        body, brace = read.links[on], (start.name, end.name)
        beside = abs(body.points.index(brace[0]) - body.points.index(brace[1])) != 1
        if beside and brace not in body.braces:
            read.links[on] = replace(body, braces=(*body.braces, brace))


def _turning(read: _Reading) -> Iterator[Drive]:
    """Drives of the connectors that are inputs, each of the first link that has it."""
    for connector in read.connectors.values():
        link = link_with(read.links, connector.name)
        if connector.turns is not None and link is not None:
            yield Drive({"link": link, "at": connector.name}, f"{connector.turns:g} rpm")


def _cylinder(read: _Reading, key: str, each: ElementTree.Element) -> Drive:
    """The barrel, the rod, the slider and the drive of an actuator, which goes out by its throw and back."""
    first, last = (read.connectors[number] for number in (read.members[key][0], read.members[key][-1]))
    name = read.called(key, f"cylinder_{key.split(maxsplit=1)[0]}")
    head, tip = f"{name}_head", f"{name}_tip"
    read.points[head] = first.place + 0.6 * (last.place - first.place)
    read.points[tip] = first.place + 0.4 * (last.place - first.place)
    rod = read.called(f"{key} rod", f"{name}_rod")
    read.links[name] = Body((first.name, head), rigid=True)
    read.links[rod] = Body((last.name, tip))
    read.slides[f"{name}_slide"] = Slide(rod, name, last.name, last.place - first.place)
    half, throw = 30 / float(each.get("cpm") or TURNS), float(each.get("throw") or 0)
    read.notes.append(f"{name} starts as drawn, goes out by {throw:g} {read.unit} and back: its start is assumed")
    ways = (throw, -throw)
    law = tuple({"curve": "harmonic", "duration": f"{half:g} s", "by": f"{by:g} {read.unit}"} for by in ways)
    return Drive({"slider": f"{name}_slide"}, law=law)


def _gears(read: _Reading, root: ElementTree.Element, fixed: tuple[str, ...]) -> Iterator[Gear]:
    """Wheels by the ratio of their sizes."""
    link_of = {key.split()[0]: name for key, name in reversed(read.link_of.items())}
    for ratio in root.iterfind("ratios/ratio"):
        wheels = [(link_of.get(each.get("id", ""), ""), float(each.get("size") or 0)) for each in ratio.findall("link")]
        if len(wheels) != 2 or any(name not in read.links or size <= 0 for name, size in wheels):
            read.notes.append("a gear between links that are not known is left out")
            continue
        (first, size), (second, other) = wheels
        teeth = ratio.get("type") == "gears"
        yield Gear(_axle(read, first, fixed), _axle(read, second, fixed), (-size if teeth else size) / other, teeth)


def _axle(read: _Reading, name: str, fixed: tuple[str, ...]) -> dict[str, str]:
    """The pin about which a wheel turns: on the ground, or else on the first other link that has a point of it."""
    points = read.links[name].points
    for point in points:
        if point in fixed:
            return {"link": name, "at": point}
    others = (
        (other, point)
        for point in points
        for other, body in read.links.items()
        if other != name and point in body.points
    )
    other, at = next(others)
    return {"link": name, "on": other, "at": at}


def linkage2_text(drawing: Drawing) -> str:
    """The mechanism as a file of Linkage: connectors, links, slots between two connectors, inputs, gears and chains.

    Raises
    ------
    ExchangeError
        It has parts that Linkage does not know, without which it would move otherwise.
    """
    turns = turns_of(drawing, SOURCE)
    if drawing.slides:
        raise ExchangeError(f"{SOURCE} has no place for a link that slides without turning")
    units, scale = WRITTEN[drawing.unit]
    root = ElementTree.Element("linkage2")
    look = {"zoom": "1", "xoffset": "0", "yoffset": "0", "scalefactor": "1", "units": units}
    ElementTree.SubElement(root, "program", look)
    members = {name: list(body.points) for name, body in drawing.links.items()}
    places, limits = dict(drawing.points), {}
    fixed = {*drawing.ground}
    for name, slot in drawing.slots.items():
        ends = _slot_ends(drawing, slot)
        limits[slot.point] = [f"{name} {number}" for number in (1, 2)]
        places.update(zip(limits[slot.point], ends, strict=True))
        members.setdefault(f"{name} ground" if slot.on == GROUND else slot.on, []).extend(limits[slot.point])
        fixed |= {*limits[slot.point]} if slot.on == GROUND else set()
    number = {
        name: str(at) for at, name in enumerate(name for name in places if any(name in of for of in members.values()))
    }
    speeds = {at: turn for _, at, turn in turns}
    for name, key in number.items():
        place = scale * places[name]
        keys = {
            "id": key,
            "x": f"{round(place.real, 9) + 0.0:.12g}",
            "y": f"{round(place.imag, 9) + 0.0:.12g}",
            "layer": "0",
        }
        if name in drawing.points:
            keys["name"] = name
        if name in fixed:
            keys["anchor"] = "true"
        if name in speeds:
            keys |= {"input": "true", "rpm": f"{speeds[name]:.12g}"}
        if name == drawing.traced:
            keys["draw"] = "true"
        connector = ElementTree.SubElement(root, "connector", keys | ({"slider": "true"} if name in limits else {}))
        for limit in limits.get(name, ()):
            ElementTree.SubElement(connector, "slidelimit", {"id": number[limit]})
    first = {link for link, _, _ in turns}  # the driven link of a connector is the first that has it
    key_of = {name: str(at) for at, name in enumerate(sorted(members, key=lambda link: link not in first), 1)}
    for name, key in key_of.items():
        link = ElementTree.SubElement(root, "Link", {"id": key, "layer": "0", "name": name})
        for point in members[name]:
            ElementTree.SubElement(link, "connector", {"id": number[point]})
    if drawing.gears:
        ratios = ElementTree.SubElement(root, "ratios")
        for gear in drawing.gears:
            _write_gear(ratios, gear, key_of)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _slot_ends(drawing: Drawing, slot: Slot) -> tuple[complex, complex]:
    """The places between which a pin slides, as drawn: a little beyond its travel."""
    low, high = slot.travel
    if low == high:
        spans = [abs(one - other) for one in drawing.points.values() for other in drawing.points.values()]
        low, high = -max(spans), max(spans)
    beyond, along = BEYOND * (high - low), slot.direction / abs(slot.direction)
    here = drawing.points[slot.point]
    return here + (low - beyond) * along, here + (high + beyond) * along


def _write_gear(ratios: ElementTree.Element, gear: Gear, key_of: dict[str, str]) -> None:
    names = gear.driver.get("link", ""), gear.follower.get("link", "")
    if not {*names} <= key_of.keys() or (gear.ratio < 0) != gear.teeth:
        raise ExchangeError(f"{SOURCE} has no place for a rack, or for teeth that mesh from within")
    ratio = ElementTree.SubElement(ratios, "ratio", {"type": "gears" if gear.teeth else "chain"})
    for name, size in zip(names, (abs(gear.ratio), 1.0), strict=True):
        ElementTree.SubElement(ratio, "link", {"id": key_of[name], "size": f"{size:.12g}"})
