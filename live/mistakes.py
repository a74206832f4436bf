"""Mistakes of a scene's text with their lines: all that single entries hold at once, else the first of the whole."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from kinelast.scene.error import SceneError
from kinelast.scene.format import SceneTable
from kinelast.scene.parsing import parse_parts, parse_scene
from kinelast.scene.tables import PER_LENGTH
from live.text import Path, line_of, places

MOST = 50  # that are told
WHOLE = ("run", "limits", "sweep", "sensitivities", "optimize", "title", "source", "units", "structure_only")


def entry_mistakes(text: str) -> list[dict[str, Any]]:
    """A mistake for every entry of a text that cannot be read; none where all can.

    Entries that can be read may still not fit each other: that only the whole scene tells.
    """
    try:
        tables = tomllib.loads(text)
    except ValueError:
        return []
    units = tables.get("units")
    empty = SceneTable(points={}, links={}, units=units if units in PER_LENGTH else "m")
    told = []
    for name, value in tables.items():
        for number, part in _entries(name, value):
            try:
                if name not in SceneTable.__struct_fields__:
                    parse_scene({name: part})
                parse_parts(empty, {name: part}, [name])
            except SceneError as error:
                table = error.table.replace("[1]", f"[{number}]") if isinstance(value, list) else error.table
                told.append(mistake(SceneError("", table, error.key, error.problem), text))
                if len(told) == MOST:
                    return told
    return told


def _entries(name: str, value: Any) -> Iterator[tuple[int, Any]]:
    """Each entry of a table or list of the top level, as one that holds it alone, and its number."""
    apart = name in SceneTable.__struct_fields__ and name not in WHOLE
    if apart and isinstance(value, Mapping):
        yield from enumerate(({key: entry} for key, entry in value.items()), 1)
    elif apart and isinstance(value, list):
        yield from enumerate(([entry] for entry in value), 1)
    else:
        yield 1, value


def mistake(error: Exception, text: str) -> dict[str, Any]:
    """A mistake in a text: its line, None where it has none, and the message."""
    if not isinstance(error, SceneError):
        at = re.search(r"at line (\d+)", str(error))
        return {"line": int(at[1]) if at else None, "message": str(error)}
    message = " ".join(part for part in (error.key if error.table == "points" else "", error.problem) if part)
    if at := re.search(r"at line (\d+)", error.problem) if not error.table else None:
        return {"line": int(at[1]), "message": message}
    try:
        first = places(text).nearest(path_of(error.table, error.key))
    except (ValueError, IndexError):
        first = None
    return {"line": None if first is None else line_of(text, first), "message": message or str(error)}


def path_of(table: str, key: str) -> Path:
    """The path of a message's table and key, counting from 0.

    Examples
    --------
    >>> path_of("drives[1]", "law[2].by")
    ('drives', 0, 'law', 1, 'by')
    """
    words = f"{table}.{key}".replace(" x", "[1]").replace(" y", "[2]").replace('"', "")
    parts = re.findall(r"\[(\d+)\]|([^.\[\]\s]+)", words)
    return tuple(int(number) - 1 if number else name for number, name in parts)
