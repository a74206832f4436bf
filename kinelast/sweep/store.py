"""Where the designs of a sweep are kept: a file a chunk, which is there as a whole or not at all.

Up to `SMALL` designs, and where there is no pyarrow, the store is one CSV file in the end, joined of the chunks'.
Larger ones are a Parquet data set, a folder of the chunks' files: they stay as they are, so that nothing is written
twice, no step at the end waits for a single process, and every reader of Parquet takes the folder as one table. The
bytes are the same however many processes computed the chunks, and in whatever order.
"""

from __future__ import annotations

import csv
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.outputs.outbox import UNFINISHED, put
from kinelast.outputs.table import Column, Table, csv_bytes, parquet_bytes, quoted
from kinelast.sweep.manifest import NAME, Kept, Manifest, manifest_bytes
from kinelast.tasks.request import RequestError

SMALL = 100_000  # designs
BLOCK = 10_000  # rows that are read at once
CSV, PARQUET = "designs.csv", "designs.parquet"
JOURNAL = "kept.txt"  # what chunks are known by, until they are all there
NUMBER, REASON = "design", "reason"  # the columns that every store has
THEORY, VERDICT = "theory", "verdict"
TEXTS = THEORY, VERDICT  # columns of words besides, which a sweep of a scene has

Columns = Mapping[str, Any]


def store_name(designs: int) -> str:
    """Name of the store of so many designs."""
    return PARQUET if designs > SMALL and find_spec("pyarrow") else CSV


def encoded(store: str, first: int, columns: Columns, units: Mapping[str, str], reasons: Sequence[str]) -> bytes:
    """A chunk as the content of its file.

    Parameters
    ----------
    store
        `CSV` or `PARQUET`.
    first
        Number of the first design.
    columns
        Numbers by the names of their columns, each of shape (designs,).
    units
        Units of columns, which become a part of their names.
    reasons
        Why a design has no figures, or fewer; empty where all is well.
    """
    table = Table(
        (
            Column(NUMBER, np.arange(first, first + len(reasons))),
            *(
                Column(name, values if name in TEXTS else np.asarray(values), units.get(name, ""))
                for name, values in columns.items()
            ),
            Column(REASON, [str(reason) for reason in reasons]),
        )
    )
    return csv_bytes(table, head=False) if store == CSV else parquet_bytes(table)


class Store:
    """The files of a sweep's folder, written by one process."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name
        self.parts = folder / (PARQUET if name == PARQUET else f"{CSV}.parts")
        self._end = Path(name).suffix
        self.kept: dict[int, Kept] = {}

    def checked(self, manifest: Manifest) -> tuple[set[int], list[int]]:
        """Numbers of the chunks that are as they were kept, and of those that are not any more.

        Raises
        ------
        RequestError
            A file among the chunks' is of none of them.
        """
        if manifest.complete and self.name == CSV:
            contents = self._parted(manifest)
        else:
            self._require_own(manifest)
            contents = map(_content, map(self._place, range(manifest.chunks)))
        known = dict(enumerate(manifest.kept)) if manifest.complete else self._noted()
        self.kept, wrong = {}, []
        for number, content in enumerate(contents):
            entry = known.get(number)
            if entry and entry.fits(content):
                self.kept[number] = entry
            elif entry:
                wrong.append(number)
        return set(self.kept), wrong

    def _place(self, number: int) -> Path:
        return self.parts / f"{number:010}{self._end}"

    def _require_own(self, manifest: Manifest) -> None:
        """Raise where a reader of the data set would take a file for one of its chunks that is none."""
        with suppress(OSError):
            for entry in sorted(os.scandir(self.parts), key=lambda each: each.name):
                name = entry.name.removesuffix(self._end)
                if not entry.name.startswith(".") and not (name.isdecimal() and int(name) < manifest.chunks):
                    raise RequestError(f"{entry.path} is of no chunk of this sweep: move it")

    def _noted(self) -> dict[int, Kept]:
        """Fingerprints of chunks as noted, a line each; a line that was torn is as if it had not been."""
        noted = {}
        for line in _content(self.folder / JOURNAL).decode("ascii", "replace").splitlines():
            with suppress(ValueError):
                number, rows, size, sha256 = line.split(" ")
                noted[int(number)] = Kept(int(rows), int(size), sha256)
        return noted

    def _parted(self, manifest: Manifest) -> Iterator[bytes]:
        """The one file of CSV as its chunks."""
        content = _content(self.folder / CSV)
        at = len(_head(manifest))
        for entry in manifest.kept:
            yield content[at : at + entry.size]
            at += entry.size

    def part(self, manifest: Manifest) -> None:
        """Make files of the chunks of the one file of CSV that are as they were kept."""
        for number, content in enumerate(self._parted(manifest)):
            if number in self.kept:
                self.keep(number, self.kept[number].rows, content)

    def is_whole(self, manifest: Manifest) -> bool:
        """Whether all there is stands in its place, nothing before, between or behind."""
        if self.name == PARQUET:
            return True
        head = _head(manifest)
        content = _content(self.folder / CSV)
        return content.startswith(head) and len(content) == len(head) + sum(entry.size for entry in manifest.kept)

    def require_free(self) -> None:
        """Raise where somebody else's files have the names of the store."""
        for name in (CSV, PARQUET):
            if (self.folder / name).exists():
                raise RequestError(
                    f"{self.folder / name} is of no sweep of this program: move it, or choose another -o"
                )

    def clear(self) -> None:
        """Remove all that a sweep has left here, its manifest last."""
        for name in (CSV, PARQUET, f"{CSV}.parts", JOURNAL, NAME):
            path = self.folder / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def tidy(self) -> None:
        """Remove unfinished files."""
        for folder in (self.folder, self.parts):
            with suppress(OSError):
                for path in folder.glob(f".*{UNFINISHED}"):
                    path.unlink()

    def keep(self, number: int, rows: int, content: bytes) -> None:
        """Put the file of a chunk into its place, and note its fingerprint."""
        self.parts.mkdir(parents=True, exist_ok=True)
        entry = Kept.of(rows, content)
        put(self._place(number), content)
        self.kept[number] = entry
        self._journal({number: entry})

    def note_kept(self) -> None:
        """Note the fingerprints of the chunks that are there."""
        self._journal(self.kept)

    def _journal(self, entries: Mapping[int, Kept]) -> None:
        with (self.folder / JOURNAL).open("ab") as file:
            for number, entry in entries.items():
                file.write(f"{number} {entry.rows} {entry.size} {entry.sha256}\n".encode())

    def note(self, manifest: Manifest) -> None:
        """Put the manifest into its place."""
        self.folder.mkdir(parents=True, exist_ok=True)
        put(self.folder / NAME, manifest_bytes(manifest))

    def join(self, manifest: Manifest) -> None:
        """Make the one file of CSV of the chunks' in their order; a Parquet data set is whole as it is."""
        if self.name == CSV:
            put(self.folder / CSV, _head(manifest), *map(self._place, range(manifest.chunks)))

    def fill(self, manifest: Manifest, cells: Mapping[int, Mapping[str, Any]]) -> Manifest:
        """Fill cells of a complete store: by number of the design, values by name of the column; its manifest then.

        A file whose cells are as told already is not written again.
        """
        kept, names = list(manifest.kept), [NUMBER, *manifest.columns, REASON]
        csv_parts = list(self._parted(manifest)) if self.name == CSV else []
        for number in sorted({design // manifest.chunk for design in cells}):
            first, last = manifest.span(number)
            own = {design - first: row for design, row in cells.items() if first <= design < last}
            before = csv_parts[number] if csv_parts else _content(self._place(number))
            after = (_csv_filled if self.name == CSV else _parquet_filled)(before, names, own)
            if after == before:
                continue
            kept[number] = Kept.of(kept[number].rows, after)
            if csv_parts:
                csv_parts[number] = after
            else:
                put(self._place(number), after)
        filled = replace(manifest, kept=kept)
        if filled != manifest:
            if csv_parts:
                put(self.folder / CSV, b"".join([_head(manifest), *csv_parts]))
            self.note(filled)
        return filled

    def drop_parts(self) -> None:
        """Remove the chunks' files where they were joined, and the notes on them."""
        if self.name == CSV:
            shutil.rmtree(self.parts, ignore_errors=True)
        (self.folder / JOURNAL).unlink(missing_ok=True)


def _content(path: Path) -> bytes:
    """The content of a file; empty where there is none."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _csv_filled(content: bytes, names: Sequence[str], cells: Mapping[int, Mapping[str, Any]]) -> bytes:
    """Rows of CSV with other values in some cells, by number of the row; other rows stay as they are."""
    lines, rows, first = content.decode().split("\n"), [], 0
    reader = csv.reader(f"{line}\n" for line in lines)
    for at, row in enumerate(reader):
        changed = cells.get(at, {})
        told = {name: csv_bytes(Table((Column(name, [value]),)), head=False).decode()[:-1]
                for name, value in changed.items()}  # fmt: skip
        pairs = zip(names, row, strict=True) if changed else ()
        filled = ",".join(told.get(name, quoted(cell)) for name, cell in pairs)
        rows.append(filled if changed else "\n".join(lines[first : reader.line_num]))
        first = reader.line_num
    return "\n".join(rows).encode()


def _parquet_filled(content: bytes, names: Sequence[str], cells: Mapping[int, Mapping[str, Any]]) -> bytes:
    """The file of a chunk of Parquet with other values in some cells, by number of the row."""
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(pyarrow.BufferReader(content))
    columns = []
    for name, heading in zip(names, table.column_names, strict=True):
        words = name in TEXTS or name == REASON
        values = table[heading].to_pylist() if words else table[heading].to_numpy().copy()
        for at, own in cells.items():
            if name in own:
                values[at] = own[name]
        columns.append(Column(heading, values))
    return parquet_bytes(Table(tuple(columns)))


def _head(manifest: Manifest) -> bytes:
    """The headings of the one file of CSV."""
    none = np.zeros(0)
    names = (Column(name, none, unit) for name, unit in manifest.columns.items())
    return csv_bytes(Table((Column(NUMBER, none), *names, Column(REASON, none))))


def stored_chunks(folder: Path, manifest: Manifest) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """The designs that are kept, some at a time in the order of their numbers, as columns by name and reasons.

    The column `NUMBER` tells which ones they are. Nothing is held but what is asked for next.
    """
    names = {Column(name, (), unit).heading: name for name, unit in manifest.columns.items()}
    if manifest.store == PARQUET:
        import pyarrow.parquet

        for path in sorted((folder / PARQUET).glob("[0-9]*.parquet")):
            table = pyarrow.parquet.read_table(path)
            reasons = table[REASON].to_pylist()
            yield (
                {
                    names.get(key, key): table[key].to_pylist() if key in TEXTS else table[key].to_numpy()
                    for key in table.column_names
                    if key != REASON
                },
                reasons,
            )
        return
    if not manifest.complete:
        raise RequestError(f"{folder}: the sweep is not complete: --resume goes on with it")
    with (folder / CSV).open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        head = next(rows)
        while block := list(islice(rows, BLOCK)):
            *cells, reasons = zip(*block, strict=True)
            yield (
                {
                    names.get(key, key): list(values)
                    if key in TEXTS
                    else np.array([float(cell or "nan") for cell in values])
                    for key, values in zip(head, cells, strict=False)
                },
                list(reasons),
            )
