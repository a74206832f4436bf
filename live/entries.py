"""Edits of single table entries, and new tables for parts without a symbol in the drawing."""

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from kinelast.scene.parsing import read_toml
from kinelast.scene.parts import PARTS
from kinelast.scene.schema import scene_schema
from live.parts import EditError, Tables, drawn, new_name, points_of
from live.text import with_table, with_value, without
from rigid import GROUND

FIRST: Mapping[str, Mapping[str, Any]] = {
    "sections": {"shape": "rectangle", "depth": "20 mm", "width": "5 mm"},
    "materials": {"E": "210 GPa", "density": "7850 kg/m^3", "yield": "235 MPa"},
    "motors": {"rated_torque": "1 N m", "peak_torque": "3 N m"},
    "joints": {"friction": 0.1, "radius": "5 mm"},
    "bearings": {"plain": {"diameter": "10 mm", "width": "10 mm", "pressure": "10 MPa"}},
    "limits": {"safety": 1.5},
    "fatigue": {"surface": "machined"},
    "sensitivities": {"figures": ["deflection"]},
}
"""Initial contents of new tables for parts without a symbol in the drawing."""
APART = 0.3  # (distance of a new camshaft below the roller) / (size of the drawing)
COUNT, TOLERANCE = 11, "1 %"  # initial number of values in a sweep, and initial tolerance of a number


@cache
def keys() -> dict[str, list[tuple[str, str]]]:
    """Return the keys of each table of a scene with their descriptions."""
    schema = scene_schema()["$defs"]
    described = {}
    for name, entry in schema["SceneTable"]["properties"].items():
        known = {
            key: value.get("description", "").replace("`", "")
            for table in _tables(entry)
            for key, value in schema[table]["properties"].items()
        }
        if known:
            described[name] = sorted(known.items())
    return described


def _tables(entry: Any) -> Iterator[str]:
    """Yield the names of the tables that an entry of the schema refers to or contains."""
    if "$ref" in entry:
        yield entry["$ref"].rpartition("/")[2]
    for each in (entry.get("additionalProperties"), entry.get("items"), *entry.get("anyOf", ())):
        yield from _tables(each) if isinstance(each, dict) else ()


def typed(words: str) -> Any:
    """Parse a value that the user has typed: as TOML if possible, otherwise as text.

    Examples
    --------
    >>> typed("5"), typed("[1, 2]"), typed("5 N/mm"), typed('"a"')
    (5, [1, 2], '5 N/mm', 'a')
    """
    try:
        parsed = read_toml(f"typed = {words.strip()}")
    except tomllib.TOMLDecodeError:
        return words.strip()
    plain = isinstance(parsed["typed"], str | int | float | list | dict)
    return parsed["typed"] if len(parsed) == 1 and plain else words.strip()


def entry(text: str, tables: Tables, change: Tables) -> str:
    """Set the table entry at a path to a value that the user has typed. An empty value removes the entry."""
    path = tuple(change["path"])
    words = str(change["value"])
    return with_value(text, path, typed(words)) if words.strip() else without(text, path)


def add_table(text: str, tables: Tables, change: Tables) -> str:
    """Add the table of a part without a symbol in the drawing.

    Examples are a section, a material, limits, the properties of a joint, or the sweep of a number. `of` is the path of
    the drive or link that gets the new motor, section or material.
    """
    kind = change["kind"]
    if kind in ("sweep", "tolerances", "optimize"):
        return _with_study(text, kind, change)
    if kind == "cams":
        return _with_cam(text, tables, change)
    part = next((each for each in PARTS if each.menu and each.key == kind), None)
    if part is not None:
        keys = part.begin(*map(str, (change.get("of") or ("", ""))[:2]))
        if keys is None:
            raise EditError(f"first select: {part.menu}")
        return with_table(text, (kind, new_name(tables.get(kind, ()), f"{kind.removesuffix('s')}_")), keys)
    if kind not in FIRST:
        raise EditError(f"there is no table {kind!r} to add")
    if kind in ("limits", "fatigue", "sensitivities"):
        if kind in tables:
            raise EditError(f"[{kind}] already exists")
        return with_table(text, (kind,), FIRST[kind])
    stem = kind.removesuffix("s")
    named = str(change.get("name") or new_name(tables.get(kind, ()), f"{stem}_"))
    if named in tables.get(kind, {}):
        raise EditError(f"[{kind}.{named}] already exists")
    if kind in ("joints", "bearings") and not change.get("name"):
        raise EditError(f"first select the point of the {stem}")
    of = change.get("of")
    if kind == "motors" and not of:
        if len(tables.get("drives", ())) != 1:
            raise EditError("first select the drive of the motor")
        of = ("drives", 0)
    text = with_table(text, (kind, named), FIRST[kind])
    return with_value(text, (*of, stem), named) if of else text


def _with_cam(text: str, tables: Tables, change: Tables) -> str:
    """Add a cam below a point of a moving link. The point becomes the centre of the roller."""
    point, links = str(change.get("name") or ""), tables.get("links", {})
    owner = next((name for name, link in links.items() if name != GROUND and point in points_of(link)), None)
    places = drawn(tables)
    if owner is None or point in points_of(links.get(GROUND, {})) or point not in places:
        raise EditError("first select a moving point as the centre of the roller")
    spots = list(places.values())
    size = max(abs(one - other) for one in spots for other in spots)
    centre = places[point] - 1j * APART * size
    drives = tables.get("drives", [])
    several = {"drive": str(drives[0].get("link") or drives[0].get("slider"))} if len(drives) > 1 else {}
    table = {
        "follower": owner,
        "centre": [f"{1e3 * part:.4g} mm" for part in (centre.real, centre.imag)],
        "roller": point,
        "roller_radius": f"{250 * APART * size:.3g} mm",
        **several,
    }
    return with_table(text, ("cams", new_name(tables.get("cams", ()), "cam_")), table)


def _with_study(text: str, kind: str, change: Tables) -> str:
    """Add a number to the sweep, the tolerances, or the variables of the optimization."""
    path = str(change.get("number") or "")
    if not path:
        raise EditError("first select the number that varies")
    ends = [f"{float(change[end]):.6g}" for end in ("low", "high")]
    low, high = map(float, ends) if change["unit"] == "1" else (f"{end} {change['unit']}" for end in ends)
    if kind == "tolerances":
        return with_value(text, ("tolerances", path), TOLERANCE)
    if kind == "sweep":
        return with_value(text, ("sweep", "vary", path), {"from": low, "to": high, "count": COUNT})
    if "optimize" not in tomllib.loads(text):
        text = with_table(text, ("optimize",), {"minimize": "deflection"})
    return with_value(text, ("optimize", "variables", path), [low, high])
