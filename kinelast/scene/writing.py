"""The text of a scene's file with other values for some of its numbers; comments and order stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import tomlkit

from kinelast.scene.error import SceneError
from kinelast.scene.format import SceneTable
from kinelast.scene.quantities import Direction
from kinelast.scene.units import FORM, TYPESET, Quantity
from kinelast.scene.variables import Place, in_file, place_of, value_at

DIGITS = range(12, 18)  # of which the fewest are taken that tell a number to its last bit
SCHEMA = "#:schema"  # whose place is told from the file's own


def written(text: str, table: SceneTable, values: Mapping[str, float], head: str = "") -> str:
    """A scene's text with other values, in SI units, for numbers named by their paths.

    A number keeps the unit that it has in the file, and is read from the new text to the last bit.

    Parameters
    ----------
    table
        The parsed tables with these values, and with the title that is to be told.
    head
        A comment for the first line.
    """
    document = tomlkit.parse(text)
    for path, value in values.items():
        _put(document, table, place_of(table, path), value)
    if document.get("title", "") != table.title:
        document["title"] = table.title
    lines = tomlkit.dumps(document).splitlines(keepends=True)
    kept = lines[1:] if lines and lines[0].startswith(SCHEMA) else lines
    return "".join([f"# {head}\n" if head else "", *kept])


def _put(document: Any, table: SceneTable, place: Place, value: float) -> None:
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
    *forms, plainest = _forms(place, there, value)
    node[last] = next((form for form in forms if _value(table, place, form) == value), plainest)


def _value(table: SceneTable, place: Place, written: Any) -> float | None:
    with suppress(SceneError):
        return value_at(table, place, written)
    return None


def _forms(place: Place, there: Any, value: float) -> Iterator[Any]:
    """A value as it may stand in a file: in the unit that stands there; at last in the SI unit."""
    unit = place.variable.unit
    for digits in () if isinstance(place.leaf, int) else DIGITS:
        if isinstance(there, str) and (form := FORM.fullmatch(there.translate(TYPESET))):
            own = Quantity.of_unit(unit, f"1 {form[2]}")
            yield f"{value / own:.{digits}g} {form[2].strip()}"
        elif isinstance(there, int | float) and not isinstance(place.leaf, Direction):
            yield float(f"{value / place.per_bare:.{digits}g}")
        else:
            yield f"{value:.{digits}g} {unit}" if unit != "1" else float(f"{value:.{digits}g}")
    yield in_file(place, value)
