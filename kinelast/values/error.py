"""Errors in scene files. An error states its location and the likely correction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

MAX_PLACE, MAX_PROBLEM = 120, 600  # maximum number of characters of the location and of the problem
MAX_WORD = 80  # maximum length of an unknown name for which similar names are suggested


class SceneError(ValueError):
    """An error in a scene.

    Attributes
    ----------
    file
        Path of the file. If the scene does not come from a file, a label or empty.
    table
        Name of the table, such as "links.crank" or "drives[1]"; empty for the top level.
    key
        Key in the table; empty if the error concerns the whole table.
    problem
        The error, the expected value and the likely correction.
    designs
        Numbers of the invalid designs if the scene represents several designs, otherwise None.
    others
        Other errors in the same file.
    """

    designs: Any = None
    others: tuple[SceneError, ...] = ()

    def __init__(self, file: str, table: str, key: str, problem: str) -> None:
        place = " ".join(plain(part, MAX_PLACE) for part in (_header(table), key) if part)
        problem = plain(problem, MAX_PROBLEM)
        parts = (plain(file, MAX_PROBLEM), place, problem)
        super().__init__(": ".join(part for part in parts if part))
        self.file, self.table, self.key, self.problem = file, table, key, problem

    def __str__(self) -> str:
        return "\n".join([str(self.args[0]), *map(str, self.others)])

    def __reduce__(self) -> tuple[Any, ...]:
        """Support pickling, so that a worker process can return the error."""
        return type(self), (self.file, self.table, self.key, self.problem), {"others": self.others}

    def of_file(self, path: str) -> SceneError:
        """Return this error and the errors in `others` with the path of the file."""
        error = type(self)(path, self.table, self.key, self.problem)
        error.others = tuple(each.of_file(path) for each in self.others)
        return error


class MissingFileError(SceneError, FileNotFoundError):
    """There is no file or included scene with the given name."""


def _header(table: str) -> str:
    """Return the header of a table, as written in a file."""
    name, _, number = table.partition("[")
    return f"[[{name}]] no. {number.rstrip(']')}" if number else f"[{name}]" if name else ""


def fault(table: str, key: str, problem: str) -> SceneError:
    """Return an error without the path of the file, which `of_file` adds."""
    return SceneError("", table, key, problem)


def require_absent(where: str, table: object, keys: Iterable[str], problem: str) -> None:
    """Raise SceneError if a table has one of the `keys`, which are not allowed in it."""
    for key in keys:
        if getattr(table, key) is not None:
            raise fault(where, key, problem)


def plain(text: str, longest: int) -> str:
    """Return a text on one line, without control characters. A long text is shortened in the middle."""
    if len(text) > longest:
        text = f"{text[: longest - longest // 3 - 5]} ... {text[-(longest // 3) :]}"
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii") for letter in text
    )


MIN_PART = 4  # minimum length of a name that is suggested because the unknown word contains it


def likely(word: str, choices: Iterable[str]) -> str:
    """Return the end of a message about an unknown name.

    It contains the most similar choice or, if there are few, all.
    """
    from difflib import get_close_matches

    names = list(choices)
    lower = {name.lower(): name for name in names if len(name) <= MAX_WORD}
    within = (name for name in lower if len(name) >= MIN_PART and name in word.lower())  # "yield" in "yield_stress"
    near = get_close_matches(word.lower(), lower, n=1, cutoff=0.6) if len(word) <= MAX_WORD else []
    near = near or sorted(within, key=len)[-1:]
    if near:
        return f'; did you mean "{lower[near[0]]}"?'
    if names and len(names) <= 12:
        return "; there is " + ", ".join(f'"{name}"' for name in names)
    return ""


def known_name(table: str, key: str, name: str, names: Iterable[str], what: str = "link") -> None:
    """Raise SceneError if `name` is not one of `names`."""
    names = list(names)
    if name not in names:
        raise fault(table, key, f'there is no {what} "{name}"{likely(name, names)}')


def known_point(table: str, key: str, point: str, points: Mapping[str, object], link: str) -> None:
    """Raise SceneError if a link does not have the point `point`."""
    if point not in points:
        raise fault(table, key, f'the link "{link}" has no point "{point}"{likely(point, points)}')
