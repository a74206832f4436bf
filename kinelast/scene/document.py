"""Documents of scenes: text and tables, parsed once. Changing a value creates a new document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any

from msgspec import Struct, field
from msgspec.structs import replace

from kinelast.scene import build, drives, limits, parsing, sections, variables
from kinelast.scene.data import Scene, require_determined
from kinelast.scene.format import SceneTable
from kinelast.scene.parts.cams import require_moved
from kinelast.scene.text import COLUMNS, decoded, file_bytes, of_file, reader_in, scene_name, with_tables, written
from kinelast.values.error import SceneError, fault
from kinelast.values.units import shown

Tables = Mapping[str, Any]


class Document(Struct, frozen=True, eq=False, dict=True):
    """A scene as written in a file. The mechanism is built from it on request.

    Attributes
    ----------
    tables, table
        Raw and parsed tables of the file.
    name, path
        Name of the scene, and path of its file for messages.
    source
        Text of the file; empty if the scene comes from tables.
    values
        Changed numbers by path [SI unit].
    varied
        Names of links whose points differ between designs, see `kinelast.scene.build.built`.
    files
        Texts of the files that the scene refers to, by file name.
    """

    tables: Tables
    table: SceneTable
    name: str = "scene"
    path: str = ""
    source: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    varied: frozenset[str] = frozenset()
    files: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        changed = "".join(f", {path} = {value:g}" for path, value in self.values.items())
        return f'Document("{self.name}"{changed})'

    def __reduce__(self) -> Any:
        """Pickle the fields only; cached values are rebuilt."""
        return Document, (self.tables, self.table, self.name, self.path, self.source, self.values, self.varied,
                          self.files)  # fmt: skip

    @cached_property
    def scene(self) -> Scene:
        """The scene, built on first use.

        Raises
        ------
        SceneError
            The tables do not define a mechanism with a determined motion.
        """
        with of_file(self.path), _all_mistakes_of("" if self.values else self.source, self.files.__getitem__):
            scene = replace(build.built(self.table, self.name, self.files, self.path, self.varied), text=self.text())
            require_determined(scene)
            require_moved(scene)
            limits.require_studies(self.table)
            return scene

    def text(self, head: str = "") -> str:
        """Return the text of the file with the current values. Comments and the order of entries do not change.

        Motions from other files are written into the text, so that it is self-contained.

        Parameters
        ----------
        head
            Comment for the first line.
        """
        if not self.source or not (self.values or head or self.files):
            return self.source
        motions = {
            number: drives.motion_of(self.table, number + 1, self.files).written
            for number, drive in enumerate(self.table.drives)
            if isinstance(drive.motion, str)
        }
        return written(self.source, self.table, self.values, motions, head)

    def variable(self, path: str) -> variables.Variable:
        """Return the number at a path, such as "links.rod.length".

        If there is none, SceneError suggests a similar path.
        """
        return variables.place_of(self.table, path).variable

    def value(self, path: str, text: Any) -> float:
        """Convert a value for the number at a path, written as in the file, to the SI unit of the number.

        A length without a unit is in the length unit of the file.

        Raises
        ------
        SceneError
            There is no such number, the dimension is wrong, or the value is out of range.
        """
        return variables.value_at(self.table, variables.place_of(self.table, path, absent=True), text)

    def with_values(self, values: Mapping[str, float], note: str = "") -> Document:
        """Return a document with changed numbers. `values` contains the new numbers in SI units, by path.

        Parameters
        ----------
        note
            Text that is added to the title, to distinguish the changed scene from the original.

        Raises
        ------
        SceneError
            There is no such number, or a value is out of range.
        TypeError
            `values` is not a mapping from paths to numbers.
        """
        if not isinstance(values, Mapping) or not all(isinstance(each, Real) for each in values.values()):
            expected = "expected a mapping from paths to numbers in SI units; with_changes accepts other units"
            raise TypeError(f'{expected}, as in ["links.rod.length=330 mm"], got {shown(values)}')
        places = {path: variables.place_of(self.table, path, absent=True) for path in values}
        tables = self.tables
        for path, place in places.items():
            tables = variables.put(tables, place.names, variables.in_file(place, values[path]))
        if note and self.table.title:
            tables = variables.put(tables, ("title",), f"{self.table.title}, {note}")
        parts = dict.fromkeys(["title", *(place.names[0] for place in places.values())])
        table = parsing.parse_parts(self.table, tables, (part for part in parts if part in tables))
        for path, place in places.items():
            variables.keep_unit(place, variables.place_of(table, path))
        return replace(self, tables=tables, table=table, values={**self.values, **values})

    def with_changes(self, changes: str | Sequence[str]) -> Document:
        """Return a document with one or several changed numbers, written as in "links.rod.length=330 mm".

        Raises
        ------
        SceneError
            A change is not of the form PATH=VALUE, the path is unknown, or the value is invalid.
        """
        if isinstance(changes, str):
            changes = [changes]
        values = {}
        with of_file(self.path):
            for change in changes:
                path, equals, value = (part.strip() for part in change.partition("="))
                if not equals:
                    expected = 'expected a path and a value, as in "links.rod.length=330 mm"'
                    raise fault("", "", f'--set: {expected}, got "{change}"')
                values[path] = self.value(path, _typed(value))
            return self.with_values(values, ", ".join(changes))

    def with_positions(self, positions: int | None) -> Document:
        """Return a document with another number of positions (default: unchanged).

        The text of the document does not change.
        """
        if positions is None:
            return self
        tables = variables.put(self.tables, ("run", "positions"), positions)
        with of_file(self.path):
            return replace(self, tables=tables, table=parsing.parse_parts(self.table, tables, ["run"]))


def _typed(value: str) -> int | float | str:
    """Convert a text to a number if possible, otherwise return the text."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(value)
    return value


def document_from_bytes(content: bytes, path: str | Path) -> Document:
    """Return the document from the bytes of a TOML file; raise SceneError if the file is invalid."""
    return document_from_text(decoded(content, str(path)), scene_name(Path(path)), str(path))


def document_from_text(text: str, name: str = "scene", path: str = "", read: sections.Read | None = None) -> Document:
    """Return the document of a scene, given as TOML text.

    Parameters
    ----------
    path
        Path of the file for messages.
    read
        Function that reads the files to which the scene refers (default: reads from the folder of `path`).

    Raises
    ------
    SceneError
        The text contains an error, or a file that it refers to cannot be read.
    """
    read = read or reader_in(Path(path).parent)
    with of_file(path), _all_mistakes_of(text, read):
        tables = parsing.parse_toml(text)
        document = document_from_dict(tables, name, path, read)
        alone = text if document.tables is tables else with_tables(text, document.tables)
        return replace(document, source=alone)


@contextmanager
def _all_mistakes_of(text: str, read: sections.Read) -> Iterator[None]:
    """If a SceneError is raised inside, add all other errors in the text to it.

    Without a text, e.g. for a changed scene, only the first error is reported.
    """
    try:
        yield
    except SceneError as error:
        if text:
            error.others = tuple(each for each in mistakes_in(text, read) if str(each) != str(error.of_file("")))
        raise


def mistakes_in(text: str, read: sections.Read) -> tuple[SceneError, ...]:
    """Return all errors in the tables of a TOML text.

    Errors of the motion, such as a loop that does not close, are left out. `read` reads the files to which the scene
    refers.
    """
    from kinelast.scene.mistakes import all_mistakes

    def require_parts(raw: Tables) -> None:
        tables, _ = sections.with_files(raw, read)
        table = _parsed(raw, tables)
        build.built(table, "scene", files_of(table, read))
        limits.require_studies(table)

    return all_mistakes(text, require_parts)


def files_of(table: SceneTable, read: sections.Read) -> dict[str, str]:
    """Return the texts of the files to which a scene refers, by file name.

    Raises
    ------
    SceneError
        A file cannot be read.
    """
    texts: dict[str, str] = {}
    for number, drive in enumerate(table.drives, 1):
        if isinstance(drive.motion, str):
            where, expected = f"drives[{number}]", "expected a list, or a file"
            texts[drive.motion] = sections.read_as(drive.motion, COLUMNS, read, where, "motion", expected)
    return texts


def document_from_dict(raw: Tables, name: str = "scene", path: str = "", read: sections.Read | None = None) -> Document:
    """Return the document from the tables of a TOML file; parameters and errors are as in `document_from_text`."""
    with of_file(path):
        read = read or reader_in(Path(path).parent)
        tables, texts = sections.with_files(raw, read)
        table = _parsed(raw, tables)
        return Document(tables, table, name, path, files={**texts, **files_of(table, read)})


def _parsed(raw: Tables, tables: Tables) -> SceneTable:
    """Validate the tables of a scene file, merged with those of its library.

    Errors in the library are reported with the name of the library.
    """
    try:
        return parsing.parse_scene(tables)
    except SceneError as error:
        kind, _, part = error.table.partition(".")
        if kind in ("materials", "sections") and "library" in raw and part not in raw.get(kind, {}):
            raise SceneError("", error.table, error.key, f"{error.problem} (in {raw['library']})") from None
        raise


def document_of(scene: Document | Tables) -> Document:
    """Return the given document, or a document built from the given tables."""
    return scene if isinstance(scene, Document) else document_from_dict(scene)


def read_document(path: str | Path) -> Document:
    """Return the document from a TOML file; raise SceneError if it cannot be read or contains an error."""
    if not isinstance(path, str | Path):
        raise TypeError(f"expected the path of a scene file, got {shown(path)}")
    return document_from_bytes(file_bytes(Path(path)), path)


def read_scene(path: str | Path) -> Scene:
    """Return the scene from a TOML file.

    Raises
    ------
    SceneError
        The file cannot be read or contains an error.
    """
    return read_document(path).scene


def scene_from_text(text: str, name: str = "scene", path: str = "") -> Scene:
    """Return the scene from a TOML text; `path` is the file name for messages.

    Raises
    ------
    SceneError
        The text contains an error.
    """
    return document_from_text(text, name, path).scene


def scene_from_dict(raw: Tables, name: str = "scene", path: str = "") -> Scene:
    """Return the scene from the tables of a TOML file; `path` is the file name for messages.

    Raises
    ------
    SceneError
        A table or a key is wrong.
    """
    return document_from_dict(raw, name, path).scene
