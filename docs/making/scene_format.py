"""Tables of the scene format from its structs: key with value, meaning with default.

A page has the table of a struct between `<!-- keys: MaterialTable -->` and `<!-- end -->`. Several names give one table
with all their keys. `python docs/making/scene_format.py` writes the tables into docs/scenes.md; a test compares them.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from msgspec import Struct, inspect
from msgspec.structs import fields
from rows import row

from kinelast.scene.format import ChainTable, SceneTable
from kinelast.scene.schema import key_words

ROOT = Path(__file__).parents[2]
MARK = re.compile(r"^<!-- keys: ([\w ]+) -->\n(?:.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)
PAGE = ROOT / "docs" / "scenes.md"
ILLUSTRATED = re.compile(r',? (?:as in|or for a pin|or) (?:"[^"]*"|\[[^]]*\]|[\d.e+-]+)')
HEAD = "| key | meaning |\n|---|---|\n"
PLAIN = {"text", "name", "true, false", "table"}  # kinds that the meaning implies
SHAPES = "| `shape` | keys, optional ones in brackets |\n|---|---|\n"


def with_tables(markdown: str) -> str:
    """Fill the tables of a page."""

    def table(mark: re.Match[str]) -> str:
        chosen = [_struct(name) for name in mark[1].split()]
        shapes = chosen[0].__struct_config__.tag is not None
        lines = _shapes(chosen) if shapes else [line for each in chosen for line in rows(each)]
        return f"<!-- keys: {mark[1]} -->\n\n{SHAPES if shapes else HEAD}{''.join(dict.fromkeys(lines))}\n<!-- end -->"

    return MARK.sub(table, markdown)


def left_out(markdown: str) -> set[str]:
    """Names of structs without a table on the page."""
    return {each.__name__ for each in structs()} - {
        name for mark in MARK.finditer(markdown) for name in mark[1].split()
    }


def _struct(name: str) -> type[Struct]:
    return next(each for each in structs() if each.__name__ == name)


@cache
def structs() -> list[type[Struct]]:
    """Structs of all tables of a scene, the scene first."""
    met: list[type[Struct]] = []
    waiting: list[Any] = [inspect.type_info(SceneTable), inspect.type_info(ChainTable)]
    while waiting:
        kind = waiting.pop(0)
        if isinstance(kind, inspect.StructType):
            if kind.cls not in met:
                met.append(kind.cls)
                waiting += [field.type for field in kind.fields]
        else:
            waiting += _parts(kind)
    return met


def _parts(kind: Any) -> list[Any]:
    if isinstance(kind, inspect.UnionType):
        return [*kind.types]
    if isinstance(kind, inspect.TupleType):
        return [*kind.item_types]
    return [part for name in ("item_type", "value_type") if (part := getattr(kind, name, None)) is not None]


def rows(struct: type[Struct]) -> list[str]:
    """Return the table rows of a struct's keys."""
    kinds = {field.name: field.type for field in inspect.type_info(struct).fields}
    inherited = {name for base in struct.__mro__[1:] if base in structs() for name in base.__struct_fields__}
    cells = []
    for field in (field for field in fields(struct) if field.name not in inherited):
        meaning, special = _words(struct, field)
        kind, bounds = _kind(kinds[field.name]), _bounds(kinds[field.name])
        value = ", ".join(filter(None, ["" if bounds and kind == "number" else kind, bounds]))
        if struct is SceneTable and "table" in _kind(kinds[field.name]).replace("or table", ""):
            continue  # a section of the page describes it
        if struct is ChainTable and field.name in {"title", "source", "units"}:
            continue  # as in a scene
        default = special or _default(field)
        key = f"**`{field.encode_name}`**" if field.required else f"`{field.encode_name}`"
        kept = "" if default in {"", "none", "no limit", "`false`"} else f" ({default})"
        if value.startswith('`"'):  # a choice
            meaning += "" if all(choice in meaning for choice in value.split(", ")) else f": {value}"
        elif value not in PLAIN:
            key += f" {value}" if "[" in value else f" [{value}]"
        cells.append([key, meaning + kept])
    return [*map(row, cells)]


def _shapes(structs: Sequence[type[Struct]]) -> list[str]:
    """Return the table rows of section shapes with their keys."""
    shown: dict[str, str] = {}
    lines = []
    for struct in structs:
        keys = []
        for field in fields(struct):
            meaning, special = _words(struct, field)
            key = f"`{field.encode_name}` {meaning}{f', default {special}' if special else ''}"
            keys.append(key if field.required else f"({key})")
        tag = f'`"{struct.__struct_config__.tag}"`'
        words = "; ".join(keys)
        lines.append(row([tag, f"as {shown[words]}" if words in shown else words]))
        shown.setdefault(words, tag)
    return lines


def _words(struct: type[Struct], field: Any) -> tuple[str, str]:
    """Return the meaning of a key, and its default if the description has one.

    Raises
    ------
    ValueError
        The key has no description.
    """
    words = key_words(struct)
    if field.encode_name not in words:
        raise ValueError(f"{struct.__name__}.{field.name} has no description: add a `#:` comment")
    description = words[field.encode_name]
    meaning, _, special = description.partition(" [") if description.endswith("]") else (description, "", "")
    return meaning, special.removesuffix("]")


def _default(field: Any) -> str:
    if isinstance(field.default, bool):
        return f"`{str(field.default).lower()}`"
    if isinstance(field.default, str) and field.default:
        return f'`"{field.default}"`'
    if isinstance(field.default, int | float):
        return f"{field.default:g}"
    return ""


def _kind(kind: Any) -> str:  # noqa: PLR0911 - a line a kind
    """Return the unit of a value, or its type in words."""
    match kind:
        case inspect.UnionType():
            parts = dict.fromkeys(_kind(part) for part in kind.types if not isinstance(part, inspect.NoneType))
            return " or ".join(parts)
        case inspect.LiteralType():
            return ", ".join(f'`"{value}"`' for value in kind.values)
        case inspect.CustomType():
            noun = "number" if kind.cls.expected.startswith("a number") else ILLUSTRATED.sub("", kind.cls.expected)
            units = [*filter(None, getattr(kind.cls, "units", ("m",) if kind.cls.__name__ == "Sizes" else ()))]
            return " or ".join(units) or re.sub(r"\b(a|an) ", "", noun)
        case inspect.StructType():
            return "table"
        case inspect.DictType():
            value = _kind(kind.value_type)
            return "named tables" if value == "table" else f"{value} by name"
        case inspect.ListType():
            value = _kind(kind.item_type)
            return f"list of {'tables' if value == 'table' else value}"
        case inspect.TupleType():
            each = [_kind(part) for part in kind.item_types]
            same = len({*each}) == 1 and len(each) > 1
            return f"[{', '.join('xyz'[: len(each)])}] {each[0]}" if same else f"[{', '.join(each)}]"
        case inspect.IntType():
            return "whole number"
        case inspect.FloatType():
            return "number"
        case inspect.BoolType():
            return "true, false"
        case inspect.StrType():
            return "name" if kind.pattern else "text"
    raise NotImplementedError(kind)


def _bounds(kind: Any) -> str:
    """Return the bounds of a value, or "". The page states those of quantities once."""
    match kind:
        case inspect.UnionType():
            return ", ".join(dict.fromkeys(bound for part in kind.types if (bound := _bounds(part))))
        case inspect.IntType() | inspect.FloatType():
            signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
            return ", ".join(
                f"{sign} {_number(bound)}"
                for name, sign in signs.items()
                if (bound := getattr(kind, name)) is not None and abs(bound) < 1e9
            )
        case inspect.ListType():
            least = f"{kind.min_length} or more" if kind.min_length else ""
            return ", ".join(filter(None, [least, _bounds(kind.item_type)]))
        case inspect.TupleType():
            return ", ".join(dict.fromkeys(filter(None, map(_bounds, kind.item_types))))
        case inspect.DictType():
            return _bounds(kind.value_type)
    return ""


def _number(bound: float) -> str:
    return f"{bound:,}" if isinstance(bound, int) else f"{bound:g}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
