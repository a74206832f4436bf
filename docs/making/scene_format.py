"""Tables of the scene format, made from the structs that read it: key, meaning, kind, bounds, default, example.

Between `<!-- keys: MaterialTable -->` and `<!-- end -->` of a page stands the table of that struct; several names stand
for one table of all. `python docs/making/scene_format.py` writes them into docs/scenes.md; a test holds them current.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import tomlkit
from msgspec import Struct, inspect
from msgspec.structs import fields
from rows import row

from kinelast.scene.format import ChainTable, SceneTable
from kinelast.scene.parsing import is_chain
from kinelast.scene.quantities import Stress
from kinelast.scene.schema import key_words
from kinelast.scene.tables import StrictTable
from kinelast.scene.units import LARGEST

ROOT = Path(__file__).parents[2]
MARK = re.compile(r"^<!-- keys: ([\w ]+) -->\n(?:.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)
PAGE = ROOT / "docs" / "scenes.md"
AS_IN = re.compile(r'as in ("[^"]*"|\[[^]]*\]|\S+)')
ILLUSTRATED = re.compile(r',? (?:as in|or for a pin|or) (?:"[^"]*"|\[[^]]*\]|[\d.e+-]+)')
LONGEST = 44  # letters of an example
HEAD = "| key | meaning | kind, unit | bounds | default | example |\n| --- | --- | --- | --- | --- | --- |\n"


def with_tables(markdown: str) -> str:
    """A page with the tables that it asks for."""

    def table(mark: re.Match[str]) -> str:
        told = "".join(rows(_struct(name)) for name in mark[1].split())
        return f"<!-- keys: {mark[1]} -->\n\n{HEAD}{told}\n<!-- end -->"

    return MARK.sub(table, markdown)


def left_out(markdown: str) -> set[str]:
    """Names of the structs whose tables the page of the format does not ask for."""
    return {each.__name__ for each in structs()} - {
        name for mark in MARK.finditer(markdown) for name in mark[1].split()
    }


def _struct(name: str) -> type[Struct]:
    return next(each for each in structs() if each.__name__ == name)


@cache
def structs() -> list[type[Struct]]:
    """The tables that a scene may hold, itself first."""
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


def rows(struct: type[Struct]) -> str:
    """Rows of the table of a struct's keys.

    Raises
    ------
    ValueError
        A key has no words.
    """
    words = key_words(struct)
    cells = []
    kinds = {field.name: field.type for field in inspect.type_info(struct).fields}
    tag = struct.__struct_config__.tag
    if tag is not None:
        cells.append(["**`shape`**", (struct.__doc__ or "").rstrip("."), f'`"{tag}"`', "", "", f'`"{tag}"`'])
    for field in fields(struct):
        if field.encode_name not in words:
            raise ValueError(f"{struct.__name__}.{field.name} has no words: `#:` beside it")
        meaning, _, special = words[field.encode_name].partition(" [") if words[field.encode_name].endswith("]") else (
            words[field.encode_name], "", "")  # fmt: skip
        kind = kinds[field.name]
        default = special.removesuffix("]") or ("**required**" if field.required else _default(field))
        cells.append(
            [f"`{field.encode_name}`", meaning, _kind(kind), _bounds(kind), default, _example(struct, field, kind)]
        )
    return "".join(map(row, cells))


def _default(field: Any) -> str:
    if isinstance(field.default, bool):
        return f"`{str(field.default).lower()}`"
    if isinstance(field.default, str) and field.default:
        return f'`"{field.default}"`'
    if isinstance(field.default, int | float):
        return f"{field.default:g}"
    return "none"


def _kind(kind: Any) -> str:  # noqa: PLR0911 - a line a kind
    """Kind of a value, in words, with its unit."""
    match kind:
        case inspect.UnionType():
            told = dict.fromkeys(_kind(part) for part in kind.types if not isinstance(part, inspect.NoneType))
            return ", or ".join(told)
        case inspect.LiteralType():
            return " or ".join(f'`"{value}"`' for value in kind.values)
        case inspect.CustomType():
            noun = "a number" if kind.cls.expected.startswith("a number") else ILLUSTRATED.sub("", kind.cls.expected)
            units = [
                unit for unit in getattr(kind.cls, "units", ("m",) if kind.cls.__name__ == "Sizes" else ()) if unit
            ]
            return f"{noun} [{' or '.join(units)}]" if units else noun
        case inspect.StructType():
            return "a table"
        case inspect.DictType():
            return f"by name: {_kind(kind.value_type)}"
        case inspect.ListType():
            return f"a list: {_kind(kind.item_type)}"
        case inspect.TupleType():
            each = [_kind(part) for part in kind.item_types]
            same = len({*each}) == 1 and len(each) > 1
            return f"[{', '.join('xyz'[: len(each)])}], each {each[0]}" if same else f"[{', '.join(each)}]"
        case inspect.IntType():
            return "a whole number"
        case inspect.FloatType():
            return "a number"
        case inspect.BoolType():
            return "`true` or `false`"
        case inspect.StrType():
            return "a name" if kind.pattern else "text"
    raise NotImplementedError(kind)


def _bounds(kind: Any) -> str:  # noqa: PLR0911 - likewise
    """Bounds of a value, empty where it has none."""
    match kind:
        case inspect.UnionType():
            return ", ".join(dict.fromkeys(bound for part in kind.types if (bound := _bounds(part))))
        case inspect.CustomType():
            told = kind.cls
            most = getattr(told, "most", LARGEST)
            return ", ".join(
                [
                    *(["> 0"] if getattr(told, "above", None) == 0 or told.__name__ == "Sizes" else []),
                    *(["≥ 0"] if getattr(told, "least", None) == 0 else []),
                    *([f"< {most:g}"] if most != LARGEST else []),
                ]
            )
        case inspect.IntType() | inspect.FloatType():
            signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
            return ", ".join(
                f"{sign} {_number(bound)}" for name, sign in signs.items() if (bound := getattr(kind, name)) is not None
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
    return f"{bound:,}" if isinstance(bound, int) and bound < 2**40 else f"{bound:g}"


def _example(struct: type[Struct], field: Any, kind: Any) -> str:
    """A value as a shipped scene has it, or as the messages ask for it."""
    for each in (part for part in struct.__mro__ if issubclass(part, StrictTable)):
        if (shown := used().get((each.__name__, field.encode_name))) is not None:
            return f"`{shown}`"
    for part in [kind, *_parts(kind)]:
        if (
            isinstance(part, inspect.CustomType)
            and part.cls is not Stress
            and (told := AS_IN.search(part.cls.expected))
        ):
            return f"`{told[1]}`"
        if isinstance(part, inspect.LiteralType):
            return f'`"{part.values[-1]}"`'
        if isinstance(part, inspect.BoolType):
            return "`true`"
    return ""


@cache
def used() -> dict[tuple[str, str], str]:
    """First values of keys in the shipped scenes, those of the gallery and the blocks of the pages."""
    texts = [path.read_text(encoding="utf-8") for folder in ("kinelast", "docs/gallery") for path in
             sorted((ROOT / folder).rglob("*.toml"))]  # fmt: skip
    texts += [
        block for page in sorted((ROOT / "docs").glob("*.md"))
        for block in re.findall(r"^```toml\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    ]  # fmt: skip
    values: dict[tuple[str, str], str] = {}
    for text in texts:
        try:
            data = tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            continue
        chain = is_chain(data)
        for place, value in _walked(inspect.type_info(ChainTable if chain else SceneTable), data):
            plain = not isinstance(value, dict) and "=" not in (shown := _shown(value)) and len(shown) <= LONGEST
            if plain and (place not in values or (shown[0] == '"' and values[place][0] in "-0123456789")):
                values[place] = shown
    return values


def _shown(value: Any) -> str:
    return str(tomlkit.item(value).as_string()) if not isinstance(value, float) else f"{value:g}"


def _walked(kind: Any, value: Any) -> Iterator[tuple[tuple[str, str], Any]]:
    """Values in a table of a file with the structs and keys that they are of."""
    if isinstance(kind, inspect.UnionType):
        kinds = [part for part in kind.types if _fits(part, value)]
        if kinds:
            yield from _walked(kinds[0], value)
    elif isinstance(kind, inspect.StructType) and isinstance(value, dict):
        for field in kind.fields:
            if field.encode_name in value:
                yield (kind.cls.__name__, field.encode_name), value[field.encode_name]
                yield from _walked(field.type, value[field.encode_name])
    elif isinstance(kind, inspect.DictType) and isinstance(value, dict):
        for each in value.values():
            yield from _walked(kind.value_type, each)
    elif isinstance(kind, inspect.ListType) and isinstance(value, list):
        for each in value:
            yield from _walked(kind.item_type, each)


def _fits(kind: Any, value: Any) -> bool:
    if isinstance(kind, inspect.StructType):
        return isinstance(value, dict) and (kind.tag is None or value.get("shape") == kind.tag) and (
            value.keys() - {"shape"} <= {field.encode_name for field in kind.fields}
        )  # fmt: skip
    if isinstance(kind, inspect.DictType):
        return isinstance(value, dict)
    return isinstance(kind, inspect.ListType) and isinstance(value, list)


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
