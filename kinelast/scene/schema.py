"""JSON Schemas of scene files, for completion and checks in editors.

`hatch_build.py` writes the files at installation; `python -m kinelast.scene.schema` writes them again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from kinelast.scene.format import ChainTable, SceneTable
from kinelast.scene.quantities import Direction, Sizes
from kinelast.scene.tables import StrictTable
from kinelast.scene.units import Quantity

SCHEMAS: Mapping[str, type[Struct]] = {"scene.schema.json": SceneTable, "chain.schema.json": ChainTable}
"""Published schemas by file: of a planar mechanism, and of a spatial chain.

With both in one schema, an editor would report a mistake only for the file as a whole.
"""


def scene_schema(file: str = "scene.schema.json") -> dict[str, Any]:
    """Return a JSON Schema, one of `SCHEMAS`."""
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
    """Return the descriptions of a table's keys: the `#:` comments of its fields and of its base tables.

    A default that differs from the field's follows in brackets.
    """
    words: dict[str, str] = {}
    for part in reversed(table.__mro__):
        if issubclass(part, Struct) and part.__struct_fields__:
            words |= _commented(part)
    names = zip(table.__struct_encode_fields__, table.__struct_fields__, strict=True)
    return {written: words[name] for written, name in names if name in words}


@cache
def _commented(table: type[Struct]) -> Mapping[str, str]:
    """Return the descriptions of a table's own fields; cached, since finding the source parses its file."""
    from inspect import getsource

    words: dict[str, str] = {}
    if "key_words" in vars(table):  # a table made from parts has no source
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
    """Yield all tables derived from a table, directly or indirectly."""
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
    """Return a schema without null, which TOML does not have; optional keys are omitted instead."""
    if isinstance(schema, list):
        return [_without_null(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _without_null(value) for key, value in schema.items() if not (key == "default" and value is None)}
    if "prefixItems" in kept:  # a pair; taplo uses an older draft, which only has `items`
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


if __name__ == "__main__":
    for name in SCHEMAS:
        (Path(__file__).parents[1] / name).write_text(schema_text(name), encoding="utf-8")
