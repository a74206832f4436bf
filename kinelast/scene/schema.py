"""The JSON Schemas of scene files, by which editors complete and check them.

`hatch_build.py` writes the files when the package is installed; `python -m kinelast.scene.schema` writes them anew.
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
"""Published schemas by their files: of a planar mechanism, and of a chain of joints in space.

Two, as of one with a choice an editor tells a mistake only of the file as a whole.
"""


def scene_schema(file: str = "scene.schema.json") -> dict[str, Any]:
    """JSON Schema of a scene, one of `SCHEMAS`."""
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
    """Words on the keys of a table, by key: the comments `#:` at its fields, with those of the tables that it extends.

    Where the default is another than the field's, it stands at the end in brackets.
    """
    words: dict[str, str] = {}
    for part in reversed(table.__mro__):
        if issubclass(part, Struct) and part.__struct_fields__:
            words |= _commented(part)
    names = zip(table.__struct_encode_fields__, table.__struct_fields__, strict=True)
    return {written: words[name] for written, name in names if name in words}


@cache
def _commented(table: type[Struct]) -> Mapping[str, str]:
    """Words on the fields that stand in a table's own source, which takes as long to find as its file to parse."""
    from inspect import getsource

    words: dict[str, str] = {}
    if "key_words" in vars(table):  # made from parts, without a source
        return {**vars(table)["key_words"]}
    told: list[str] = []
    for line in getsource(table).splitlines():
        told += WORDS.findall(line)
        if field := FIELD.match(line):
            if told:
                words[field[1]] = " ".join(told)
            told = []
    return words


def schema_text(file: str = "scene.schema.json") -> str:
    """A schema as it is published in a file, one of `SCHEMAS`."""
    import json

    return json.dumps(scene_schema(file), indent=2) + "\n"


def subtables(table: type[Struct]) -> Iterator[type[Struct]]:
    """Every table that extends a table, and those that extend these."""
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
    """A schema without null, which TOML has not: keys that may be null may be left out."""
    if isinstance(schema, list):
        return [_without_null(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _without_null(value) for key, value in schema.items() if not (key == "default" and value is None)}
    if "prefixItems" in kept:  # of a pair: older drafts, as of taplo, know `items` alone, and take false for no entries
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
