"""Positions of keys, values and errors in a TOML text, and edits that leave the rest of the text unchanged."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from msgspec import Struct

from kinelast.scene.document import mistakes_in
from kinelast.scene.mistakes import path_of
from kinelast.scene.sections import Read
from kinelast.values.error import SceneError

Path = tuple[str | int, ...]
Span = tuple[int, int]

BARE = re.compile(r"[A-Za-z0-9_-]+")
OTHER = re.compile(r"[^\s,\]}#]+")  # numbers and booleans; a scene contains no dates
BLANK = re.compile(r"(?:[ \t]*\n)*")
QUOTES = '"""', "'''", '"', "'"
NEXT = "Next: Support puts points on the ground, Drive turns a link about its pin."
"""Message of the page for a scene without drives."""


class Places(Struct, frozen=True):
    """Spans (start and end, exclusive) of the parts of a TOML text by path.

    A path consists of keys, and of list indices from 0.

    Attributes
    ----------
    values
        Span of each value, including values in lists and inline tables.
    tables
        Span of each table with a heading: from the start of the heading to the end of the line of the last entry.
    """

    values: Mapping[Path, Span]
    tables: Mapping[Path, Span]

    def nearest(self, path: Path) -> int | None:
        """Return the start of the value or table at a path, or of its nearest parent.

        If the text contains neither, return the start of the first table with the same first key, or None.
        """
        for length in range(len(path), 0, -1):
            for spans in (self.values, self.tables):
                if path[:length] in spans:
                    return spans[path[:length]][0]
        return next((span[0] for key, span in self.tables.items() if path and key[0] == path[0]), None)


@dataclass
class _Scanner:
    """Scanner of a valid TOML text."""

    text: str
    at: int = 0
    values: dict[Path, Span] = field(default_factory=dict)
    tables: dict[Path, Span] = field(default_factory=dict)
    counts: dict[Path, int] = field(default_factory=dict)

    def whole(self) -> Places:
        table: Path = ()
        while self._skip():
            begin = self.at
            if self.text.startswith("[", self.at):
                double = self.text.startswith("[[", self.at)
                self.at += 2 if double else 1
                table = self._entered(self._key(), double)
                self.at = self._end_of_line()
                self.tables[table] = (begin, self.at)
                continue
            path = table + tuple(self._key())
            self._skip()
            self.at += 1  # the equals sign
            self._value(path)
            self.at = self._end_of_line()
            if table in self.tables:
                self.tables[table] = (self.tables[table][0], self.at)
        return Places(self.values, self.tables)

    def _entered(self, keys: list[str], double: bool) -> Path:
        """Return the path of a heading. In a list of tables, this is the path of the last table so far."""
        path: Path = ()
        for number, key in enumerate(keys):
            path = (*path, key)
            if double and number == len(keys) - 1:
                self.counts[path] = self.counts.get(path, 0) + 1
            if path in self.counts:
                path = (*path, self.counts[path] - 1)
        return path

    def _skip(self) -> bool:
        """Skip white space and comments. Return False at the end of the text."""
        while self.at < len(self.text):
            if self.text[self.at] == "#":
                self.at = self._end_of_line()
            elif self.text[self.at].isspace():
                self.at += 1
            else:
                return True
        return False

    def _end_of_line(self) -> int:
        end = self.text.find("\n", self.at)
        return len(self.text) if end < 0 else end

    def _key(self) -> list[str]:
        parts = []
        while True:
            self._skip()
            if self.text[self.at] in "\"'":
                begin = self.at
                self._string()
                parts.append(self.text[begin + 1 : self.at - 1])
            elif bare := BARE.match(self.text, self.at):
                parts.append(bare[0])
                self.at = bare.end()
            else:
                raise ValueError("no key")
            self._skip()
            if self.text[self.at : self.at + 1] != ".":
                return parts
            self.at += 1

    def _string(self) -> None:
        quote = next(each for each in QUOTES if self.text.startswith(each, self.at))
        self.at += len(quote)
        while not self.text.startswith(quote, self.at):
            self.at += 2 if quote[0] == '"' and self.text[self.at] == "\\" else 1
        self.at += len(quote)
        while len(quote) == 3 and self.text.startswith(quote[0], self.at):
            self.at += 1

    def _value(self, path: Path) -> None:
        self._skip()
        begin = self.at
        if self.text[begin] in "\"'":
            self._string()
        elif self.text[begin] in "[{":
            self.at += 1
            self._entries(path, "]" if self.text[begin] == "[" else "}")
        elif other := OTHER.match(self.text, begin):
            self.at = other.end()
        self.values[path] = (begin, self.at)

    def _entries(self, path: Path, close: str) -> None:
        number = 0
        while self._skip() and self.text[self.at] != close:
            if self.text[self.at] == ",":
                self.at += 1
                continue
            if close == "]":
                self._value((*path, number))
                number += 1
            else:
                keys = self._key()
                self.at += 1  # the equals sign
                self._value((*path, *keys))
        self.at += 1


@lru_cache(maxsize=8)
def places(text: str) -> Places:
    r"""Return the spans of all parts of a valid TOML text.

    Examples
    --------
    >>> text = '[points]\nA = [0, "3 mm"]  # pin\n'
    >>> begin, end = places(text).values["points", "A", 1]
    >>> text[begin:end]
    '"3 mm"'
    """
    return _Scanner(text).whole()


def replaced(text: str, changes: Iterable[tuple[Span, str]]) -> str:
    """Replace spans of a text. The spans must not overlap."""
    for (begin, end), new in sorted(changes, reverse=True):
        text = text[:begin] + new + text[end:]
    return text


def as_toml(value: Any) -> str:
    """Return a value as TOML.

    Examples
    --------
    >>> as_toml(["A", [0, 0.25], True])
    '["A", [0, 0.25], true]'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_as_key(key)} = {as_toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def _as_key(key: str) -> str:
    return key if BARE.fullmatch(key) else as_toml(key)


def with_value(text: str, path: Path, value: Any) -> str:
    """Set the value at a path. If there is no such entry, add the entry, and if necessary the table.

    If the table is an inline table, it is rewritten with the new entry.
    """
    known = places(text)
    if path in known.values:
        return replaced(text, [(known.values[path], as_toml(value))])
    *above, key = path
    if tuple(above) in known.values:  # inline table
        begin, end = known.values[tuple(above)]
        inner = text[begin + 1 : end - 1].rstrip().rstrip(",")
        entry = f"{_as_key(str(key))} = {as_toml(value)}"
        return replaced(text, [((begin, end), "{" + (f"{inner}, {entry}" if inner.strip() else entry) + "}")])
    line = f"{_as_key(str(key))} = {as_toml(value)}"
    if not above:
        return f"{line}\n{text}"
    if tuple(above) in known.tables:
        end = known.tables[tuple(above)][1]
        return replaced(text, [((end, end), f"\n{line}")])
    return with_table(text, tuple(above), {str(key): value})


def with_table(text: str, path: Path, entries: Mapping[str, Any]) -> str:
    """Add a table after the last table with the same first key.

    If the path ends with a number, add the table to a list of tables. The value of this number has no effect.
    """
    heading = ".".join(_as_key(str(part)) for part in path if not isinstance(part, int))
    heading = f"[[{heading}]]" if isinstance(path[-1], int) else f"[{heading}]"
    lines = [heading, *(f"{_as_key(key)} = {as_toml(value)}" for key, value in entries.items())]
    ends = [end for key, (_, end) in places(text).tables.items() if key[0] == path[0]]
    at = max(ends) if ends else len(text.rstrip())
    before = "\n\n" if text[:at].strip() else ""
    return text[:at] + before + "\n".join(lines) + (text[at:] or "\n")


def without(text: str, path: Path) -> str:
    """Remove the table or entry at a path. An inline list or table is rewritten without the entry."""
    known = places(text)
    below = [span for key, span in known.tables.items() if key[: len(path)] == path]
    if below:
        for begin, end in sorted(below, reverse=True):
            text = text[:begin] + text[BLANK.match(text, min(end + 1, len(text))).end() :]  # type: ignore[union-attr]
        return text
    if path not in known.values:
        return text
    begin, end = known.values[path]
    above = known.values.get(path[:-1])
    if above is None:
        start = text.rfind("\n", 0, begin) + 1
        stop = text.find("\n", end)
        return text[:start] + (text[stop + 1 :] if stop >= 0 else "")
    kept = [text[slice(*known.values[each])] for each in _siblings(known, path[:-1]) if each != path]
    if isinstance(path[-1], int):
        return replaced(text, [(above, f"[{', '.join(kept)}]")])
    pairs = [
        f"{_as_key(str(each[-1]))} = {text[slice(*known.values[each])]}"
        for each in _siblings(known, path[:-1])
        if each != path
    ]
    return replaced(text, [(above, "{" + ", ".join(pairs) + "}")])


def _siblings(known: Places, above: Path) -> Iterator[Path]:
    return (each for each in known.values if len(each) == len(above) + 1 and each[:-1] == above)


def line_of(text: str, at: int) -> int:
    """Return the number (from 1) of the line that contains the character with the index `at`."""
    return text.count("\n", 0, at) + 1


def mistakes_of(error: Exception, text: str, read: Read) -> list[dict[str, Any]]:
    """Return all errors in a text from top to bottom, each with a line number and a message.

    `error` was raised when the scene was built or solved. It is returned if the tables of the scene contain no error.
    `read` reads the files to which the scene refers.
    """
    others = error.others if isinstance(error, SceneError) else ()
    found = [mistake(each, text) for each in mistakes_in(text, read) or [error, *others]]
    return sorted(found, key=lambda each: each["line"] or math.inf)


def mistake(error: Exception, text: str) -> dict[str, Any]:
    """Return the line number (or None) and the message of an error. If drives are missing, the message is `NEXT`."""
    if isinstance(error, SceneError) and error.table == "drives" and error.problem.startswith("the table is missing"):
        return {"line": None, "message": NEXT, "next": True}
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
