"""A scene's document: its text and tables, parsed once; with other values it is another document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any

from kinelast.scene.build import built
from kinelast.scene.data import Scene, require_determined, require_moved
from kinelast.scene.drives import motion_of
from kinelast.scene.error import SceneError, fault
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import require_studies
from kinelast.scene.mistakes import all_mistakes
from kinelast.scene.parsing import parse_parts, parse_scene
from kinelast.scene.sections import Read, read_as, with_files
from kinelast.scene.text import (
    COLUMNS,
    beside,
    decoded,
    file_bytes,
    of_file,
    scene_name,
    toml_tables,
    with_tables,
    written,
)
from kinelast.scene.units import shown
from kinelast.scene.variables import Variable, in_file, place_of, put, value_at

Tables = Mapping[str, Any]


@dataclass(frozen=True, eq=False, repr=False)
class Document:
    """A scene as it is written: its tables and numbers, before a mechanism is built of them.

    Attributes
    ----------
    tables, table
        Of the file, and parsed.
    name, path
        Of the scene, and of its file, for messages.
    source
        The text of the file as it was read; empty where the scene comes from tables.
    values
        Numbers that differ from the source, by their paths [SI units].
    varied
        Names of links with points that differ by design, see `kinelast.scene.build.built`.
    files
        Texts of the files beside the scene that it names, as they were read, by their names.
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
        """Pickled by its fields: all else is built again."""
        return Document, (self.tables, self.table, self.name, self.path, self.source, self.values, self.varied,
                          self.files)  # fmt: skip

    @cached_property
    def scene(self) -> Scene:
        """The scene, built once.

        Raises
        ------
        SceneError
            The tables tell no mechanism whose motion is determined.
        """
        with of_file(self.path), _all_told("" if self.values else self.source, self.files.__getitem__):
            scene = replace(built(self.table, self.name, self.files, self.path, self.varied), text=self.text())
            require_determined(scene)
            require_moved(scene)
            require_studies(self.table)
            return scene

    def text(self, head: str = "") -> str:
        """The text of the file with the values as they are now; its comments and order stay.

        Motions that are in files beside it stand in the text itself, which so is whole wherever it is put.

        Parameters
        ----------
        head
            A comment for the first line.
        """
        if not self.source or not (self.values or head or self.files):
            return self.source
        motions = {
            number: motion_of(self.table, number + 1, self.files).written
            for number, drive in enumerate(self.table.drives)
            if isinstance(drive.motion, str)
        }
        return written(self.source, self.table, self.values, motions, head)

    def variable(self, path: str) -> Variable:
        """A number of the scene by its path; SceneError names the nearest where there is none."""
        return place_of(self.table, path).variable

    def value(self, path: str, text: Any) -> float:
        """A value for a number as it may stand in the file, in the SI unit of the number; bare lengths in the file's.

        Raises
        ------
        SceneError
            As `variable`; another dimension, or a value that cannot stand there.
        """
        return value_at(self.table, place_of(self.table, path), text)

    def with_values(self, values: Mapping[str, float], note: str = "") -> Document:
        """The same scene with other values [SI units] for numbers by their paths.

        Parameters
        ----------
        note
            What is added to the title, where there is one, to tell the scene from others of that title.

        Raises
        ------
        SceneError
            As `variable`; or a value cannot stand there.
        TypeError
            These are no numbers by their paths.
        """
        if not isinstance(values, Mapping) or not all(isinstance(each, Real) for each in values.values()):
            expected = "expected numbers in SI units by their paths; with_changes takes them with other units"
            raise TypeError(f'{expected}, as in ["links.rod.length=330 mm"], got {shown(values)}')
        places = {path: place_of(self.table, path) for path in values}
        tables = self.tables
        for path, place in places.items():
            tables = put(tables, place.names, in_file(place, values[path]))
        if note and self.table.title:
            tables = put(tables, ("title",), f"{self.table.title}, {note}")
        parts = dict.fromkeys(["title", *(place.names[0] for place in places.values())])
        table = parse_parts(self.table, tables, (part for part in parts if part in tables))
        return replace(self, tables=tables, table=table, values={**self.values, **values})

    def with_changes(self, changes: str | Sequence[str]) -> Document:
        """The same scene with other values as they were typed, one or several, as in "links.rod.length=330 mm".

        Raises
        ------
        SceneError
            As `with_values`.
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
        """The same scene at another number of positions, which its text does not tell; None for its own."""
        if positions is None:
            return self
        tables = put(self.tables, ("run", "positions"), positions)
        with of_file(self.path):
            return replace(self, tables=tables, table=parse_parts(self.table, tables, ["run"]))


def _typed(value: str) -> int | float | str:
    """A number, or else a text with a unit."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(value)
    return value


def document_from_bytes(content: bytes, path: str | Path) -> Document:
    """The document in the bytes of a TOML file; SceneError where they are none."""
    return document_from_text(decoded(content, str(path)), scene_name(Path(path)), str(path))


def document_from_text(text: str, name: str = "scene", path: str = "", read: Read | None = None) -> Document:
    """The document in a TOML text.

    Parameters
    ----------
    path
        Stands for the file in messages.
    read
        Reader of the files that the scene names; where left out, of those beside `path`, or in the working folder.

    Raises
    ------
    SceneError
        The text holds a mistake, or a file that it names cannot be read.
    """
    read = read or beside(Path(path).parent)
    with of_file(path), _all_told(text, read):
        tables = toml_tables(text, "")
        document = document_from_dict(tables, name, path, read)
        alone = text if document.tables is tables else with_tables(text, document.tables)
        return replace(document, source=alone)


@contextmanager
def _all_told(text: str, read: Read) -> Iterator[None]:
    """Add the other mistakes of a text to the first; where there is no text, as of a design, there is that one."""
    try:
        yield
    except SceneError as error:
        if text:
            error.others = tuple(each for each in mistakes_in(text, read) if str(each) != str(error.of_file("")))
        raise


def mistakes_in(text: str, read: Read) -> tuple[SceneError, ...]:
    """All mistakes of a TOML text, but for those of its mechanism as a whole, as one that does not close.

    `read` reads the files that it names.
    """

    def require_parts(raw: Tables) -> None:
        tables, _ = with_files(raw, read)
        table = _parsed(raw, tables)
        built(table, "scene", files_of(table, read))
        require_studies(table)

    return all_mistakes(text, require_parts)


def files_of(table: SceneTable, read: Read) -> dict[str, str]:
    """Texts of the files that a scene names, by their names.

    Raises
    ------
    SceneError
        One of them cannot be read.
    """
    texts: dict[str, str] = {}
    for number, drive in enumerate(table.drives, 1):
        if isinstance(drive.motion, str):
            where, expected = f"drives[{number}]", "expected a list, or a file"
            texts[drive.motion] = read_as(drive.motion, COLUMNS, read, where, "motion", expected)
    return texts


def document_from_dict(raw: Tables, name: str = "scene", path: str = "", read: Read | None = None) -> Document:
    """The document in the tables of a TOML file; parameters and errors as of `document_from_text`."""
    with of_file(path):
        read = read or beside(Path(path).parent)
        tables, texts = with_files(raw, read)
        table = _parsed(raw, tables)
        return Document(tables, table, name, path, files={**texts, **files_of(table, read)})


def _parsed(raw: Tables, tables: Tables) -> SceneTable:
    """Tables as of a file, with those of its library, validated: a mistake in these names the library."""
    try:
        return parse_scene(tables)
    except SceneError as error:
        kind, _, part = error.table.partition(".")
        if kind in ("materials", "sections") and "library" in raw and part not in raw.get(kind, {}):
            raise SceneError("", error.table, error.key, f"{error.problem} (in {raw['library']})") from None
        raise


def document_of(scene: Document | Tables) -> Document:
    """A document, or the one in the tables of a file."""
    return scene if isinstance(scene, Document) else document_from_dict(scene)


def read_document(path: str | Path) -> Document:
    """The document in a TOML file; SceneError where it cannot be read or holds a mistake."""
    if not isinstance(path, str | Path):
        raise TypeError(f"expected the path of a scene's file, got {shown(path)}")
    return document_from_bytes(file_bytes(Path(path)), path)


def read_scene(path: str | Path) -> Scene:
    """The scene in a TOML file.

    Raises
    ------
    SceneError
        The file cannot be read or holds a mistake.
    """
    return read_document(path).scene


def scene_from_text(text: str, name: str = "scene", path: str = "") -> Scene:
    """The scene in a TOML text; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        The text holds a mistake.
    """
    return document_from_text(text, name, path).scene


def scene_from_dict(raw: Tables, name: str = "scene", path: str = "") -> Scene:
    """The scene in the tables of a TOML file; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        A table or a key is wrong.
    """
    return document_from_dict(raw, name, path).scene
