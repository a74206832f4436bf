"""Storage of the designs of a sweep: one file per chunk, written completely or not at all.

When a sweep of at most `MAX_CSV` designs is complete, all chunks are joined to a single CSV file. A larger sweep is a
Parquet data set: a folder with one file per chunk, which any Parquet reader opens as one table. Without pyarrow, every
sweep is a CSV file. The bytes of the files depend neither on the processes nor on the order in which the chunks are
computed.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from kinelast.outputs.outbox import UNFINISHED, put
from kinelast.outputs.table import Column, Table, csv_bytes, csv_rows, parquet_bytes
from kinelast.sweep.manifest import NAME, ChunkChecksum, Manifest, manifest_bytes
from kinelast.tasks.request import RequestError

MAX_CSV = 100_000  # sweeps with more designs are stored as Parquet data sets
CSV, PARQUET = "designs.csv", "designs.parquet"
JOURNAL = "kept.txt"  # file with the checksums of complete chunks; removed when all chunks are complete
NUMBER, REASON = "design", "reason"  # names of the first and last column of every sweep
THEORY, VERDICT = "theory", "verdict"  # names of two columns that describe full answers
TEXTS = THEORY, VERDICT  # names of the columns with text; the column REASON contains text, too

Columns = Mapping[str, Any]


def store_name(designs: int) -> str:
    """Return the name of the file or folder that stores a sweep with the given number of designs."""
    return PARQUET if designs > MAX_CSV and find_spec("pyarrow") else CSV


def encoded(store: str, first: int, columns: Columns, units: Mapping[str, str], reasons: Sequence[str]) -> bytes:
    """Encode a chunk as the content of its file.

    Parameters
    ----------
    store
        `CSV` or `PARQUET`.
    first
        Index of the first design of the chunk.
    columns
        Values by column name, each of shape (designs,).
    units
        Units by column name, for the headings of a Parquet file. A chunk of a CSV file has no headings.
    reasons
        Reason why a design has no figures (results), for each design; empty for designs with figures.
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


def decoded(store: str, content: bytes, names: Iterable[str]) -> tuple[dict[str, Any], list[str]]:
    """Decode the content of a chunk's file; return columns by name, and reasons for missing figures, see `encoded`."""
    if store == PARQUET:
        import pyarrow.parquet

        _, *parts, reasons = pyarrow.parquet.read_table(pyarrow.BufferReader(content)).itercolumns()
        named = dict(zip(names, parts, strict=True))
        columns = {name: part.to_pylist() if name in TEXTS else part.to_numpy().copy() for name, part in named.items()}
        return columns, reasons.to_pylist()
    _, *cells, reasons = zip(*csv_rows(content), strict=True)
    words = dict(zip(names, cells, strict=True))
    return {
        name: list(each) if name in TEXTS else np.array([float(cell or "nan") for cell in each])
        for name, each in words.items()
    }, list(reasons)


class Store:
    """Files in the folder of a sweep. Only one process writes the files."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name
        self.parts = folder / (PARQUET if name == PARQUET else f"{CSV}.parts")
        self._end = Path(name).suffix
        self.kept: dict[int, ChunkChecksum] = {}

    def checked(self, manifest: Manifest) -> tuple[set[int], list[int]]:
        """Verify the checksums of chunks; return the indices of valid chunks, and of damaged chunks.

        Raises
        ------
        RequestError
            The folder contains a file that does not belong to a chunk.
        """
        if not manifest.complete or self.name == PARQUET:
            self._require_own(manifest)
        known = dict(enumerate(manifest.kept)) if manifest.complete else self._journal_entries()
        self.kept, wrong = {}, []
        for number, content in enumerate(self.contents(manifest)):
            entry = known.get(number)
            if entry and entry.fits(content):
                self.kept[number] = entry
            elif entry:
                wrong.append(number)
        return set(self.kept), wrong

    def _place(self, number: int) -> Path:
        return self.parts / f"{number:010}{self._end}"

    def _require_own(self, manifest: Manifest) -> None:
        """Raise RequestError if the folder of the chunks contains a file that is not a chunk.

        A Parquet reader would treat such a file as part of the data set.
        """
        with suppress(OSError):
            for entry in sorted(os.scandir(self.parts), key=lambda each: each.name):
                name = entry.name.removesuffix(self._end)
                if not entry.name.startswith(".") and not (name.isdecimal() and int(name) < manifest.chunks):
                    raise RequestError(f"{entry.path} does not belong to this sweep: move it")

    def _journal_entries(self) -> dict[int, ChunkChecksum]:
        """Return the checksums in the journal by index of the chunk. Incomplete lines of the journal are ignored."""
        noted = {}
        for line in _content(self.folder / JOURNAL).decode("ascii", "replace").splitlines():
            with suppress(ValueError):
                number, rows, size, sha256 = line.split(" ")
                noted[int(number)] = ChunkChecksum(int(rows), int(size), sha256)
        return noted

    def contents(self, manifest: Manifest) -> Iterator[bytes]:
        """Yield the content of every chunk in order; yield empty bytes if a chunk is missing."""
        if not manifest.complete or self.name == PARQUET:
            yield from map(_content, map(self._place, range(manifest.chunks)))
            return
        content = _content(self.folder / CSV)
        at = len(_csv_header(manifest))
        for entry in manifest.kept:
            yield content[at : at + entry.size]
            at += entry.size

    def part(self, manifest: Manifest) -> None:
        """Split the CSV file into one file per valid chunk."""
        for number, content in enumerate(self.contents(manifest)):
            if number in self.kept:
                self.keep(number, self.kept[number].rows, content)

    def is_whole(self, manifest: Manifest) -> bool:
        """Return True if the CSV file consists of the header and all chunks. For a Parquet data set, return True."""
        if self.name == PARQUET:
            return True
        head = _csv_header(manifest)
        content = _content(self.folder / CSV)
        return content.startswith(head) and len(content) == len(head) + sum(entry.size for entry in manifest.kept)

    def require_free(self) -> None:
        """Raise RequestError if a file or folder with the name of a store already exists."""
        for name in (CSV, PARQUET):
            if (self.folder / name).exists():
                raise RequestError(f"{self.folder / name} does not belong to a sweep: move it, or choose another -o")

    def clear(self) -> None:
        """Remove all files of a sweep. The manifest is removed last."""
        for name in (CSV, PARQUET, f"{CSV}.parts", JOURNAL, NAME):
            path = self.folder / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def tidy(self) -> None:
        """Remove incomplete files of a run that was stopped."""
        for folder in (self.folder, self.parts):
            with suppress(OSError):
                for path in folder.glob(f".*{UNFINISHED}"):
                    path.unlink()

    def keep(self, number: int, rows: int, content: bytes) -> None:
        """Write the file of a chunk, and add its checksum to the journal."""
        self.parts.mkdir(parents=True, exist_ok=True)
        entry = ChunkChecksum.of(rows, content)
        put(self._place(number), content)
        self.kept[number] = entry
        self.journal({number: entry})

    def journal(self, entries: Mapping[int, ChunkChecksum]) -> None:
        """Append checksums of chunks to the journal."""
        with (self.folder / JOURNAL).open("ab") as file:
            for number, entry in entries.items():
                file.write(f"{number} {entry.rows} {entry.size} {entry.sha256}\n".encode())

    def note(self, manifest: Manifest) -> None:
        """Write the manifest to the folder."""
        self.folder.mkdir(parents=True, exist_ok=True)
        put(self.folder / NAME, manifest_bytes(manifest))

    def join(self, manifest: Manifest) -> None:
        """Join the chunks to a single CSV file. A Parquet data set is not changed."""
        if self.name == CSV:
            put(self.folder / CSV, _csv_header(manifest), *map(self._place, range(manifest.chunks)))

    def fill(self, manifest: Manifest, cells: Mapping[int, Mapping[str, Any]]) -> Manifest:
        """Write new values to a complete store; return the new manifest.

        `cells` maps the index of a design to a dictionary that maps column names to new values.

        A file is not written if its content does not change.
        """
        kept = list(manifest.kept)
        csv_parts = list(self.contents(manifest)) if self.name == CSV else []
        for number in sorted({design // manifest.chunk for design in cells}):
            first, last = manifest.span(number)
            before = csv_parts[number] if csv_parts else _content(self._place(number))
            columns, reasons = decoded(self.name, before, manifest.columns)
            for design in cells.keys() & range(first, last):
                for name, value in cells[design].items():
                    columns[name][design - first] = value
            after = encoded(self.name, first, columns, manifest.columns, reasons)
            if after == before:
                continue
            kept[number] = ChunkChecksum.of(kept[number].rows, after)
            if csv_parts:
                csv_parts[number] = after
            else:
                put(self._place(number), after)
        filled = replace(manifest, kept=kept)
        if filled != manifest:
            if csv_parts:
                put(self.folder / CSV, b"".join([_csv_header(manifest), *csv_parts]))
            self.note(filled)
        return filled

    def drop_parts(self) -> None:
        """Remove the journal and, if the store is a CSV file, the files of the chunks."""
        if self.name == CSV:
            shutil.rmtree(self.parts, ignore_errors=True)
        (self.folder / JOURNAL).unlink(missing_ok=True)


def _content(path: Path) -> bytes:
    """Return the content of a file; empty if the file cannot be read."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _csv_header(manifest: Manifest) -> bytes:
    none = np.zeros(0)
    names = (Column(name, none, unit) for name, unit in manifest.columns.items())
    return csv_bytes(Table((Column(NUMBER, none), *names, Column(REASON, none))))


def stored_chunks(folder: Path, manifest: Manifest) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """Yield the columns by name and the reasons for missing figures of each stored chunk, in order.

    The column `NUMBER` contains the indices of the designs.

    Raises
    ------
    RequestError
        The sweep is to be a CSV file, and is not complete.
    """
    if manifest.store == CSV and not manifest.complete:
        raise RequestError(f"{folder}: the sweep is not complete: continue with --resume")
    for number, content in enumerate(Store(folder, manifest.store).contents(manifest)):
        if content:
            columns, reasons = decoded(manifest.store, content, manifest.columns)
            first, last = manifest.span(number)
            yield {NUMBER: np.arange(first, last), **columns}, reasons
