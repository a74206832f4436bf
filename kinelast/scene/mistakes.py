"""Find all errors in the text of a scene.

Validation stops at the first error, so each error is reported, repaired in a copy by a guess, and the copy is validated
again. Errors that a wrong guess may have caused are not reported.
"""

import re
from collections.abc import Callable, Mapping
from copy import deepcopy
from itertools import pairwise
from typing import Any

from msgspec import Struct, field

from kinelast.scene.parsing import leaves, parse_toml, read_toml
from kinelast.scene.parts import PARTS
from kinelast.values.error import SceneError

MAX_MISTAKES = 100  # maximum number of reported errors
MAX_CHARACTERS = 2_000_000  # maximum total number of characters of all texts that are checked
Path = tuple[Any, ...]  # path in the tables: names, and indices from 0
TOP_LEVEL = (
    "run",
    "limits",
    "fatigue",
    "sweep",
    "sensitivities",
    "optimize",
    "title",
    "source",
    "units",
    "structure_only",
)
STAND_INS = {  # valid tables that replace an invalid one to which other entries may refer
    "masses": 1.0,
    "materials": {"E": 2e11, "density": 8e3, "yield": 2e8, "ultimate": 4e8, "endurance": 1e8},
    "sections": {"shape": "rectangle", "depth": 0.01, "width": 0.01},
    "joints": {},
    **{part.key: part.stand_in for part in PARTS if part.stand_in is not None},
}
UNAFFECTED = re.compile(
    r'expected|there is no|the (point|link) "[^"]*" has no'
)  # messages of errors that do not depend on other entries
TABLE = re.compile(r"\s*\[{1,2}\s*([\w.\s\"-]+?)\s*\]{1,2}\s*(#.*)?$")


def all_mistakes(text: str, check: Callable[[Mapping[str, Any]], object]) -> tuple[SceneError, ...]:
    """Return the errors in a TOML text, in the order in which they are found.

    The errors do not contain the path of the file.

    Parameters
    ----------
    check
        Function that validates tables. It raises SceneError for the first error in them.
    """
    errors, kept, left_out = _unreadable(text)
    try:
        tables = read_toml(kept)
    except ValueError:
        return errors
    copy = _Copy(deepcopy(tables), found=[*errors], doubtful={*left_out})
    for _ in range(min(MAX_MISTAKES, MAX_CHARACTERS // (len(text) + 1))):
        try:
            check(copy.tables)
        except SceneError as error:
            if not copy.repair(error) or error.key == "library":  # names in the library are unknown
                break
        except Exception:  # a repaired copy may raise any exception
            break
        else:
            break
    return tuple(copy.found)


def _unreadable(text: str) -> tuple[tuple[SceneError, ...], str, set[Path]]:
    """Return the syntax errors in a text, the text without the invalid lines, and the entries of these lines."""
    errors: list[SceneError] = []
    lines, left_out = text.splitlines(), set()
    while len(errors) < MAX_MISTAKES:
        try:
            parse_toml("\n".join(lines))
            break
        except SceneError as error:
            at = _invalid_line(lines, error)
            errors.append(error)
            if at is None:
                return tuple(errors), "not TOML =", set()
            header = lines[at].lstrip().startswith("[")
            left_out.add(() if header else _table_of_line(lines, at))
            lines[at] = ""
            while header and at + 1 < len(lines) and not lines[at + 1].lstrip().startswith("["):
                at += 1  # otherwise, the keys below would belong to the table above
                lines[at] = ""
    return tuple(errors), "\n".join(lines), left_out


def _invalid_line(lines: list[str], error: SceneError) -> int | None:
    """Return the number of the reported line or, if that line is valid by itself, of the nearest invalid line above."""
    reported = re.search(r"at line (\d+)", error.problem)
    last = min(int(reported[1]), len(lines)) - 1 if reported else len(lines) - 1
    return next((at for at in range(last, -1, -1) if not _is_valid(lines[at])), last if lines[last].strip() else None)


def _is_valid(line: str) -> bool:
    try:
        read_toml(line)
    except ValueError:
        return False
    return True


def _table_of_line(lines: list[str], at: int) -> Path:
    """Return the path of the entry to which a line belongs."""
    above = [match for line in lines[: at + 1] if (match := TABLE.match(line))]
    if not above:
        return ()
    name = above[-1][1].replace('"', "")
    if above[-1][0].lstrip().startswith("[["):
        same = sum(match[1] == above[-1][1] and match[0].lstrip().startswith("[[") for match in above)
        return (name, same - 1)
    return tuple(name.split(".")[:2])


class _Copy(Struct, eq=False):
    """A copy of the tables of a file in which errors are repaired one by one.

    Attributes
    ----------
    found
        Reported errors.
    doubtful
        Entries with removed or guessed keys. Errors that depend on these entries are not reported. The path () stands
        for any entry. It is used if an unreadable line may belong to any table.
    seen
        Paths of the reported errors.
    removed
        Paths of removed entries.
    numbers
        For each list of tables, the indices in the file of the remaining tables.
    """

    tables: dict[str, Any]
    found: list[SceneError]
    doubtful: set[Path]
    seen: set[Path] = field(default_factory=set)
    removed: set[Path] = field(default_factory=set)
    numbers: dict[str, list[int]] = field(default_factory=dict)

    def repair(self, error: SceneError) -> bool:
        """Repair an error, and report it unless it may result from an earlier repair.

        Return True if it was repaired.
        """
        path = path_of(error.table, error.key)
        entry = self._entry(path)
        place = self._in_file(entry) + path[len(entry) :]
        if place in self.seen or self._follows_repair(error.problem, path, entry):
            return self._remove_key(path, entry) or self._remove_entry(entry)
        self.seen.add(place)
        self.found.append(self._numbered(error, path))
        if path == ("structure_only",):  # this key decides which other keys are valid
            return False
        ways = self._rename, self._put_example, self._put_existing
        return (
            any(way(path, error.problem) for way in ways) or self._remove_key(path, entry) or self._remove_entry(entry)
        )

    def _follows_repair(self, problem: str, path: Path, entry: Path) -> bool:
        """Return True if an error may result from an earlier repair."""
        if path[:1] in self.removed or self.removed & {*pairwise(path)} or self._names_removed_entry(problem):
            return True
        if () in self.doubtful and problem.startswith("the table is missing"):
            return True
        names = {name for doubted in self.doubtful for name in doubted[1:]}
        alone = bool(path) and path[0] in TOP_LEVEL
        depends = alone or self._in_file(entry) in self.doubtful or names & {*leaves(self._at(entry), str)}
        return bool(self.doubtful and depends) and (self._at(path) is None or not UNAFFECTED.match(problem))

    def _names_removed_entry(self, problem: str) -> bool:
        """Return True if a message reports a name as unknown because of a repair.

        The repair removed the name, or an unreadable line may define it.
        """
        unknown = re.search(r'(?:no|the) (\w+) "([^"]*)"', problem)
        if not unknown or not re.search(r"\bno\b", problem):
            return False
        tables = f"{unknown[1]}s", *(("points", "sliders") if unknown[1] in ("joint", "pin") else ())
        near = {(table, *name) for table in tables for name in ((), (unknown[2],))}
        return bool(near & self.removed) or () in self.doubtful or any((table,) in self.doubtful for table in tables)

    def _rename(self, path: Path, problem: str) -> bool:
        """Replace a wrong key, value or list item by the name that the message suggests."""
        hint = re.search(r'; (?:did you mean|there is|is it) ("[^;]*")', problem)
        holder = self._at(path[:-1])
        if not hint or not path or path[-1] == "shape" or not isinstance(holder, dict | list):
            return False
        new, key, sure = re.findall(r'"([^"]*)"', hint[1])[-1], path[-1], "; there is" not in problem
        if problem.startswith("there is no such"):
            return sure and isinstance(holder, dict) and key in holder and _joined(holder, key, new)
        if not sure:
            self._doubt(path)
        words = re.findall(r'"([^"]*)"', problem.split("; ", maxsplit=1)[0])
        value = self._at(path)
        if isinstance(value, str) and value in words and value != new:
            holder[key] = new
            return True
        if isinstance(value, list) and new not in value and any(word in value for word in words):
            value[next(at for at, each in enumerate(value) if each in words)] = new
            return True
        return False

    def _doubt(self, path: Path) -> None:
        self.doubtful.add(self._in_file(self._entry(path)))

    def _put_example(self, path: Path, problem: str) -> bool:
        """Replace a wrong value by the example or the first choice in the message."""
        if path[-1:] == ("shape",):  # the shape decides which other keys are valid
            return self._remove_entry(path[:2])
        example = re.search(r'^expected .*?as in "([^"]*)"', problem)
        choice = re.search(r"^expected one of ([^\s,]+)", problem)
        proposed = example[1] if example else choice[1] if choice else None
        value, holder = self._at(path), self._at(path[:-1])
        if proposed is None or value is None or not isinstance(holder, dict | list) or path[0] == "points":
            return False
        holder[path[-1]] = proposed
        self._doubt(path)
        return True

    def _put_existing(self, path: Path, problem: str) -> bool:
        """Replace the name of a section, material etc. that does not exist by the name of one that does."""
        value, there = self._at(path), self.tables.get(f"{path[-1]}s") if path else None
        if not isinstance(value, str) or f'"{value}"' not in problem or not isinstance(there, dict) or value in there:
            return False
        self._at(path[:-1])[path[-1]] = next(iter(there), value)
        self._doubt(path)
        return bool(there)

    def _remove_key(self, path: Path, entry: Path) -> bool:
        """Remove a key from its table. If the path leads to an item of a list, remove the whole list."""
        while path and path != entry and not isinstance(path[-1], str):
            path = path[:-1]
        holder = self._at(path[:-1])
        if not path or path == entry or not isinstance(holder, dict) or path[-1] not in holder:
            return False
        del holder[path[-1]]
        self._doubt(entry)
        return True

    def _remove_entry(self, entry: Path) -> bool:
        """Remove an entry with its contents."""
        holder = self._at(entry[:-1])
        if not entry or self._at(entry) is None:
            return False
        if isinstance(holder, list):
            number = int(entry[-1])
            self._numbers(str(entry[0])).pop(number)
            del holder[number]
            if not holder:
                del self.tables[entry[0]]
                self.removed.add(entry[:1])
            return True
        instead = self._stand_in(entry)
        if instead is not None and holder[entry[-1]] != instead:
            holder[entry[-1]] = instead
            self._doubt(entry)
            return True
        del holder[entry[-1]]
        self.removed.add(entry)
        return True

    def _stand_in(self, entry: Path) -> Any:
        """Return a replacement for an entry to which others may refer, or None."""
        if len(entry) == 2 and entry[0] == "points":
            return [0.0173 * len(self.found), 0.0291]  # all at different positions
        if entry[0] != "links" or len(entry) != 2:
            return deepcopy(STAND_INS.get(entry[0])) if len(entry) == 2 else None
        points = self._at((*entry, "points")) or [*self.tables.get("points", ())][:1]
        if entry[1] == "ground":
            return {"points": points}
        center = [0.0, 0.0] if isinstance(points, dict) else next(iter(points), "")
        return {"points": points, "rigid": True, "mass": 1.0, "inertia": 1.0, "center": center}

    def _entry(self, path: Path) -> Path:
        """Return the path of the top-level entry or table that contains a path."""
        return path[:2] if path and path[0] not in TOP_LEVEL else path[:1]

    def _at(self, path: Path) -> Any:
        """Return the content at a path, or None."""
        node: Any = self.tables
        for part in path:
            if isinstance(node, list):
                node = dict(enumerate(node))
            if not isinstance(node, dict) or part not in node:
                return None
            node = node[part]
        return node

    def _numbers(self, name: str) -> list[int]:
        return self.numbers.setdefault(name, [*range(len(self.tables[name]))])

    def _in_file(self, entry: Path) -> Path:
        """Return the path of an entry in the file.

        In a list, indices differ from those in the copy if tables were removed.
        """
        if len(entry) == 2 and isinstance(entry[1], int) and isinstance(self.tables.get(str(entry[0])), list):
            return entry[0], self._numbers(str(entry[0]))[entry[1]]
        return entry

    def _numbered(self, error: SceneError, path: Path) -> SceneError:
        """Return an error with the path of its entry in the file, see `_in_file`."""
        entry = self._entry(path)
        there = self._in_file(entry)
        if there == entry or not error.table.startswith(f"{entry[0]}["):
            return error
        table = error.table.replace(f"[{int(entry[1]) + 1}]", f"[{int(there[1]) + 1}]", 1)
        return SceneError(error.file, table, error.key, error.problem)


def _joined(holder: dict[str, Any], key: str, new: str) -> bool:
    """Move the content of a key to the key `new`. Return False if `new` has content that cannot be joined with it."""
    there, content = holder.get(new), holder[key]
    if there is None:
        holder[new] = content
    elif isinstance(there, dict) and isinstance(content, dict) and not there.keys() & content.keys():
        there.update(content)
    elif isinstance(there, list) and isinstance(content, list):
        there.extend(content)
    else:
        return False
    del holder[key]
    return True


def path_of(table: str, key: str) -> Path:
    """Return the path to the table and key that a message names, with indices from 0.

    Examples
    --------
    >>> path_of("drives[1]", "law[2].by"), path_of("tolerances", '"points.B.x"')
    (('drives', 0, 'law', 1, 'by'), ('tolerances', 'points.B.x'))
    """
    words = f"{table}.{key}".replace(" x", "[1]").replace(" y", "[2]")
    parts = re.findall(r'"([^"]*)"|\[(\d+)\]|([^.\[\]\s"]+)', words)
    return tuple(int(number) - 1 if number else quoted or name for quoted, number, name in parts)
