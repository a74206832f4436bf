"""A mechanism as programs that draw linkages keep it, and the scene that it makes.

They know points, links, joints and drives, and as a rule neither section nor material: what a scene wants besides is
assumed, and marked so in its text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite
from typing import Any

SLENDERNESS = 20  # of the longest link: its length over the depth of the assumed section
MATERIAL = "S235"
BLOCK = "100 g"
GROUND = "ground"


class ExchangeError(ValueError):
    """A file that is not one of the format, or holds no mechanism."""


@dataclass(frozen=True)
class Body:
    """A link: its points; its mass [kg], where the file tells it; whether it is rigid; beams besides point to point."""

    points: tuple[str, ...]
    mass: float | None = None
    rigid: bool = False
    braces: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Slot:
    """The pin `point` of `link` in a straight slot of `on`, along `direction` as drawn.

    `travel` is how far the pin goes to and fro from where it is drawn; both zero where that is not known.
    """

    point: str
    link: str
    on: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Slide:
    """`link` slides on `on` along a line through `through` in `direction`, and does not turn against it."""

    link: str
    on: str
    through: str
    direction: complex


@dataclass(frozen=True)
class Drive:
    """The coordinate of a joint in time: constant `speed`, or segments of a `law` that is repeated.

    Attributes
    ----------
    joint
        Keys of the scene's drive: `link`, `on` and `at` of a pin, or `slider`.
    speed
        With its unit, as in "30 rpm"; None where there is a law.
    law
        Segments as in a scene: curve, duration, by.
    """

    joint: Mapping[str, str]
    speed: str | None = None
    law: tuple[Mapping[str, str], ...] = ()


@dataclass(frozen=True)
class Gear:
    """Two wheels by their joints, the ratio of the second's angle to the first's, and whether they mesh by teeth."""

    driver: Mapping[str, str]
    follower: Mapping[str, str]
    ratio: float
    teeth: bool


@dataclass(frozen=True)
class Drawing:
    """A mechanism by its drawing.

    Attributes
    ----------
    title, source
        Of the scene.
    unit
        Of all lengths: "m", "cm", "mm" or "in".
    points
        Places as drawn; names are those of the scene already.
    ground, links
        Points of the fixed link, and the moving links by their names.
    slots, slides
        By their names.
    drives, gears
        In the order of the file.
    traced
        Point that the user looks at; "" where none is marked.
    notes
        Sentences on what the scene has not, or has otherwise.
    """

    title: str
    source: str
    unit: str
    points: Mapping[str, complex]
    ground: tuple[str, ...]
    links: Mapping[str, Body]
    slots: Mapping[str, Slot] = field(default_factory=dict)
    slides: Mapping[str, Slide] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    gears: tuple[Gear, ...] = ()
    traced: str = ""
    notes: tuple[str, ...] = ()


class Names:
    """Names of a scene, of letters, digits, - and _, each once, for the names or numbers of a file."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._names: dict[str, str] = {}
        self._taken = set(taken)

    def __call__(self, key: object, wanted: str = "") -> str:
        """The name of the thing that the file calls `key`, made of the name that is wanted at its first call."""
        known = str(key)
        if known not in self._names:
            plain = re.sub(r"[^A-Za-z0-9_-]+", "_", wanted or known).strip("_") or "x"
            name, number = plain, 2
            while name in self._taken:
                name, number = f"{plain}_{number}", number + 1
            self._taken.add(name)
            self._names[known] = name
        return self._names[known]


def link_with(links: Mapping[str, Body], *points: str) -> str | None:
    """The first link that has all of some points; None where there is none."""
    return next((name for name, body in links.items() if {*points} <= {*body.points}), None)


def turns_of(drawing: Drawing, program: str) -> list[tuple[str, str, float]]:
    """Link, pin and speed [rpm] of every drive, for a program that knows steady turns about fixed pins alone.

    Raises
    ------
    ExchangeError
        A drive is another, or none is there.
    """
    if not drawing.drives:
        raise ExchangeError(f"{program} wants a drive")
    told = []
    for drive in drawing.drives:
        joint = drive.joint
        if "at" not in joint or joint.get("on", GROUND) != GROUND or drive.speed is None:
            name = joint.get("slider") or joint.get("link")
            raise ExchangeError(f'{program} drives links at constant speed about fixed pins, and "{name}" otherwise')
        told.append((joint["link"], joint["at"], float(drive.speed.removesuffix("rpm"))))
    return told


def scene_text(drawing: Drawing) -> str:
    """The text of a scene with this mechanism; every assumption has a comment that says so.

    Raises
    ------
    ExchangeError
        There is no moving link, or a place is not finite.
    """
    import tomlkit

    if not drawing.links:
        raise ExchangeError("there is no moving link in it")
    if not all(isfinite(place.real) and isfinite(place.imag) for place in drawing.points.values()):
        raise ExchangeError("a point of it has no finite place")
    document = tomlkit.document()
    for note in drawing.notes:
        document.add(tomlkit.comment(note))
    document["title"] = drawing.title
    document["source"] = drawing.source
    if drawing.unit != "m":
        document["units"] = drawing.unit
    _add_section(document, drawing)
    document["points"] = {name: _place(place) for name, place in drawing.points.items()}
    document["links"] = tomlkit.table(is_super_table=True)
    document["links"]["ground"] = {"points": list(drawing.ground)}
    for name, body in drawing.links.items():
        document["links"][name] = _link(body)
    _add_joints(document, drawing)
    run: dict[str, Any] = {"positions": 180}
    if drawing.traced:
        run["output"] = drawing.traced
    document["run"] = run
    return tomlkit.dumps(document)


def _place(place: complex) -> list[float]:
    return [round(place.real, 9) + 0.0, round(place.imag, 9) + 0.0]


def _add_section(document: Any, drawing: Drawing) -> None:
    """The one section that all links get."""
    import tomlkit

    spans = [
        abs(drawing.points[a] - drawing.points[b]) for body in drawing.links.values() for a, b in pairwise(body.points)
    ]
    depth = float(f"{max(spans, default=1.0) / SLENDERNESS:.1g}")
    section = tomlkit.table()
    section["shape"] = "rectangle"
    for key, size in (("depth", depth), ("width", depth / 2)):
        section[key] = f"{size:g} {drawing.unit}"
        section[key].comment(f"assumed, {'of the longest link' if key == 'depth' else 'half the depth'}: put in yours")
    document["sections"] = tomlkit.table(is_super_table=True)
    document["sections"]["bar"] = section


def _link(body: Body) -> Any:
    import tomlkit

    table = tomlkit.table()
    table["points"] = list(body.points)
    if len(body.points) == 1:
        table["mass"] = f"{body.mass:g} kg" if body.mass else BLOCK
        if not body.mass:
            table["mass"].comment("assumed: put in yours")
        return table
    if body.braces:
        table["beams"] = [list(pair) for pair in (*pairwise(body.points), *body.braces)]
    if body.rigid:
        table["rigid"] = True
    table["section"] = "bar"
    table["material"] = MATERIAL
    table["material"].comment(
        "assumed: --list materials" + (f"; the file gives it {body.mass:g} kg" if body.mass else "")
    )
    return table


def _add_joints(document: Any, drawing: Drawing) -> None:
    import tomlkit

    tables: dict[str, dict[str, dict[str, Any]]] = {
        "slots": {
            name: {"point": slot.point, "link": slot.link, "on": slot.on, "direction": _direction(slot.direction)}
            for name, slot in drawing.slots.items()
        },
        "sliders": {
            name: {
                "link": slide.link,
                "on": slide.on,
                "through": slide.through,
                "direction": _direction(slide.direction),
            }
            for name, slide in drawing.slides.items()
        },
    }
    for kind, of_kind in tables.items():
        if of_kind:
            document[kind] = tomlkit.table(is_super_table=True)
            for name, keys in of_kind.items():
                document[kind][name] = {key: value for key, value in keys.items() if (key, value) != ("on", "ground")}
    drives, gears = tomlkit.aot(), tomlkit.aot()
    for drive in drawing.drives:
        table = tomlkit.table()
        table.update(dict(drive.joint))
        if drive.speed is not None:
            table["speed"] = drive.speed
        else:
            table["law"] = [dict(segment) for segment in drive.law]
            table["repeat"] = True
        drives.append(table)
    for gear in drawing.gears:
        table = tomlkit.table()
        table.update({"driver": dict(gear.driver), "follower": dict(gear.follower), "ratio": gear.ratio})
        if not gear.teeth:
            table["teeth"] = False
        gears.append(table)
    if drives:
        document["drives"] = drives
    if gears:
        document["gears"] = gears


def _direction(direction: complex) -> list[float]:
    return _place(direction / (abs(direction) or 1.0))
