"""Execution of a sweep of any size. Chunks of designs are computed in parallel, and stored when complete.

Chunks are computed by processes, or by the workers of a dask scheduler (see `cluster`).
"""

import traceback
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.outputs.outbox import locked
from kinelast.sweep.cluster import chunks_by_cluster
from kinelast.sweep.manifest import Manifest, read_manifest, require_same, versions
from kinelast.sweep.store import CSV, Store, encoded, store_name
from kinelast.tasks.processes import Lost, map_surviving
from kinelast.tasks.progress import SILENT, Progress, stops_kept
from kinelast.tasks.request import RequestError
from kinelast.values.error import plain

MAX_TRIES = 3  # maximum number of attempts to compute a chunk; a new attempt is made if the process dies
MAX_NAMED = 5  # maximum number of chunks named in a message
MAX_FAILED = 10  # number of failed chunks after which a run stops


class Compute(Protocol):
    """Callable object that computes designs.

    It must be picklable. The results must depend neither on the process nor on the order of calls.
    """

    @property
    def units(self) -> Mapping[str, str]:
        """Units by column name."""

    def __call__(self, first: int, last: int) -> tuple[Mapping[str, Any], Sequence[str]]:
        """Compute designs `first` to `last` - 1.

        Returns
        -------
        Columns by name, each of shape (last - first,), and a text for each design. The text is the reason for nan
        values, or empty if the design has no nan values.
        """


class SweepState(Struct, frozen=True):
    """State of a sweep: folder, manifest, and number of stored designs (`kept`)."""

    folder: Path
    manifest: Manifest
    kept: int


class Chunk(Struct, frozen=True):
    """A computed chunk: content of the chunk's file, names of the columns, and number of designs (`rows`)."""

    content: bytes
    columns: tuple[str, ...]
    rows: int


class ChunkWork(Struct, frozen=True):
    """Callable object that computes and encodes a chunk. The object can be sent to other processes."""

    compute: Compute
    manifest: Manifest

    def __call__(self, number: int) -> Chunk | str:
        """Return the chunk with the index `number`, or the reason why computing the chunk failed."""
        first, last = self.manifest.span(number)
        try:
            with stops_kept(), np.errstate(all="ignore"):  # no numpy warnings, because nan marks a missing value
                columns, reasons = self.compute(first, last)
            content = encoded(self.manifest.store, first, columns, self.compute.units, reasons)
        except MemoryError:
            return "out of memory: use smaller chunks"
        except Exception:  # a failed chunk must not stop the computation of other chunks
            return traceback.format_exc()
        return Chunk(content, tuple(columns), len(reasons))


def run_plan(
    count: int,
    compute: Compute,
    folder: Path,
    identity: Mapping[str, Any],
    chunk: int,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress = SILENT,
    resume: bool = False,
) -> SweepState:
    """Compute all designs of a sweep and store them in a folder.

    Complete chunks are kept if the run is interrupted, and `resume` computes only the missing chunks. The bytes of the
    final files depend neither on interruptions nor on the number of processes.

    Parameters
    ----------
    count
        Number of designs.
    compute
        Callable object that computes designs, see `Compute`. The results of a design must depend only on its index.
    identity
        Inputs on which the results depend, as JSON data. `run_plan` adds the versions of the software.
    chunk
        Number of designs per chunk. A chunk should take about half a second.
    jobs
        Number of parallel processes. With 1, the chunks are computed in the current process.
    scheduler
        Address of a dask scheduler, such as "tcp://host:8786", whose workers compute the chunks.
    progress
        Progress callback. If the run is interrupted, the callback also reports the number of stored designs.
    resume
        Whether to continue a sweep that is already stored in the folder.

    Raises
    ------
    RequestError
        The folder contains files that do not belong to the sweep, or is locked by another run. If `resume` is True, the
        folder contains another sweep. If `resume` is False, the folder contains an incomplete sweep. The folder cannot
        be written, or the connection to the scheduler fails.
    """
    store = Store(folder, store_name(count))
    manifest = Manifest({**identity, "versions": versions()}, count, chunk, store.name)
    with locked(folder, patience=0.0):
        try:
            manifest = _prepared(store, manifest, resume)
            manifest, wrong = _verified(store, manifest, progress)
            manifest = _computed(store, manifest, wrong, compute, jobs, scheduler, progress)
            return SweepState(folder, _finished(store, manifest), manifest.count(store.kept))
        except RequestError:
            raise
        except BaseException as stop:
            kept = f"{manifest.count(store.kept)} of {count} designs are stored; continue with --resume"
            if isinstance(stop, ConnectionError):
                raise RequestError(f"{stop}; {kept}") from stop
            if isinstance(stop, OSError):
                raise RequestError(f"{_not_written(stop, folder)}; {kept}") from stop
            progress.tell(kept)
            raise


def _prepared(store: Store, requested: Manifest, resume: bool) -> Manifest:
    """Prepare a folder for a sweep; return the manifest of the sweep.

    If the sweep is resumed, the result is the manifest stored in the folder. Otherwise the result is `requested`.
    """
    folder, stored = store.folder, read_manifest(store.folder)
    if stored is None:
        store.require_free()
    elif resume:
        require_same(stored, requested, folder)
        store.tidy()
        return stored
    else:
        old = Store(folder, stored.store)
        if not stored.complete and (done := old.checked(stored)[0]):
            part = f"{stored.count(done)} of {stored.designs} designs of an incomplete sweep"
            raise RequestError(f"{folder} contains {part}: continue with --resume, or remove it")
        old.clear()
    store.note(requested)
    return requested


def _verified(store: Store, manifest: Manifest, progress: Progress) -> tuple[Manifest, list[int]]:
    """Verify the checksums of stored chunks; return the manifest, and the indices of damaged chunks."""
    done, wrong = store.checked(manifest)
    if not manifest.complete:
        if wrong:
            progress.tell(f"{store.folder}: damaged, computed again: {_chunks(wrong)}")
        return manifest, wrong
    if len(done) == manifest.chunks and store.is_whole(manifest):
        return manifest, []
    action = f"computed again: {_chunks(wrong)}" if wrong else "joined again"
    progress.tell(f"{store.folder / store.name} has changed since it was written; {action}")
    if store.name == CSV:
        store.part(manifest)
    else:
        store.journal(store.kept)
    manifest = replace(manifest, complete=False, kept=())
    store.note(manifest)
    return manifest, wrong


def _chunks(numbers: Sequence[int]) -> str:
    """Return a text that names chunks by index, at most `MAX_NAMED` of them."""
    more = f" and {len(numbers) - MAX_NAMED} more" if len(numbers) > MAX_NAMED else ""
    noun = "chunks" if len(numbers) > 1 else "chunk"
    return f"{noun} {', '.join(map(str, numbers[:MAX_NAMED]))}{more}"


def _computed(
    store: Store,
    manifest: Manifest,
    wrong: Sequence[int],
    compute: Compute,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
) -> Manifest:
    """Compute and store the missing chunks, damaged chunks first; return the manifest with the failed chunks."""
    failed: dict[int, str] = {}
    done = {*store.kept, *wrong}
    missing = [*wrong, *(number for number in range(manifest.chunks) if number not in done)]
    work = ChunkWork(compute, manifest)
    with closing(_chunk_results(work, iter(missing), min(jobs, len(missing)), scheduler, progress)) as coming:
        for number, answer in coming:
            chunk = _checked_columns(answer, manifest)
            if isinstance(chunk, str):
                failed[number] = chunk
                manifest = replace(manifest, failed=dict(failed))
                store.note(manifest)
                if len(failed) == MAX_FAILED:
                    break
                continue
            if not manifest.columns:
                units = compute.units
                manifest = replace(manifest, columns={name: units.get(name, "") for name in chunk.columns})
                store.note(manifest)
            store.keep(number, chunk.rows, chunk.content)
            progress("designs", manifest.count(store.kept), manifest.designs)
    return replace(manifest, failed=failed)


def _chunk_results(
    work: ChunkWork, numbers: Iterator[int], jobs: int, scheduler: str | None, progress: Progress
) -> Generator[tuple[int, Chunk | str | Lost], None, None]:
    """Yield the index and the result of each chunk, in the order of completion.

    The chunks are computed by the workers of a scheduler, by parallel processes, or by the current process.
    """
    if scheduler is not None:
        return chunks_by_cluster(work, numbers, scheduler, progress)
    if jobs > 1:
        return map_surviving(work, numbers, jobs, MAX_TRIES)
    return ((number, work(number)) for number in numbers)


def _checked_columns(answer: Chunk | str | Lost, manifest: Manifest) -> Chunk | str:
    """Return a computed chunk if its columns agree with the manifest, otherwise return an error message."""
    if isinstance(answer, Lost):
        return f"its process ended {MAX_TRIES} times ({answer.how}); if memory ran out, use smaller chunks"
    if isinstance(answer, Chunk) and manifest.columns and list(manifest.columns) != list(answer.columns):
        return f"its columns are {', '.join(answer.columns)}, expected {', '.join(manifest.columns)}"
    return answer


def _finished(store: Store, manifest: Manifest) -> Manifest:
    """Write the final files of a sweep if all chunks are stored; return the final manifest."""
    if len(store.kept) < manifest.chunks:
        whole = replace(manifest, complete=False, kept=())
        store.note(whole)
        return whole
    whole = replace(manifest, complete=True, kept=[store.kept[number] for number in range(manifest.chunks)])
    if not manifest.complete:
        store.join(whole)
    store.note(whole)
    store.drop_parts()
    return whole


def filled(state: SweepState, cells: Mapping[int, Mapping[str, Any]]) -> SweepState:
    """Write new values to the files of a complete sweep.

    `cells` maps the index of a design to a dictionary that maps column names to new values.

    Raises
    ------
    RequestError
        Another run has locked the folder, or the folder cannot be written.
    """
    store = Store(state.folder, state.manifest.store)
    with locked(state.folder, patience=0.0):
        try:
            return replace(state, manifest=store.fill(state.manifest, cells))
        except OSError as error:
            raise RequestError(_not_written(error, state.folder)) from error


def _not_written(error: OSError, folder: Path) -> str:
    """Return the reason why a file in a folder cannot be written."""
    return "not written: " + plain(f"{error.filename or folder}: {(error.strerror or str(error)).lower()}", 300)
