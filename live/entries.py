"""Entries of a scene's tables by their keys, set and taken away as they are typed; and tables that are not drawn."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from kinelast.scene.parsing import read_toml
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
"""Tables with which a part begins that is not drawn."""
APART = 0.3  # share of the drawing by which the shaft of a new cam lies below its roller
COUNT, PART = 11, "1 %"  # designs of a sweep, and a tolerance, to begin with


@cache
def keys() -> dict[str, list[tuple[str, str]]]:
    """By the tables of a scene all keys that they may have, with the words on them."""
    schema = scene_schema()["$defs"]
    told = {}
    for name, entry in schema["SceneTable"]["properties"].items():
        known = {
            key: value.get("description", "")
            for table in _tables(entry)
            for key, value in schema[table]["properties"].items()
        }
        if known:
            told[name] = sorted(known.items())
    return told


def _tables(entry: Any) -> Iterator[str]:
    """Names of the tables that an entry of the schema may be, or hold."""
    if "$ref" in entry:
        yield entry["$ref"].rpartition("/")[2]
    for each in (entry.get("additionalProperties"), entry.get("items"), *entry.get("anyOf", ())):
        yield from _tables(each) if isinstance(each, dict) else ()


def typed(words: str) -> Any:
    """A value as it was typed: as TOML where it is some, else a text.

    Examples
    --------
    >>> typed("5"), typed("[1, 2]"), typed("5 N/mm"), typed('"a"')
    (5, [1, 2], '5 N/mm', 'a')
    """
    try:
        told = read_toml(f"typed = {words.strip()}")
    except tomllib.TOMLDecodeError:
        return words.strip()
    plain = isinstance(told["typed"], str | int | float | list | dict)
    return told["typed"] if len(told) == 1 and plain else words.strip()


def entry(text: str, tables: Tables, change: Tables) -> str:
    """An entry of a table by its path, as it was typed; taken away where nothing was."""
    path = tuple(change["path"])
    words = str(change["value"])
    return with_value(text, path, typed(words)) if words.strip() else without(text, path)


def add_table(text: str, tables: Tables, change: Tables) -> str:
    """A table more of those that are not drawn: a section, a material, limits; a point's joint, a number's sweep.

    A motor is that of the drive that is named, a section or a material that of the link.
    """
    kind = change["kind"]
    if kind in ("sweep", "tolerances", "optimize"):
        return _studied(text, kind, change)
    if kind == "cams":
        return _rolled(text, tables, change)
    if kind not in FIRST:
        raise EditError(f"there is no table {kind!r} to add")
    if kind in ("limits", "fatigue", "sensitivities"):
        if kind in tables:
            raise EditError(f"[{kind}] is there already")
        return with_table(text, (kind,), FIRST[kind])
    stem = kind.removesuffix("s")
    named = str(change.get("name") or new_name(tables.get(kind, ()), f"{stem}_"))
    if named in tables.get(kind, {}):
        raise EditError(f"[{kind}.{named}] is there already")
    if kind in ("joints", "bearings") and not change.get("name"):
        raise EditError(f"choose the point first of which the {stem} is")
    text = with_table(text, (kind, named), FIRST[kind])
    of = change.get("of")
    return with_value(text, (*of, stem), named) if of else text


def _rolled(text: str, tables: Tables, change: Tables) -> str:
    """A text with a cam more, below the roller that a moving point of a link becomes."""
    point, links = str(change.get("name") or ""), tables.get("links", {})
    owner = next((name for name, link in links.items() if name != GROUND and point in points_of(link)), None)
    places = drawn(tables)
    if owner is None or point in points_of(links.get(GROUND, {})) or point not in places:
        raise EditError("choose the moving point first that is the centre of the roller")
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


def _studied(text: str, kind: str, change: Tables) -> str:
    """A text in which a number is swept, scatters, or is a variable of the best design."""
    path = str(change.get("number") or "")
    if not path:
        raise EditError("choose the number first that is to vary")
    low, high = (_written(change[end], change["unit"]) for end in ("low", "high"))
    if kind == "tolerances":
        return with_value(text, ("tolerances", path), PART)
    if kind == "sweep":
        return with_value(text, ("sweep", "vary", path), {"from": low, "to": high, "count": COUNT})
    if "optimize" not in tomllib.loads(text):
        text = with_table(text, ("optimize",), {"minimize": "deflection"})
    return with_value(text, ("optimize", "variables", path), [low, high])


def _written(value: Any, unit: str) -> Any:
    return f"{float(value):.6g} {unit}" if unit != "1" else float(f"{float(value):.6g}")
