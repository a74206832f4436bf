"""Random scenes with any key of the format, and calls with any option: right, at a bound, or spoilt.

The keys come from the tables of the format and the options from the requests, so new ones are included. A seed and a
number determine a case.
"""

import math
import random
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import msgspec.inspect as types

from kinelast.scene.format import ChainTable, SceneTable
from kinelast.tasks.request import Batch, Request, options_of
from kinelast.tasks.task import shipped_scenes, shipped_structures
from kinelast.values.quantities import Direction, Sizes
from kinelast.values.units import Quantity

HOW = ("right", "at a bound", "spoilt")
CHANCES = (7, 3, 1)  # relative frequency of each
SMALL = 0, -0.0, 5e-324, 1e-18, 1e-15, 1e-12, 1e-9, 1e-6, -1e-9
LARGE = 1e3, 1e6, 1e9, 1e12, 1e15, 1.7e308, -1e30
WRONG: tuple[Any, ...] = (
    "", "x", "1 parsec", "nan", math.nan, math.inf, True, [], {}, [[]], -1, 0, 1e400, "10 mm^9", "é\x1b[31m", "=1+1",
    "9" * 40, {"from": 1}, [1, 2, 3], "ground", 2**70,
)  # fmt: skip
FIGURES = (
    "mass", "deflection", "stress", "safety", "drive_effort", "joint_force", "output_most", "output_least",
    "transmission_angle", "frequency", "N", "phi", "chord", "output", "path", "nothing",
)  # fmt: skip
POINTS, LINKS = {"at", "point", "through", "from", "to", "center", "anchor", "points"}, {"link", "on", "links"}
WORDS: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {  # by option and HOW
    "positions": (("1", "2", "3", "5", "7"), ("1", "2"), ("0", "-1", "1000001", "1e3", "x", "")),
    "changes": (("run.positions=3", "run.tolerance=1e-8"), ("run.positions=1",), ("", "=", "a=b", "run=3", "points")),
    "theory": (("quasi-static", "elastodynamic", "geometrically-exact"), ("quasi-static",), ("", "exact")),
    "accuracy": (("2 %", "0.1"), ("1e-12", "99.999 %"), ("0", "200 %", "x", "nan")),
    "units": (("SI", "mm", "in"), ("mm",), ("m", "")),
    "refine": ((), (), ()),
    "reachable": ((), (), ()),
    "speeds": (("20 rad/s : 60 rad/s : 3", "100 rpm:300 rpm:2"), ("1e-9:1e9:2",), ("3:2:1", "1:2", "nan:2:3", "")),
    "tables": (("html", "parquet", "xlsx", "html,parquet"), (",", "html,html"), ("x", "csv,,x")),
    "new": ((), (), ("/nowhere/mine",)),
    "copy": ((), (), ("nothing", "", "../x")),
    "elastic": ((), (), ()),
    "foreign": ((), (), ("none.json", "", "/", "https://x/?j=")),
    "export": ((), (), ("/nowhere/x.pmks", "x.txt", "")),
    "motion": ((), (), ()),
    "columns": (("time", "*", "A.*,time"), ("", "*,*"), ("nothing.*", "[", ",,")),
    "fields": ((), (), ()),
    "stations": (("3", "11"), ("2",), ("1", "10002", "x")),
    "checks": (("1", "2", "4", "nonlinear", "solid", "2,solid"), ("1",), ("0", "5000", "1,2", "x", "")),
    "handout": ((), (), ()),
    "stills": ((), (), ()),
    "dxf": ((), (), ()),
    "mesh": ((), (), ()),
    "animate": (("deflection", "slope"), ("deflection,deflection",), ("x", "")),
    "frames": (("1", "2"), ("1",), ("0", "x", "100000")),
    "picture": (("png", "gif", "mp4"), ("png",), ("jpg", "")),
    "fps": (("5",), ("1e-6", "1e6"), ("0", "nan", "x")),
    "size": (("160x160", "320x200"), ("160x160",), ("161x160", "8x8", "x")),
    "style": (("plain", "solid"), ("solid",), ("wire", "")),
    "exaggeration": (("2", "10"), ("1e-300", "1e300"), ("0", "inf", "x")),
    "background": (("black", "#ffffff"), ("#000",), ("no colour", "")),
    "show": (("names", "links,peak", "none", "drives,paths,deformed"), ("",), ("x", "names,x")),
    "balance": ((), (), ()),
    "sensitivities": ((), (), ()),
    "tolerances": ((), (), ()),
    "samples": (("16", "32"), ("16",), ("15", "x", "1000001")),
    "optimize": ((), (), ()),
    "scenes": ((), (), ("nowhere.toml", "", "*.none", "/dev/null", "st eel", "press_swep")),
    "structure": ((), (), ()),
    "sweep": ((), (), ()),
    "design": (("0", "1"), ("0", "999999999999999999999"), ("-1", "x")),
    "most": (("100", "1000"), ("1",), ("0", "x")),
    "pages": (("0", "1"), ("0",), ("-1", "x")),
    "scheduler": ((), (), ("nowhere", "tcp://127.0.0.1:1", "")),
    "out": ((), (), ()),
    "jobs": (("1", "2"), ("1",), ("-1", "x")),
    "resume": ((), (), ()),
    "quiet": ((), (), ()),
    "list": ((), (), ()),
    "completion": (("bash", "zsh", "fish"), ("bash",), ("sh", "")),
    "version": ((), (), ()),
}
RARE = {"animate": 8, "stills": 4, "jobs": 6, "checks": 3, "scheduler": 4, "optimize": 3, "list": 4, "version": 8}
NEEDS = {"design": "sweep", "sweep": "sweep", "tolerances": "tolerances", "optimize": "optimize"}  # table of an option


COMMON = """
title = "drawn"
materials = {steel = {E = "210 GPa", poisson = 0.3, density = 7850, yield = "355 MPa", damping = "1 us"}}
sections = {bar = {shape = "rectangle", depth = "6 mm", width = "10 mm"}}
"""
GEARED = f"""{COMMON}
points = {{O = [0, 0], A = [0.05, 0.02], B = [0.2, 0.3], C = [0.43, 0.03], D = [0.4, 0]}}
gears = [{{driver = {{link = "crank"}}, follower = {{link = "wheel"}}, ratio = -2, pressure_angle = "20 deg"}}]
drives = [{{link = "crank", speed = "60 rad/s"}}]
[links]
ground = {{points = ["O", "D"]}}
crank = {{points = ["O", "A"], section = "bar", material = "steel"}}
rod = {{points = ["A", "B"], section = "bar", material = "steel"}}
other = {{points = ["C", "B"], section = "bar", material = "steel"}}
wheel = {{points = ["D", "C"], section = "bar", material = "steel"}}
"""
BY_EFFORT = f"""{COMMON}
points = {{O = [0, 0], A = [0.3, -0.1], G = [-0.1, 0.2]}}
drives = [{{link = "arm", effort = "0.2 N m", table = [[0, 1], ["50 ms", 2]], start = "-20 deg", extend = "hold"}}]
springs = [{{link = "arm", point = "A", anchor = "G", length = "200 mm", stiffness = "20 N/m", damping = "1 N s/m"}}]
run = {{duration = "0.1 s", positions = 6, gravity = [0, -9.81], tolerance = 1e-6}}
[links]
ground = {{points = ["O", "G"]}}
arm = {{points = ["O", "A"], section = "bar", material = "steel"}}
"""


@dataclass(frozen=True)
class Key:
    """A key of the format: its path ("*" is a name, "[]" a list entry) and the type of its value."""

    path: tuple[str, ...]
    type: types.Type
    chain: bool = False

    def __str__(self) -> str:
        return ("chain: " if self.chain else "") + ".".join(self.path).replace(".[]", "[]")


@dataclass(frozen=True)
class Drawn:
    """A scene's text, the options of a call, and the count of each key and option by quality."""

    text: str
    words: tuple[str, ...]
    drawn: Counter[tuple[str, str]] = field(default_factory=Counter)


def format_keys() -> list[Key]:
    """Return all keys of a scene and of a spatial chain."""
    found: dict[tuple[str, ...], Key] = {}
    for root, chain in ((SceneTable, False), (ChainTable, True)):
        for key in _keys(types.type_info(root), (), chain):
            found.setdefault((str(chain), *key.path), key)
    return list(found.values())


def _keys(kind: types.Type, path: tuple[str, ...], chain: bool) -> Iterator[Key]:
    for each in _choices(kind):
        match each:
            case types.StructType():
                if each.tag_field:
                    yield Key((*path, each.tag_field), types.LiteralType((each.tag,)), chain)
                for part in each.fields:
                    yield Key((*path, part.encode_name), part.type, chain)
                    yield from _keys(part.type, (*path, part.encode_name), chain)
            case types.DictType():
                yield from _keys(each.value_type, (*path, "*"), chain)
            case types.ListType():
                yield from _keys(each.item_type, (*path, "[]"), chain)


def _choices(kind: types.Type) -> tuple[types.Type, ...]:
    if isinstance(kind, types.Metadata):
        return _choices(kind.type)
    return kind.types if isinstance(kind, types.UnionType) else (kind,)


KEYS = format_keys()
SCENE, CHAIN = types.type_info(SceneTable), types.type_info(ChainTable)


def drawn_case(seed: int, number: int) -> Drawn:
    """Return a case; consecutive numbers cycle through all keys and options."""
    chance = random.Random(f"drawn {seed} {number}")
    first = KEYS[number % len(KEYS)]
    count: Counter[tuple[str, str]] = Counter()
    scene = _base(chance, first)
    keys = [
        first,
        *(
            chance.choice([key for key in KEYS if key.chain == first.chain])
            for _ in range(chance.choice((0, 0, 0, 1, 1, 2)))
        ),
    ]
    for key in keys:
        how = chance.choices(HOW, CHANCES)[0]
        scene = _with(scene, key, how, chance)
        count[str(key), how] += 1
    run = scene.get("run")
    if isinstance(run, dict) and isinstance(run.get("positions"), int) and run["positions"] > 12 and not first.chain:
        run["positions"] = chance.choice((3, 6, 12))
    words = _call(scene, list(WORDS)[number % len(WORDS)], first.chain, chance, count)
    return Drawn(text_of(scene), words, count)


@cache
def _shipped() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the tables of the shipped scenes and of the shipped structures."""
    paths = shipped_scenes(), shipped_structures()
    scenes, structures = ([tomllib.loads(path.read_text("utf-8")) for path in each.values()] for each in paths)
    return [*scenes, tomllib.loads(GEARED), tomllib.loads(BY_EFFORT)], structures


def _base(chance: random.Random, key: Key) -> dict[str, Any]:
    """Return the tables of a shipped scene, preferably one with the table of the key."""
    scenes, structures = _shipped()
    if key.chain:
        return deepcopy(chance.choice([each for each in structures if _is_chain(each)]))
    planar = [each for each in structures if not _is_chain(each)]
    pool = planar if key.path[0] == "contacts" and chance.random() < 0.7 else scenes
    having = [each for each in pool if key.path[0] in each]
    scene = deepcopy(chance.choice(having if having and chance.random() < 0.6 else pool))
    if not scene.get("structure_only"):
        scene.setdefault("run", {})["positions"] = chance.choice((1, 2, 4, 6, 9))
    return scene


def _is_chain(tables: Mapping[str, Any]) -> bool:
    return any("type" in joint for joint in tables.get("joints", {}).values())


class Names:
    """Random names of a scene's parts."""

    def __init__(self, scene: Mapping[str, Any], chance: random.Random) -> None:
        self.scene, self.chance = scene, chance

    def table(self, name: str) -> list[str]:
        """All names in a table."""
        there = self.scene.get(name)
        return list(there) if isinstance(there, dict) and there else ["none"]

    def of(self, key: str) -> str:
        """A random name that fits a key."""
        if key in LINKS:
            return self.chance.choice([*self.table("links"), "ground"])
        if key in POINTS:
            return self.chance.choice(self.table("points"))
        if key == "slider":
            return self.chance.choice([*self.table("sliders"), *self.table("slots")])
        return self.chance.choice(self.table(f"{key}s"))

    def on(self, link: str) -> str:
        """A random point of a link."""
        return self.chance.choice(self.points(link) or self.table("points"))

    def moving(self) -> str:
        """A random moving link, preferably one on the ground."""
        links = [name for name in self.table("links") if name != "ground"] or ["none"]
        at_ground = [name for name in links if set(self.points(name)) & set(self.points("ground"))]
        return self.chance.choice(at_ground if at_ground and self.chance.random() < 0.7 else links)

    def points(self, link: str) -> list[str]:
        """All points of a link."""
        tables = self.scene.get("links")
        table = tables.get(link) if isinstance(tables, dict) else None
        points = table.get("points") if isinstance(table, dict) else None
        return [point for point in points if isinstance(point, str)] if isinstance(points, (list, dict)) else []

    def numbers(self) -> dict[str, Any]:
        """Numbers of the scene by path."""
        found: dict[str, Any] = {}
        for name in ("materials", "sections", "links", "points"):
            for part, table in self.scene.get(name, {}).items() if isinstance(self.scene.get(name), dict) else ():
                for key, value in table.items() if isinstance(table, dict) else ():
                    if re.match(r"[-+\d.]", str(value)) and not isinstance(value, bool):
                        found[f"{name}.{part}.{key}"] = value
                if name == "points" and isinstance(table, list) and len(table) == 2:
                    found |= {f"points.{part}.x": table[0], f"points.{part}.y": table[1]}
        return found or {"points.O.x": 0.0}


def _with(scene: dict[str, Any], key: Key, how: str, chance: random.Random) -> dict[str, Any]:
    """Set a key of a scene to a random value; make missing tables."""
    names = Names(scene, chance)
    node: Any = scene
    kind = CHAIN if key.chain else SCENE
    for step, below in zip(key.path[:-1], (*key.path[1:],), strict=True):
        kind = _inside(kind, step, below)
        before, node = node, _stepped(node, step, kind, below, names)
        if node is None:
            return scene
        if step in ("law", "motion", "against") and isinstance(before, dict) and chance.random() < 0.9:
            _make_fit((key.path[0], "[]", step), before, names)
    if not isinstance(node, dict):
        return scene
    last = key.path[-1]
    there, value = node.get(last), value_of(key.type, last, how, names)
    if how != "spoilt" and _is_number(there) and chance.random() < 0.5:
        value = _scaled(there, how, chance)
    elif how == "right" and isinstance(there, dict) and isinstance(value, dict):
        value = there | value
    elif how == "right" and isinstance(there, list) and isinstance(value, list) and chance.random() < 0.5:
        value = [*there, *value]
    node[last] = value
    if how != "spoilt" and chance.random() < 0.85:
        _make_fit(key.path, node, names)
    return scene


def _make_fit(path: tuple[str, ...], node: dict[str, Any], names: Names) -> None:
    """Add the keys that a key requires, and remove those that it excludes."""
    table, last = path[0], path[-1]
    link = node["link"] if isinstance(node.get("link"), str) else ""
    if path[1:2] == ("[]",) and len(path) == 3:
        groups = ONE_OF.get(table, ())
        mine = next((group for group in groups if last in group), None)
        for key in (key for group in groups if mine and group is not mine for key in group):
            node.pop(key, None)
        if fit := FITS.get(table):
            fit(node, last, link, names)
    if table == "gears" and last == "link":
        node["link"] = names.moving()
    if table == "sections" and last in ("inner", "wall"):
        node.pop("wall" if last == "inner" else "inner", None)
    near = link and names.chance.random() < 0.7
    for key in (key for key in ("at", "point", "through") if near and key in node):
        node[key] = names.on(link)


def _fit_drive(node: dict[str, Any], last: str, _link: str, _names: Names) -> None:
    if last in OF_TABLE:
        node.setdefault("table", deepcopy(TABLE))
        node.setdefault("effort", 1.0)
    if last == "repeat" and not {"law", "motion"} & node.keys():
        node.pop("speed", None)
        node["law"] = [{"curve": "harmonic", "duration": "0.1 s", "by": 0.2}]


def _fit_load(node: dict[str, Any], last: str, link: str, names: Names) -> None:
    if last in OF_TABLE:
        node.setdefault("table", deepcopy(TABLE))
    if last in BEAM:
        for key, value in (("beam", [names.on(link), names.on(link)]), ("start", [1.0, 2.0]), ("end", [1.0, 2.0])):
            node.setdefault(key, value)
    elif "beam" not in node:
        node.setdefault("point", names.on(link))


def _fit_spring(node: dict[str, Any], last: str, link: str, names: Names) -> None:
    if last in ("at", "angle"):
        node.setdefault("at", names.on(link))
    else:
        node.setdefault("point", names.on(link))
        node.setdefault("anchor", names.on(str(node.get("on", "ground"))))


FITS = {"drives": _fit_drive, "loads": _fit_load, "springs": _fit_spring}
OF_TABLE = ("table", "against", "interpolation", "extend")
TABLE = [[0.0, 1.0], [1.0, 2.0], [7.0, 0.5]]
BEAM = ("beam", "start", "end")
ONE_OF = {  # groups of keys that exclude one another
    "drives": (("speed",), ("law",), ("motion",), ("effort", "table", "against", "interpolation", "extend")),
    "loads": (BEAM, ("point", "force", "moment", "resists")),
    "springs": (("point", "anchor", "length"), ("at", "angle")),
}


def _inside(kind: types.Type, step: str, below: str) -> types.Type:
    """Type at a step into another type; of several, the one that fits the next step."""
    found: list[types.Type] = []
    for each in _choices(kind):
        match each:
            case types.StructType():
                found += [part.type for part in each.fields if part.encode_name == step]
            case types.DictType() if step == "*":
                found.append(each.value_type)
            case types.ListType() if step == "[]":
                found.append(each.item_type)
    fitting = [each for one in found for each in _choices(one) if _fits(each, below)]
    return fitting[0] if len(fitting) == 1 else types.UnionType(tuple(fitting)) if fitting else found[0]


def _fits(kind: types.Type, step: str) -> bool:
    match kind:
        case types.StructType():
            return step == kind.tag_field or any(part.encode_name == step for part in kind.fields)
        case types.DictType():
            return step == "*"
        case types.ListType():
            return step == "[]"
    return False


def _stepped(node: Any, step: str, kind: types.Type, below: str, names: Names) -> Any:
    """Return the value at a step; replace it if it is missing or cannot hold the next step."""
    if step == "[]":
        if not isinstance(node, list):
            return None
        if not node or (names.chance.random() < 0.3) or not _holds(node[-1], kind, below):
            node.append(made(kind, names, below))
        return node[-1] if not _holds(node[0], kind, below) or names.chance.random() < 0.5 else node[0]
    if not isinstance(node, dict):
        return None
    if step == "*":
        fitting = [name for name, value in node.items() if _holds(value, kind, below)]
        if fitting and names.chance.random() < 0.8:
            return node[names.chance.choice(fitting)]
        step = _new_name(kind, names)
    if step not in node or not _holds(node[step], kind, below):
        node[step] = made(kind, names, below)
    return node[step]


def _new_name(kind: types.Type, names: Names) -> str:
    cls = getattr(_choices(kind)[0], "cls", None)
    named = getattr(cls, "__name__", "")
    if named in ("RangeTable", "ToleranceTable") or isinstance(_choices(kind)[0], types.TupleType):
        return names.chance.choice(list(names.numbers()))
    if named in ("JointTable", "WeldTable"):
        return names.of("point")
    if named == "LinkLimitsTable":
        return names.moving()
    return names.chance.choice(FIGURES) if named == "BoundTable" else f"n{names.chance.randrange(100)}"


def _holds(value: Any, kind: types.Type, below: str) -> bool:
    """Return whether a value of a scene can hold the next step."""
    if below == "[]":
        return isinstance(value, list)
    if not isinstance(value, dict):
        return False
    shapes = [each.tag for each in _choices(kind) if isinstance(each, types.StructType) and each.tag_field]
    return not shapes or value.get("shape") in shapes


def made(kind: types.Type, names: Names, below: str = "") -> Any:  # noqa: PLR0911, PLR0912 - a branch a table
    """Return a table with its required keys, right as far as possible."""
    each = _choices(kind)[0]
    if isinstance(each, types.DictType):
        return {}
    if isinstance(each, types.ListType):
        return []
    if not isinstance(each, types.StructType):
        return value_of(kind, below, "right", names)
    link, chance = names.moving(), names.chance
    match each.cls.__name__:
        case "LinkTable":
            return {"points": [names.of("point"), names.of("point")], "rigid": True}
        case "DriveTable":
            return chance.choice(({"link": link, "speed": 10.0}, {"slider": names.of("slider"), "speed": 0.1}))
        case "LoadTable":
            beam = {"link": link, "beam": [names.on(link), names.on(link)], "start": [1.0, 0.0], "end": [0.0, 2.0]}
            at = {"link": link, "point": names.on(link), "force": [3.0, -1.0]}
            return chance.choice((at, at, {"link": link, "moment": "1 N m"}, beam))
        case "SpringTable":
            between = {"link": link, "point": names.on(link), "anchor": names.on("ground"), "length": "50 mm"}
            about = {"link": link, "at": names.on(link), "angle": "10 deg"}
            return chance.choice((between, about)) | {"stiffness": 5.0}
        case "GearTable":
            return {"driver": {"link": link}, "follower": {"link": names.moving()}, "ratio": -2.0}
        case "SliderTable":
            return {"link": link, "through": names.on(link), "direction": [1, 0]}
        case "SlotTable":
            return {"point": names.on(link), "link": link, "direction": "30 deg"}
        case "BeamTable":
            return {"from": names.on(link), "to": names.on(link)}
        case "JointTable" | "LimitsTable" | "LinkLimitsTable" | "RunTable" | "WeldTable" | "AgainstTable":
            return {}
        case "PathTable":
            return {"point": names.of("point"), "places": [[0.1, 0.1], [0.2, 0.1]]}
        case "SweepTable" | "OptimizeTable":
            path, value = chance.choice(list(names.numbers().items()))
            low, high = _scaled(value, "right", chance, 0.97), _scaled(value, "right", chance, 1.02)
            if each.cls.__name__ == "SweepTable":
                return {"vary": {path: {"from": low, "to": high, "count": 3}}, "figures": [], "method": "grid"}
            return {"variables": {path: [low, high]}, "minimize": chance.choice(FIGURES)}
    table = {
        part.encode_name: value_of(part.type, part.encode_name, "right", names) for part in each.fields if part.required
    }
    return table | ({each.tag_field: each.tag} if each.tag_field else {})


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float, str)) and not isinstance(value, bool) and bool(re.match(r"[-+\d.]", str(value)))
    )


def _scaled(value: Any, how: str, chance: random.Random, factor: float | None = None) -> Any:
    """Multiply a number, or the number of a quantity with a unit, by a factor."""
    if factor is None:
        factor = (
            chance.uniform(0.9, 1.1) if how == "right" else 10.0 ** chance.choice((-9, -6, -3, -2, -1, 1, 2, 3, 6, 9))
        )
    if isinstance(value, (int, float)):
        return value * factor or 1e-3 * (factor - 1)
    number = re.match(r"[-+]?[\d.]+(?:e[-+]?\d+)?", str(value))
    return f"{float(number[0]) * factor:.6g}{str(value)[number.end() :]}" if number else value


def value_of(kind: types.Type, key: str, how: str, names: Names) -> Any:  # noqa: PLR0911 - a branch a kind
    """Return a value of a type: right, at a bound, or of a wrong type."""
    chance = names.chance
    if how == "spoilt":
        return deepcopy(chance.choice(WRONG))
    each = chance.choice([one for one in _choices(kind) if not isinstance(one, types.NoneType)] or [kind])
    match each:
        case types.CustomType():
            return _quantity(each.cls, how, chance)
        case types.LiteralType():
            return chance.choice(each.values)
        case types.BoolType():
            return chance.random() < 0.7
        case types.IntType() | types.FloatType():
            return _number(each, how, chance)
        case types.StrType():
            return _text(key, how, names)
        case types.TupleType():
            return [value_of(part, key, how, names) for part in each.item_types]
        case types.ListType():
            return _list(each, key, how, names)
        case types.DictType():
            return {} if how == "at a bound" else _dict(each, key, names)
        case types.StructType():
            return made(each, names)
    return 1


def _list(kind: types.ListType, key: str, how: str, names: Names) -> list[Any]:
    if key in ("table", "motion"):  # ordered by the first column
        second = kind.item_type.item_types[1] if isinstance(kind.item_type, types.TupleType) else kind.item_type
        steps = (
            (0.0, 0.1, 0.2, 0.5, 1.0)[: names.chance.randrange(2, 6)] if how == "right" else (0.0, 1e-300, 1e-9, 1.0)
        )
        return [[step, value_of(second, key, "right", names)] for step in steps]
    least, most = (0, 1) if how == "at a bound" else (1, 3)
    return [value_of(kind.item_type, key, how, names) for _ in range(names.chance.randint(least, most))]


def _dict(kind: types.DictType, key: str, names: Names) -> dict[str, Any]:
    numbers, chance = names.numbers(), names.chance
    if key in ("vary", "variables", "tolerances"):
        path = chance.choice(list(numbers))
        low, high = (_scaled(numbers[path], "right", chance, factor) for factor in (0.97, 1.02))
        return {path: {"variables": [low, high], "vary": [low, high]}.get(key, "1 %")}
    name = chance.choice(FIGURES) if key == "limits" else names.of("point")
    return {name: value_of(kind.value_type, name, "right", names)}


def _quantity(cls: type, how: str, chance: random.Random) -> Any:
    if issubclass(cls, Direction):
        return chance.choice(
            ([1, 0], [0, -2.5], "30 deg", "-1 rad")
            if how == "right"
            else ([1e-300, 0], [1e200, 1e200], "1e9 rad", [0, 0])
        )
    if issubclass(cls, Sizes):
        return chance.choice(("8 mm", ["8 mm", "5 mm"], 0.004) if how == "right" else (1e-9, [1, 1e-3], [1e-6, 1], 1e6))
    assert issubclass(cls, Quantity)
    if how == "at a bound":
        bounds = [
            bound
            for bound in (getattr(cls, "least", None), getattr(cls, "above", None), getattr(cls, "most", None))
            if bound is not None
        ]
        return chance.choice((*(float(bound) for bound in bounds if math.isfinite(bound)), *SMALL, *LARGE))
    examples = re.findall(r'"([^"]+)"', cls.expected) or ["0.5"]
    return _scaled(chance.choice(examples), how, chance, 10 ** chance.uniform(-0.7, 0.3))


def _number(kind: types.IntType | types.FloatType, how: str, chance: random.Random) -> Any:
    low = next((bound for bound in (kind.ge, kind.gt) if bound is not None), None)
    high = next((bound for bound in (kind.le, kind.lt) if bound is not None), None)
    if isinstance(kind, types.IntType):
        if how == "at a bound":
            return chance.choice(
                [int(bound) + step for bound in (low, high) if bound is not None and bound < 100 for step in (0, 1)]
                or [0]
            )
        return (low or 0) + chance.randrange(1, 6)
    if how == "at a bound":
        bounds = [float(bound) for bound in (low, high) if bound is not None]
        return chance.choice(
            [*(4 * bounds), *(bound * (1 + step) for bound in bounds for step in (-1e-9, 1e-9)), *SMALL, *LARGE]
        )
    top = min(high if high is not None else 1.0, 1.0)
    return chance.uniform(max(low if low is not None else 0.0, 0.0), top)


def _text(key: str, how: str, names: Names) -> Any:  # noqa: PLR0911 - a branch a key
    chance = names.chance
    if how == "at a bound":
        return chance.choice(("", " ", "é", "a" * 300, "ground", "-", "%", "{x}", "[bold]"))
    if key in LINKS | POINTS | {"slider", "section", "material"}:
        return names.of(key)
    if key in ("figures", "smallest", "largest", "minimize", "maximize"):
        return chance.choice(FIGURES)
    if key in ("numbers", "vary"):
        return chance.choice(list(names.numbers()))
    if key == "output":
        return chance.choice((names.on(names.moving()), names.on(names.moving()) + ".x", names.moving() + ".angle"))
    if key == "type":
        return chance.choice(("revolute", "prismatic", "helical", "cylindrical", "spherical", "planar"))
    if key == "length":
        return "50 mm"
    if key == "fixed":
        return names.of("link")
    if key == "table":
        return "designs.csv"
    return chance.choice(("5 mm", "10 deg", "2 %", "3", "a word"))


def text_of(scene: Mapping[str, Any]) -> str:
    """Return tables as TOML, one line each."""
    return "".join(f"{_key(key)} = {_toml(value)}\n" for key, value in scene.items())


def _key(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else _toml(key)


def _toml(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return '"' + "".join(_letter(letter) for letter in value) + '"'
        case dict():
            return "{" + ", ".join(f"{_key(str(key))} = {_toml(each)}" for key, each in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value)


def _letter(letter: str) -> str:
    return f"\\{letter}" if letter in '"\\' else letter if letter.isprintable() else f"\\u{ord(letter):04x}"


def _call(
    scene: dict[str, Any], first: str, chain: bool, chance: random.Random, count: Counter[tuple[str, str]]
) -> tuple[str, ...]:
    """Return the options of a call: the first one, those that it requires, and some more."""
    known = options_of(Request, Batch)
    asked = [first] if chance.random() * RARE.get(first, 1) < 1 else []
    asked += [
        name
        for name in chance.sample(list(WORDS), chance.choice((0, 0, 1, 2)))
        if name not in RARE and name not in ("design", "sweep")
    ]
    for name in list(asked):
        if (owner := known[name].belongs) and owner not in asked:
            if chance.random() < RARE.get(owner, 1) ** -0.5 * 0.6:
                asked.insert(0, owner)
            elif owner in RARE:
                asked.remove(name)
    if chain or scene.get("structure_only"):
        asked.append("structure")
    words: list[str] = []
    for name in dict.fromkeys(asked):
        option = known[name]
        how = chance.choices(HOW, CHANCES)[0]
        choices = WORDS[name][HOW.index(how)]
        switch = not option.takes_value
        count[f"--{name}", how if choices else "right"] += 1
        if NEEDS.get(name) and NEEDS[name] not in scene:
            scene[NEEDS[name]] = _study(NEEDS[name], Names(scene, chance))
        if name in ("scenes", "out"):
            words += [chance.choice(choices)] if choices else []
        elif switch:
            words.append(f"--{name}")
        elif choices:
            words.append(f"{option.flags[0]}={chance.choice(choices)}")
    if "tolerances" in asked and "samples" not in asked:
        words.append("--samples=16")
    if "animate" in asked:
        words += [
            word for word in ("--frames=2", "--size=160x160") if not any(one.startswith(word[:6]) for one in words)
        ]
    return tuple(words)


def _study(name: str, names: Names) -> dict[str, Any]:
    if name == "tolerances":
        return _dict(types.DictType(types.StrType(), types.StrType()), "tolerances", names)
    struct = next(part.type for part in SCENE.fields if part.encode_name == name)
    return made(struct, names)
