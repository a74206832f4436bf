"""Scene tables as Python classes: names, base classes and typed fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

from msgspec import Struct
from msgspec.structs import FieldInfo, fields

from kinelast.scene.format import Dimensioned, SceneTable
from kinelast.scene.quantities import Direction, Sizes
from kinelast.scene.tables import Place, StrictTable
from kinelast.scene.units import Quantity

NAMED = {  # keys that accept an object of a class instead of its name
    "link": "Link", "on": "Link", "links": "Link", "point": "Point", "points": "Point", "through": "Point",
    "anchor": "Point", "at": "Point", "start": "Point", "end": "Point", "center": "Point", "beam": "Point",
    "beams": "Point", "outline": "Point", "slider": "Slider | Slot", "motor": "Motor", "cylinder": "Cylinder",
    "material": "Material", "section": "SectionPart",
}  # fmt: skip
QUANTITIES: tuple[tuple[type, str], ...] = (
    (Sizes, "Quantity | Sequence[Quantity]"),
    (Direction, "Direction"),
    (Quantity, "Quantity"),
)
ROWS = "Sequence[Sequence[Quantity]]", "Sequence[Sequence[Quantity | float]]"
HEADER = "@dataclass(frozen=True, eq=False, repr=False)"


@dataclass(frozen=True)
class TableClass:
    """A table as a class: `constants` are class variables, `required` and `optional` field types."""

    name: str
    base: str
    doc: str
    constants: dict[str, Any]
    required: dict[str, str]
    optional: dict[str, str]

    def source(self) -> str:
        """Return the source text of the class."""
        types = {"under": "str", "shape": "str", "spelled": "Mapping[str, str]"}
        lines = [f'"""{self.doc}"""']
        lines += [f"{key}: ClassVar[{types[key]}] = {value!r}" for key, value in self.constants.items()]
        lines += [f"{key}: {kind}" for key, kind in self.required.items()]
        lines += ["_: KW_ONLY"] if self.optional else []
        lines += [f"{key}: {kind} | None = None" for key, kind in self.optional.items()]
        return "\n    ".join([f"{HEADER}\nclass {self.name}({self.base}):", *lines])


def table_classes() -> Iterator[TableClass]:
    """Yield the classes of all tables of a scene."""
    places: dict[type[Struct], tuple[str, str]] = {}
    for entry in fields(SceneTable):
        base = {dict: "NamedPart", list: "ListedPart"}.get(_origin(entry.type), "TypedPart")
        for table in _inside(entry.type):
            section = entry.encode_name == "sections" or issubclass(table, Dimensioned)
            places[table] = entry.encode_name, "SectionPart" if section else base
    for table in (waiting := [*places]):
        for inner in (inner for each in fields(table) for inner in _inside(each.type)):
            if inner not in places:
                places[inner] = "", "TypedPart"
                waiting.append(inner)
    return (_class_of(table, *where) for table, where in places.items())


def _class_of(table: type[Struct], under: str, base: str) -> TableClass:
    """Return the class of a table under a key of the scene or inside another table."""
    tag, keys = table.__struct_config__.tag, fields(table)
    spelled = {each.name: each.encode_name for each in keys if each.name != each.encode_name}
    constants = {"shape": tag} if tag else {"under": under} if under else {}
    return TableClass(
        _class_name(table),
        base,
        (table.__doc__ or "").splitlines()[0],
        {**constants, **({"spelled": spelled} if spelled else {})},
        _types(each for each in keys if each.required),
        _types(each for each in keys if not each.required),
    )


def _types(keys: Iterator[FieldInfo]) -> dict[str, str]:
    return {each.name: _annotation(each.type, each.name) for each in keys}


def _class_name(table: type) -> str:
    return table.__name__.removesuffix("Table")


def _plain(kind: Any) -> Any:
    """Return a type without its bounds."""
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _origin(kind: Any) -> Any:
    return get_origin(_plain(kind))


def _inside(kind: Any) -> list[type[Struct]]:
    """Return the tables in the type of a key."""
    kind = _plain(kind)
    if isinstance(kind, type) and issubclass(kind, StrictTable):
        return [kind]
    return [table for part in get_args(kind) for table in _inside(part)]


def _annotation(kind: Any, key: str) -> str:
    """Return the Python type of a key."""
    kind = _plain(kind)
    if kind == Place:
        return "Place"
    if get_origin(kind) is Literal:
        return f"Literal[{', '.join(map(repr, get_args(kind)))}]"
    if not get_args(kind):
        return _simple(kind, key)
    key = "" if float in get_args(kind) else key  # a number or text, not the name of a part
    inner = [_annotation(part, key) for part in get_args(kind) if part is not NoneType]
    if get_origin(kind) is dict:
        return f"Mapping[Any, {inner[1]}]"
    if get_origin(kind) in (list, tuple):
        sequence = f"Sequence[{' | '.join(dict.fromkeys(inner))}]"
        return "Rows" if sequence in ROWS else sequence
    return " | ".join(dict.fromkeys(inner))


def _simple(kind: type, key: str) -> str:
    """Return the Python type of a key that is not a list, mapping or choice."""
    if kind is str:
        return f"{NAMED[key]} | str" if key in NAMED else "str"
    return next((name for ours, name in QUANTITIES if issubclass(kind, ours)), _class_name(kind))
