"""Scenes side by side, each in a process that is started anew when it dies, and dies with this one."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

from kinelast.folder import recovered
from kinelast.outcome import BUG, Outcome, Task
from kinelast.run import try_scene
from kinelast.stopping import without_interrupts
from kinelast.terminal import say

if TYPE_CHECKING:
    from kinelast.request import Request

GRACE = 2.0  # [s] that a worker has to end by itself
Report = Callable[[str, int, int], None]


@dataclass(eq=False)
class _Worker:
    """A process, the line to it, and the number of the scene that it is at."""

    process: Any
    line: Connection
    number: int


def side_by_side(tasks: Sequence[Task], jobs: int, request: Request, resume: bool, report: Report) -> Iterator[Outcome]:
    """The outcomes of scenes in their order, computed in so many processes.

    A scene whose process dies is failed, the others go on. However this ends, no process is left behind.
    """
    waiting, done, count = deque(range(len(tasks))), dict[int, Outcome](), 0
    workers: list[_Worker] = []
    try:
        for number in range(len(tasks)):
            while number not in done:
                while waiting and len(workers) < jobs:
                    workers.append(_started(request, resume))
                    _assign(workers, workers[-1], waiting, tasks)
                for worker in _ready(workers):
                    done[worker.number] = _outcome(worker, tasks[worker.number])
                    count += 1
                    report("scenes", count, len(tasks))
                    _assign(workers, worker, waiting, tasks)
            yield done.pop(number)
    finally:
        _end(workers, tasks)


def _assign(workers: list[_Worker], worker: _Worker, waiting: deque[int], tasks: Sequence[Task]) -> None:
    """Give a worker the next scene; dismiss it where there is none, or where it has died."""
    if waiting:
        worker.number = waiting.popleft()
        try:
            worker.line.send(tasks[worker.number])
            return
        except OSError:
            waiting.appendleft(worker.number)
    workers.remove(worker)
    worker.line.close()


def _started(request: Request, resume: bool) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there, request, resume), daemon=True)
    with without_interrupts():
        process.start()
    there.close()
    return _Worker(process, here, -1)


def _ready(workers: Sequence[_Worker]) -> list[_Worker]:
    """Workers that have answered or died; waits for the first."""
    heard = set(wait([each for worker in workers for each in (worker.line, worker.process.sentinel)]))
    return [worker for worker in workers if worker.line in heard or worker.process.sentinel in heard]


def _outcome(worker: _Worker, task: Task) -> Outcome:
    """What a worker answers, or what to say of a scene whose worker has died."""
    try:
        if worker.line.poll():
            answer: Outcome = worker.line.recv()
            return answer
    except (EOFError, OSError):
        pass
    worker.process.join(GRACE)
    recovered(task.folder)
    code = worker.process.exitcode
    how = f"signal {-code}" if code is not None and code < 0 else f"status {code}"
    why = "by the system if memory ran out, or by somebody; fewer positions or --jobs take less memory"
    return Outcome(BUG, f"{task.name}: its process was ended ({how}), {why}")


def _end(workers: Sequence[_Worker], tasks: Sequence[Task]) -> None:
    """End what still runs, and clear away what it leaves half done."""
    for worker in workers:
        worker.process.terminate()
    for worker in workers:
        worker.process.join(GRACE)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join(GRACE)
        worker.line.close()
        recovered(tasks[worker.number].folder)


def _work(line: Connection, request: Request, resume: bool) -> None:
    """What a worker does: scene after scene, until nobody asks any more."""
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = line.recv()
        except EOFError:
            return
        line.send(try_scene(task, request, resume, tell=lambda sentence: say(sentence, sys.stderr)))


def _die_with_parent() -> None:
    """End this process as soon as the one that started it has ended, however that came about."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
