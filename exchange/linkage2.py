"""Import of mechanisms from the program Linkage, versions 2 and 3: XML files (.linkage2) with connectors and links."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import sqrt
from xml.etree import ElementTree

from msgspec import Struct
from msgspec.structs import replace

from exchange.foreign_mechanism import (
    GROUND,
    Drive,
    ExchangeError,
    ForeignGear,
    ForeignLink,
    ForeignMechanism,
    ForeignSlider,
    Names,
    Slot,
    link_with,
    to_and_fro,
)

SOURCE = "Linkage"
UNITS = {"inches": "in", "millimeters": "mm"}
DRAWN_ONLY = 1 << 0  # bit of a layer number: drawings and dimensions, which are not part of the mechanism
TURNS = 15.0  # default speed of a rotating input [rpm] and of an actuator [cycles per minute] in Linkage
MAX_OFFSET = 1e-3  # (largest accepted distance between a pin and the centre line of its slot) / (length of the slot)
MAX_ARC_OFFSET = 0.02  # (largest accepted distance between a pin and the arc of its curved slot) / (radius of the slot)
LIGHT = 1e-6  # [kg] mass of the link that replaces a curved slot
# Pattern of an attribute without a space before the next attribute. Linkage allows such attributes, but XML does not.
TOUCHING = re.compile(r'(="[^"]*")(?=[A-Za-z_])')


class Connector(Struct, frozen=True):
    """Connector of Linkage.

    `turns` is the counter-clockwise speed [rpm] of an input (driven connector), or None for any other connector. An
    input with a `swing` [deg] oscillates by this angle. The motion starts `offset` [deg] after the beginning of the
    first stroke. If `offset` exceeds `swing`, the motion starts in the return stroke.

    If the connector slides in a slot, `limits` contains the numbers of the connectors at both ends of the slot;
    otherwise, `limits` is empty. `radius` is the radius of a curved slot, or 0 for a straight slot.
    """

    name: str
    place: complex
    fixed: bool
    turns: float | None
    swing: float
    offset: float
    traced: bool
    limits: tuple[str, ...]
    radius: float


@dataclass
class _LinkageReading:
    """State of the import: connectors of the file by number, and parts of the mechanism.

    Each link of the file has a key. For each key, `members` contains the connectors of the link, and `link_of` contains
    the name of the link in the scene file.
    """

    connectors: dict[str, Connector]
    unit: str
    called: Names = field(default_factory=lambda: Names([GROUND]))
    members: dict[str, tuple[str, ...]] = field(default_factory=dict)
    link_of: dict[str, str] = field(default_factory=dict)
    points: dict[str, complex] = field(default_factory=dict)
    fixed: list[str] = field(default_factory=list)
    links: dict[str, ForeignLink] = field(default_factory=dict)
    slots: dict[str, Slot] = field(default_factory=dict)
    slides: dict[str, ForeignSlider] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def of_linkage2(text: str, title: str) -> ForeignMechanism:
    """Return the mechanism in a file of Linkage.

    Raises
    ------
    ExchangeError
        If the file is damaged or comes from another program.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ExchangeError("the file has a document type, which files of Linkage do not have")
    try:
        root = ElementTree.fromstring(TOUCHING.sub(r"\1 ", text))
    except ElementTree.ParseError as error:
        raise ExchangeError(f"this file of Linkage is damaged: {error}") from None
    program = root.find("program")
    names = Names()
    read = _LinkageReading(
        {each.attrib["id"]: _connector(each, names) for each in root.findall("connector") if _moves(each)},
        UNITS.get("" if program is None else program.get("units", "").lower(), "mm"),
    )
    read.points.update({each.name: each.place for each in read.connectors.values()})
    read.fixed += [each.name for each in read.connectors.values() if each.fixed]
    wheels = {each.attrib["id"] for each in root.iterfind("ratios/ratio/link")}
    actuators = _read_links(read, root, wheels)
    for key in read.connectors:
        _read_slot(read, key)
    drives = [*_turning(read), *(_cylinder(read, key, each) for key, each in actuators.items())]
    gears = _driven_first(list(_gears(read, root)), [drive.joint for drive in drives])
    used = {name for body in read.links.values() for name in body.points} | {*read.fixed}
    traced = next(
        (each.name for each in read.connectors.values() if each.traced and each.name in used and not each.fixed), ""
    )
    places = {name: place for name, place in read.points.items() if name in used}
    return ForeignMechanism(
        title, SOURCE, read.unit, places, tuple(read.fixed), read.links, read.slots, read.slides, tuple(drives), gears,
        traced, notes=tuple(read.notes),
    )  # fmt: skip


def _moves(each: ElementTree.Element) -> bool:
    """Return whether a connector or link belongs to the mechanism, and not to a drawing or dimension."""
    return not int(each.get("layer") or 0) & DRAWN_ONLY and each.get("measurementelement") != "true"


def _connector(each: ElementTree.Element, names: Names) -> Connector:
    limits = tuple(limit.attrib["id"] for limit in each.findall("slidelimit")) if each.get("slider") == "true" else ()
    name = (each.get("name") or "").strip()
    return Connector(
        names(each.attrib["id"], name or f"P{each.attrib['id']}"),
        complex(float(each.attrib["x"]), float(each.attrib["y"])),
        each.get("anchor") == "true",
        -float(each.get("rpm") or TURNS)
        if each.get("input") == "true"
        else None,  # clockwise speeds are positive in Linkage
        float(each.get("limitangle") or 0),
        float(each.get("startoffset") or 0),
        each.get("draw") == "true",
        limits[:2],
        float(each.get("slideradius") or 0),
    )


def _read_links(read: _LinkageReading, root: ElementTree.Element, wheels: set[str]) -> dict[str, ElementTree.Element]:
    """Read the links, merge links that are fastened together, and return the actuators by key."""
    actuators: dict[str, ElementTree.Element] = {}
    elements: dict[str, ElementTree.Element] = {}
    for number, each in enumerate((*root.findall("Link"), *root.findall("element"))):
        names = [c.attrib["id"] for kind in ("connector", "fastenconnector") for c in each.findall(kind)]
        connectors = tuple(name for name in names if name in read.connectors)
        if connectors and _moves(each):
            # The key contains the position in the file, because some files use the same number for two links.
            key = f"{each.get('id')} {number}"
            read.members[key] = connectors
            (actuators if each.get("actuator") == "true" else elements)[key] = each
    for keys, grounded in _fastened(read, elements):
        connectors = tuple(dict.fromkeys(c for key in keys for c in read.members[key]))
        wheel = len(keys) == 1 and len(connectors) == 1 and elements[keys[0]].get("id") in wheels
        if grounded or (all(read.connectors[c].fixed for c in connectors) and not wheel):
            read.link_of |= dict.fromkeys(keys, GROUND)
            continue
        first = elements[keys[0]]
        name = read.called(keys[0], (first.get("name") or "").strip() or f"link_{first.get('id')}")
        read.link_of |= dict.fromkeys(keys, name)
        read.links[name] = ForeignLink(tuple(read.connectors[c].name for c in connectors))
    return actuators


def _fastened(read: _LinkageReading, elements: dict[str, ElementTree.Element]) -> list[tuple[list[str], bool]]:
    """Return the groups of fastened links, and whether each group is fastened to the ground.

    The first link of each group is the link with the most connectors. In Linkage, an input (driven pin) turns all links
    at the pin. All links at a driven pin therefore also form a group.
    """
    groups = {key: [key] for key in elements}
    grounded = set()
    driven: dict[str, str] = {}

    def join(key: str, other: str) -> None:
        if groups[other] is not groups[key]:
            groups[other] += groups[key]
            for member in groups[key]:
                groups[member] = groups[other]

    for key, each in elements.items():
        other = next((name for name in elements if name.split()[0] == each.get("fastenlink")), None)
        anchor = read.connectors.get(each.get("fastenconnector", ""))
        fixed = [read.connectors[pin] for pin in read.members[key] if read.connectors[pin].fixed]
        if other is not None:
            join(key, other)
        elif anchor is not None and anchor.fixed:
            grounded.add(key)
        elif len(fixed) == 1 and fixed[0].turns is not None:
            join(key, driven.setdefault(fixed[0].name, key))
        if anchor is not None and not anchor.fixed:
            read.notes.append(f"left out: the fastening of link {each.get('id')} to the moving connector {anchor.name}")
    distinct = {id(keys): keys for keys in groups.values()}.values()
    return [(sorted(keys, key=lambda key: -len(read.members[key])), bool(grounded & {*keys})) for keys in distinct]


def _read_slot(read: _LinkageReading, key: str) -> None:
    """Read the slot of a connector, if the connector slides.

    Either the slot guides the connector, which is a pin of a moving link, or the connector is a fixed pin, and the slot
    moves.
    """
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
        on = GROUND
    mine = [read.link_of[link] for link, members in read.members.items() if key in members and link in read.link_of]
    link = GROUND if pin.fixed else next((name for name in mine if name not in (on, GROUND)), "")
    if not on or not link or link == on:
        read.notes.append(f"left out: {pin.name} slides between points of two links")
    elif pin.radius:
        _read_arc(read, pin, start, end, on)
    else:
        _read_straight(read, pin, start, end, link, on)


def _read_straight(read: _LinkageReading, pin: Connector, start: Connector, end: Connector, link: str, on: str) -> None:
    along = end.place - start.place
    across = ((pin.place - start.place) * along.conjugate()).imag / abs(along) ** 2 if along else 1.0
    if abs(across) > MAX_OFFSET:
        read.notes.append(f"left out: the slot of {pin.name}, because the pin is not on its line")
        return
    read.points[pin.name] -= 1j * across * along
    read.slots[f"slot_{pin.name}"] = Slot(pin.name, link, on, along)
    if on != GROUND:
        read.links[on] = read.links[on].with_beam(start.name, end.name)


def _read_arc(read: _LinkageReading, pin: Connector, start: Connector, end: Connector, on: str) -> None:
    """Replace a curved slot by a link from the centre of the arc to the pin. The motion of the pin does not change."""
    half, radius = (end.place - start.place) / 2, abs(pin.radius)
    if not half or abs(half) > radius * (1 + MAX_ARC_OFFSET):
        read.notes.append(f"left out: the curved slot of {pin.name}, because no arc of its radius joins its ends")
        return
    height = 1j * half / abs(half) * sqrt(max(radius**2 - abs(half) ** 2, 0.0))
    centers = [start.place + half + side * height for side in (1, -1)]
    offset, center = min(((abs(abs(pin.place - each) - radius), each) for each in centers), key=lambda pair: pair[0])
    if offset > MAX_ARC_OFFSET * radius:
        read.notes.append(f"left out: the curved slot of {pin.name}, because the pin is not on its arc")
        return
    owned = read.fixed if on == GROUND else read.links[on].points
    name = next((point for point in owned if abs(read.points[point] - center) < MAX_OFFSET * radius), "")
    if not name:
        name = read.called(f"center {pin.name}", f"center_{pin.name}")
        read.points[name] = center
        if on == GROUND:
            read.fixed.append(name)
        else:
            body = read.links[on]
            read.links[on] = replace(body, points=(*body.points, name))
    read.links[read.called(f"arc {pin.name}", f"arc_{pin.name}")] = ForeignLink((name, pin.name), LIGHT, None, 0.0)
    read.notes.append(f"the curved slot of {pin.name} is replaced by a link from its centre, with the same motion")


def _turning(read: _LinkageReading) -> Iterator[Drive]:
    """Yield the drives of the inputs (driven connectors). Each drive moves the first link at its connector."""
    for connector in read.connectors.values():
        link = link_with(read.links, connector.name)
        if connector.turns is not None and link is not None:
            start = "0 deg" if len(read.links[link].points) == 1 else ""
            joint = {"link": link, "at": connector.name}
            if connector.swing > 0:
                ways = _strokes(connector.swing if connector.turns > 0 else -connector.swing, connector.offset)
                law = to_and_fro(ways, abs(connector.turns) * 6, "deg")
                read.notes.append(f"{link} swings by {connector.swing:g} deg, here with a smooth start and stop")
                yield Drive(joint, law=law, start=start)
            else:
                yield Drive(joint, f"{connector.turns:g} rpm", start=start)


def _strokes(stroke: float, offset: float) -> tuple[float, float, float]:
    """Return the three strokes of a cycle that moves to and fro by `stroke` and does not start at an end.

    The cycle starts at the distance `offset` from the beginning of the stroke. If `offset` exceeds |`stroke`|, the
    cycle starts in the return stroke.
    """
    done = offset if stroke > 0 else -offset
    if offset <= abs(stroke):
        return stroke - done, -stroke, done
    return done - 2 * stroke, stroke, stroke - done


def _cylinder(read: _LinkageReading, key: str, each: ElementTree.Element) -> Drive:
    """Add the barrel, rod and slider of an actuator to the mechanism, and return the drive of the slider.

    The rod extends by the attribute `throw` and returns. If the attribute `cpm` (cycles per minute) is negative, the
    rod retracts first.
    """
    first, last = (read.connectors[number] for number in (read.members[key][0], read.members[key][-1]))
    name = read.called(key, f"cylinder_{key.split(maxsplit=1)[0]}")
    head, tip = f"{name}_head", f"{name}_tip"
    read.points[head] = first.place + 0.6 * (last.place - first.place)
    read.points[tip] = first.place + 0.4 * (last.place - first.place)
    rod = read.called(f"{key} rod", f"{name}_rod")
    read.links[name] = ForeignLink((first.name, head), rigid=True)
    read.links[rod] = ForeignLink((last.name, tip))
    read.slides[f"{name}_slide"] = ForeignSlider(rod, name, last.name, last.place - first.place)
    cycles, throw = float(each.get("cpm") or 0) or TURNS, float(each.get("throw") or 0)
    ways = _strokes(throw if cycles > 0 else -throw, float(each.get("startoffset") or 0))
    verb = "extends" if cycles > 0 else "retracts"
    read.notes.append(f"{name} {verb} by {throw:g} {read.unit} and returns, here with a smooth start and stop")
    speed = 2 * throw * abs(cycles) / 60
    return Drive({"slider": f"{name}_slide"}, law=to_and_fro(ways, speed, read.unit))


def _gears(read: _LinkageReading, root: ElementTree.Element) -> Iterator[ForeignGear]:
    """Yield the gears.

    Both wheels turn on the same link (the carrier) or on the ground. The sizes of the wheels give the ratio.
    """
    for ratio in root.iterfind("ratios/ratio"):
        wheels = [_wheel(read, each) for each in ratio.findall("link")]
        if len(wheels) != 2 or any(not name or size <= 0 for name, _, size in wheels):
            read.notes.append("left out: a gear between links that are not in the file")
            continue
        (first, axle, size), (second, other, other_size) = sorted(wheels, key=lambda wheel: wheel[0] != GROUND)
        pins = read.connectors[axle], read.connectors[other]
        others = {name: body for name, body in read.links.items() if name not in (first, second)}
        carrier = link_with(others, *(pin.name for pin in pins))
        if carrier is None and not all(pin.fixed for pin in pins):
            read.notes.append(f"left out: a gear between {first} and {second}, because no link carries both")
            continue
        on = {} if carrier is None else {"on": carrier}
        driver = {"link": first, **on, "at": pins[0].name}
        teeth, standing = ratio.get("type") == "gears", first == GROUND
        if standing:  # the driver is the carrier: seen from the carrier, a fixed wheel turns in the opposite direction
            driver = {"link": carrier or "", "at": pins[0].name}
        sign = -1 if teeth != standing else 1
        follower = {"link": second, **on, "at": pins[1].name}
        yield ForeignGear(driver, follower, sign * size / other_size, teeth and not standing)


def _driven_first(gears: list[ForeignGear], driven: Sequence[Mapping[str, str]]) -> tuple[ForeignGear, ...]:
    """Sort the gears so that a drive or an earlier gear moves the driver of each gear, if possible.

    Driver and follower of a gear are swapped if a drive or an earlier gear moves only the follower.
    """
    moved, left, ordered = [dict(joint) for joint in driven], gears, []
    while left:
        pairs = [(gear, end in moved) for gear in left for end in (dict(gear.driver), dict(gear.follower))]
        gear = next((gear for gear, known in pairs if known), left[0])
        left = [each for each in left if each is not gear]
        if dict(gear.follower) in moved and dict(gear.driver) not in moved:
            gear = ForeignGear(gear.follower, gear.driver, 1 / gear.ratio, gear.teeth)
        moved.append(dict(gear.follower))
        ordered.append(gear)
    return tuple(ordered)


def _wheel(read: _LinkageReading, each: ElementTree.Element) -> tuple[str, str, float]:
    """Return link, axle (connector number) and size of a wheel. Link and axle are "" if the link is not in the file."""
    key = next((key for key in read.link_of if key.split()[0] == each.get("id")), "")
    return (read.link_of.get(key, ""), read.members[key][0] if key else "", float(each.get("size") or 0))
