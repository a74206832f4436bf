"""Text of a scene file: reading, and writing with changed values."""

import re
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import msgspec
from msgspec import Struct

from kinelast.scene import sections, variables
from kinelast.scene.format import SceneTable
from kinelast.values import quantities, units
from kinelast.values.error import MissingFileError, SceneError, fault, likely

LARGEST_FILE = 4_000_000  # maximum number of bytes of a scene file, enough for a table with 100,000 entries
MAX_PAGE_BYTES = 64_000_000  # maximum number of bytes of a report
PAGES = ".html", ".htm"


def file_bytes(path: Path) -> bytes:
    """Return the bytes of a scene file; raise SceneError if it is unreadable or too large."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise OSError("a folder, a pipe or a device is not a scene")
        with path.open("rb") as file:
            largest = MAX_PAGE_BYTES if path.suffix.lower() in PAGES else LARGEST_FILE
            content = file.read(largest + 1)
    except FileNotFoundError:
        raise MissingFileError(str(path), "", "", "there is no such file") from None
    except (OSError, ValueError) as error:  # a null character in the path raises ValueError
        problem = getattr(error, "strerror", None) or str(error)
        raise SceneError(str(path), "", "", f"not readable: {problem}") from None
    if len(content) > largest:
        raise SceneError(str(path), "", "", f"larger than {largest // 1_000_000} MB: too large for a scene")
    return content


def decoded(content: bytes, path: str) -> str:
    """Return the text of a scene, given the bytes of a scene file, or of a report that contains the scene.

    Raise SceneError if the file contains no such text.
    """
    if content[:15].lower() == b"<!doctype html>":
        return _scene_in_report(content, path)
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise SceneError(path, "", "", f"not a text in UTF-8 at line {line}: save it in UTF-8") from None


def _scene_in_report(page: bytes, path: str) -> str:
    """Return the text of the scene in a report."""
    data = re.search(rb'<script type="application/json" id="scene">(.*?)</script>', page, re.DOTALL)
    with suppress(msgspec.DecodeError):
        text = msgspec.json.decode(data[1] if data else b"{}", type=_ReportData).text
        if text:
            return text
    raise SceneError(path, "", "", "the page contains no scene: give the report.html of one, or its .toml file")


class _ReportData(Struct):
    """The data in a report. Only the text of the scene is read."""

    text: str = ""


def file_text(path: Path) -> str:
    """Return the text of a file; raise SceneError if it cannot be read."""
    return decoded(file_bytes(path), str(path))


COLUMNS = ".csv", ".tsv", ".txt"
FILES = *COLUMNS, ".toml", ".dxf"  # files to which a scene may refer


def reader_in(folder: Path | None) -> sections.Read:
    """Return a function that reads files in a folder and its subfolders. It raises SceneError for other files.

    Examples
    --------
    >>> reader_in(Path("scenes"))("../lift.csv")
    Traceback (most recent call last):
    kinelast.values.error.SceneError: "../lift.csv" is not in the folder of the scene: put the file there
    """

    def read(name: str) -> str:
        if not name.lower().endswith(FILES):
            expected = f"expected a file in the folder of the scene with the suffix {' or '.join(FILES)}"
            raise fault("", "", f'{expected}, got "{name}"')
        ways = PurePosixPath(name), PureWindowsPath(name)
        if any(way.anchor or ".." in way.parts for way in ways):
            raise fault("", "", f'"{name}" is not in the folder of the scene: put the file there')
        if folder is None:
            raise fault("", "", f'"{name}" cannot be found because the scene has no folder: save the scene first')
        try:
            return file_text(folder / name)
        except MissingFileError:
            there = sorted(path.name for path in folder.glob("*.*") if path.suffix.lower() in FILES)
            raise MissingFileError(
                "", "", "", f'there is no file "{name}" in the folder of the scene{likely(name, there)}'
            ) from None
        except SceneError as error:
            raise fault("", "", f'"{name}": {error.problem}') from None

    return read


def scene_name(path: Path) -> str:
    """Return the name of a scene: its file name without the suffix, in valid UTF-8."""
    return path.stem.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


@contextmanager
def of_file(path: str) -> Iterator[None]:
    """Context manager that adds the path of the file to a SceneError raised inside it."""
    try:
        yield
    except SceneError as error:
        raise error.of_file(path) from None
    except RecursionError:
        raise SceneError(path, "", "", "lists or tables are nested too deeply") from None


DIGITS = range(12, 18)  # numbers of digits, tried in this order until the text is read as exactly the same number
Rows = Iterable[Sequence[str | float]]
SCHEMA = "#:schema"


def written(
    text: str, table: SceneTable, values: Mapping[str, float], motions: Mapping[int, Rows], head: str = ""
) -> str:
    """Return the text of a scene with changed numbers.

    `values` contains the numbers in SI units, by path. A number keeps the unit that it has in the file. The number in
    the new text has exactly the given value.

    Parameters
    ----------
    table
        Parsed tables with the changed numbers and the new title.
    motions
        Motions from CSV files, by index of the drive. They are written into the text in place of the file names.
    head
        Comment for the first line.
    """
    import json

    import tomlkit

    document = tomlkit.parse(text)
    for path, value in values.items():
        _put(document, table, variables.place_of(table, path, absent=True), value)
    if document.get("title", "") != table.title:
        document["title"] = table.title
    for number in motions:
        document["drives"][number]["motion"] = _token(number)
    whole = tomlkit.dumps(document)
    for number, rows in motions.items():
        entries = "".join(f"\n    {json.dumps(row, ensure_ascii=False)}," for row in rows)
        whole = whole.replace(f'"{_token(number)}"', f"[{entries}\n]")
    lines = whole.splitlines(keepends=True)
    kept = lines[1:] if lines and lines[0].startswith(SCHEMA) else lines
    return "".join([f"# {head}\n" if head else "", *kept])


def with_tables(text: str, tables: Mapping[str, Any]) -> str:
    """Return the text of a scene in which the given sections and materials replace the key `library`."""
    import tomlkit

    document = tomlkit.parse(text)
    document.pop("library", None)
    for kind in ("materials", "sections"):
        for name, table in tables.get(kind, {}).items():
            own = document.get(kind, {})
            if name not in own or own[name].unwrap() != table:
                if kind not in document:
                    document[kind] = tomlkit.table(is_super_table=True)
                document[kind][name] = table
    return tomlkit.dumps(document)


def _token(number: int) -> str:
    """Return the text that stands for the motion of a drive until the motion is written."""
    return f"motion of the drive {number}"


def with_schema(text: str) -> str:
    """Add the path of the installed schema to the first line of a scene, so that editors can complete keys."""
    schema = Path(__file__).parents[1] / "scene.schema.json"
    rest = text.partition("\n")[2].lstrip("\n") if text.startswith(SCHEMA) else text
    return f"{SCHEMA} {schema.as_uri()}\n{rest}"


def _put(document: Any, table: SceneTable, place: variables.Place, value: float) -> None:
    """Write a value into a document."""
    node: Any = document
    for name, following in zip(place.names[:-1], place.names[1:], strict=True):
        if isinstance(node, dict) and name not in node:
            node[name] = {}
        if isinstance(following, int) and not isinstance(node[name], list):
            node[name] = [node[name], node[name]]  # the same dimension at both ends of a beam
        node = node[name]
    last = place.names[-1]
    there = node[last] if not isinstance(node, dict) or last in node else None
    *forms, plainest = _forms(place, there, value)
    node[last] = next((form for form in forms if _value(table, place, form) == value), plainest)


def _value(table: SceneTable, place: variables.Place, written: Any) -> float | None:
    with suppress(SceneError):
        return variables.value_at(table, place, written)
    return None


def _forms(place: variables.Place, there: Any, value: float) -> Iterator[Any]:
    """Yield texts for a value with more and more digits, in the unit of the old value `there`.

    The last text is in SI.
    """
    unit = place.variable.unit
    for digits in () if isinstance(place.leaf, int) else DIGITS:
        if isinstance(there, str) and units.FORM.fullmatch(there.translate(units.TYPESET)):
            yield units.written_like(there, value, unit, digits)
        elif isinstance(there, int | float) and not isinstance(place.leaf, quantities.Direction):
            yield units.written_like(there, value, unit, digits, place.per_bare)
        else:
            yield f"{value:.{digits}g} {unit}" if unit != "1" else float(f"{value:.{digits}g}")
    yield variables.in_file(place, value)
