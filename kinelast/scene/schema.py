"""The published JSON Schema of scenes, for editors that complete TOML."""

from __future__ import annotations

from typing import Any

import msgspec

from kinelast.scene.format import ChainTable, SceneTable
from kinelast.scene.quantities import Direction
from kinelast.scene.shapes import Sizes
from kinelast.scene.units import Quantity


def scene_schema() -> dict[str, Any]:
    """JSON Schema of a scene: of a planar mechanism, or of a chain of joints in space."""
    choices, tables = msgspec.json.schema_components(
        (SceneTable, ChainTable), schema_hook=_quantity_schema, ref_template="#/$defs/{name}"
    )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinelast scene",
        "anyOf": list(choices),
        "$defs": _without_null(tables),
    }


def schema_text() -> str:
    """The schema as it is published in scene.schema.json."""
    import json

    return json.dumps(scene_schema(), indent=2) + "\n"


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
    choices = [choice for choice in kept.get("anyOf", ()) if choice != {"type": "null"}]
    if "anyOf" in kept and len(choices) == 1:
        del kept["anyOf"]
        return {**choices[0], **kept}
    return {**kept, "anyOf": choices} if choices else kept
