"""Numbers of a scene and their paths: `sections.bar.depth`, `points.B.x`, `drives.crank.speed`, `loads[1].force.y`.

Every number of a file can be a variable. An entry in a list of tables is given by its number from 1, or by the name of
its link or slider if that is unique. Components are x and y, or [1] and [2].
"""

import cmath
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from msgspec import Struct

from kinelast.scene.format import LinkTable, SceneTable
from kinelast.scene.joints import UNITS
from kinelast.scene.links import drawn_places
from kinelast.scene.tables import PER_LENGTH, AgainstTable
from kinelast.values.error import SceneError, fault, likely
from kinelast.values.quantities import Abscissa, Direction, PlaneAngle, Size, Sizes
from kinelast.values.units import Quantity
from rigid.arrays import Flags

PART = re.compile(r"\[(\d+)\]|([^.\[\]]+)")
COMPARED = {"gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal}
AXES = {"x": 0, "y": 1}
STUDIES = ("sweep", "sensitivities", "tolerances", "optimize")  # tables that describe studies instead of the machine
NAMED = {  # keys whose value is the name of a table, with advice on the paths of the numbers in this table
    "section": 'write [sections.NAME] with shape, depth and width, and use paths such as "sections.NAME.depth"',
    "material": 'write [materials.NAME] with E and density, and use paths such as "materials.NAME.E"',
}
MAX_COMPARED = 3000  # maximum number of paths with which a misspelt path is compared


class Variable(Struct, frozen=True):
    """A number of a scene: path, SI unit, and value in the file."""

    path: str
    unit: str
    base: float


class Place(Struct, frozen=True):
    """Location of a number in the tables.

    Attributes
    ----------
    variable
        The number.
    keys
        Keys that lead to the number in the parsed tables.
    names
        Keys that lead to the number in the tables of the file.
    leaf
        Parsed value of the number.
    per_length
        Metres per length unit of the file.
    """

    variable: Variable
    keys: tuple[Any, ...]
    names: tuple[Any, ...]
    leaf: Any
    per_length: float

    @property
    def per_bare(self) -> float:
        """SI value of the number 1 if it is written without a unit at this location."""
        return self.per_length if self.variable.unit == "m" else 1.0


def value_at(table: SceneTable, place: Place, text: Any) -> float:
    """Convert a value, written as in the file, to the SI unit of the number.

    Raises
    ------
    SceneError
        The dimension is wrong, or the value is out of range.
    """
    variable = place.variable
    try:
        value = _read(place, text)
    except ValueError as error:
        raise fault("", variable.path, str(error)) from None
    if isinstance(value, Quantity):
        bare_speed = variable.unit == "m/s" and not value.unit and place.per_length != 1.0
        if value.unit not in ("", variable.unit) or bare_speed:
            raise fault("", variable.path, f"expected {value.expected}, in {variable.unit}, got {text}")
        return float(value.within(variable.unit))
    if not within_bounds(table, place, np.array([value]))[0]:
        raise fault("", variable.path, f"expected a number within its bounds, got {value:g}")
    return float(value)


def in_file(place: Place, value: float) -> Any:
    """Return a value [SI unit] as written in a file: with its unit, unless it is dimensionless."""
    if isinstance(place.leaf, int):
        return round(value)
    unit = place.variable.unit
    return float(value) if unit == "1" else f"{float(value)!r} {unit}"


def keep_unit(before: Place, after: Place) -> None:
    """Copy the unit that a number has in the file to the changed number, because the report uses this unit."""
    if isinstance(before.leaf, Quantity) and isinstance(after.leaf, Quantity):
        after.leaf.written = before.leaf.written


def put(node: Any, names: Sequence[Any], value: Any) -> Any:
    """Return a copy of the tables with another value at the location given by `names`."""
    if not names:
        return value
    name, *rest = names
    if isinstance(name, int):
        parts = list(node) if isinstance(node, list) else [node, node]  # the same dimension at both ends of a beam
        parts[name] = put(parts[name], rest, value)
        return parts
    return {**(node or {}), name: put((node or {}).get(name), rest, value)}


def place_of(table: SceneTable, path: str, absent: bool = False) -> Place:
    """Return the location of a number in parsed tables, given its path.

    Parameters
    ----------
    absent
        Whether the file may lack the key. If it is, `base` of the number is nan.

    Raises
    ------
    SceneError
        There is no such number. The message suggests the most similar path.
    """
    keys: list[Any] = []
    names: list[Any] = []
    node: Any = table
    parents = []
    parts = list(PART.finditer(path))
    if not parts or PART.sub("", path).strip(".") or parts[0][2] in STUDIES:
        raise _unknown(table, path)
    for part in parts:
        parents.append(node)
        try:
            key, name, node = _entered(node, part[1], part[2])
        except LookupError:
            raise _unknown(table, path) from None
        keys.append(key)
        names.append(name)
    if node is None and isinstance(parents[-1], LinkTable) and keys[-1] == "length":
        node = _drawn_length(table, parents[-1], path)
    if node is None and absent and isinstance(parents[-1], msgspec.Struct):
        node = _without_value(parents[-1], keys[-1])
    if isinstance(node, tuple) and not isinstance(node, Sizes) and len(node) == 2:
        raise fault("", path, f'is two numbers: use "{path}.x" or "{path}.y"')
    if keys[-1] in NAMED and (node is None or isinstance(node, str)):
        raise fault("", path, f"there is no such number in the scene: it is a name; {NAMED[keys[-1]]}")
    if not isinstance(node, int | float | Sizes | Direction) or isinstance(node, bool):
        raise _unknown(table, path)
    unit = _unit(table, keys, parents, node)
    return Place(Variable(path, unit, _base(node, unit)), tuple(keys), tuple(names), node, PER_LENGTH[table.units])


def _drawn_length(table: SceneTable, link: LinkTable, path: str) -> Size:
    """Return the drawn length of a link. Raise SceneError if the points do not give a length."""
    places = drawn_places(table)
    if isinstance(link.points, dict) or len(link.points) != 2 or not {*link.points} <= places.keys():
        advice = f'change the coordinates of one of them, as in "{path.rpartition(".")[0]}.points.{{0}}.x"'
        if not isinstance(link.points, dict):
            advice = 'change the position of one of them, as in "points.{0}.x"'
        raise fault("", path, f"the points determine the size of this link: {advice.format([*link.points][-1])}")
    one, other = (places[point] for point in link.points)
    return Size.read(abs(other - one))


def _without_value(table: msgspec.Struct, key: str) -> int | float | Quantity | None:
    """Return a placeholder number of the type that a key accepts, or None if the key does not accept numbers."""
    kinds = [kind for kind in get_args(get_type_hints(type(table))[key]) if isinstance(kind, type)]
    quantity = next((kind for kind in kinds if issubclass(kind, Quantity)), None)
    if quantity:
        return quantity.many(None, "")
    return 0 if int in kinds else np.nan if float in kinds else None


def numbers(table: SceneTable) -> Iterator[str]:
    """Yield the paths of all numbers in parsed tables."""
    for name in table.__struct_fields__:
        if name not in STUDIES:
            yield from _numbers(getattr(table, name), name)


def _numbers(node: Any, path: str) -> Iterator[str]:
    if isinstance(node, int | float | Direction | Sizes) and not isinstance(node, bool):
        yield path
    elif isinstance(node, msgspec.Struct):
        for name, written in zip(node.__struct_fields__, node.__struct_encode_fields__, strict=True):
            yield from _numbers(getattr(node, name), f"{path}.{written}".lstrip("."))
    elif isinstance(node, dict):
        for key, value in node.items():
            if "." not in key:  # a name of a figure
                yield from _numbers(value, f"{path}.{key}")
    elif isinstance(node, tuple) and len(node) == 2 and all(isinstance(part, Quantity) for part in node):
        yield from (f"{path}.{axis}" for axis in AXES)
    elif isinstance(node, list | tuple):
        calls = [_called(entry) for entry in node]
        for number, entry in enumerate(node, 1):
            own = calls[number - 1]
            yield from _numbers(entry, f"{path}.{own}" if own and calls.count(own) == 1 else f"{path}[{number}]")


def _called(entry: Any) -> str | None:
    """Return the name of the link or slider in a table of a list. Paths can refer to the table by this name."""
    return getattr(entry, "link", None) or getattr(entry, "slider", None)


def _entered(node: Any, number: str | None, name: str | None) -> tuple[Any, Any, Any]:
    """Return the key, the name in the file, and the value to which one part of a path, such as `loads[1]`, leads.

    Raise LookupError if there is no such part.
    """
    if isinstance(node, msgspec.Struct) and name is not None:
        names = dict(zip(node.__struct_encode_fields__, node.__struct_fields__, strict=True))
        return names[name], name, getattr(node, names[name])
    if isinstance(node, Mapping) and name is not None:
        return name, name, node[name]
    if not isinstance(node, list | tuple):
        raise LookupError
    if number is not None and 1 <= int(number) <= len(node):
        at = int(number) - 1
    elif name in AXES and isinstance(node, tuple) and len(node) == 2:
        at = AXES[name]
    else:
        same = [at for at, entry in enumerate(node) if name is not None and _called(entry) == name]
        if len(same) != 1:
            raise LookupError
        at = same[0]
    return at, at, Size.read(float(node[at])) if isinstance(node, Sizes) else node[at]


def _unknown(table: SceneTable, path: str) -> SceneError:
    near = likely(path, islice(numbers(table), MAX_COMPARED)).partition("; there is")[0]
    kind = path.partition("s.")[0]  # sections and materials of the library have no paths
    advice = f"; {NAMED[kind]}" if kind in NAMED else ""
    return fault("", path, f"there is no such number in the scene{near or advice}")


def _read(place: Place, text: Any) -> Any:
    """Read a value as a quantity of the same kind, such as a length, as the value at a location."""
    if isinstance(place.leaf, Sizes):
        return Size.read(text, place.per_length)
    if isinstance(place.leaf, Direction):
        return PlaneAngle.read(text)
    if isinstance(place.leaf, Quantity):
        return type(place.leaf).read(text, place.per_length)
    if isinstance(text, bool) or not isinstance(text, int | float):
        raise ValueError(f"expected a number, got {text}")
    return text


def _base(leaf: Any, unit: str) -> float:
    if isinstance(leaf, Sizes):
        return float(leaf[0])
    if isinstance(leaf, Direction):
        return cmath.phase(leaf)
    return float(leaf.within(unit)) if isinstance(leaf, Quantity) else float(leaf)


def _unit(table: SceneTable, keys: list[Any], parents: list[Any], leaf: Any) -> str:
    """Return the SI unit of a number.

    If the key accepts several units, other keys of the scene decide which one applies.
    """
    if isinstance(leaf, Sizes | Direction):
        return "m" if isinstance(leaf, Sizes) else "rad"
    if not isinstance(leaf, Quantity):
        return "1"
    units = [unit or "1" for unit in type(leaf).units]
    if leaf.unit or len(units) == 1 or keys[0] == "motors":  # a gear ratio without a unit is dimensionless
        return leaf.unit or ("1" if keys[0] == "motors" and len(units) > 1 else units[0])
    if isinstance(leaf, Abscissa):
        against = parents[2].against
        return "s" if against is None else "rad" if against.link else "m"
    if keys[0] == "gears":
        gear = table.gears[keys[1]]
        return UNITS[gear.driver.turns, gear.follower.turns]
    if keys[0] == "limits":
        turns = table.run.output.endswith(".angle")
    elif keys[0] == "joints":
        turns = keys[1] not in {*table.sliders, *table.slots}
    else:
        turns = parents[2].turns if isinstance(parents[2], AgainstTable) else parents[2].at is not None
    turning = [unit for unit in units if "rad" in unit or unit == "N m"]
    return next(unit for unit in units if (unit in turning) == turns)


def within_bounds(table: SceneTable, place: Place, values: Any) -> Flags:
    """Return, for each dimensionless value, whether it is within the bounds of the file format at a location."""
    node: Any = table
    for key in place.keys[:-1]:
        node = getattr(node, key) if isinstance(node, msgspec.Struct) else node[key]
    holds: Flags = np.isfinite(values)
    if not isinstance(node, msgspec.Struct):
        return holds
    hint = get_type_hints(type(node), include_extras=True)[place.keys[-1]]
    metas = [meta for part in (hint, *get_args(hint)) if get_origin(part) is Annotated for meta in get_args(part)[1:]]
    for meta in metas:
        for name, compare in COMPARED.items():
            bound = getattr(meta, name)
            if bound is not None:
                holds &= compare(values, bound)
    return holds


def replaced(node: Any, keys: tuple[Any, ...], value: Any) -> Any:
    """Return parsed tables with another value at a location."""
    if not keys:
        return value
    key, *rest = keys
    if isinstance(node, msgspec.Struct):
        return msgspec.structs.replace(node, **{key: replaced(getattr(node, key), tuple(rest), value)})
    if isinstance(node, dict):
        return {**node, key: replaced(node[key], tuple(rest), value)}
    parts = list(node)
    parts[key] = replaced(parts[key], tuple(rest), value)
    return type(node)(parts) if isinstance(node, list | Sizes) else tuple(parts)
