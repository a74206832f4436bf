"""Edits of the text of a scene file: move points, set numbers, add and remove parts."""

import cmath
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from elastic.links import in_line
from kinelast.scene.document import document_from_text
from kinelast.scene.links import in_order
from kinelast.scene.parsing import read_toml
from kinelast.scene.text import reader_in
from kinelast.values.units import Quantity, written_like
from live import parts
from live.copies import copy
from live.drives import add_cylinder, add_drive, add_gear, set_law, with_cylinders
from live.entries import add_table, entry
from live.parts import EditError, Tables, drawn, scale_of
from live.text import as_toml, places, replaced, with_value, without
from rigid import GROUND, MechanismError, position_of

STRAIGHT = 1e-3  # [rad] largest angle between successive beams of a straight bar
BARE = "1", "", "rad/rad", "rad/m", "m/rad"  # numbers with these units are written without a unit
EMPTY = """title = "New mechanism"

[points]

[links.ground]
points = []

[run]
gravity = [0, -9.81]
"""


def edited(text: str, change: Mapping[str, Any], folder: Path | None = None) -> str:
    """Apply an edit to the text of a scene.

    Parameters
    ----------
    change
        Arguments of the edit in SI units. The key `do` is the name of the edit in `EDITS`.
    folder
        Folder of the files to which the scene refers.

    Raises
    ------
    EditError
        The edit does not fit the scene.
    ValueError
        The text is not TOML.
    """
    do = EDITS.get(str(change.get("do")))
    if do is None:
        raise EditError(f"there is no edit {change.get('do')!r}")
    try:
        text, change = _with_joined_points(text, {**change, "folder": folder})
        return do(text, _tables(text), change)
    except (KeyError, TypeError, IndexError) as error:
        raise EditError(f"the edit does not fit the scene: {error}") from None


def _with_joined_points(text: str, change: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Add a point to the link for each end of a new part that lies on a link; return the text and the edit.

    Such an end is a table with the keys `link`, `between` and `share`, see `add_to_link`. In the returned edit, the
    name of the new point replaces the table.
    """
    for key in {"points", "from", "to"} & change.keys():
        ends = change[key] if key == "points" else [change[key]]
        for at, end in enumerate(ends):
            if isinstance(end, Mapping):
                before = drawn(_tables(text))
                text = add_to_link(text, _tables(text), {**end, "folder": change["folder"]})
                ends = [*ends[:at], *(drawn(_tables(text)).keys() - before.keys()), *ends[at + 1 :]]
        change[key] = ends if key == "points" else ends[0]
    return text, change


@lru_cache(maxsize=4)
def _tables(text: str) -> Tables:
    """Return the tables of a text. The result is cached, because each step of a drag edits the same text."""
    return read_toml(text)


@lru_cache(maxsize=4)
def start_of(text: str, folder: Path | None = None) -> tuple[dict[str, complex], dict[str, complex]]:
    """Return the positions of points [m] and the directions of the x axes of links at the start of the motion.

    Both are empty if the scene is invalid. Points and links of a loop that does not close are left out.
    """
    try:
        with np.errstate(all="ignore"):
            scene = document_from_text(text, read=reader_in(folder)).scene
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


def _number(there: Any, value: float, unit: str, per_bare: float = 1.0, digits: int = parts.DIGITS) -> Any:
    """Return an SI value as written in a file, with the unit of the existing number `there`.

    If the unit of `there` has another dimension, the result has no unit.
    """
    with suppress(ValueError):
        return written_like(there, value, unit, digits, per_bare)
    return written_like(None, value, unit, digits, per_bare)


def _place(tables: Tables, there: Any, place: complex, digits: int) -> str:
    per_length = scale_of(tables)
    x, y = there if isinstance(there, list) and len(there) == 2 else (0, 0)
    return as_toml([_number(x, place.real, "m", per_length, digits), _number(y, place.imag, "m", per_length, digits)])


def move(text: str, tables: Tables, change: Tables) -> str:
    """Move a point to the position `to` at the start of the motion.

    Update the drawn position, the lengths and coordinates of links, the start angles of drives, and cylinders. Points
    on a straight bar that ends at the moved point stay on the bar. At the start of the motion, a link may have another
    direction than in the drawing. The displacement in the drawing is then rotated accordingly.
    """
    now, ways = start_of(text, change["folder"])
    sheet, spans = drawn(tables), places(text).values
    seen = {**sheet, **now}
    moved = _carried(tables, seen, change["point"], complex(*change["to"]))
    after, digits = {**seen, **moved}, parts.DIGITS if len(moved) == 1 else parts.EXACT
    changes: dict[tuple[int, int], str] = {}
    for point, to in moved.items():
        links = _links_at(tables, point)
        if ("points", point) in spans and point in sheet:
            shift = (to - seen[point]) * _turned_back(_drawn_shapes(links), sheet, ways)
            rest = abs(seen[point] - sheet[point]) < 1e-9 or not _drawn_shapes(links)
            place = to if rest else sheet[point] + shift
            changes[spans["points", point]] = _place(tables, tables["points"][point], place, digits)
        for name, link in links.items():
            changes |= _of_link(tables, spans, name, link, point, after, ways, digits)
        changes |= _starts(tables, spans, links, point, seen, after)
    text = replaced(text, changes.items())
    for point in moved:
        text = with_cylinders(tables, text, point)
    return text


def _links_at(tables: Tables, point: str) -> Tables:
    """Return the links that contain a point."""
    return {name: link for name, link in tables.get("links", {}).items() if point in link.get("points", ())}


def _carried(tables: Tables, seen: Mapping[str, complex], point: str, to: complex) -> dict[str, complex]:
    """Return the new positions of a moved point, and of the points on straight bars that end at this point."""
    moved = {point: to}
    for each in (queue := [point]):
        for name, link in _links_at(tables, each).items():
            if name == GROUND or (isinstance(link["points"], dict) and each == next(iter(link["points"]))):
                continue  # the link defines its points by coordinates from this point, and keeps these coordinates
            for bar in _bars_from(link, seen, each):
                end = seen[bar[-1]]
                fresh = [other for other in bar[1:-1] if other not in moved]
                moved |= {
                    other: end + (seen[other] - end) * (moved[each] - end) / (seen[each] - end) for other in fresh
                }
                queue += fresh
    return moved


def _bars_from(link: Tables, seen: Mapping[str, complex], point: str) -> list[list[str]]:
    """Return the straight bars that end at a point. Each bar is a list of points, and starts at the given point.

    If the point is inside a bar, return an empty list.
    """
    known = {each: seen[each] for each in parts.points_of(link) if each in seen}
    pairs = [pair for pair in parts.beams_of(link) or pairwise(in_order(known, STRAIGHT)) if known.keys() >= {*pair}]
    pairs += [pair[::-1] for pair in pairs]

    def beyond(start: str, end: str) -> str | None:
        ways = ((far, known[far] - known[end]) for near, far in pairs if near == end)
        return next((far for far, way in ways if in_line(known[end] - known[start], way, STRAIGHT)), None)

    bars = [list(pair) for pair in pairs if pair[0] == point]
    if any(beyond(bar[1], point) for bar in bars):
        return []
    for bar in bars:
        while far := beyond(*bar[-2:]):
            bar.append(far)
    return bars


def _drawn_shapes(links: Tables) -> Tables:
    """Return the links without their own dimensions. The drawn positions of the points define their shape."""
    return {name: link for name, link in links.items() if "length" not in link and not isinstance(link["points"], dict)}


def _turned_back(links: Tables, sheet: Mapping[str, complex], ways: Mapping[str, complex]) -> complex:
    """Return the unit vector that rotates a displacement from the start of the motion to the drawing."""
    for name, link in links.items():
        ends = [sheet[each] for each in list(link["points"])[:2] if each in sheet]
        if name != GROUND and name in ways and len(ends) == 2 and ends[0] != ends[1]:
            return (ends[1] - ends[0]) / abs(ends[1] - ends[0]) / ways[name]
    return 1 + 0j


def _of_link(
    tables: Tables, spans: Any, name: str, link: Tables, point: str, after: Any, ways: Any, digits: int
) -> Iterator[Any]:
    """Yield the edits of a link after one of its points has moved.

    The edits change the length of the link, or the coordinates of the point in link axes.
    """
    per_length = scale_of(tables)
    if "length" in link and len(link["points"]) == 2:
        other = next(each for each in link["points"] if each != point)
        if other in after and abs(after[point] - after[other]) > 0:
            length = _number(link["length"], abs(after[point] - after[other]), "m", per_length)
            yield spans["links", name, "length"], as_toml(length)
    if isinstance(link["points"], dict) and ("links", name, "points", point) in spans:
        first = next(iter(link["points"]))
        direction = ways.get(name, 1 + 0j)
        origin = 0j if name == GROUND else after.get(first, 0j)
        offset = 0j if name == GROUND else complex(*(parts.metres(part, per_length) for part in link["points"][first]))
        if point != first:
            own = (after[point] - origin) * direction.conjugate() + offset
            yield spans["links", name, "points", point], _place(tables, link["points"][point], own, digits)


def _starts(tables: Tables, spans: Any, links: Tables, point: str, before: Any, after: Any) -> Iterator[Any]:
    """Yield the edits of the start angles of drives after a point has moved.

    A start angle changes if the point is one of the first two points of the driven link.
    """
    for number, drive in enumerate(tables.get("drives", ())):
        ends = list(links.get(drive.get("link"), {}).get("points", ()))[:2]
        if "start" not in drive or point not in ends or len(ends) < 2 or not before.keys() >= {*ends}:
            continue
        was, now = (at[ends[1]] - at[ends[0]] for at in (before, after))
        if was and now:
            turn = cmath.phase(now / was)
            angle = Quantity.of_unit("rad", drive["start"]) if isinstance(drive["start"], str) else drive["start"]
            yield spans["drives", number, "start"], as_toml(_number(drive["start"], float(angle) + turn, "rad"))


def add_to_link(text: str, tables: Tables, change: Tables) -> str:
    """Add a new point to a link, or pin an existing point to the link.

    `at` is the position of a new point, or the name of an existing point. Alternatively, the new point divides the line
    `between` two points at the fraction `share` of its length. A point on a beam divides the beam into two beams, and
    the points of the link stay in order along the beams. A point beside the beams gets no beam.
    """
    name, link = change["link"], tables["links"][change["link"]]
    ends = parts.points_of(link)
    now, ways = start_of(text, change["folder"])
    sheet = drawn(tables)
    there, seen = change.get("at"), {**sheet, **now}
    if "between" in change:
        first, last = (sheet[each] for each in change["between"])
        place = first + float(change["share"]) * (last - first)
        there = [place.real, place.imag]
    text, (point,) = parts.with_points(text, tables, [there])
    if point in ends:
        raise EditError(f'"{name}" already has the point "{point}"')
    if "between" in change:
        text = with_value(text, ("points", point), parts.exact_place(place, tables))  # exactly on the line
    seen = {**seen, point: _place_at_start(change, seen, point)}
    order = in_order({each: seen[each] for each in (*ends, point)}, STRAIGHT)
    if "length" in link or isinstance(link["points"], dict):
        text = _in_own_axes(text, tables, name, order, seen, ways)
    else:
        text = with_value(text, ("links", name, "points"), order)
    path = "links", name, "beams"
    if "beams" in link:
        return with_value(text, path, _divided(link["beams"], change.get("between"), point))
    if link.get("rigid") or order[-1] != point:
        return text
    return with_value(text, path, [list(pair) for pair in pairwise(order[:-1])])


def _divided(beams: list[Any], between: Any, point: str) -> list[Any]:
    """Return the beams of a link after a new point has divided the beam `between` two points."""
    divided: list[Any] = []
    for beam, ends in zip(beams, parts.beams_of({"beams": beams}), strict=True):
        if between is None or {*ends} != {*between}:
            divided.append(beam)
        elif isinstance(beam, dict):
            divided += [{**beam, "to": point}, {**beam, "from": point}]
        else:
            divided += [[ends[0], point], [point, ends[1]]]
    return divided


def _place_at_start(change: Tables, seen: Mapping[str, complex], point: str) -> complex:
    """Return the position of a new point at the start of the motion."""
    if "between" in change:
        first, last = (seen[each] for each in change["between"])
        return first + float(change["share"]) * (last - first)
    return seen[point] if isinstance(change["at"], str) else complex(*change["at"])


def _in_own_axes(text: str, tables: Tables, name: str, order: list[str], seen: Mapping[str, complex], ways: Any) -> str:
    """Define the points `order` of a link by coordinates in link axes. Existing coordinates stay as they are."""
    link = tables["links"][name]
    ends = parts.points_of(link)
    first, last = (seen[each] for each in ends[:2])
    way = ways.get(name, (last - first) / abs(last - first))
    coordinates = dict(link["points"]) if isinstance(link["points"], dict) else {}
    for each in order:
        coordinates.setdefault(each, parts.exact_place((seen[each] - first) * way.conjugate(), tables))
    text = without(text, ("links", name, "length"))
    return with_value(text, ("links", name, "points"), {each: coordinates[each] for each in order})


def put(text: str, tables: Tables, change: Tables) -> str:
    """Set a value of any type by its path."""
    return with_value(text, tuple(change["path"]), change["value"])


def _is_number(written: str) -> bool:
    with suppress(ValueError):
        return math.isfinite(float(written))
    return False


def set_number(text: str, tables: Tables, change: Tables) -> str:
    """Set a number by its path. The new value is a number in SI units, or a text with a unit."""
    document = document_from_text(text, read=reader_in(change["folder"]))
    from kinelast.scene.variables import in_file, place_of

    place = place_of(document.table, change["path"])
    written, unit = change["value"], place.variable.unit
    if isinstance(written, str) and unit not in BARE and not isinstance(place.leaf, int):
        if _is_number(written):
            raise EditError(f'{change["path"]}: expected a number with its unit, as in "{written.strip()} {unit}"')
        value = float(Quantity.of_unit(unit, written))
    elif isinstance(written, str) and not _is_number(written):
        raise EditError(f"{change['path']}: expected a number")
    else:
        value = float(written)
    node: Any = tables
    for name in place.names:
        node = node[name] if not isinstance(name, int) or isinstance(node, list) else node
    names = place.names
    if names not in places(text).values and isinstance(names[-1], int):
        names = names[:-1]  # the file has one value for both ends of a beam, without a list
    if isinstance(place.leaf, int):
        return with_value(text, names, round(value))
    if isinstance(written, str) and unit not in BARE:
        return with_value(text, names, written.strip())
    new = _number(node, value, unit, place.per_bare) if isinstance(node, str | int | float) else in_file(place, value)
    return with_value(text, names, new)


EDITS: Mapping[str, Callable[[str, Tables, Tables], str]] = {
    "move": move, "put": put, "set": set_number, "trace": add_to_link, "entry": entry, "table": add_table, "copy": copy,
    "drive": add_drive, "law": set_law, "gear": add_gear, "cylinder": add_cylinder,
    "point": parts.add_point, "link": parts.add_link, "fix": parts.fix, "slot": parts.add_slot, "weld": parts.weld,
    "spring": parts.add_spring, "mass": parts.add_mass, "load": parts.add_load, "remove": parts.remove,
}  # fmt: skip
