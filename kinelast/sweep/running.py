"""Execution of a sweep of any size. Chunks of designs are computed in parallel, and stored when complete.

Chunks are computed by processes, or by the workers of a dask scheduler. A worker receives the scene and the plan once,
when the worker connects. Afterwards, the worker receives only the indices of chunks. If a worker is lost, dask assigns
its chunks to other workers. Only a few chunks per worker are queued, so that the memory does not grow with the size of
the sweep.
"""

import secrets
import time
import traceback
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from itertools import islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.outputs.outbox import locked
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
            part = f"{kept.count(done)} of {kept.designs} designs of an incomplete sweep"
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
    """Compute and store the missing chunks, damaged chunks first; return the manifest with the failed chunks."""
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
    """Yield the index and the result of each chunk, in the order of completion.

    The chunks are computed by the workers of a scheduler, by parallel processes, or by the current process.
    """
    if scheduler is not None:
        return cluster_answers(work, numbers, scheduler, progress)
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


CHUNKS_PER_THREAD = 3  # number of running or queued chunks per thread of the workers
COUNT_INTERVAL = 5.0  # [s] the threads of all workers are counted again after this time
TIMEOUT = "10s"  # time limit for the connection to a scheduler
A = TypeVar("A")


def cluster_answers(
    work: Callable[[int], A], numbers: Iterator[int], address: str, progress: Progress = SILENT
) -> Generator[tuple[int, A | Lost], None, None]:
    """Compute chunks by the workers of a dask scheduler; yield the index and the result of each chunk.

    The results are yielded in the order of arrival. If workers repeatedly die during the computation of a chunk, the
    result of this chunk is `Lost`.

    Raises
    ------
    RequestError
        Dask is not installed. There is no scheduler at the address. The workers cannot load kinelast, or have other
        software versions than this computer.
    ConnectionError
        The connection to the scheduler is lost.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RequestError('--scheduler needs dask: pip install "distributed" "pyarrow"') from None
    try:
        client = Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        problem = f'there is no answer from "{plain(address, 200)}" ({_error_text(error)})'
        raise RequestError(f"--scheduler: {problem}") from None
    name = f"kinelast-{secrets.token_hex(8)}"
    try:
        _send(client, name, work)
        if not client.nthreads():
            shown = plain(address, 200)
            progress.tell(f'--scheduler: "{shown}" has no workers yet, start one: dask worker {shown}')
        yield from _results(client, name, numbers)
    finally:
        with suppress(Exception):  # ignore errors, because the scheduler may have stopped
            client.unregister_worker_plugin(name)
        client.close(timeout=1)


def _send(client: Any, name: str, work: Callable[[int], Any]) -> None:
    """Send `work` to all workers of a scheduler, including workers that connect later."""
    from distributed import WorkerPlugin

    class StoredWork(WorkerPlugin):  # type: ignore[misc]  # local class: pickled by value
        """Plugin that stores the function `work` on a worker."""

        def __init__(self, work: Callable[[int], Any]) -> None:
            self.work = work

    try:
        client.register_plugin(StoredWork(work), name=name)
    except Exception as error:
        problem = f"the workers cannot load the task ({_error_text(error)}): is kinelast installed there?"
        raise RequestError(f"--scheduler: {problem}") from None


def _answer(name: str, number: int) -> tuple[dict[str, str], Any]:
    """Compute a chunk on a worker; return the software versions on the worker, and the result."""
    from distributed import get_worker

    return versions(), get_worker().plugins[name].work(number)


def _results(client: Any, name: str, numbers: Iterator[int]) -> Generator[tuple[int, Any], None, None]:
    """Submit enough chunks to keep the workers busy; yield the index and the result of each chunk on arrival."""
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
            raise ConnectionError(f"--scheduler: the connection is lost ({_error_text(error)})") from None
        future.release()
        if there != here:
            raise RequestError(f"--scheduler: a worker has {there}, but this computer has {here}: results would differ")
        yield number, answer


def _error_text(error: BaseException) -> str:
    return plain(f"{type(error).__name__}: {error}", 200)
