"""Execution of a sweep of any size: chunks in parallel, each stored when complete."""

from __future__ import annotations

import traceback
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from kinelast.outputs.outbox import locked
from kinelast.scene.error import plain
from kinelast.sweep.manifest import Manifest, read_manifest, require_same, versions
from kinelast.sweep.store import CSV, Store, encoded, store_name
from kinelast.tasks.processes import Lost, map_surviving
from kinelast.tasks.progress import SILENT, Progress, stops_kept
from kinelast.tasks.request import RequestError

MAX_TRIES = 3  # attempts at a chunk whose process dies
MAX_NAMED = 5  # chunks named in a message
MAX_FAILED = 10  # failed chunks that stop a run


class Compute(Protocol):
    """Computation of designs; must be picklable, and callable anywhere in any order."""

    @property
    def units(self) -> Mapping[str, str]:
        """Units by column name."""

    def __call__(self, first: int, last: int) -> tuple[Mapping[str, Any], Sequence[str]]:
        """Columns of designs first to last - 1, each of shape (last - first,), and reasons for nan."""


@dataclass(frozen=True)
class SweepState:
    """State of a sweep: stored designs and failed chunks."""

    folder: Path
    manifest: Manifest
    kept: int


@dataclass(frozen=True)
class Chunk:
    """Computed chunk: file content and columns."""

    content: bytes
    columns: tuple[str, ...]
    rows: int


@dataclass(frozen=True)
class ChunkWork:
    """Computes a chunk and encodes its file, in any process."""

    compute: Compute
    manifest: Manifest

    def __call__(self, number: int) -> Chunk | str:
        """Return the chunk, or why it failed."""
        first, last = self.manifest.span(number)
        try:
            with stops_kept(), np.errstate(all="ignore"):  # nan is reported as missing
                columns, reasons = self.compute(first, last)
            content = encoded(self.manifest.store, first, columns, self.compute.units, reasons)
        except MemoryError:
            return "out of memory: use smaller chunks"
        except Exception:  # a failing chunk must not stop the others
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

    Complete chunks survive interruption; `resume` continues with the rest. The final bytes are the same in any case.

    Parameters
    ----------
    count
        Number of designs.
    compute
        Computes designs first to last - 1, see `Compute`. A row must depend on the index of its design only.
    identity
        Inputs that determine the figures, as JSON data; versions are added.
    chunk
        Designs per chunk, about one second of work.
    jobs
        Number of parallel processes; 1: this process only.
    scheduler
        Address of a dask scheduler whose workers compute, such as "tcp://host:8786".
    progress
        Progress callback; also reports what is stored after an interruption.
    resume
        True to continue with stored chunks.

    Raises
    ------
    RequestError
        If the folder holds another sweep, or this one without `resume`; if it is locked by another run or cannot be
        written; or if too many chunks fail.
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
            kept = f"{manifest.count(store.kept)} of {count} designs are kept; --resume goes on from there"
            if isinstance(stop, ConnectionError):
                raise RequestError(f"{stop}; {kept}") from stop
            if isinstance(stop, OSError):
                why = plain(f"{stop.filename or folder}: {(stop.strerror or str(stop)).lower()}", 300)
                raise RequestError(f"not written: {why}; {kept}") from stop
            progress.tell(kept)
            raise


def _prepared(store: Store, requested: Manifest, resume: bool) -> Manifest:
    """Prepare a folder for a sweep; return its manifest or a new one."""
    folder, kept = store.folder, read_manifest(store.folder)
    if kept is None:
        store.require_free()
    elif resume:
        require_same(kept, requested, folder)
        store.tidy()
        return kept
    else:
        old = Store(folder, kept.store)
        if not kept.complete and (done := old.checked(kept)[0]):
            part = f"{kept.count(done)} of {kept.designs} designs of a sweep that was not finished"
            raise RequestError(f"{folder} holds {part}: --resume goes on with it, or remove it")
        old.clear()
    store.note(requested)
    return requested


def _verified(store: Store, manifest: Manifest, progress: Progress) -> tuple[Manifest, list[int]]:
    """Verify stored chunks; return the manifest, and the indices of damaged chunks."""
    done, wrong = store.checked(manifest)
    if not manifest.complete:
        if wrong:
            progress.tell(f"{store.folder}: computed again, as not as they were kept: {_chunks(wrong)}")
        return manifest, wrong
    if len(done) == manifest.chunks and store.is_whole(manifest):
        return manifest, []
    action = f"computed again: {_chunks(wrong)}" if wrong else "joined again"
    progress.tell(f"{store.folder / store.name} is not as it was written; {action}")
    if store.name == CSV:
        store.part(manifest)
    else:
        store.note_kept()
    manifest = replace(manifest, complete=False, kept=())
    store.note(manifest)
    return manifest, wrong


def _chunks(numbers: Sequence[int]) -> str:
    """Name chunks by index, at most `MAX_NAMED`."""
    more = f" and {len(numbers) - MAX_NAMED} more" if len(numbers) > MAX_NAMED else ""
    return f"chunk{'s'[: len(numbers) > 1]} {', '.join(map(str, numbers[:MAX_NAMED]))}{more}"


def _computed(
    store: Store,
    manifest: Manifest,
    wrong: Sequence[int],
    compute: Compute,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
) -> Manifest:
    """Compute and store missing chunks, damaged ones first; return the manifest."""
    failed: dict[int, str] = {}
    first = [*wrong, *(number for number in range(manifest.chunks) if number not in store.kept and number not in wrong)]
    with closing(
        _chunk_results(ChunkWork(compute, manifest), iter(first), min(jobs, len(first)), scheduler, progress)
    ) as coming:
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
    """Yield chunks from a scheduler, processes, or this process."""
    if scheduler is not None:
        from kinelast.sweep.cluster import cluster_answers

        return cluster_answers(work, numbers, scheduler, progress)
    if jobs > 1:
        return map_surviving(work, numbers, jobs, MAX_TRIES)
    return ((number, work(number)) for number in numbers)


def _checked_columns(answer: Chunk | str | Lost, manifest: Manifest) -> Chunk | str:
    """Return a chunk with the same columns as the others, else an error message."""
    if isinstance(answer, Lost):
        return f"its process ended {MAX_TRIES} times ({answer.how}); if memory ran out, use smaller chunks"
    if isinstance(answer, Chunk) and manifest.columns and list(manifest.columns) != list(answer.columns):
        return f"its columns are {', '.join(answer.columns)}, expected {', '.join(manifest.columns)}"
    return answer


def _finished(store: Store, manifest: Manifest) -> Manifest:
    """Complete the store if all chunks are present; return the final manifest."""
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
    """Change cells of a complete sweep, by index of the design and column name.

    Raises
    ------
    RequestError
        If another run locks the folder, or it cannot be written.
    """
    store = Store(state.folder, state.manifest.store)
    with locked(state.folder, patience=0.0):
        try:
            return replace(state, manifest=store.fill(state.manifest, cells))
        except OSError as error:
            why = plain(f"{error.filename or state.folder}: {(error.strerror or str(error)).lower()}", 300)
            raise RequestError(f"not written: {why}") from error
