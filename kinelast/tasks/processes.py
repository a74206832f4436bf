"""Work side by side, in processes that are started anew when they die, and die with this one."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

from kinelast.tasks.progress import ignored_interrupts, without_interrupts

GRACE = 2.0  # [s] that a worker has to end by itself
T = TypeVar("T")
A = TypeVar("A")


@dataclass(frozen=True)
class Lost:
    """In place of an answer where the process at work has died: how it ended."""

    how: str


@dataclass(eq=False)
class _Worker:
    """A process, the line to it, and the task that it is at."""

    process: Any
    line: Connection
    task: Any = None

    def takes(self, task: Any) -> bool:
        """Whether a task could be handed over: not where the process has died meanwhile."""
        self.task = task
        try:
            self.line.send(task)
        except OSError:
            return False
        return True


class _Queue(Generic[T]):
    """Tasks to come, first those that a dead process has left."""

    def __init__(self, tasks: Iterable[T]) -> None:
        self._tasks, self._left = iter(tasks), deque[T]()

    def next(self) -> T | None:
        """The next task; None where there is none now."""
        return self._left.popleft() if self._left else next(self._tasks, None)

    def put_back(self, task: T) -> None:
        """Take a task back."""
        self._left.append(task)


def map_surviving(
    work: Callable[[T], A], tasks: Iterable[T], jobs: int, tries: int = 1
) -> Generator[tuple[T, A | Lost], None, None]:
    """Tasks with their answers, in the order in which these are found, computed in so many processes.

    A process has its next task before its answer is handed out. However this ends, no process is left behind.

    Parameters
    ----------
    work
        Goes to every process once; it, tasks and answers can be pickled. No task is None.
    tries
        How often a task is begun at most whose process dies; then it is `Lost`.
    """
    queue, deaths, workers = _Queue(tasks), Counter[T](), list[_Worker]()
    try:
        while True:
            while len(workers) < jobs and (task := queue.next()) is not None:
                workers.append(_started(work))
                if not workers[-1].takes(task):
                    queue.put_back(task)
                    _dismiss(workers, workers[-1])
            if not workers:
                return
            for worker in _ready(workers):
                task, answer = worker.task, _answer(worker)
                following = None if isinstance(answer, Lost) else queue.next()
                if following is None or not worker.takes(following):
                    _dismiss(workers, worker)
                    if following is not None:
                        queue.put_back(following)
                if isinstance(answer, Lost):
                    deaths[task] += 1
                    if deaths[task] < tries:
                        queue.put_back(task)
                        continue
                yield task, answer
    finally:
        with ignored_interrupts():
            _end(workers)


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _started(work: Callable[[Any], Any]) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, work), daemon=True)
    resource_tracker.ensure_running()  # else it is started meanwhile, and lets interrupts through again
    with without_interrupts():
        process.start()
    there.close()
    return _Worker(process, here)


def _dismiss(workers: list[_Worker], worker: _Worker) -> None:
    """Let a worker go; it ends as its line does."""
    workers.remove(worker)
    worker.line.close()


def _ready(workers: list[_Worker]) -> list[_Worker]:
    """Workers that have answered or died; waits for the first."""
    heard = set(wait([each for worker in workers for each in (worker.line, worker.process.sentinel)]))
    return [worker for worker in workers if worker.line in heard or worker.process.sentinel in heard]


def _answer(worker: _Worker) -> Any:
    """The answer of a worker, or how it has died."""
    try:
        if worker.line.poll():
            return worker.line.recv()
    except (EOFError, OSError):
        pass
    worker.process.join(GRACE)
    code = worker.process.exitcode
    return Lost(f"signal {-code}" if code is not None and code < 0 else f"status {code}")


def _end(workers: list[_Worker]) -> None:
    """End the workers that still run."""
    for worker in workers:
        worker.process.terminate()
    for worker in workers:
        worker.process.join(GRACE)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join(GRACE)
        worker.line.close()


def _serve(line: Connection, work: Callable[[Any], Any]) -> None:
    """The loop of a worker: task after task, until nobody asks any more."""
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = line.recv()
        except (EOFError, OSError):  # the other end is closed, or gone with something unread
            return
        answer = work(task)
        with suppress(OSError):
            line.send(answer)


def _die_with_parent() -> None:
    """End this process as soon as the one that started it has ended, however that came about."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
