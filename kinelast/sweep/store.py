"""Where the designs of a sweep are kept: a file a chunk, which is there as a whole or not at all.

Up to `SMALL` designs, and where there is no pyarrow, the store is one CSV file in the end, joined of the chunks'.
Larger ones are a Parquet data set, a folder of the chunks' files: they stay as they are, so that nothing is written
twice, no step at the end waits for a single process, and every reader of Parquet takes the folder as one table. The
bytes are the same however many processes computed the chunks, and in whatever order.
"""

from __future__ import annotations

import csv
import io
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.request import RequestError
from kinelast.sweep.manifest import NAME, Manifest, manifest_bytes

SMALL = 100_000  # designs
BLOCK = 10_000  # rows that are read at once
CSV, PARQUET = "designs.csv", "designs.parquet"
NUMBER, REASON = "design", "reason"  # the columns that every store has
UNFINISHED = ".part"

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
    numbers = np.arange(first, first + len(reasons))
    whole = {NUMBER: numbers, **{heading(name, units): np.asarray(each) for name, each in columns.items()}}
    return _csv(whole, reasons) if store == CSV else _parquet(whole, reasons)


def heading(name: str, units: Mapping[str, str]) -> str:
    """A column's name as it stands in the store."""
    return f"{name} [{units[name]}]" if units.get(name) else name


def _csv(columns: Columns, reasons: Sequence[str]) -> bytes:
    """Rows without a head: all digits; nothing for nan."""
    import msgspec

    rows = list(zip(*(values.tolist() for values in columns.values()), strict=True))
    if any(np.isinf(values).any() for values in columns.values()):  # for which JSON has no word
        lines = [",".join("" if one != one else repr(one) for one in row).encode() for row in rows]  # noqa: PLR0124
    else:
        lines = msgspec.json.encode(rows)[2:-2].replace(b"null", b"").split(b"],[")
    return b"".join(b"%b,%b\n" % (line, _cell(reason)) for line, reason in zip(lines, reasons, strict=True))


def _cell(text: str) -> bytes:
    """A text as a cell of a table."""
    quoted = '"{}"'.format(text.replace('"', '""')) if any(letter in text for letter in ',"\n\r') else text
    return quoted.encode()


def _parquet(columns: Columns, reasons: Sequence[str]) -> bytes:
    import pyarrow
    import pyarrow.parquet

    words = pyarrow.array(list(map(str, reasons)), pyarrow.string()).dictionary_encode()
    table = pyarrow.table({**{name: pyarrow.array(values) for name, values in columns.items()}, REASON: words})
    target = io.BytesIO()
    pyarrow.parquet.write_table(table, target, compression="zstd", use_dictionary=[REASON])
    return target.getvalue()


class Store:
    """The files of a sweep's folder, written by one process."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name
        self.parts = folder / (PARQUET if name == PARQUET else f"{CSV}.parts")
        self._end = Path(name).suffix

    def done(self, manifest: Manifest) -> set[int]:
        """Numbers of the chunks whose files are there."""
        if self.name == CSV and manifest.complete and (self.folder / CSV).exists():
            return set(range(manifest.chunks))
        with suppress(OSError):
            found = (entry.name.removesuffix(self._end) for entry in os.scandir(self.parts))
            return {int(name) for name in found if name.isdecimal() and int(name) < manifest.chunks}
        return set()

    def require_free(self) -> None:
        """Raise where somebody else's files have the names of the store."""
        for name in (CSV, PARQUET):
            if (self.folder / name).exists():
                raise RequestError(
                    f"{self.folder / name} is of no sweep of this program: move it, or choose another -o"
                )

    def clear(self) -> None:
        """Away with all that a sweep has left here, its manifest last."""
        for name in (CSV, PARQUET, f"{CSV}.parts", NAME):
            path = self.folder / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def tidy(self) -> None:
        """Away with what was not finished."""
        for folder in (self.folder, self.parts):
            with suppress(OSError):
                for path in folder.glob(f".*{UNFINISHED}"):
                    path.unlink()

    def keep(self, number: int, content: bytes) -> None:
        """Put the file of a chunk into its place."""
        self.parts.mkdir(parents=True, exist_ok=True)
        put(self.parts / f"{number:010}{self._end}", content)

    def note(self, manifest: Manifest) -> None:
        """Put the manifest into its place."""
        self.folder.mkdir(parents=True, exist_ok=True)
        put(self.folder / NAME, manifest_bytes(manifest))

    def join(self, manifest: Manifest) -> None:
        """Make the one file of CSV of the chunks' in their order; a Parquet data set is whole as it is."""
        if self.name == CSV:
            head = io.StringIO()
            names = [heading(name, manifest.columns) for name in manifest.columns]
            csv.writer(head, lineterminator="\n").writerow([NUMBER, *names, REASON])
            parts = (self.parts / f"{number:010}.csv" for number in range(manifest.chunks))
            put(self.folder / CSV, head.getvalue().encode(), *parts)

    def drop_parts(self) -> None:
        """Away with the chunks' files where they were joined."""
        if self.name == CSV:
            shutil.rmtree(self.parts, ignore_errors=True)


def put(path: Path, content: bytes, *more: Path) -> None:
    """Write a file that appears in its place as a whole.

    Its content is on the disk before its name is. Whether the name is, is left to the system: where the machine fails
    right after, a chunk may be missing and is computed again.
    """
    unfinished = path.with_name(f".{path.name}{UNFINISHED}")
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            for source in more:
                with source.open("rb") as part:
                    shutil.copyfileobj(part, file, 1 << 20)
            file.flush()
            sync(file.fileno())
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink()
        raise


def sync(file: int) -> None:
    """Wait until the disk has a file, which is when it finds that it is full."""
    os.fsync(file)


def stored_chunks(folder: Path, manifest: Manifest) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """The designs that are kept, some at a time in the order of their numbers, as columns by name and reasons.

    The column `NUMBER` tells which ones they are. Nothing is held but what is asked for next.
    """
    names = {heading(name, manifest.columns): name for name in manifest.columns}
    if manifest.store == PARQUET:
        import pyarrow.parquet

        for path in sorted((folder / PARQUET).glob("[0-9]*.parquet")):
            table = pyarrow.parquet.read_table(path)
            reasons = table[REASON].to_pylist()
            yield {names.get(key, key): table[key].to_numpy() for key in table.column_names if key != REASON}, reasons
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
                    names.get(key, key): np.array([float(cell or "nan") for cell in values])
                    for key, values in zip(head, cells, strict=False)
                },
                list(reasons),
            )
