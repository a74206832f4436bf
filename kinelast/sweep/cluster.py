"""A sweep past one machine: its chunks on the workers of a dask scheduler.

A worker is sent the sweep once, when it joins, and the numbers of chunks after that. What a lost worker was at, or
held, dask gives to the others. The scheduler never knows of more chunks than the workers need to stay busy, so that
neither it nor this process grows with the sweep.
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

AHEAD = 3  # chunks a thread has, done or to do
LOOKED = 5.0  # [s] after which workers are counted again
PATIENCE = "10s"  # for a scheduler to answer
A = TypeVar("A")


def cluster_answers(
    work: Callable[[int], A], numbers: Iterator[int], address: str, progress: Progress = SILENT
) -> Generator[tuple[int, A | Lost], None, None]:
    """Numbers with their answers, as they come from the workers of a scheduler; see `map_surviving`.

    Raises
    ------
    RequestError
        There is no scheduler at the address; its workers have other versions of what computes.
    ConnectionError
        It was there, and is no more.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RequestError('--scheduler needs dask: pip install "distributed" "pyarrow"') from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise RequestError(f'--scheduler: nobody answers at "{plain(address, 200)}" ({_told(error)})') from None
    name = f"kinelast-{secrets.token_hex(8)}"
    try:
        _send(client, name, work)
        if not client.nthreads():
            shown = plain(address, 200)
            progress.tell(f'--scheduler: "{shown}" has no worker yet, waiting for one: dask worker {shown}')
        yield from _collected(client, name, numbers)
    finally:
        with suppress(Exception):  # a scheduler that is gone has nothing to forget
            client.unregister_worker_plugin(name)
        client.close(timeout=1)


def _send(client: Any, name: str, work: Callable[[int], Any]) -> None:
    """Give the work to all workers that are there, and to those to come."""
    from distributed import WorkerPlugin

    class Held(WorkerPlugin):  # type: ignore[misc]  # pickled by value: dask is loaded nowhere else
        """Work that a worker holds."""

        def __init__(self, work: Callable[[int], Any]) -> None:
            self.work = work

    try:
        client.register_plugin(Held(work), name=name)
    except Exception as error:
        told = f"its workers do not take the work ({_told(error)}): is kinelast installed there?"
        raise RequestError(f"--scheduler: {told}") from None


def _answer(name: str, number: int) -> tuple[dict[str, str], Any]:
    """The answer of a worker: the versions that it computes with, and the result."""
    from distributed import get_worker

    return versions(), get_worker().plugins[name].work(number)


def _collected(client: Any, name: str, numbers: Iterator[int]) -> Generator[tuple[int, Any], None, None]:
    """Answers as they come, while as many more numbers are handed over as keep the workers busy."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    coming, numbered, here = as_completed(loop=client.loop), dict[str, int](), versions()
    most, counted = 0, -LOOKED
    while True:
        if time.monotonic() > counted + LOOKED:
            most, counted = AHEAD * max(1, sum(client.nthreads().values())), time.monotonic()
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
            yield number, Lost(_told(error))
            continue
        except Exception as error:
            raise ConnectionError(f"--scheduler: it can no longer be reached ({_told(error)})") from None
        future.release()
        if there != here:
            raise RequestError(f"--scheduler: a worker has {there}, and here is {here}: results would differ")
        yield number, answer


def _told(error: BaseException) -> str:
    return plain(f"{type(error).__name__}: {error}", 200)
