"""The one way in which a scene file can be wrong."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

LONGEST_PLACE, LONGEST_PROBLEM = 120, 600  # letters of a message's parts, whatever a file holds
LONGEST_WORD = 80  # of which near ones are looked for


class SceneError(ValueError):
    """A mistake in a scene, told in one message.

    Attributes
    ----------
    file
        Path of the file, or what stands for it where a scene is not read from a file.
    table
        Table of the file, as "links.crank" or "drives[1]"; empty for the top level.
    key
        Key in the table; empty where the whole table is meant.
    problem
        What is wrong, what was expected and, where there is one, the likely correction.
    designs
        Rows of the designs that are at fault, where a scene stands for many; else None.
    others
        Further mistakes of the same file, each told on a line of its own.
    """

    designs: Any = None
    others: tuple[SceneError, ...] = ()

    def __init__(self, file: str, table: str, key: str, problem: str) -> None:
        place = " ".join(plain(part, LONGEST_PLACE) for part in (_header(table), key) if part)
        problem = plain(problem, LONGEST_PROBLEM)
        told = (plain(file, LONGEST_PROBLEM), place, problem)
        super().__init__(": ".join(part for part in told if part))
        self.file, self.table, self.key, self.problem = file, table, key, problem

    def __str__(self) -> str:
        return "\n".join([str(self.args[0]), *map(str, self.others)])

    def __reduce__(self) -> tuple[Any, ...]:
        """Survive the way back from a worker process."""
        return type(self), (self.file, self.table, self.key, self.problem), {"others": self.others}

    def of_file(self, path: str) -> SceneError:
        """The same mistakes with the file that they are in."""
        error = type(self)(path, self.table, self.key, self.problem)
        error.others = tuple(each.of_file(path) for each in self.others)
        return error


class MissingFileError(SceneError, FileNotFoundError):
    """There is no file, or shipped scene, of the name given for one."""


def _header(table: str) -> str:
    """A table as it is written in a file."""
    name, _, number = table.partition("[")
    return f"[[{name}]] no. {number.rstrip(']')}" if number else f"[{name}]" if name else ""


def fault(table: str, key: str, problem: str) -> SceneError:
    """A mistake found where the file is not known; the reader adds it."""
    return SceneError("", table, key, problem)


def require_absent(where: str, table: object, keys: Iterable[str], problem: str) -> None:
    """Raise where a table has one of some keys, which belong to another kind of it."""
    for key in keys:
        if getattr(table, key) is not None:
            raise fault(where, key, problem)


def plain(text: str, longest: int) -> str:
    """A text as it can be printed anywhere: on one line, without control characters, its middle left out if long."""
    if len(text) > longest:
        text = f"{text[: longest - longest // 3 - 5]} ... {text[-(longest // 3) :]}"
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii") for letter in text
    )


def likely(word: str, choices: Iterable[str]) -> str:
    """The end of a message about a name that is not known: the nearest choice, or all when they are few."""
    names = list(choices)
    lower = {name.lower(): name for name in names if len(name) <= LONGEST_WORD}
    near = get_close_matches(word.lower(), lower, n=1, cutoff=0.6) if len(word) <= LONGEST_WORD else []
    if near:
        return f'; did you mean "{lower[near[0]]}"?'
    if names and len(names) <= 12:
        return "; there is " + ", ".join(f'"{name}"' for name in names)
    return ""


def known_name(table: str, key: str, name: str, names: Iterable[str], what: str = "link") -> None:
    """Raise where there is no link, or other thing, of a name."""
    names = list(names)
    if name not in names:
        raise fault(table, key, f'there is no {what} "{name}"{likely(name, names)}')
