"""Edits that add or remove drives, motion laws, gears and cylinders."""

import cmath
import tomllib
from collections.abc import Iterator
from typing import Any

from kinelast.scene.drives import motion_table
from kinelast.values.units import Quantity
from live import parts as edits
from live.parts import EditError, Tables, drawn, points_of
from live.text import with_table, with_value, without
from rigid import GROUND
from rigid.laws import CURVES

SPEED, LAW = "60 rpm", "cycloidal"
STROKE_DURATION = "1 s"  # initial duration of each stroke of a sliding drive
CONSTANT, SPLINE = "constant speed", "spline through points"
MOTIONS = [CONSTANT, *(curve for curve in CURVES if curve not in ("dwell", "constant-speed")), SPLINE]
"""Menu of motions: constant speed, strokes from rest to rest, and a spline."""
UNITS = {True: ("m", "m/s"), False: ("rad", "rad/s")}  # units of coordinate and rate; True: slider, False: pin


def _shared(tables: Tables, link: str, other: str) -> list[str]:
    """Return the points at which two links are pinned together."""
    points = points_of(tables["links"].get(other, {}))
    return [point for point in points_of(tables["links"].get(link, {})) if point in points]


def _carriers(tables: Tables, *links: str) -> Iterator[str]:
    """Yield the other links to which all given links are pinned. Links with fewer joints to the ground come first."""
    near, seen = [GROUND], {GROUND}
    for each in near:
        found = [name for name in tables["links"] if name not in seen and _shared(tables, name, each)]
        near += found
        seen |= set(found)
    return (each for each in near if each not in links and all(_shared(tables, link, each) for link in links))


def _joint(tables: Tables, link: str, carrier: str) -> dict[str, Any]:
    """Return the table entries that identify the joint between a link and its carrier."""
    pins = _shared(tables, link, carrier)
    names = {"link": link} if carrier == GROUND else {"link": link, "on": carrier}
    return names if len(pins) == 1 else {**names, "at": pins[0]}


def add_drive(text: str, tables: Tables, change: Tables) -> str:
    """Add a drive of a link or of a point in a slot. If the link or slot has a drive already, remove it.

    A link is driven at constant speed relative to the ground. If the link is not pinned to the ground, it is driven
    relative to a link to which it is pinned: the link with the fewest joints to the ground. A point is driven along its
    slot and back.
    """
    if "point" in change:
        return _add_slide(text, tables, change["point"])
    link = change["link"]
    for number, drive in enumerate(tables.get("drives", ())):
        if drive.get("link") == link:
            return without(text, ("drives", number))
    carrier = next(_carriers(tables, link), None)
    if carrier is None:
        raise EditError(f'"{link}" has no pin for a drive: draw a link to it, or fix a point')
    entries = {**_joint(tables, link, carrier), "speed": change.get("speed", SPEED)}
    return with_table(text, ("drives", 0), entries)


def _there_and_back(way: float) -> list[dict[str, str]]:
    """Return a motion law: a stroke by a distance [m], rounded to two digits, and a return stroke."""
    by = f"{float(f'{1000 * way:.2g}'):g} mm"
    return [{"curve": LAW, "duration": STROKE_DURATION, "by": each} for each in (by, edits.opposite(by))]


def _add_slide(text: str, tables: Tables, point: str) -> str:
    """Add a drive along the slot of a point. If the slot has a drive already, remove it."""
    for kind, key in (("slots", "point"), ("sliders", "through")):
        for name, table in tables.get(kind, {}).items():
            if table.get(key) != point:
                continue
            for number, drive in enumerate(tables.get("drives", ())):
                if drive.get("slider") == name:
                    return without(text, ("drives", number))
            places = list(drawn(tables).values())
            extent = max(abs(one - other) for one in places for other in places)
            return with_table(text, ("drives", 0), {"slider": name, "law": _there_and_back(extent / 10)})
    raise EditError(f'"{point}" has no slot for a drive')


def set_law(text: str, tables: Tables, change: Tables) -> str:
    """Set the motion of a drive: constant speed, a stroke (optionally with return), or a spline through points.

    In `change`, quantities are strings with units, and the points of a spline are a CSV text.
    """
    number = int(change["drive"])
    drive = tables["drives"][number]
    if "effort" in drive:
        raise EditError("the motion of this drive follows from its effort: change it in the text")
    length, rate = UNITS["slider" in drive]
    points = spline_points(str(change["points"]), length, edits.scale_of(tables)) if change["curve"] == SPLINE else []
    for key in ("speed", "law", "motion", "repeat"):
        text = without(text, ("drives", number, key))
    if points:
        return with_value(text, ("drives", number, "motion"), points)
    if change["curve"] == CONSTANT:
        Quantity.of_unit(rate, str(change["speed"]))
        return with_value(text, ("drives", number, "speed"), str(change["speed"]))
    by, duration = str(change["by"]).strip(), str(change["duration"]).strip()
    Quantity.of_unit(length, by)
    Quantity.of_unit("s", duration)
    strokes = [by, edits.opposite(by)] if change.get("back") else [by]
    law = [{"curve": str(change["curve"]), "duration": duration, "by": each} for each in strokes]
    return with_value(text, ("drives", number, "law"), law)


def spline_points(written: str, unit: str, per_length: float) -> list[list[Any]]:
    r"""Convert a CSV text to the times and coordinates of a motion, as written in a scene file.

    `unit` and `per_length` are explained in `kinelast.scene.drives.motion_table`.

    Examples
    --------
    >>> spline_points("time [s], angle [deg]\n0, 0\n1, 90\n2, 45\n3, 0", "rad", 1.0)[1]
    ['1 s', '90 deg']
    """
    try:
        return [[*row] for row in motion_table(written, unit, per_length).written]
    except ValueError as error:
        raise EditError(str(error)) from None


def add_gear(text: str, tables: Tables, change: Tables) -> str:
    """Add a pair of external gears, or a gear and a rack. If the pair exists already, remove it."""
    pair = change["driver"], change["follower"]
    if any(isinstance(end, dict) for end in pair):
        return _add_rack(text, tables, *pair)
    if pair[0] == pair[1]:
        raise EditError("a gear pair needs two links: click the driver and the follower")
    for number, gear in enumerate(tables.get("gears", ())):
        if {gear["driver"].get("link"), gear["follower"].get("link")} == set(pair):
            return without(text, ("gears", number))
    carrier = next(_carriers(tables, *pair), None)
    if carrier is None:
        raise EditError("both links need a pin on the same link, such as the ground")
    driver, follower = (_joint(tables, link, carrier) for link in pair)
    return with_table(text, ("gears", 0), {"driver": driver, "follower": follower, "ratio": -1.0})


def _add_rack(text: str, tables: Tables, driver: Any, follower: Any) -> str:
    """Add a gear and a rack. If the pair exists already, remove it.

    Either `driver` or `follower` is the name of the link with the gear. The other argument is a table with the key
    `point`: a point of the rack that slides in a slot. The radius of the gear is the distance from its pin to the line
    of the slot. The magnitude of the ratio is the radius [m], or 1/radius if the rack drives the gear.
    """
    wheel = next((end for end in (driver, follower) if isinstance(end, str)), None)
    slid = next(end["point"] for end in (driver, follower) if isinstance(end, dict))
    slots = {**tables.get("sliders", {}), **tables.get("slots", {})}
    rail = next((name for name, table in slots.items() if slid in (table.get("point"), table.get("through"))), None)
    if wheel is None or rail is None:
        raise EditError("a rack needs a link and a point in a slot: click both")
    for number, gear in enumerate(tables.get("gears", ())):
        if {wheel, rail} == {name for end in ("driver", "follower") for name in gear[end].values()} & {wheel, rail}:
            return without(text, ("gears", number))
    carrier = str(slots[rail].get("on", GROUND))
    joint = _joint(tables, wheel, carrier)
    pins, sheet = _shared(tables, wheel, carrier), drawn(tables)
    if not pins:
        raise EditError(f'"{wheel}" has no pin on "{carrier}", which has the slot')
    given = slots[rail]["direction"]
    way = complex(*given) if isinstance(given, list) else cmath.rect(1.0, Quantity.of_unit("rad", str(given)))
    arm = sheet[slid] - sheet[pins[0]]
    ratio = -(arm * (way / abs(way)).conjugate()).imag
    if not abs(ratio) > 0:
        raise EditError("the line of the slot goes through the pin of the gear: the gear would have no radius")
    rack, turns = {"slider": rail}, isinstance(driver, str)
    ends = {"driver": joint, "follower": rack} if turns else {"driver": rack, "follower": joint}
    return with_table(text, ("gears", 0), {**ends, "ratio": float(f"{ratio if turns else 1 / ratio:.{edits.EXACT}g}")})


def wheels(tables: Tables) -> Iterator[dict[str, Any]]:
    """Yield the links or sliders, the pins (None for a rack), and the ratio of each gear pair."""
    for gear in tables.get("gears", ()):
        ends = [gear.get(end) if isinstance(gear.get(end), dict) else {} for end in ("driver", "follower")]
        pins = [
            end.get("at") or next(iter(_shared(tables, end.get("link"), end.get("on", GROUND))), None) for end in ends
        ]
        names = [str(end.get("link") or end.get("slider")) for end in ends]
        yield {"joints": names, "pins": pins if all(pins) else None, "ratio": gear.get("ratio")}


def add_cylinder(text: str, tables: Tables, change: Tables) -> str:
    """Add a cylinder between two points: barrel, rod, slider and drive.

    The drive extends the cylinder by 1/10 of the length and retracts it. One end must be a point of a moving link. If
    the other end does not belong to a link, it is fixed to the ground.
    """
    text, (start, end) = edits.with_points(text, tables, [change["from"], change["to"]])
    tables = tomllib.loads(text)
    if end in edits.ground_points(tables) or not _is_moving(tables, end):
        start, end = end, start
    edits.moving_links(tables, end)
    if start not in edits.ground_points(tables) and not _is_moving(tables, start):
        text = edits.fix(text, tables, {"point": start})
    if start == end:
        raise EditError("a cylinder needs two different points")
    for point in (start, end):  # a weld at the point does not include the cylinder, which is pinned
        if point in tables.get("welds", {}):
            text = with_value(text, ("welds", point, "links"), edits.welded(tables, point))
    return _with_cylinder(text, tables, start, end)


def _with_cylinder(text: str, tables: Tables, start: str, end: str) -> str:
    """Add the tables of a cylinder between two points."""
    name = edits.new_name(
        [*tables.get("cylinders", ()), *tables.get("sliders", ()), *tables.get("slots", ())], "cylinder_"
    )
    middle, barrel, rod = f"{name}_middle", f"{name}_barrel", f"{name}_rod"
    sheet = drawn(tables)
    line = sheet[end] - sheet[start]
    text = with_value(text, ("points", middle), edits.rounded_place(sheet[start] + line / 2, tables))
    body = {"points": [start, middle], "rigid": True, "mass": "1 kg", "center": middle}
    text = with_table(text, ("links", barrel), body)
    text = with_table(text, ("links", rod), {"points": [end], "mass": "0.5 kg"})
    slider = {"link": rod, "on": barrel, "through": end, "direction": edits.along(line)}
    text = with_table(text, ("sliders", name), slider)
    law = _there_and_back(abs(line) / 10)
    text = with_table(text, ("drives", 0), {"slider": name, "cylinder": name, "law": law})
    sizes = {"bore": "40 mm", "rod": "20 mm", "length": f"{1000 * abs(line):.{edits.DIGITS}g} mm"}
    return with_table(text, ("cylinders", name), sizes)


def _is_moving(tables: Tables, point: str) -> bool:
    return any(point in points_of(link) for name, link in tables["links"].items() if name != GROUND)


def with_cylinders(before: Tables, text: str, point: str) -> str:
    """Realign the cylinders that end at a moved point.

    `before` are the tables before the move. A `length` that was equal to the distance between the ends is updated.
    """
    if "cylinders" not in before:
        return text
    tables = tomllib.loads(text)
    for name, slider, parts in edits.cylinders_of(tables):
        start, end = (_ends(each, parts) for each in (before, tables))
        if point not in (parts["from"], parts["to"]) or start is None or end is None:
            continue
        text = with_value(text, ("sliders", slider, "direction"), edits.along(end[1] - end[0]))
        text = with_value(text, ("points", parts["middle"]), edits.rounded_place((end[0] + end[1]) / 2, tables))
        length = tables["cylinders"][name].get("length")
        if length == f"{1000 * abs(start[1] - start[0]):.{edits.DIGITS}g} mm":
            text = with_value(text, ("cylinders", name, "length"), f"{1000 * abs(end[1] - end[0]):.{edits.DIGITS}g} mm")
    return text


def _ends(tables: Tables, parts: Tables) -> tuple[complex, complex] | None:
    """Return the drawn positions of both ends of a cylinder [m], or None if an end has no valid position."""
    sheet = drawn(tables)
    return (sheet[parts["from"]], sheet[parts["to"]]) if {parts["from"], parts["to"]} <= sheet.keys() else None
