"""Copies of links, shifted or mirrored.

The masses, welds, slots and sliders at the links are also copied. Drives are copied if they have a constant speed and
no further settings. Loads, springs and gears are not copied.
"""

import tomllib
from cmath import rect
from collections.abc import Iterator, Mapping
from typing import Any

from kinelast.values.units import Quantity
from live.parts import EditError, Tables, along, drawn, fix, ground_points, new_name, opposite, points_of, with_points
from live.text import with_table, with_value
from rigid import GROUND

APART = 1.2  # (offset of a shifted copy) / (width of the copied links)
ON_LINE = 1e-9  # a point is on the mirror line if its distance <= ON_LINE * (width of the copied links)


def copy(text: str, tables: Tables, change: Tables) -> str:
    """Copy one link or all moving links. The copy is shifted, or mirrored in the vertical line through `about`.

    Points on the mirror line belong to both the original and the copy. `about` is the name of a point. Without `about`,
    the mirror line goes through the first point of the links that is fixed to the ground. If no point is fixed to the
    ground, the mirror line goes through the first point.
    """
    links = tables.get("links", {})
    names = [change["link"]] if change.get("link") else [name for name in links if name != GROUND]
    places = drawn(tables)
    points = [each for each in dict.fromkeys(p for name in names for p in points_of(links[name])) if each in places]
    if not points:
        raise EditError("there is no link to copy")
    grounded = [each for each in points if each in ground_points(tables)]
    across = [places[each].real for each in points]
    width = max(across) - min(across) or max(abs(places[each] - places[points[0]]) for each in points)
    mirror = bool(change.get("mirror"))
    line = places[change.get("about") or [*grounded, *points][0]].real
    image = {
        each: complex(2 * line - at.real, at.imag) if mirror else at + APART * width
        for each, at in places.items()
        if each in points
    }
    moved = [each for each in points if abs(image[each] - places[each]) > ON_LINE * width]
    if not moved:
        raise EditError("the link lies on the mirror line: choose another point for the line")
    shared = next((each for each in points if each not in moved and each not in grounded), "")
    if shared and len(names) > 1 and tables.get("drives"):
        raise EditError(
            f'the mirror line goes through "{shared}", which moves: both halves, each with a drive, would share it. '
            "Choose another point for the line, or mirror a single link"
        )
    text, fresh = with_points(text, tables, [[image[each].real, image[each].imag] for each in moved])
    named = {**{each: each for each in points}, **dict(zip(moved, fresh, strict=True))}
    for each in grounded:
        if each in moved:
            text = fix(text, tomllib.loads(text), {"point": named[each]})
    taken = [*links]
    for name in names:
        named[name] = new_name(taken, "link_")
        taken.append(named[name])
        text = with_table(text, ("links", named[name]), _link(links[name], named, mirror))
    for path, entries in _attached_parts(tables, names, named, mirror):
        text = with_value(text, path, entries) if path[0] == "masses" else with_table(text, path, entries)
    return text


def _link(link: Tables, named: Mapping[str, str], mirror: bool) -> dict[str, Any]:
    """Return the table entries of the copy of a link."""
    entries: dict[str, Any] = _renamed(link, named)
    if isinstance(link["points"], dict):
        entries["points"] = {named[point]: _flipped(place, mirror) for point, place in link["points"].items()}
    if mirror and link.keys() & {"outline", "masses"}:
        raise EditError("a link with an outline or with masses cannot be mirrored: copy it instead")
    if "center" in link:
        entries["center"] = _flipped(link["center"], mirror)
    return entries


def _flipped(place: list[Any], mirror: bool) -> list[Any]:
    """Return a position on a copied link, in link axes.

    If the copy is mirrored, the second coordinate changes its sign.
    """
    return [place[0], opposite(place[1])] if mirror else place


def _attached_parts(
    tables: Tables, names: list[str], named: Mapping[str, str], mirror: bool
) -> Iterator[tuple[Any, Any]]:
    """Yield paths and entries of the copied masses, welds, slots, sliders, and drives.

    A drive is copied if its speed is constant and it has no further settings, such as a motor.
    """
    for point, mass in tables.get("masses", {}).items():
        if named.get(point, point) != point:
            yield ("masses", named[point]), mass
    for point, weld in tables.get("welds", {}).items():
        if named.get(point, point) != point:
            yield ("welds", named[point]), _renamed(weld, named)
    for kind in ("slots", "sliders"):
        taken = [*tables.get(kind, {})]
        for guide in tables.get(kind, {}).values():
            if guide.get("link") in names and guide.get("on", GROUND) in (GROUND, *names) and "direction" in guide:
                taken.append(new_name(taken, f"{kind[:-1]}_"))
                entries = _renamed(guide, named)
                turned = {"direction": _mirrored(guide["direction"])} if mirror else {}
                yield (kind, taken[-1]), {**entries, **turned}
    for drive in tables.get("drives", ()):
        if drive.get("link") in names and drive.keys() <= {"link", "on", "at", "speed"}:
            entries = _renamed(drive, named)
            yield ("drives", 0), {**entries, "speed": opposite(drive["speed"])} if mirror else entries


def _renamed(value: Any, named: Mapping[str, str]) -> Any:
    """Replace the names of points and links in table entries by their names in the copy."""
    if isinstance(value, dict):
        kept = ("section", "material", "motor")
        return {key: each if key in kept else _renamed(each, named) for key, each in value.items()}
    if isinstance(value, list):
        return [_renamed(each, named) for each in value]
    return named.get(value, value) if isinstance(value, str) else value


def _mirrored(direction: Any) -> Any:
    """Mirror a direction in a vertical line."""
    if isinstance(direction, list):
        return [opposite(direction[0]), direction[1]]
    angle = float(Quantity.of_unit("rad", direction)) if isinstance(direction, str) else float(direction)
    return along(-rect(1.0, angle).conjugate())
