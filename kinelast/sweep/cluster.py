"""Computation of the chunks of a sweep by the workers of a dask scheduler.

A worker receives the scene and the plan once, when the worker connects. Afterwards, the worker receives only the
indices of chunks. If a worker is lost, dask assigns its chunks to other workers. Only a few chunks per worker are
queued, so that the memory does not grow with the size of the sweep.
"""

import secrets
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from itertools import islice
from typing import Any, TypeVar

from kinelast.sweep.manifest import versions
from kinelast.tasks.processes import Lost
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.request import RequestError
from kinelast.values.error import plain

CHUNKS_PER_THREAD = 3  # number of running or queued chunks per thread of the workers
COUNT_INTERVAL = 5.0  # [s] the threads of all workers are counted again after this time
TIMEOUT = "10s"  # time limit for the connection to a scheduler
A = TypeVar("A")


def chunks_by_cluster(
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
        yield from _arriving(client, name, numbers)
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


def _chunk_on_worker(name: str, number: int) -> tuple[dict[str, str], Any]:
    """Compute a chunk on a worker; return the software versions on the worker, and the result."""
    from distributed import get_worker

    return versions(), get_worker().plugins[name].work(number)


def _arriving(client: Any, name: str, numbers: Iterator[int]) -> Generator[tuple[int, Any], None, None]:
    """Submit enough chunks to keep the workers busy; yield the index and the result of each chunk on arrival."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    coming, numbered, here = as_completed(loop=client.loop), dict[str, int](), versions()
    most, counted = 0, -COUNT_INTERVAL
    while True:
        if time.monotonic() > counted + COUNT_INTERVAL:
            most, counted = CHUNKS_PER_THREAD * max(1, sum(client.nthreads().values())), time.monotonic()
        for number in islice(numbers, max(0, most - len(numbered))):
            future = client.submit(_chunk_on_worker, name, number, key=f"{name}-{number}", pure=False)
            numbered[future.key] = number
            coming.add(future)
        if not numbered:
            return
        future = next(coming)
        number = numbered.pop(future.key)
        try:
            there, chunk = future.result()
        except KilledWorker as error:
            yield number, Lost(_error_text(error))
            continue
        except Exception as error:
            raise ConnectionError(f"--scheduler: the connection is lost ({_error_text(error)})") from None
        future.release()
        if there != here:
            raise RequestError(f"--scheduler: a worker has {there}, but this computer has {here}: results would differ")
        yield number, chunk


def _error_text(error: BaseException) -> str:
    return plain(f"{type(error).__name__}: {error}", 200)
