"""Scenes side by side, each in a process of its own while it lasts."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kinelast.cli.terminal import say
from kinelast.outcome import BUG, Outcome, Task
from kinelast.outputs.outbox import recovered
from kinelast.processes import Lost, answers
from kinelast.run import try_scene

if TYPE_CHECKING:
    from kinelast.request import Request

Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class _Work:
    """What a process does with the scenes that it is given."""

    request: Request
    resume: bool

    def __call__(self, task: Task) -> Outcome:
        return try_scene(task, self.request, self.resume, tell=lambda sentence: say(sentence, sys.stderr))


def side_by_side(tasks: Sequence[Task], jobs: int, request: Request, resume: bool, report: Report) -> Iterator[Outcome]:
    """The outcomes of scenes in their order, computed in so many processes.

    A scene whose process dies is failed, the others go on. However this ends, no process is left behind, and what
    they leave half done is cleared away.
    """
    begun: set[Task] = set()
    found: dict[Task, Outcome] = {}

    def begin() -> Iterator[Task]:
        for task in tasks:
            begun.add(task)
            yield task

    coming = answers(_Work(request, resume), begin(), jobs)
    try:
        for number, task in enumerate(tasks):
            while task not in found:
                one, answer = next(coming)
                begun.discard(one)
                found[one] = _lost(one, answer.how) if isinstance(answer, Lost) else answer
                report("scenes", number + len(found), len(tasks))
            yield found.pop(task)
    finally:
        coming.close()
        for task in begun:
            recovered(task.folder)


def _lost(task: Task, how: str) -> Outcome:
    """What to say of a scene whose process has died."""
    recovered(task.folder)
    why = "by the system if memory ran out, or by somebody; fewer positions or --jobs take less memory"
    return Outcome(BUG, f"{task.name}: its process was ended ({how}), {why}")
