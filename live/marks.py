"""Marks (symbols, see `symbols.marks`) of the editor.

If the mechanism moves, its marks come from the motion. Otherwise, they come from the tables of the scene.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

import symbols
from kinelast.scene.data import Scene
from kinelast.scene.parsing import is_chain
from kinelast.scene.parts import symbols_of
from live.drives import wheels
from live.parts import beams_of, cylinders_of, drawn, ground_points, points_of
from rigid import GROUND, Motion
from symbols import Anchor, Mark

Tables = Mapping[str, Any]


def scene_marks(scene: Scene, motion: Motion) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the marks of a moving scene and two opposite corners of the box around it, and complex arrays.

    Marks of points and masses are left out. The arrays have the shape (items, positions): `origin` and `direction` of
    the links, and `x_axis` of the marks with a function `x_axis_of`.
    """
    on_points = (*symbols.POINTS, symbols.MASS)  # `sheet` returns these marks
    marks = [mark for mark in symbols.marks_of(motion, symbols_of(scene)) if mark.kind not in on_points]
    corners = [[place.real, place.imag] for place in symbols.extent_of(motion, marks) or ()]
    x_axes = [mark.direction(motion) for mark in marks if mark.x_axis_of]
    rows = {"origin": motion.origin, "direction": motion.direction, "x_axis": x_axes}
    arrays = {name: np.reshape(np.asarray(values), (-1, len(motion.time))) for name, values in rows.items()}
    return {"marks": symbols.plain_marks(marks, motion.mechanism), "extent": corners}, arrays


def _list(value: Any) -> list[Any]:
    """Return a value from the file if it is a list, otherwise an empty list."""
    return value if isinstance(value, list) else []


def _readable(parts: Iterable[Any]) -> list[Any]:
    """Return parts as a list, or an empty list if the tables of these parts are invalid."""
    try:
        return list(parts)
    except (TypeError, AttributeError):
        return []


def sheet(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of a scene from its tables, as drawn. Invalid parts are left out.

    Raise ValueError if the scene is a mechanism in space.
    """
    if is_chain(tables):
        raise ValueError("joints in space cannot be drawn in the plane")

    def named(kind: str) -> dict[str, Any]:
        entries = tables.get(kind)
        return entries if isinstance(entries, dict) else {}

    known: dict[str, Any] = {
        kind: {name: entry for name, entry in named(kind).items() if isinstance(entry, dict)}
        for kind in ("links", "sliders", "slots", "welds", "cylinders", "sections", "materials")
    }
    for kind in ("drives", "gears", "springs", "loads"):
        known[kind] = [entry for entry in _list(tables.get(kind)) if isinstance(entry, dict)]
    links = [
        {
            "name": name,
            "points": points_of(link),
            "beams": _readable(beams_of(link)),
            "section": link.get("section"),
            "material": link.get("material"),
            "rigid": bool(link.get("rigid")),
        }
        for name, link in known["links"].items()
    ]
    content: dict[str, Any] = {
        "empty": not tables.get("points") and known["links"].keys() <= {GROUND} and not known["sliders"],
        "points": {name: [place.real, place.imag] for name, place in drawn(tables).items()},
        "links": links,
        "slots": {**known["slots"], **{k: {**v, "point": v.get("through")} for k, v in known["sliders"].items()}},
        "sliders": list(known["sliders"]),
        "welds": list(known["welds"]),
        "masses": {name: str(mass) for name, mass in named("masses").items()},
        "springs": known["springs"],
        "loads": known["loads"],
        "drives": known["drives"],
        "gears": _readable(wheels(known)),
        "cylinders": {name: {**parts, "slider": on} for name, on, parts in _readable(cylinders_of(known))},
        "sections": list(known["sections"]),
        "materials": list(known["materials"]),
        "title": str(tables.get("title", "")),
        "units": str(tables.get("units", "m")),
    }
    return content | {"pins": point_marks(content), "discs": mass_marks(tables)}


def point_marks(sheet: Tables) -> list[dict[str, Any]]:
    """Return a pin or weld for each point that the user can drag. The middle points of cylinders are left out."""
    middles = {each["middle"] for each in sheet["cylinders"].values()}
    names = [name for name in sheet["points"] if name not in middles]
    return [(symbols.weld if name in sheet["welds"] else symbols.pin)(Anchor("", name)).plain() for name in names]


def mass_marks(tables: Tables) -> list[dict[str, Any]]:
    """Return the discs at point masses, including the masses in tables of links."""
    links = tables.get("links")
    owners = [tables, *(links.values() if isinstance(links, dict) else ())]
    given = [owner["masses"] for owner in owners if isinstance(owner, dict) and isinstance(owner.get("masses"), dict)]
    return [
        symbols.mass(Anchor("", name)).plain() for name in dict.fromkeys(name for masses in given for name in masses)
    ]


def drawn_marks(tables: Tables, sheet: Tables) -> list[dict[str, Any]]:
    """Return the marks of supports, slots, springs, cylinders, gears, loads and drives as drawn.

    Invalid parts are left out.
    """
    makers = (_supports, _slides, _springs, _cylinders, _gears, _loads, _drives)
    plain = [mark.plain() for maker in makers for mark in _valid(maker, tables, sheet)]
    return [each for each in plain if each["at"]["point"] in sheet["points"]]


def _valid(maker: Callable[[Tables, Tables], Iterator[Mark]], tables: Tables, sheet: Tables) -> Iterator[Mark]:
    """Yield marks up to the first invalid table. The answer lists the error in this table."""
    with suppress(AttributeError, KeyError, TypeError, ValueError, IndexError, ZeroDivisionError):
        yield from maker(tables, sheet)


def _supports(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    for name in ground_points(tables):
        yield from symbols.support(Anchor(GROUND, name))


def _slides(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    pushed = {each["slider"] for each in sheet["cylinders"].values()}
    for name, slot in sheet["slots"].items():
        if name not in pushed:
            yield symbols.rails(Anchor("", slot["point"]), str(slot.get("on", GROUND)), _way(slot["direction"]))


def _way(direction: Any) -> complex:
    """Return the unit vector of a direction in the file: a vector, or an angle in radians or degrees."""
    if isinstance(direction, list):
        way = complex(*direction)
        return way / abs(way)
    angle = _number(direction) * (math.pi / 180 if "deg" in str(direction) else 1.0)
    return complex(math.cos(angle), math.sin(angle))


def _number(value: Any) -> float:
    """Return the number at the start of a quantity, or 0 if there is no number."""
    found = re.match(r"\s*[-+]?[\d.]+(e[-+]?\d+)?", str(value), re.IGNORECASE)
    return float(found[0]) if found else 0.0


def _springs(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    for each in sheet["springs"]:
        if "anchor" in each:
            yield symbols.spring(Anchor("", each["point"]), Anchor("", each["anchor"]))
        elif "at" in each:
            yield symbols.torsion_spring(Anchor("", each["at"]))


def _cylinders(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    places = drawn(tables)
    for parts in sheet["cylinders"].values():
        length = abs(places[parts["to"]] - places[parts["from"]])
        yield from symbols.cylinder(Anchor("", parts["from"]), Anchor("", parts["to"]), length, parts["slider"])


def _gears(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    places = drawn(tables)
    for each in sheet["gears"]:
        if each["pins"] and each["ratio"] not in (None, 0, 1):
            one, other = each["pins"]
            pins, links = (Anchor("", one), Anchor("", other)), (GROUND, GROUND)
            yield from symbols.wheels_of_pair(pins, links, places[other] - places[one], float(each["ratio"]))


def _loads(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    for each in sheet["loads"]:
        force = complex(*map(_number, each.get("force", (0, 0))))
        if force:
            yield symbols.arrow(Anchor("", each["point"]), (GROUND, force / abs(force)))


def _drives(tables: Tables, sheet: Tables) -> Iterator[Mark]:
    points = {link["name"]: link["points"] for link in sheet["links"]}
    for each in sheet["drives"]:
        on = points.get(each.get("on", GROUND), ())
        pins = [each["at"]] if "at" in each else [name for name in points.get(each.get("link"), ()) if name in on]
        if pins:
            yield symbols.turn_arrow(Anchor("", pins[0]), None)
