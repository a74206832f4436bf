"""Scene tables for other tools: JSON schemas for editors, and Python classes with typed fields.

`hatch_build.py` writes the schemas at installation. `python -m kinelast.scene.schema` writes them again.
"""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

import msgspec
from msgspec import Struct
from msgspec.structs import FieldInfo, fields

from kinelast.scene.format import ChainTable, Dimensioned, SceneTable
from kinelast.scene.tables import Place, StrictTable
from kinelast.values.quantities import Direction, Sizes
from kinelast.values.units import Quantity

SCHEMAS: Mapping[str, type[Struct]] = {"scene.schema.json": SceneTable, "chain.schema.json": ChainTable}
"""Published schemas by file: for a planar mechanism, and for a spatial chain.

With a common schema, an editor could not locate an error in the file.
"""


def scene_schema(file: str = "scene.schema.json") -> dict[str, Any]:
    """Return the JSON Schema with a file name in `SCHEMAS`."""
    (chosen,), tables = msgspec.json.schema_components(
        (SCHEMAS[file],), schema_hook=_quantity_schema, ref_template="#/$defs/{name}"
    )
    for table in subtables(StrictTable):
        for key, words in key_words(table).items() if table.__name__ in tables else ():
            entry = tables[table.__name__]["properties"][key]
            entry["description"] = "; ".join([words, *([entry["description"]] if "description" in entry else [])])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinelast scene",
        "allOf": [chosen],
        "$defs": _without_null(tables),
    }


FIELD = re.compile(r"    (\w+): ")
WORDS = re.compile(r"#: (.*)")


def key_words(table: type[Struct]) -> dict[str, str]:
    """Return the descriptions of the keys of a table, from the `#:` comments on its fields and in its base tables.

    A description ends with the default in brackets, unless it is the default value of the field.
    """
    words: dict[str, str] = {}
    for part in reversed(table.__mro__):
        if issubclass(part, Struct) and part.__struct_fields__:
            words |= _commented(part)
    names = zip(table.__struct_encode_fields__, table.__struct_fields__, strict=True)
    return {written: words[name] for written, name in names if name in words}


@cache
def _commented(table: type[Struct]) -> Mapping[str, str]:
    """Return the descriptions of the fields that a table adds to those of its base tables.

    The result is cached, because `getsource` parses the whole file.
    """
    from inspect import getsource

    words: dict[str, str] = {}
    if "key_words" in vars(table):  # a table that is built at run time has no source text
        return {**vars(table)["key_words"]}
    comments: list[str] = []
    for line in getsource(table).splitlines():
        comments += WORDS.findall(line)
        if field := FIELD.match(line):
            if comments:
                words[field[1]] = " ".join(comments)
            comments = []
    return words


def schema_text(file: str = "scene.schema.json") -> str:
    """Return the text of a schema file, one of `SCHEMAS`."""
    import json

    return json.dumps(scene_schema(file), indent=2) + "\n"


def subtables(table: type[Struct]) -> Iterator[type[Struct]]:
    """Yield all tables that are derived from a table, directly or indirectly."""
    for below in table.__subclasses__():
        yield below
        yield from subtables(below)


def _quantity_schema(kind: Any) -> dict[str, Any]:
    number: dict[str, Any] = {"type": "number"}
    if issubclass(kind, Direction):
        pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
        return {"anyOf": [pair, {"type": "string"}], "description": kind.expected}
    if issubclass(kind, Sizes):
        one = [{**number, "exclusiveMinimum": 0}, {"type": "string"}]
        pair = {"type": "array", "items": {"anyOf": one}, "minItems": 2, "maxItems": 2}
        return {"anyOf": [*one, pair], "description": f"{kind.expected}; a bare number is in m"}
    if issubclass(kind, Quantity):
        if kind.above == 0:
            number["exclusiveMinimum"] = 0
        if kind.least == 0:
            number["minimum"] = 0
        text = kind.expected + (f"; a bare number is in {' or '.join(kind.units)}" if any(kind.units) else "")
        return {"anyOf": [number, {"type": "string"}], "description": text}
    raise NotImplementedError(kind)


def _without_null(schema: Any) -> Any:
    """Remove null from a schema. TOML has no null: optional keys are omitted instead."""
    if isinstance(schema, list):
        return [_without_null(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _without_null(value) for key, value in schema.items() if not (key == "default" and value is None)}
    if "prefixItems" in kept:  # a pair of values; taplo supports only an older draft, without `prefixItems`
        parts = kept["prefixItems"]
        alike = all(part == parts[0] for part in parts)
        kept["items"] = parts[0] if alike else {"anyOf": parts}
        if alike:
            del kept["prefixItems"]
    choices = [choice for choice in kept.get("anyOf", ()) if choice != {"type": "null"}]
    if "anyOf" in kept and len(choices) == 1:
        del kept["anyOf"]
        return {**choices[0], **kept}
    return {**kept, "anyOf": choices} if choices else kept


NAMED = {  # classes by key: in Python, the key accepts an object of the class in place of a name
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


class TableClass(Struct, frozen=True):
    """A Python class for a table.

    `constants` are its class variables. `required` and `optional` are the types of its fields.
    """

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
        base = {dict: "NamedPart", list: "ListedPart"}.get(get_origin(_plain(entry.type)), "TypedPart")
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
    """Return the Python class of a table. The table is under the key `under` of the scene, or inside another table."""
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
    """Return a type without the bounds on its values."""
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _inside(kind: Any) -> list[type[Struct]]:
    """Return the types of tables that a key of the type `kind` accepts."""
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
    key = "" if float in get_args(kind) else key  # a text for a number, such as "3 mm", is not a name of an object
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


if __name__ == "__main__":
    for name in SCHEMAS:
        (Path(__file__).parents[1] / name).write_text(schema_text(name), encoding="utf-8")
