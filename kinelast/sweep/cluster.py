"""Sweep on the workers of a dask scheduler.

A worker receives the sweep once, when it joins, then only indices of chunks. dask reassigns the chunks of a lost
worker. The scheduler holds only as many chunks as keep the workers busy, so its memory does not grow with the sweep.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from itertools import islice
from typing import Any, TypeVar

from kinelast.scene.error import plain
from kinelast.sweep.manifest import versions
from kinelast.tasks.processes import Lost
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.request import RequestError

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
        with suppress(Exception):  # if the scheduler is gone
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
    """Yield results as they arrive, and submit as many chunks as keep the workers busy."""
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
