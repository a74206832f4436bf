"""Run tasks in parallel processes.

If a process dies, a new process replaces it. All processes end with the main process.
"""

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from kinelast.tasks.progress import ignored_interrupts, signals_held_back

EXIT_DELAY = 2.0  # [s] a worker process is killed if it has not ended after this time
T = TypeVar("T")
A = TypeVar("A")


@dataclass(frozen=True)
class Lost:
    """Result of a task after the process that ran the task has died.

    `how` is the signal or exit status of the process.
    """

    how: str


@dataclass(eq=False)
class _Worker:
    """A process with its connection and its current task."""

    process: Any
    line: Connection
    task: Any = None

    def send(self, task: Any) -> bool:
        """Send a task; return False if the process has died."""
        self.task = task
        try:
            self.line.send(task)
        except OSError:
            return False
        return True


def map_surviving(
    work: Callable[[T], A], tasks: Iterable[T], jobs: int, tries: int = 1
) -> Generator[tuple[T, A | Lost], None, None]:
    """Run tasks in parallel processes. Yield each task with its result as soon as the task is complete.

    If a process dies, its task is repeated before new tasks start. Before a result is yielded, the process that
    computed the result receives its next task. All processes end when the generator ends or is closed.

    Parameters
    ----------
    work
        Function that runs a task. Each process receives the function once, when the process starts. The function, the
        tasks and the results must be picklable. A task must not be None.
    tries
        Maximum number of attempts at a task. If the process dies in each attempt, the result of the task is `Lost`.
    """
    new, again, deaths, workers = iter(tasks), deque[T](), Counter[T](), list[_Worker]()

    def next_task() -> T | None:
        return again.popleft() if again else next(new, None)

    try:
        while True:
            while len(workers) < jobs and (task := next_task()) is not None:
                workers.append(_start_worker(work))
                if not workers[-1].send(task):
                    again.append(task)
                    _dismiss(workers, workers[-1])
            if not workers:
                return
            for worker in _ready(workers):
                task, answer = worker.task, _answer(worker)
                following = None if isinstance(answer, Lost) else next_task()
                if following is None or not worker.send(following):
                    _dismiss(workers, worker)
                    if following is not None:
                        again.append(following)
                if isinstance(answer, Lost):
                    deaths[task] += 1
                    if deaths[task] < tries:
                        again.append(task)
                        continue
                yield task, answer
    finally:
        with ignored_interrupts():
            _end(workers)


def cores() -> int:
    """Return the number of cores that are available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _start_worker(work: Callable[[Any], Any]) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, work), daemon=True)
    # Start the resource tracker of multiprocessing before interrupts are blocked, because its start unblocks
    # interrupts.
    resource_tracker.ensure_running()
    with signals_held_back([signal.SIGINT]):
        process.start()
    there.close()
    return _Worker(process, here)


def _dismiss(workers: list[_Worker], worker: _Worker) -> None:
    """Close the connection of a worker, so that the worker ends."""
    workers.remove(worker)
    worker.line.close()


def _ready(workers: list[_Worker]) -> list[_Worker]:
    """Wait until a worker has returned a result or died. Return all workers that have done so."""
    ready = set(wait([each for worker in workers for each in (worker.line, worker.process.sentinel)]))
    return [worker for worker in workers if worker.line in ready or worker.process.sentinel in ready]


def _answer(worker: _Worker) -> Any:
    """Return the result of a worker, or `Lost` if the worker has died."""
    try:
        if worker.line.poll():
            return worker.line.recv()
    except (EOFError, OSError):
        pass
    worker.process.join(EXIT_DELAY)
    code = worker.process.exitcode
    return Lost(f"signal {-code}" if code is not None and code < 0 else f"status {code}")


def _end(workers: list[_Worker]) -> None:
    """Terminate all workers. Kill workers that are still alive after `EXIT_DELAY`."""
    for worker in workers:
        worker.process.terminate()
    for worker in workers:
        worker.process.join(EXIT_DELAY)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join(EXIT_DELAY)
        worker.line.close()


def _serve(line: Connection, work: Callable[[Any], Any]) -> None:
    """Run tasks in a worker until the connection is closed."""
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = line.recv()
        except (EOFError, OSError):  # raised if the connection is closed or broken
            return
        answer = work(task)
        with suppress(OSError):
            line.send(answer)


def _die_with_parent() -> None:
    """End this process when its parent ends for any reason."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
