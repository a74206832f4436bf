"""Mechanisms of PMKS+: its links, and the files it saves, which hold the same text."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import parse_qs, unquote, urlsplit

from exchange.drawing import GROUND, Body, Drawing, Drive, ExchangeError, Names, Slide, link_with, turns_of

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
UNITS = ("in", "cm", "m")  # by the number that the file has
SOURCE = "PMKS+"
TURNS = 20  # rpm, PMKS+'s own default
CHECKS = DIGITS[:62]
WRITTEN = {"mm": ("cm", 0.1), "cm": ("cm", 1.0), "m": ("cm", 100.0), "in": ("in", 1.0)}
KEYS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"  # of joints: a link is known by those of its joints
SHOWN = 1 << 3 | 1 << 5  # grid lines and names


@dataclass(frozen=True)
class Joint:
    """A joint of PMKS+: its place, the angle of its line [rad] where it slides, and its marks."""

    key: str
    name: str
    place: complex
    angle: float
    slides: bool
    driven: bool
    fixed: bool
    welded: bool
    traced: bool


@dataclass(frozen=True)
class Part:
    """A link of PMKS+ by its joints; a piston is the block of a slider."""

    key: str
    name: str
    mass: float
    joints: tuple[str, ...]
    piston: bool


def of_pmks(text: str, title: str) -> Drawing:
    """The mechanism in a link or file of PMKS+, version 1 or 2.

    Raises
    ------
    ExchangeError
        It is none.
    """
    query = urlsplit(text.strip()).query if "?" in text else text.strip()
    try:
        return _of_first(query, title) if "j=" in query else _of_second(query, title)
    except (ValueError, IndexError, KeyError, StopIteration) as error:
        raise ExchangeError(f"no mechanism of PMKS+ that can be read: {error!r}") from None


def _integer(text: str) -> int:
    """A number in base 64; one that begins with 0 is not positive."""
    value = 0
    for digit in text.removeprefix("0") if text[:1] == "0" else text:
        value = 64 * value + DIGITS.index(digit)
    return -value if text[:1] == "0" else value


def _number(text: str) -> float:
    return _integer(text) / 1000


def _of_second(query: str, title: str) -> Drawing:
    """Version 2: settings, joints, links and forces between dots; an empty entry ends each list."""
    words = query.split(".")
    first = next(at for at, word in enumerate(words) if word.count(",") == 4 and len(word) > 5)
    lists: list[list[str]] = [[]]
    for word in words[first:]:
        lists.append([]) if not word else lists[-1].append(word)
    joints = [_joint(word) for word in lists[0]]
    parts = [_part(word) for word in lists[1] if word[0] == "Y"]
    forces = len([word for word in (lists[2] if len(lists) > 2 else []) if word.count(",") >= 6])
    settings = words[:first]
    enums = settings[-1] if settings else ""
    unit = UNITS[int(enums[0])] if enums[:1] in ("0", "1", "2") else "cm"
    turns = _integer(next((word for word in settings[1:] if "," in word), "K").split(",")[0]) or TURNS
    clockwise = bool(settings and DIGITS.index(settings[0][-1]) & 1)
    return _drawing(title, unit, joints, parts, f"{-turns if clockwise else turns} rpm", forces)


def _joint(word: str) -> Joint:
    marks = DIGITS.index(word[0])
    key, name, x, y, angle = word[1:].split(",")
    slides, driven, fixed, welded, traced = (bool(marks >> bit & 1) for bit in range(5))
    return Joint(
        key, unquote(name), complex(_number(x), _number(y)), _number(angle), slides, driven, fixed, welded, traced
    )


def _part(word: str) -> Part:
    key, name, mass, *rest = word[2:].split(",")
    joints = rest[4 : rest.index("", 4)]
    return Part(key, unquote(name), _number(mass), tuple(joints), word[1] == "P")


def _of_first(query: str, title: str) -> Drawing:
    """Version 1: joints and links as rows of comma-separated values."""
    given = parse_qs(query, keep_blank_values=True)
    joints = []
    for row in _rows(given.get("j", [""])[0]):
        key, x, y, _, kind, fixed, angle, _, driven = row[:9]
        joints.append(
            Joint(
                key,
                key,
                complex(float(x), float(y)),
                float(angle),
                kind == "P",
                driven == "t",
                fixed == "t",
                False,
                False,
            )
        )
    parts = [
        Part(row[0], row[0], float(row[1]), tuple(row[5].split("|")), False) for row in _rows(given.get("l", [""])[0])
    ]
    settings = given.get("s", [""])[0].split(",")
    turns = float(settings[0]) if settings[0] else TURNS
    unit = settings[3] if len(settings) > 3 and settings[3] in ("cm", "m", "in", "mm") else "cm"
    speed = f"{-turns if settings[1:2] == ['true'] else turns:g} rpm"
    return _drawing(title, unit, joints, parts, speed, len(_rows(given.get("f", [""])[0])))


def _rows(text: str) -> list[list[str]]:
    return [row.split(",") for row in text.replace("\\n", "\n").split("\n") if row.strip()]


def _drawing(title: str, unit: str, joints: Sequence[Joint], parts: Sequence[Part], speed: str, forces: int) -> Drawing:
    names, called = Names(), Names(["ground"])
    blocks = {part.key: part for part in parts if part.piston}
    sliders = {each.key: each for each in joints if each.slides}
    point = {each.key: names(each.key, each.name) for each in joints if not each.slides or not _at_pin(each, joints)}
    known = {each.key: each for each in joints}
    links = {
        called(part.key, part.name): Body(tuple(point[key] for key in part.joints if key in point))
        for part in parts
        if not part.piston
    }
    slides = {}
    for key, joint in sliders.items():
        block = next((part for part in blocks.values() if key in part.joints), None)
        pin = next((other for other in (block.joints if block else (key,)) if other in point), None)
        if pin is None:
            raise ExchangeError(f'the slider "{joint.name}" has no pin')
        name = called(f"block {key}", f"block_{point[pin]}")
        links[name] = Body((point[pin],))
        slides[f"guide_{point[pin]}"] = Slide(name, "ground", point[pin], cmath.rect(1.0, joint.angle))
    fixed = tuple(point[each.key] for each in joints if each.fixed and not each.slides)
    drives = tuple(_drive(each, point, links, slides, speed) for each in joints if each.driven)
    notes = ["masses of PMKS+ are left out: those of section and material count"]
    if forces:
        notes.append(f"forces of PMKS+ that were left out: {forces}; put them under [[loads]]")
    if any(each.welded for each in known.values()):
        notes.append("links that are welded in PMKS+ are one link here")
    traced = next((point[each.key] for each in joints if each.traced and not each.fixed and each.key in point), "")
    places = {point[key]: known[key].place for key in point}
    return Drawing(
        title, SOURCE, unit, places, fixed, links, slides=slides, drives=drives, traced=traced, notes=tuple(notes)
    )


def _at_pin(slider: Joint, joints: Sequence[Joint]) -> bool:
    return any(not each.slides and each.place == slider.place for each in joints)


def _drive(joint: Joint, point: dict[str, str], links: dict[str, Body], slides: dict[str, Slide], speed: str) -> Drive:
    if joint.slides:
        name = next((name for name, slide in slides.items() if name.endswith(point.get(joint.key, ""))), "")
        raise ExchangeError(f"a driven slider ({name or joint.name}) is not read: its stroke is not in the file")
    link = link_with(links, point[joint.key])
    if link is None:
        raise ExchangeError(f'no link has the driven joint "{joint.name}"')
    return Drive({"link": link, "at": point[joint.key]}, speed)


def pmks_text(drawing: Drawing) -> str:
    """The mechanism as PMKS+ saves it, version 2: the query of a link, or a whole file.

    Places are to a thousandth of a centimetre or inch, directions to a milliradian, speeds to an rpm, as it keeps them.

    Raises
    ------
    ExchangeError
        It has parts that PMKS+ does not know, without which it would move otherwise.
    """
    turns = turns_of(drawing, SOURCE)
    sliding = next((name for name, slot in drawing.slots.items() if slot.on != GROUND), None)
    for wrong, why in (
        (drawing.gears, "gears"),
        (drawing.slides, "a link that slides without turning"),
        (sliding, "a slot in a moving link"),
        (len({turn for _, _, turn in turns}) > 1, "drives of several speeds"),
    ):
        if wrong:
            raise ExchangeError(f"{SOURCE} has no place for {why}")
    unit, scale = WRITTEN[drawing.unit]
    links = {name: body.points for name, body in drawing.links.items() if len(body.points) > 1}
    used = [name for name in drawing.points if any(name in points for points in links.values())]
    if len(used) + len(drawing.slots) > len(KEYS):
        raise ExchangeError(f"{SOURCE} names joints by a letter, and here are more than {len(KEYS)}")
    key = dict(zip([*used, *(f"{name} slot" for name in drawing.slots)], KEYS, strict=False))
    driven, called = {at for _, at, _ in turns}, Names()
    joints, parts = [], []
    for name in used:
        bits = (name in driven) << 1 | (name in drawing.ground) << 2 | (name == drawing.traced) << 4
        joints.append(_written_joint(bits, key[name], called(name), scale * drawing.points[name], 0.0))
    for name, points in sorted(links.items(), key=lambda link: link[0] not in {link for link, _, _ in turns}):
        members = [key[each] for each in points]
        center = scale * sum(drawing.points[each] for each in points) / len(points)
        sizes = ",".join(map(_digits, (1.0, 1.0, center.real, center.imag)))
        parts.append(f"YR{''.join(members)},{called(f'link {name}', name)},{sizes},c5cae9,{','.join(members)},,")
    for name, slot in drawing.slots.items():
        pin, block = key[slot.point], key[f"{name} slot"]
        angle = cmath.phase(slot.direction)
        joints.append(_written_joint(5, block, block, scale * drawing.points[slot.point], angle))
        parts.append(f"YP{pin}{block},{pin}{block},{_digits(1.0)},0,0,0,,{pin},{block},,")
    marks = DIGITS[SHOWN >> 6] + DIGITS[SHOWN & 63 | (turns[0][2] < 0)]
    speed = _digits(max(1, round(abs(turns[0][2]))) / 1000)
    enums = f"{UNITS.index(unit)}0{int(unit != 'in')}{UNITS.index(unit)}"
    lists = "".join(f"{word}." for word in joints) + "." + "".join(f"{word}." for word in parts)
    whole = f"{marks}.{_digits(1.0)}.{speed},0.{enums}.{lists}..N_"
    return whole + CHECKS[len(whole) % len(CHECKS)]


def _written_joint(marks: int, key: str, name: str, place: complex, angle: float) -> str:
    return f"{DIGITS[marks]}{key},{name},{_digits(place.real)},{_digits(place.imag)},{_digits(angle)}"


def _digits(value: float) -> str:
    """Thousandths in base 64; of a negative number a 0 before."""
    left, text = abs(round(1000 * value)), ""
    while left or not text:
        left, digit = divmod(left, 64)
        text = DIGITS[digit] + text
    return f"0{text}" if round(1000 * value) < 0 else text
