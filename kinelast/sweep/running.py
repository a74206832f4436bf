"""Execution of a sweep of any size: chunks in parallel, each stored when complete.

Chunks are computed in processes, or on the workers of a dask scheduler. A worker receives the sweep once, when it
joins, and after that only indices of chunks. dask reassigns the chunks of a lost worker. The scheduler only queues
enough chunks to keep the workers busy, so its memory does not grow with the sweep.
"""

import secrets
import time
import traceback
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from kinelast.outputs.outbox import locked
from kinelast.scene.error import plain
from kinelast.sweep.manifest import Manifest, read_manifest, require_same, versions
from kinelast.sweep.store import CSV, Store, encoded, store_name
from kinelast.tasks.processes import Lost, map_surviving
from kinelast.tasks.progress import SILENT, Progress, stops_kept
from kinelast.tasks.request import RequestError

MAX_TRIES = 3  # attempts at a chunk if its process dies
MAX_NAMED = 5  # maximum number of chunks named in a message
MAX_FAILED = 10  # number of failed chunks that stops a run


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
        """Return the chunk, or the reason why it failed."""
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

    Complete chunks survive an interruption; `resume` continues with the rest. The final bytes are the same in any case.

    Parameters
    ----------
    count
        Number of designs.
    compute
        Computes designs first to last - 1, see `Compute`. A row must depend only on the index of its design.
    identity
        Inputs that determine the figures, as JSON data; versions are added.
    chunk
        Designs per chunk, about one second of work.
    jobs
        Number of parallel processes; 1 means this process only.
    scheduler
        Address of a dask scheduler, such as "tcp://host:8786", whose workers compute the chunks.
    progress
        Progress callback; after an interruption it also reports how much is stored.
    resume
        True to continue with stored chunks.

    Raises
    ------
    RequestError
        If the folder contains another sweep, or this one and `resume` is False; if it is locked by another run or
        cannot be written; or if too many chunks fail.
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
                raise RequestError(f"{_not_written(stop, folder)}; {kept}") from stop
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
        store.journal(store.kept)
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
    """Yield the chunks that a scheduler, worker processes, or this process compute."""
    if scheduler is not None:
        return cluster_answers(work, numbers, scheduler, progress)
    if jobs > 1:
        return map_surviving(work, numbers, jobs, MAX_TRIES)
    return ((number, work(number)) for number in numbers)


def _checked_columns(answer: Chunk | str | Lost, manifest: Manifest) -> Chunk | str:
    """Return a chunk if it has the same columns as the others, or else an error message."""
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
            raise RequestError(_not_written(error, state.folder)) from error


def _not_written(error: OSError, folder: Path) -> str:
    """Reason why a file in a folder cannot be written."""
    return "not written: " + plain(f"{error.filename or folder}: {(error.strerror or str(error)).lower()}", 300)


CHUNKS_PER_THREAD = 3  # chunks per thread, running or queued
COUNT_INTERVAL = 5.0  # [s] between counts of the workers
TIMEOUT = "10s"  # of the connection to a scheduler
A = TypeVar("A")


def cluster_answers(
    work: Callable[[int], A], numbers: Iterator[int], address: str, progress: Progress = SILENT
) -> Generator[tuple[int, A | Lost], None, None]:
    """Yield indices of chunks with their results, as they arrive from the workers; see `map_surviving`.

    Raises
    ------
    RequestError
        If there is no scheduler at the address, or its workers have other versions.
    ConnectionError
        If the connection is lost.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RequestError('--scheduler needs dask: pip install "distributed" "pyarrow"') from None
    try:
        client = Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise RequestError(f'--scheduler: nobody answers at "{plain(address, 200)}" ({_error_text(error)})') from None
    name = f"kinelast-{secrets.token_hex(8)}"
    try:
        _send(client, name, work)
        if not client.nthreads():
            shown = plain(address, 200)
            progress.tell(f'--scheduler: "{shown}" has no worker yet, waiting for one: dask worker {shown}')
        yield from _results(client, name, numbers)
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.unregister_worker_plugin(name)
        client.close(timeout=1)


def _send(client: Any, name: str, work: Callable[[int], Any]) -> None:
    """Send the work to all present and future workers."""
    from distributed import WorkerPlugin

    class StoredWork(WorkerPlugin):  # type: ignore[misc]  # pickled by value: dask is loaded nowhere else
        """Work stored on a worker."""

        def __init__(self, work: Callable[[int], Any]) -> None:
            self.work = work

    try:
        client.register_plugin(StoredWork(work), name=name)
    except Exception as error:
        problem = f"its workers do not take the work ({_error_text(error)}): is kinelast installed there?"
        raise RequestError(f"--scheduler: {problem}") from None


def _answer(name: str, number: int) -> tuple[dict[str, str], Any]:
    """Result of a worker, and the versions that it uses."""
    from distributed import get_worker

    return versions(), get_worker().plugins[name].work(number)


def _results(client: Any, name: str, numbers: Iterator[int]) -> Generator[tuple[int, Any], None, None]:
    """Yield results as they arrive, and submit enough chunks to keep the workers busy."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    coming, numbered, here = as_completed(loop=client.loop), dict[str, int](), versions()
    most, counted = 0, -COUNT_INTERVAL
    while True:
        if time.monotonic() > counted + COUNT_INTERVAL:
            most, counted = CHUNKS_PER_THREAD * max(1, sum(client.nthreads().values())), time.monotonic()
        for number in islice(numbers, max(0, most - len(numbered))):
            future = client.submit(_answer, name, number, key=f"{name}-{number}", pure=False)
            numbered[future.key] = number
            coming.add(future)
        if not numbered:
            return
        future = next(coming)
        number = numbered.pop(future.key)
        try:
            there, answer = future.result()
        except KilledWorker as error:
            yield number, Lost(_error_text(error))
            continue
        except Exception as error:
            raise ConnectionError(f"--scheduler: it can no longer be reached ({_error_text(error)})") from None
        future.release()
        if there != here:
            raise RequestError(f"--scheduler: a worker has {there}, and here is {here}: results would differ")
        yield number, answer


def _error_text(error: BaseException) -> str:
    return plain(f"{type(error).__name__}: {error}", 200)
