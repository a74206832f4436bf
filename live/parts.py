"""Edits that add or remove points, links, slots, welds, springs, masses and loads."""

import cmath
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from kinelast.scene.parts import PARTS
from kinelast.scene.tables import PER_LENGTH
from kinelast.values.units import Quantity
from live.text import with_table, with_value, without
from rigid import GROUND

DIGITS = 6  # significant digits of numbers in the text
EXACT = 12  # digits of coordinates and directions of points that must lie on a line
SECTION, MATERIAL = "flat 20x5", "S235"
Tables = Mapping[str, Any]


class EditError(ValueError):
    """An edit is not possible in the scene."""


def drawn(tables: Tables) -> dict[str, complex]:
    """Return the drawn positions of the points [m], complex. Invalid points are left out."""
    per_length = scale_of(tables)
    points = tables.get("points")
    ground = tables.get("links", {}).get(GROUND, {}) if isinstance(tables.get("links"), dict) else {}
    own = ground.get("points") if isinstance(ground, dict) else None
    entries = [*(points.items() if isinstance(points, dict) else ()), *(own.items() if isinstance(own, dict) else ())]
    known = {}
    for name, place in entries:
        try:
            x, y = (metres(part, per_length) for part in place)
        except (TypeError, ValueError):
            continue
        if math.isfinite(x) and math.isfinite(y):
            known[name] = complex(x, y)
    return known


def scale_of(tables: Tables) -> float:
    """Return the length unit of the file [m]. It applies to numbers without a unit."""
    return PER_LENGTH.get(tables.get("units", "m"), 1.0)


def ground_points(tables: Tables) -> Any:
    """Return the points of the ground as in the file: a list, or a table of coordinates."""
    return tables.get("links", {}).get(GROUND, {}).get("points", ())


def metres(value: Any, per_length: float) -> float:
    """Convert a length in the file to m. Raise ValueError if the value is not a length."""
    return float(Quantity.of_unit("m", value)) if isinstance(value, str) else float(value) * per_length


def new_name(taken: Any, stem: str) -> str:
    """Return the first unused name.

    If `stem` is a letter, the name is a letter from `stem` to Z, or P with a number if all these letters are taken.
    Otherwise, the name is `stem` with a number.
    """
    names = set(taken)
    if len(stem) == 1:
        letters = (chr(code) for code in range(ord(stem), ord("Z") + 1))
        free = next((letter for letter in letters if letter not in names), None)
        if free:
            return free
        stem = "P"
    number = next(k for k in range(1, len(names) + 2) if f"{stem}{k}" not in names)
    return f"{stem}{number}"


def rounded_place(place: complex, tables: Tables) -> list[float]:
    """Return the coordinates of a position in the length unit of the file, with `DIGITS` significant digits."""
    per_length = scale_of(tables)
    return [float(f"{part / per_length:.{DIGITS}g}") for part in (place.real, place.imag)]


def exact_place(place: complex, tables: Tables) -> list[float]:
    """Return the coordinates of a position in the length unit of the file, with `EXACT` decimals."""
    return [round(part / scale_of(tables), EXACT) + 0.0 for part in (place.real, place.imag)]


def opposite(value: Any) -> Any:
    """Change the sign of a number, which may be a text with a unit."""
    if isinstance(value, str):
        return value.strip()[1:] if value.strip().startswith("-") else f"-{value.strip()}"
    return -value


def with_points(text: str, tables: Tables, wanted: list[Any]) -> tuple[str, list[str]]:
    """Add a point for each position in `wanted`; return the text and the names of all points.

    `wanted` contains names of existing points, and positions [m].
    """
    taken = {*tables.get("points", ()), *drawn(tables)}
    names = []
    for each in wanted:
        if isinstance(each, str):
            names.append(each)
            continue
        name = new_name(taken, "A")
        taken.add(name)
        names.append(name)
        text = with_value(text, ("points", name), rounded_place(complex(*each), tables))
    return text, names


def add_point(text: str, tables: Tables, change: Tables) -> str:
    """Add a point. If `fixed`, fix the point to the ground."""
    text, names = with_points(text, tables, [change["at"]])
    return fix(text, tomllib.loads(text), {"point": names[0]}) if change.get("fixed") else text


def add_link(text: str, tables: Tables, change: Tables) -> str:
    """Add a link through existing points and new positions.

    If `closed` and there are three or more points, a beam also connects the last point to the first.
    """
    text, names = with_points(text, tables, change["points"])
    if len(set(names)) < 2:
        raise EditError("a link needs two different points")
    name = new_name(tables.get("links", ()), "link_")
    entries: dict[str, Any] = {"points": names}
    if change.get("closed") and len(names) > 2:
        entries["beams"] = [[names[k], names[(k + 1) % len(names)]] for k in range(len(names))]
    if change.get("rigid"):
        entries["rigid"] = True
    entries |= {"section": change.get("section") or SECTION, "material": change.get("material") or MATERIAL}
    return with_table(text, ("links", name), entries)


def fix(text: str, tables: Tables, change: Tables) -> str:
    """Fix a point to the ground, or release a fixed point."""
    point = change["point"]
    ground = tables.get("links", {}).get(GROUND)
    if ground is None:
        return with_table(text, ("links", GROUND), {"points": [point]})
    points = ground.get("points", [])
    if isinstance(points, dict):
        raise EditError("[links.ground] gives the coordinates of its points: change them in the text")
    kept = [each for each in points if each != point] if point in points else [*points, point]
    return with_value(text, ("links", GROUND, "points"), kept)


def moving_links(tables: Tables, point: str) -> list[str]:
    """Return the moving links that contain a point. Raise EditError if there is no such link."""
    links = tables.get("links", {})
    names = [name for name, link in links.items() if name != GROUND and point in link.get("points", ())]
    if not names:
        raise EditError(f'no moving link has the point "{point}": draw a link to it first')
    return names


def along(direction: complex) -> str:
    """Return the angle of a direction in degrees, as written in a file."""
    return f"{math.degrees(cmath.phase(direction)):.{DIGITS}g} deg"


def add_slot(text: str, tables: Tables, change: Tables) -> str:
    """Add a straight slot for a point, in the ground or in the link `on`.

    If the point has a slot already, change the direction of this slot; without a given `direction`, remove the slot.
    By default, a slot in the ground has the direction of the x axis, and a slot in a link has the direction of the
    link. If no `direction` is given, a link with a free end is first turned towards the point.
    """
    point, on = change["point"], change.get("on")
    if on is not None and on in tables.get("links", {}) and "direction" not in change:
        text, way = _aligned(text, tables, on, point)
        direction = f"{math.degrees(cmath.phase(way)):.{EXACT}g} deg"
    else:
        direction = along(complex(*change.get("direction", (1, 0))))
    for kind, key in (("slots", "point"), ("sliders", "through")):
        for name, table in tables.get(kind, {}).items():
            if table.get(key) == point and "direction" in change:
                return with_value(text, (kind, name, "direction"), direction)
            if table.get(key) == point:
                return remove(text, tables, {"kind": kind[:-1], "name": name})
    link = next((name for name in moving_links(tables, point) if name != on), None)
    if link is None:
        raise EditError(f'"{point}" only belongs to "{on}": a slot guides the pin of another link')
    entries = {"point": point, "link": link, **({"on": on} if on else {}), "direction": direction}
    return with_table(text, ("slots", new_name(tables.get("slots", ()), "slot_")), entries)


def _aligned(text: str, tables: Tables, name: str, point: str) -> tuple[str, complex]:
    """Turn a link towards a point; return the text and the direction of the link.

    A link is only turned if it has two points and exactly one of them belongs to no other link.
    """
    sheet, ends = drawn(tables), points_of(tables["links"][name])
    others = [each for other, link in tables["links"].items() if other != name for each in points_of(link)]
    free = [end for end in ends if end not in others]
    if len(ends) == 2 and len(free) == 1 and isinstance(tables["points"].get(free[0]), list):
        (fixed,) = (sheet[end] for end in ends if end not in free)
        way = sheet[point] - fixed
        place = fixed + way / abs(way) * abs(sheet[free[0]] - fixed)
        return with_value(text, ("points", free[0]), exact_place(place, tables)), way
    return text, sheet[ends[1]] - sheet[ends[0]]


def weld(text: str, tables: Tables, change: Tables) -> str:
    """Weld the links at a point. If the point has a weld already, remove the weld.

    The barrel and the rod of a cylinder stay pinned.
    """
    point = change["point"]
    if point in tables.get("welds", {}):
        return without(text, ("welds", point))
    pinned = {link for _, _, parts in cylinders_of(tables) for link in parts["links"]}
    here = welded(tables, point)
    links = [link for link in here if link not in pinned]
    if len(links) < 2:
        raise EditError(f'a weld needs two links, but "{point}" only belongs to one')
    return with_table(text, ("welds", point), {} if links == here else {"links": links})


def welded(tables: Tables, point: str) -> list[str]:
    """Return the links that a weld at a point joins: the links in the file, by default all links with this point."""
    named = tables.get("welds", {}).get(point, {}).get("links")
    return named or [name for name, link in tables["links"].items() if point in points_of(link)]


def add_spring(text: str, tables: Tables, change: Tables) -> str:
    """Add a spring between two points. Its unloaded length is the drawn distance between the points."""
    text, (first, last) = with_points(text, tables, [change["from"], change["to"]])
    tables = tomllib.loads(text)
    grounded = ground_points(tables)
    if first in grounded:
        first, last = last, first
    if last not in grounded and not any(last in link.get("points", ()) for link in tables["links"].values()):
        text = fix(text, tables, {"point": last})
        grounded = (*grounded, last)
    sheet = drawn(tables)
    entries: dict[str, Any] = {"link": moving_links(tables, first)[0], "point": first, "anchor": last}
    if last not in grounded:
        entries["on"] = next(name for name in moving_links(tables, last) if name != entries["link"])
    entries |= {"length": f"{1000 * abs(sheet[first] - sheet[last]):.{DIGITS}g} mm", "stiffness": "1 N/mm"}
    return with_table(text, ("springs", 0), entries)


def add_mass(text: str, tables: Tables, change: Tables) -> str:
    """Add a point mass at a point of a moving link. If the point has a mass already, remove the mass."""
    point = change["point"]
    if point in tables.get("masses", {}):
        return without(text, ("masses", point))
    moving_links(tables, point)
    return with_value(text, ("masses", point), change.get("mass", "1 kg"))


def add_load(text: str, tables: Tables, change: Tables) -> str:
    """Add a force [N] at a point of a moving link."""
    point = change["point"]
    force = [float(f"{part:.{DIGITS}g}") for part in change["force"]]
    return with_table(text, ("loads", 0), {"link": moving_links(tables, point)[0], "point": point, "force": force})


def cylinders_of(tables: Tables) -> Iterator[tuple[str, str, Tables]]:
    """Yield the name, slider and parts of each cylinder that consists of a barrel and a rod.

    The parts are a table with four keys. `from` and `to` are the end points, `links` are the rod and the barrel, and
    `middle` is the second point of the barrel.
    """
    links, sliders = tables.get("links", {}), tables.get("sliders", {})
    for drive in tables.get("drives", ()):
        name, slider = drive.get("cylinder"), sliders.get(drive.get("slider"), {})
        rod, barrel = slider.get("link"), slider.get("on", GROUND)
        ends = points_of(links.get(barrel, {}))
        others = [point for other, link in links.items() if other != barrel for point in points_of(link)]
        alone = len(ends) == 2 and ends[1] not in others and len(points_of(links.get(rod, {}))) == 1
        if name in tables.get("cylinders", {}) and barrel != GROUND and alone and "through" in slider:
            parts = {"from": ends[0], "to": slider["through"], "links": [rod, barrel], "middle": ends[1]}
            yield name, drive["slider"], parts


def points_of(link: Tables) -> list[str]:
    """Return the names of the points of a link, or an empty list if the entry is invalid."""
    points = link.get("points", ())
    return [str(each) for each in points] if isinstance(points, list | dict) else []


def beams_of(link: Tables) -> list[list[Any]]:
    """Return the end points of the beams in the table of a link. Invalid beams are left out."""
    beams = link.get("beams")
    ends = [[each.get("from"), each.get("to")] if isinstance(each, dict) else each for each in beams or ()]
    return [each for each in ends if isinstance(each, list) and len(each) == 2]


SINGLE = {
    "link": "links", "slot": "slots", "slider": "sliders", "weld": "welds", "mass": "masses", "section": "sections",
    "material": "materials", "motor": "motors", "joint": "joints", "bearing": "bearings", "cam": "cams",
    **{part.key.removesuffix("s"): part.key for part in PARTS if part.menu},
}  # fmt: skip
LISTED = {"drive": "drives", "load": "loads", "spring": "springs", "gear": "gears"}


def remove(text: str, tables: Tables, change: Tables) -> str:
    """Remove a part and all parts attached to it."""
    kind, name = change["kind"], change["name"]
    if kind in LISTED:
        return without(text, (LISTED[kind], int(name)))
    if kind == "cylinder":
        return _without_cylinder(text, tables, name)
    if kind == "point":
        return _without_point(text, tables, name)
    if kind == "table":
        return without(text, (name,))
    if kind == "motor":
        for number, drive in enumerate(tables.get("drives", ())):
            text = without(text, ("drives", number, "motor")) if drive.get("motor") == name else text
    if name == GROUND:
        raise EditError("the ground cannot be removed")
    if kind == "link":
        text = _without_naming(text, tables, lambda table: name in (table.get("link"), table.get("on")))
    if kind in ("slot", "slider"):
        text = _without_naming(text, tables, partial(_names_slider, name))
    return without(text, (SINGLE[kind], name))


def _without_naming(text: str, tables: Tables, names: Callable[[Tables], bool]) -> str:
    """Remove all drives, loads, springs, gears, slots and sliders that refer to a removed part.

    `names` returns True if a table refers to the removed part.
    """
    for kind in LISTED.values():
        entries = tables.get(kind, [])
        for number in range(len(entries) - 1, -1, -1):
            entry = entries[number]
            if names(entry) or any(names(entry.get(end, {})) for end in ("driver", "follower")):
                text = without(text, (kind, number))
    for kind in ("slots", "sliders"):
        for name, table in tables.get(kind, {}).items():
            if names(table):
                text = _without_naming(text, tomllib.loads(text), partial(_names_slider, name))
                text = without(text, (kind, name))
    return text


def _names_slider(name: str, table: Tables) -> bool:
    """Return True if a table refers to the slider `name`."""
    return bool(table.get("slider") == name)


def _without_cylinder(text: str, tables: Tables, name: str) -> str:
    """Remove a cylinder with its barrel, rod, drive and middle point."""
    parts = next((parts for other, _, parts in cylinders_of(tables) if other == name), None)
    for link in parts["links"] if parts else ():
        text = remove(text, tomllib.loads(text), {"kind": "link", "name": link})
    text = without(text, ("points", parts["middle"])) if parts else text
    return without(text, ("cylinders", name))


def _without_point(text: str, tables: Tables, point: str) -> str:
    """Remove a point with all parts at this point, and the moving links that would keep only one point."""
    for name, link in tables.get("links", {}).items():
        points = link.get("points", ())
        if point not in points:
            continue
        if name != GROUND and len(points) <= 2:
            text = remove(text, tomllib.loads(text), {"kind": "link", "name": name})
            continue
        if isinstance(points, dict):
            text = without(text, ("links", name, "points", point))
        else:
            text = with_value(text, ("links", name, "points"), [each for each in points if each != point])
        beams = [list(beam) for beam in link.get("beams", ()) if isinstance(beam, list) and point not in beam]
        if "beams" in link and all(isinstance(beam, list) for beam in link["beams"]):
            path = ("links", name, "beams")
            text = with_value(text, path, beams) if beams else without(text, path)
    named = lambda table: point in (table.get("point"), table.get("anchor"), table.get("through"), table.get("at"))  # noqa: E731
    text = _without_naming(text, tomllib.loads(text), named)
    for kind in ("welds", "masses", "points"):
        text = without(text, (kind, point))
    return text
