"""Edits of a scene as changes of its text: points moved, numbers set, parts added or taken away."""

from __future__ import annotations

import cmath
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from kinelast.scene.document import document_from_text
from kinelast.scene.tables import PER_LENGTH
from kinelast.scene.units import Quantity, written_like
from live.text import as_toml, places, replaced, with_table, with_value, without
from rigid import GROUND, MechanismError, position_of

DIGITS = 6
EMPTY = """title = "New mechanism"

[points]

[links.ground]
points = []

[run]
gravity = [0, -9.81]
"""
SECTION, MATERIAL = "flat 20x5", "S235"
Tables = Mapping[str, Any]


class EditError(ValueError):
    """An edit that cannot be made of this scene."""


def edited(text: str, change: Mapping[str, Any]) -> str:
    """The text of a scene after an edit.

    Parameters
    ----------
    change
        `do`: a name of `EDITS`; and what that takes. Places are in m, angles in rad, numbers in SI units.

    Raises
    ------
    EditError
        The edit does not fit the scene.
    ValueError
        The text is no TOML.
    """
    do = EDITS.get(str(change.get("do")))
    if do is None:
        raise EditError(f"there is no edit {change.get('do')!r}")
    try:
        return do(text, tomllib.loads(text), change)
    except (KeyError, TypeError, IndexError) as error:
        raise EditError(f"the edit does not fit the scene: {error}") from None


def drawn(tables: Tables) -> dict[str, complex]:
    """Places of the points as the tables draw them [m]; those that cannot be read are left out."""
    per_length = _per_length(tables)
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


def _per_length(tables: Tables) -> float:
    """Metres to a bare length of the file."""
    return PER_LENGTH.get(tables.get("units", "m"), 1.0)


def _grounded(tables: Tables) -> Any:
    """Points of the ground as the file lists them."""
    return tables.get("links", {}).get(GROUND, {}).get("points", ())


def metres(value: Any, per_length: float) -> float:
    """A length as it stands in a file [m]; ValueError where it is none."""
    return float(Quantity.of_unit("m", value)) if isinstance(value, str) else float(value) * per_length


@lru_cache(maxsize=4)
def start_of(text: str) -> tuple[dict[str, complex], dict[str, complex]]:
    """Places of the points [m], and unit vectors of the links' axes, where the mechanism stands at its start.

    Empty where it is not determined or does not close.
    """
    try:
        with np.errstate(all="ignore"):
            scene = document_from_text(text).scene
            moved = scene.course.at([0.0])
    except (ValueError, MechanismError):
        return {}, {}
    seen: dict[str, complex] = {}
    for number, link in enumerate(scene.mechanism.links):
        for point in link.points:
            place = complex(position_of(moved, number, point)[0])
            if cmath.isfinite(place):
                seen.setdefault(point, place)
    ways = {link.name: complex(moved.direction[k, 0]) for k, link in enumerate(scene.mechanism.links)}
    return seen, {name: way for name, way in ways.items() if cmath.isfinite(way)}


def _number(there: Any, value: float, unit: str, per_bare: float = 1.0) -> Any:
    """A value in SI units written as the one that stands there; bare where that has no unit of this kind."""
    with suppress(ValueError):
        return written_like(there, value, unit, DIGITS, per_bare)
    return written_like(None, value, unit, DIGITS, per_bare)


def _place(tables: Tables, there: Any, place: complex) -> str:
    per_length = _per_length(tables)
    x, y = there if isinstance(there, list) and len(there) == 2 else (0, 0)
    return as_toml([_number(x, place.real, "m", per_length), _number(y, place.imag, "m", per_length)])


def move(text: str, tables: Tables, change: Tables) -> str:
    """A point put in another place: where it is drawn, with the lengths of the links of two points that end there.

    Where links stand otherwise than drawn, and one of the point has its shape from the drawing, the drawn place moves
    as far, turned back with that link.
    """
    point, to = change["point"], complex(*change["to"])
    now, ways = start_of(text)
    sheet, known = drawn(tables), places(text)
    before = now.get(point, sheet[point])
    links = {name: link for name, link in tables.get("links", {}).items() if point in link.get("points", ())}
    changes = []
    if ("points", point) in known.values and point in sheet:
        shift = (to - before) * _turned_back(_drawn_shapes(links), sheet, ways)
        rest = abs(before - sheet[point]) < 1e-9 or not _drawn_shapes(links)
        there = tables["points"][point]
        place = to if rest else sheet[point] + shift
        changes.append((known.values["points", point], _place(tables, there, place)))
    for name, link in links.items():
        changes += _of_link(tables, known.values, name, link, point, to, {**sheet, **now}, ways)
    changes += _starts(tables, known.values, links, point, to, {**sheet, **now})
    return replaced(text, changes)


def _drawn_shapes(links: Tables) -> Tables:
    """Those of some links that have their shape from the drawing."""
    return {name: link for name, link in links.items() if "length" not in link and not isinstance(link["points"], dict)}


def _turned_back(links: Tables, sheet: Mapping[str, complex], ways: Mapping[str, complex]) -> complex:
    """Unit vector that turns a step in the plane to the drawing's, of the first link that is drawn."""
    for name, link in links.items():
        ends = [sheet[each] for each in list(link["points"])[:2] if each in sheet]
        if name != GROUND and name in ways and len(ends) == 2 and ends[0] != ends[1]:
            return (ends[1] - ends[0]) / abs(ends[1] - ends[0]) / ways[name]
    return 1 + 0j


def _of_link(
    tables: Tables, spans: Any, name: str, link: Tables, point: str, to: complex, now: Any, ways: Any
) -> Iterator[Any]:
    """Changes of a link that has the point: of its length, or of the point in its own axes."""
    per_length = _per_length(tables)
    if "length" in link and len(link["points"]) == 2:
        other = next(each for each in link["points"] if each != point)
        if other in now and abs(to - now[other]) > 0:
            length = _number(link["length"], abs(to - now[other]), "m", per_length)
            yield spans["links", name, "length"], as_toml(length)
    if isinstance(link["points"], dict) and ("links", name, "points", point) in spans:
        first = next(iter(link["points"]))
        direction = ways.get(name, 1 + 0j)
        origin = 0j if name == GROUND else now.get(first, 0j)
        offset = 0j if name == GROUND else complex(*(metres(part, per_length) for part in link["points"][first]))
        if point != first:
            own = (to - origin) * direction.conjugate() + offset
            yield spans["links", name, "points", point], _place(tables, link["points"][point], own)


def _starts(tables: Tables, spans: Any, links: Tables, point: str, to: complex, now: Any) -> Iterator[Any]:
    """Changes of the start angles of drives that turn a link with the point at an end of its axes."""
    for number, drive in enumerate(tables.get("drives", ())):
        ends = list(links.get(drive.get("link"), {}).get("points", ()))[:2]
        if "start" not in drive or point not in ends or len(ends) < 2 or not all(each in now for each in ends):
            continue
        after = [to if each == point else now[each] for each in ends]
        before = now[ends[1]] - now[ends[0]]
        if before and after[1] != after[0]:
            turn = cmath.phase((after[1] - after[0]) / before)
            angle = Quantity.of_unit("rad", drive["start"]) if isinstance(drive["start"], str) else drive["start"]
            yield spans["drives", number, "start"], as_toml(_number(drive["start"], float(angle) + turn, "rad"))


def put(text: str, tables: Tables, change: Tables) -> str:
    """A value of any kind put in a place of the file."""
    return with_value(text, tuple(change["path"]), change["value"])


def set_number(text: str, tables: Tables, change: Tables) -> str:
    """A number by its path, in the SI unit, written in the unit that stands there."""
    document = document_from_text(text)
    from kinelast.scene.variables import in_file, place_of

    place = place_of(document.table, change["path"])
    value = float(change["value"])
    node: Any = tables
    for name in place.names:
        node = node[name] if not isinstance(name, int) or isinstance(node, list) else node
    names = place.names
    if names not in places(text).values and isinstance(names[-1], int):
        names = names[:-1]  # one size for both ends of a beam
    if isinstance(place.leaf, int):
        return with_value(text, names, round(value))
    unit = place.variable.unit
    new = _number(node, value, unit, place.per_bare) if isinstance(node, str | int | float) else in_file(place, value)
    return with_value(text, names, new)


def new_name(taken: Any, stem: str) -> str:
    """The first free name: of a capital letter the next letters, of a word the word and a number."""
    names = set(taken)
    if len(stem) == 1:
        letters = (chr(code) for code in range(ord(stem), ord("Z") + 1))
        free = next((letter for letter in letters if letter not in names), None)
        if free:
            return free
        stem = "P"
    number = next(k for k in range(1, len(names) + 2) if f"{stem}{k}" not in names)
    return f"{stem}{number}"


def _with_points(text: str, tables: Tables, wanted: list[Any]) -> tuple[str, list[str]]:
    """A text with a point more for every place among some points, and the names of all."""
    taken = {*tables.get("points", ()), *drawn(tables)}
    per_length = _per_length(tables)
    names = []
    for each in wanted:
        if isinstance(each, str):
            names.append(each)
            continue
        name = new_name(taken, "A")
        taken.add(name)
        names.append(name)
        text = with_value(text, ("points", name), [float(f"{part / per_length:.{DIGITS}g}") for part in each])
    return text, names


def add_point(text: str, tables: Tables, change: Tables) -> str:
    """A point more, of a link where one is named, of the ground where it is fixed."""
    text, names = _with_points(text, tables, [change["at"]])
    return fix(text, tomllib.loads(text), {"point": names[0]}) if change.get("fixed") else text


def add_link(text: str, tables: Tables, change: Tables) -> str:
    """A link through points and places, of a section and a material; three and more in a ring where `closed`."""
    text, names = _with_points(text, tables, change["points"])
    if len(set(names)) < 2:
        raise EditError("a link needs two points apart from each other")
    name = new_name(tables.get("links", ()), "link_")
    entries: dict[str, Any] = {"points": names}
    if change.get("closed") and len(names) > 2:
        entries["beams"] = [[names[k], names[(k + 1) % len(names)]] for k in range(len(names))]
    if change.get("rigid"):
        entries["rigid"] = True
    entries |= {"section": change.get("section") or SECTION, "material": change.get("material") or MATERIAL}
    return with_table(text, ("links", name), entries)


def fix(text: str, tables: Tables, change: Tables) -> str:
    """A point that stands on the ground from now on; or no longer."""
    point = change["point"]
    ground = tables.get("links", {}).get(GROUND)
    if ground is None:
        return with_table(text, ("links", GROUND), {"points": [point]})
    points = ground.get("points", [])
    if isinstance(points, dict):
        raise EditError("the ground's points have coordinates of their own: change them in the text")
    kept = [each for each in points if each != point] if point in points else [*points, point]
    return with_value(text, ("links", GROUND, "points"), kept)


def _moving_links(tables: Tables, point: str) -> list[str]:
    links = tables.get("links", {})
    names = [name for name, link in links.items() if name != GROUND and point in link.get("points", ())]
    if not names:
        raise EditError(f'no moving link has the point "{point}": draw a link to it first')
    return names


def add_slot(text: str, tables: Tables, change: Tables) -> str:
    """A straight slot of the ground in which a point moves; or none any longer."""
    point = change["point"]
    for kind, key in (("slots", "point"), ("sliders", "through")):
        for name, table in tables.get(kind, {}).items():
            if table.get(key) == point:
                return without(text, (kind, name))
    link = _moving_links(tables, point)[0]
    direction = complex(*change.get("direction", (1, 0)))
    entries = {"point": point, "link": link, "direction": f"{math.degrees(cmath.phase(direction)):.{DIGITS}g} deg"}
    return with_table(text, ("slots", new_name(tables.get("slots", ()), "slot_")), entries)


def weld(text: str, tables: Tables, change: Tables) -> str:
    """A point at which its links are joined rigidly; or no longer."""
    point = change["point"]
    if point in tables.get("welds", {}):
        return without(text, ("welds", point))
    if len(_moving_links(tables, point)) + (point in tables["links"].get(GROUND, {}).get("points", ())) < 2:
        raise EditError(f'a weld joins two links, and "{point}" belongs to one')
    return with_table(text, ("welds", point), {})


def add_spring(text: str, tables: Tables, change: Tables) -> str:
    """A spring between two points, unloaded as drawn."""
    text, (first, last) = _with_points(text, tables, [change["from"], change["to"]])
    tables = tomllib.loads(text)
    grounded = _grounded(tables)
    if first in grounded:
        first, last = last, first
    if last not in grounded and not any(last in link.get("points", ()) for link in tables["links"].values()):
        text = fix(text, tables, {"point": last})
        grounded = (*grounded, last)
    sheet = drawn(tables)
    entries: dict[str, Any] = {"link": _moving_links(tables, first)[0], "point": first, "anchor": last}
    if last not in grounded:
        entries["on"] = next(name for name in _moving_links(tables, last) if name != entries["link"])
    entries |= {"length": f"{1000 * abs(sheet[first] - sheet[last]):.{DIGITS}g} mm", "stiffness": "1 N/mm"}
    return with_table(text, ("springs", 0), entries)


def add_mass(text: str, tables: Tables, change: Tables) -> str:
    """A point mass at a point of a moving link; or none any longer."""
    point = change["point"]
    if point in tables.get("masses", {}):
        return without(text, ("masses", point))
    _moving_links(tables, point)
    return with_value(text, ("masses", point), change.get("mass", "1 kg"))


def add_load(text: str, tables: Tables, change: Tables) -> str:
    """A force at a point of a moving link [N]."""
    point = change["point"]
    force = [float(f"{part:.{DIGITS}g}") for part in change["force"]]
    return with_table(text, ("loads", 0), {"link": _moving_links(tables, point)[0], "point": point, "force": force})


def add_drive(text: str, tables: Tables, change: Tables) -> str:
    """A drive at constant speed of a link about its pin on the ground; or none any longer."""
    link = change["link"]
    for number, drive in enumerate(tables.get("drives", ())):
        if drive.get("link") == link:
            return without(text, ("drives", number))
    grounded = _grounded(tables)
    if not any(point in grounded for point in tables["links"][link]["points"]):
        raise EditError(f'"{link}" has no pin on the ground about which a drive could turn it')
    return with_table(text, ("drives", 0), {"link": link, "speed": change.get("speed", "60 rpm")})


SINGLE = {"link": "links", "slot": "slots", "slider": "sliders", "weld": "welds", "mass": "masses"}
LISTED = {"drive": "drives", "load": "loads", "spring": "springs"}


def remove(text: str, tables: Tables, change: Tables) -> str:
    """A part taken away, with all that hangs on it."""
    kind, name = change["kind"], change["name"]
    if kind in LISTED:
        return without(text, (LISTED[kind], int(name)))
    if kind == "point":
        return _without_point(text, tables, name)
    if name == GROUND:
        raise EditError("the ground stays: a mechanism stands on it")
    if kind == "link":
        text = _without_naming(text, tables, lambda table: name in (table.get("link"), table.get("on")))
    if kind in ("slot", "slider"):
        text = _without_naming(text, tables, lambda table: table.get("slider") == name)
    return without(text, (SINGLE[kind], name))


def _without_naming(text: str, tables: Tables, names: Callable[[Tables], bool]) -> str:
    """A text without drives, loads, springs, slots and sliders that name something that goes."""
    for kind in LISTED.values():
        entries = tables.get(kind, [])
        for number in range(len(entries) - 1, -1, -1):
            if names(entries[number]):
                text = without(text, (kind, number))
    for kind in ("slots", "sliders"):
        for name, table in tables.get(kind, {}).items():
            if names(table):
                text = without(text, (kind, name))
    return text


def _without_point(text: str, tables: Tables, point: str) -> str:
    """A text without a point: links of more than two points lose it, links of two go."""
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


EDITS: Mapping[str, Callable[[str, Tables, Tables], str]] = {
    "move": move, "put": put, "set": set_number, "point": add_point, "link": add_link, "fix": fix, "slot": add_slot,
    "weld": weld, "spring": add_spring, "mass": add_mass, "load": add_load, "drive": add_drive, "remove": remove,
}  # fmt: skip
