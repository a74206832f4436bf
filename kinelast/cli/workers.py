"""The work on the scenes of a batch, one after the other or side by side in processes."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from kinelast.cli.terminal import Sentences
from kinelast.process.progress import SILENT, Progress
from kinelast.tasks.outcome import BUG, Outcome, Task
from kinelast.tasks.request import Batch, Request

if TYPE_CHECKING:
    from kinelast.process.processes import Lost


@dataclass(frozen=True)
class SceneWork:
    """The work on a scene, in any process: its report, its structure, its sweep, or one design of that."""

    request: Request
    batch: Batch

    def __call__(self, task: Task, progress: Progress | None = None) -> Outcome:
        """The outcome; without a listener to its progress, sentences alone are said."""
        with _uncollected():
            do = self._chosen()
        return do(task, progress or (SILENT if self.batch.quiet else Sentences()))

    def _chosen(self) -> Callable[[Task, Progress], Outcome]:
        request, batch = self.request, self.batch
        if batch.structure:
            from kinelast.structure.output import try_structure

            return try_structure
        if batch.design is not None:
            from kinelast.sweep.output import try_design

            return partial(try_design, batch.design)
        if batch.sweep:
            from kinelast.sweep.output import try_sweep

            return partial(try_sweep, request, batch)
        from kinelast.runs.run import try_scene

        return partial(try_scene, request, batch.resume)


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without looking for garbage: imports leave none, and looking through all that they make takes a while."""
    looks = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if looks:
            gc.enable()


def one_by_one(tasks: Sequence[Task], work: SceneWork, progress: Progress) -> Iterator[Outcome]:
    """The outcomes of scenes, computed in this process."""
    for number, task in enumerate(tasks):
        progress(task.name, number, len(tasks))
        yield work(task, progress)


def side_by_side(tasks: Sequence[Task], work: SceneWork, jobs: int, progress: Progress) -> Iterator[Outcome]:
    """The outcomes of scenes in their order, computed in so many processes, of 0 as many as cores.

    A scene whose process dies is failed, the others go on. However this ends, no process is left behind, and what
    they leave half done is cleared away.
    """
    from kinelast.outputs.outbox import recovered
    from kinelast.process.processes import Lost, cores, map_surviving

    begun: set[Task] = set()
    ready: dict[Task, Outcome] = {}

    def begin() -> Iterator[Task]:
        for task in tasks:
            begun.add(task)
            yield task

    coming = map_surviving(work, begin(), min(jobs or cores(), len(tasks)))
    try:
        for number, task in enumerate(tasks):
            while task not in ready:
                done, answer = next(coming)
                begun.discard(done)
                ready[done] = _lost(done, answer) if isinstance(answer, Lost) else answer
                progress("scenes", number + len(ready), len(tasks))
            yield ready.pop(task)
    finally:
        coming.close()
        for task in begun:
            recovered(task.folder)


def _lost(task: Task, end: Lost) -> Outcome:
    """The outcome of a scene after the death of its process."""
    from kinelast.outputs.outbox import recovered

    recovered(task.folder)
    why = "by the system if memory ran out, or by somebody; fewer positions or --jobs take less memory"
    return Outcome(BUG, f"{task.name}: its process was ended ({end.how}), {why}")
