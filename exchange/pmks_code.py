"""Decoding and encoding of the text format of PMKS+: numbers in base 64, records separated by dots."""

import re
from collections.abc import Callable, Mapping
from typing import TypeVar
from urllib.parse import unquote

from msgspec import Struct
from msgspec.structs import replace

from exchange.foreign_mechanism import ExchangeError

Record = TypeVar("Record")
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"  # digits of base 64
CHECKS = DIGITS[:62]  # characters of the length check and of the hash
UNITS = ("in", "cm", "m")  # units of length; a file contains the index of its unit in this tuple
HEAD = 4  # number of records before the first joint: one record each for switches, decimals, integers and units
CLOCKWISE, NO_GRAVITY = 1 << 0, 1 << 8  # bits of the switches
SHOWN = 1 << 3 | 1 << 4 | 1 << 5 | 1 << 7  # switches of a new drawing in PMKS+: show grids, names and forces
SLIDES, DRIVEN, FIXED, WELDED, TRACED, SEALED = (1 << bit for bit in range(6))  # flags of a joint
# The mark of a link is one character. It states the shape of the link, and whether the user entered the inertia and the
# centre of mass.
LINK_MARKS = "YAMG0123"  # marks of links that are not part of a welded link
PART_MARKS = "NamgN4567"  # marks of the parts of a welded link
OWN_INERTIA, OWN_CENTER = "YGNg0347", "YMNm0246"  # marks of links with entered inertia, and with entered centre
# exact values of numbers that are rounded to 3 decimals
CORRECTION = re.compile(r"P([JLF])([^~,.]*)~(\d+)~([-+.\deE]+)")
DIGEST = re.compile(r"\*[0-9A-Za-z]{6}$")  # hash at the end of the text


class PmksJoint(Struct, frozen=True):
    """Joint of PMKS+.

    `marks` is a sum of flags, such as `FIXED`. A pin in a fixed slot slides in the direction `angle` [rad]. A moving
    slot is in the link `carrier`, between the two joints in `slot`. A `speed` of 0 means the default speed of the file.
    """

    key: str
    name: str
    place: complex
    angle: float = 0.0
    marks: int = 0
    carrier: str = ""
    slot: tuple[str, str] = ("", "")
    speed: float = 0.0
    mass: float = 0.0

    def has(self, mark: int) -> bool:
        """Return whether the joint has a flag."""
        return bool(self.marks & mark)


class PmksPart(Struct, frozen=True):
    """Link of PMKS+.

    If the link is welded, `parts` contains the keys of its parts. `whole` is False for such a part. In older files,
    `piston` is True for the block of a slider.
    """

    key: str
    name: str
    joints: tuple[str, ...]
    mass: float = 0.0
    inertia: float | None = None
    center: complex | None = None
    whole: bool = True
    piston: bool = False
    parts: tuple[str, ...] = ()


class PmksForce(Struct, frozen=True):
    """Force at `start`, towards `end` if `outward`, else away from `end`. If `local`, the force turns with the link."""

    link: str
    name: str
    start: complex
    end: complex
    size: float
    local: bool
    outward: bool


class Saved(Struct, frozen=True):
    """Contents of a file of PMKS+.

    `turns` [rpm] and `slides` [unit/s] are the default speeds of rotating and sliding drives.
    """

    unit: str
    joints: tuple[PmksJoint, ...]
    parts: tuple[PmksPart, ...]
    forces: tuple[PmksForce, ...] = ()
    turns: float = 20.0
    slides: float = 5.0
    gravity: bool = False


def integer(text: str) -> int:
    """Decode a number in base 64. A leading 0 means a minus sign."""
    value = 0
    for digit in text[1:] if text[:1] == "0" else text:
        value = 64 * value + DIGITS.index(digit)
    return -value if text[:1] == "0" else value


def coded(value: float) -> str:
    """Encode round(1000 * value) in base 64, with a leading 0 if the value is negative."""
    left, text = abs(round(1000 * value)), ""
    while left or not text:
        left, digit = divmod(left, 64)
        text = DIGITS[digit] + text
    return f"0{text}" if round(1000 * value) < 0 else text


def decoded(text: str) -> Saved:
    """Decode a saved mechanism of version 2.

    Raises
    ------
    ExchangeError
        If a record cannot be read.
    """
    words = DIGEST.sub("", text).split(".")
    if len(words) <= HEAD or "," not in words[HEAD]:
        raise ExchangeError("this is not a mechanism of PMKS+: no joints follow the four settings")
    lists: list[list[str]] = [[]]
    for word in words[HEAD:]:
        lists.append([]) if not word and len(lists) < 4 else lists[-1].append(word)
    exact = {(kind, key, int(number)): float(value) for kind, key, number, value in CORRECTION.findall(text)}
    lists += [[], []]
    joints = tuple(_read("joint", word, exact, _joint) for word in lists[0])
    parts = tuple(_read("link", word, exact, _part) for word in lists[1])
    # skip the checksum after the forces in early files of version 2: unlike a force, the checksum contains no commas
    forces = tuple(_read("force", word, exact, _force) for word in lists[2] if "," in word)
    _require_known(joints, parts)
    switches, decimals, integers, units = words[:HEAD]
    try:
        marks = abs(sum(DIGITS.index(digit) << 6 * place for place, digit in enumerate(reversed(switches))))
        turns = float(integer(integers.split(",")[0])) or 20.0
        slides = next((integer(word) / 1000 for word in decimals.split(",")[1:2]), 0.0) or 5.0
    except ValueError:
        raise ExchangeError(f'the settings "{".".join(words[:HEAD])}" of PMKS+ cannot be read') from None
    sense = -1.0 if marks & CLOCKWISE else 1.0
    unit = UNITS[int(units[0])] if units[:1] in ("0", "1", "2") else "cm"
    return Saved(unit, joints, parts, forces, sense * turns, sense * slides, not marks & NO_GRAVITY)


def _read(
    kind: str,
    word: str,
    exact: Mapping[tuple[str, str, int], float],
    reader: Callable[[list[str], Callable[[int, str], float]], Record],
) -> Record:
    """Read a record.

    `exact` contains the numbers with more than three decimals. The keys of `exact` are (kind of record, key of the
    record, index of the number).
    """
    fields = word.split(",")
    mark = 2 if kind == "link" else 1
    key = fields[0][mark:]

    def number(field: int, text: str) -> float:
        return exact.get((kind[0].upper(), key, field), integer(text) / 1000 if text else 0.0)

    try:
        return reader(fields, number)
    except (ValueError, IndexError):
        raise ExchangeError(f'the {kind} "{word[:80]}" of PMKS+ cannot be read') from None


def _joint(fields: list[str], number: Callable[[int, str], float]) -> PmksJoint:
    key, name, x, y, angle = fields[0][1:], *fields[1:5]
    carrier, first, second, speed, mass, *_ = [*fields[5:], "", "", "", "", ""]
    return PmksJoint(
        key, unquote(name), complex(number(0, x), number(1, y)), number(2, angle), DIGITS.index(fields[0][0]),
        carrier, (first, second), number(3, speed), number(4, mass),
    )  # fmt: skip


def _part(fields: list[str], number: Callable[[int, str], float]) -> PmksPart:
    mark, piston, key = fields[0][0], fields[0][1] == "P", fields[0][2:]
    if mark not in LINK_MARKS + PART_MARKS:
        raise ValueError(mark)
    name, mass, inertia, x, y = fields[1:6]
    end = fields.index("", 7)
    center = complex(number(2, x), number(3, y))
    return PmksPart(
        key, unquote(name), tuple(fields[7:end]), number(0, mass),
        number(1, inertia) if mark in OWN_INERTIA else None, center if mark in OWN_CENTER else None,
        mark in LINK_MARKS, piston, tuple(filter(None, fields[end:])),
    )  # fmt: skip


def _force(fields: list[str], number: Callable[[int, str], float]) -> PmksForce:
    marks, link, name = DIGITS.index(fields[0][0]), *fields[1:3]
    x, y, x2, y2, size = (number(field, text) for field, text in enumerate(fields[3:8]))
    return PmksForce(link, unquote(name), complex(x, y), complex(x2, y2), size, bool(marks & 1), bool(marks & 2))


def _require_known(joints: tuple[PmksJoint, ...], parts: tuple[PmksPart, ...]) -> None:
    """Raise ExchangeError if a record refers to an unknown joint or link."""
    keys, links = {joint.key for joint in joints}, {part.key for part in parts}
    for part in parts:
        for key in part.joints:
            if key not in keys:
                raise ExchangeError(f'the link "{part.name}" of PMKS+ has a joint "{key}" that is not in the file')
    for joint in joints:
        if joint.carrier and (joint.carrier not in links or not keys.issuperset(joint.slot)):
            raise ExchangeError(
                f'the slot of the joint "{joint.name}" of PMKS+ refers to parts that are not in the file'
            )


def folded(saved: Saved) -> Saved:
    """Replace each slider of an older file (joint, pin and block) by a single joint, as in the current format."""
    known = {joint.key: joint for joint in saved.joints}
    merged: dict[str, str] = {}
    blocks = set()
    for block in saved.parts:
        ends = [known[key] for key in block.joints if key in known]
        guide = next((each for each in ends if each.has(SLIDES)), None)
        pin = next((each for each in ends if not each.has(SLIDES)), None)
        if len(ends) != 2 or guide is None or pin is None or not (block.piston or guide.place == pin.place):
            continue
        fixed = FIXED if not guide.carrier else 0
        marks = guide.marks & ~WELDED | pin.marks & (DRIVEN | WELDED | TRACED | fixed)
        known[pin.key] = replace(
            guide, key=pin.key, name=pin.name, marks=marks, mass=block.mass, speed=guide.speed or pin.speed
        )
        del known[guide.key]
        merged[guide.key] = pin.key
        blocks.add(block.key)
    slots = {
        key: replace(joint, slot=(merged.get(joint.slot[0], joint.slot[0]), merged.get(joint.slot[1], joint.slot[1])))
        for key, joint in known.items()
    }
    parts = tuple(
        replace(part, joints=tuple(merged.get(key, key) for key in part.joints))
        for part in saved.parts
        if part.key not in blocks
    )
    return replace(saved, joints=tuple(slots.values()), parts=parts)


def encoded(saved: Saved) -> str:
    """Encode a mechanism as text that ends with a length check and a hash."""
    switches = SHOWN | (CLOCKWISE if saved.turns < 0 else 0) | (0 if saved.gravity else NO_GRAVITY)
    head = DIGITS[switches >> 6] + DIGITS[switches & 63]
    turns = coded(max(1, round(abs(saved.turns))) / 1000)
    units = f"{UNITS.index(saved.unit)}0{int(saved.unit != 'in')}{UNITS.index(saved.unit)}"
    settings = f"{head}.{coded(1.0)},{coded(abs(saved.slides))}.{turns},0.{units}"
    lists = (map(_joint_word, saved.joints), map(_part_word, saved.parts), map(_force_word, saved.forces))
    whole = f"{settings}.{'.'.join(''.join(f'{word}.' for word in each) for each in lists)}.N_"
    whole += CHECKS[len(whole) % len(CHECKS)]
    return f"{whole}*{_digest(whole)}"


def _digest(text: str) -> str:
    """Return the 32-bit FNV-1a hash of a text as six characters."""
    value, letters = 0x811C9DC5, ""
    for letter in text:
        value = (value ^ ord(letter)) * 0x01000193 & 0xFFFFFFFF
    for _ in range(6):
        value, digit = divmod(value, len(CHECKS))
        letters = CHECKS[digit] + letters
    return letters


def _joint_word(joint: PmksJoint) -> str:
    own = coded(joint.speed) if joint.speed else ""
    rest = [joint.carrier, *joint.slot, own, coded(joint.mass) if joint.mass else ""]
    fields = [joint.name, *map(coded, (joint.place.real, joint.place.imag, joint.angle)), *rest]
    while not fields[-1]:
        fields.pop()
    return f"{DIGITS[joint.marks]}{joint.key},{','.join(fields)}"


def _part_word(part: PmksPart) -> str:
    center = part.center or 0j
    sizes = ",".join(map(coded, (part.mass, part.inertia or 0.0, center.real, center.imag)))
    mark = "YMGA"[2 * (part.center is None) + (part.inertia is None)]
    return f"{mark}R{part.key},{part.name},{sizes},c5cae9,{','.join(part.joints)},,"


def _force_word(force: PmksForce) -> str:
    marks = DIGITS[force.local | force.outward << 1]
    places = (force.start.real, force.start.imag, force.end.real, force.end.imag, force.size)
    return f"{marks}{force.name},{force.link},{force.name},{','.join(map(coded, places))}"
