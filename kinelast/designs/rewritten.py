"""The text of a scene's file with other values for some of its numbers; comments and order stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import tomlkit

from kinelast.scene.error import fault
from kinelast.scene.parsing import parse_scene, parse_toml
from kinelast.scene.quantities import Direction
from kinelast.scene.text import of_file
from kinelast.scene.units import FORM, TYPESET, Quantity
from kinelast.scene.variables import Place, place_of, value_at

DIGITS = 12
SCHEMA = "#:schema"  # whose place is told from the file's own


def rewritten(text: str, values: Mapping[str, float], head: str = "", which: str = "") -> str:
    """A scene's text with other values, in SI units, for numbers named by their paths.

    A number keeps the unit that it has in the file.

    Parameters
    ----------
    head
        A comment for the first line.
    which
        What is added to the title, where there is one, to tell the scene from others of that title.

    Raises
    ------
    SceneError
        The text holds a mistake, or no number of a name.
    """
    document = tomlkit.parse(text)
    table = parse_scene(document.unwrap())
    for path, value in values.items():
        _put(document, place_of(table, path), value)
    if which and "title" in document:
        document["title"] = f"{table.title}, {which}"
    lines = tomlkit.dumps(document).splitlines(keepends=True)
    kept = lines[1:] if lines and lines[0].startswith(SCHEMA) else lines
    return "".join([f"# {head}\n" if head else "", *kept])


def with_changes(text: str, changes: Sequence[str], path: str = "") -> str:
    """A scene's text with other values as they were typed, each as in "links.rod.length=330 mm"; its title tells them.

    Parameters
    ----------
    path
        Of the scene's file, for messages.

    Raises
    ------
    SceneError
        No number of a name, or a value that cannot stand there.
    """
    with of_file(path):
        table = parse_scene(parse_toml(text))
        values = {}
        for change in changes:
            name, equals, value = (part.strip() for part in change.partition("="))
            if not equals:
                raise fault(
                    "", "", f'--set: expected a path and a value, as in "links.rod.length=330 mm", got "{change}"'
                )
            values[name] = value_at(table, place_of(table, name), _typed(value))
        return rewritten(text, values, which=", ".join(changes))


def _typed(value: str) -> int | float | str:
    """A number, or else a text with a unit."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(value)
    return value


def _put(document: Any, place: Place, value: float) -> None:
    """Put a value into a document."""
    node: Any = document
    for name, following in zip(place.names[:-1], place.names[1:], strict=True):
        if isinstance(node, dict) and name not in node:
            node[name] = tomlkit.table()
        if isinstance(following, int) and not isinstance(node[name], list):
            node[name] = [node[name], node[name]]  # one size for both ends of a beam
        node = node[name]
    last = place.names[-1]
    there = node[last] if not isinstance(node, dict) or last in node else None
    node[last] = _written(place, there, value)


def _written(place: Place, there: Any, value: float) -> Any:
    """A value as it stands in a file."""
    unit = place.variable.unit
    if isinstance(place.leaf, int):
        return round(value)
    if isinstance(there, str) and (form := FORM.fullmatch(there.translate(TYPESET))):
        own = Quantity.of_unit(unit, f"1 {form[2]}")
        return f"{value / own:.{DIGITS}g} {form[2].strip()}"
    if isinstance(there, int | float) and not isinstance(place.leaf, Direction):
        return float(f"{value / place.per_bare:.{DIGITS}g}")
    return f"{value:.{DIGITS}g} {unit}" if unit != "1" else float(f"{value:.{DIGITS}g}")
