"""The deflection-report command. It computes scenes and writes a result folder for each scene.

Scenes can be computed in parallel processes. Modules are imported when they are needed, so that `--help` is fast.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from kinelast.cli.instead import instead_of_reports
from kinelast.cli.terminal import Sentences, fill_closed_streams, listener, parsed, say
from kinelast.tasks.progress import SILENT, Progress, StoppedError, ignored_interrupts, signals_held_back, stoppable
from kinelast.tasks.request import Batch, Request, RequestError
from kinelast.tasks.task import BAD_INPUT, BUG, FAILED, FINE, Outcome, Task, missing_package, result_names, scene_paths
from kinelast.values.error import SceneError, plain

if TYPE_CHECKING:
    from kinelast.tasks.processes import Lost


class SceneWork(Struct, frozen=True):
    """Function that runs a task. It can be pickled, so that other processes can run it too.

    The options determine the kind of task: write a report, analyse the structure, compute a sweep, or write the scene
    of one design of a sweep.
    """

    request: Request
    batch: Batch

    def __call__(self, task: Task, progress: Progress | None = None) -> Outcome:
        """Run a task and return its outcome.

        Without `progress`, messages are printed, but no progress. With the option --quiet, messages are not printed
        either.
        """
        with _without_collection():
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
def _without_collection() -> Iterator[None]:
    """Turn off garbage collection during imports. This shortens a short run by a seventh.

    Later garbage collections ignore the imported objects.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        _freeze_imports()
        if was_enabled:
            gc.enable()


NEW_OBJECTS = 20_000  # number of new objects per garbage collection; large, because most objects live long


@cache
def _freeze_imports() -> None:
    """Exclude the imported modules from garbage collection, and make collections rarer.

    Further calls in the same process have no effect.
    """
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)


def one_by_one(tasks: Sequence[Task], work: SceneWork, progress: Progress) -> Iterator[Outcome]:
    """Compute scenes one after the other in this process, and yield their outcomes."""
    for number, task in enumerate(tasks):
        progress(task.name, number, len(tasks))
        yield work(task, progress)


def side_by_side(tasks: Sequence[Task], work: SceneWork, jobs: int, progress: Progress) -> Iterator[Outcome]:
    """Compute scenes in parallel processes, and yield their outcomes in the order of `tasks`.

    `jobs` is the number of processes; 0 starts one process per core. If a process dies, its scene fails, and the other
    scenes continue. At the end, all processes are terminated and incomplete result folders are removed.
    """
    from kinelast.outputs.outbox import recovered
    from kinelast.tasks.processes import Lost, cores, map_surviving

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
    """Return the outcome of a scene after its process died."""
    from kinelast.outputs.outbox import recovered

    recovered(task.folder)
    why = "if memory ran out, use fewer positions or --jobs"
    return Outcome(BUG, f"{task.name}: its process died ({end.how}); {why}")


BY_SIGNAL, INTERRUPTED = 128, 130  # exit status: 128 + number of the signal; keyboard interrupt


def main(argv: Sequence[str]) -> int:
    """Run the command.

    Parameters
    ----------
    argv
        Command-line arguments without the name of the program.

    Returns
    -------
    Exit status: 0 for success, 1 if a check fails or a limit or accuracy is not met, 2 for invalid input, 3 for an
    error in the program, 130 if interrupted, and 128 plus the number of the signal if a signal ended the run.
    """
    fill_closed_streams()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # before numpy is imported; results then do not depend on --jobs
    try:
        with stoppable():
            with signals_held_back():  # argparse does not handle an interrupt
                requested = parsed(argv)
            return _answer(*requested)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else BAD_INPUT
    except (KeyboardInterrupt, StoppedError) as stop:
        return _stopped(stop, "")
    except Exception as error:
        return _failed(error)


def _answer(request: Request, batch: Batch) -> int:
    """Carry out an option such as --list if one is given. Otherwise compute the scenes. Return the exit status."""
    if (answer := instead_of_reports(batch)) is not None:
        return answer()
    if not batch.scenes:
        return _refuse("no scene was given: name a .toml file or a shipped scene, see --list")
    try:
        Path.cwd()
    except OSError:  # some libraries cannot be imported if there is no working folder
        return _refuse("the working folder no longer exists: change to another folder")
    return _run(request, batch)


def _refuse(message: str) -> int:
    say(f"deflection-report: {message}", sys.stderr)
    return BAD_INPUT


def _failed(error: Exception) -> int:
    """Print a message about an error that does not belong to a scene. Return the exit status."""
    if isinstance(error, (RequestError, SceneError)):
        return _refuse(str(error))
    if isinstance(error, OSError):
        return _refuse(plain(f"{error.filename or ''} {error.strerror or error}".strip(), 300))
    if words := missing_package(error):
        return _refuse(words)
    import traceback

    say(f"deflection-report: the program failed, please report this:\n{traceback.format_exc()}", sys.stderr)
    return BUG


def _stopped(stop: BaseException, done: str) -> int:
    """Print a message about an interrupt or stop signal, followed by the text `done`. Return the exit status."""
    number = stop.number if isinstance(stop, StoppedError) else 0
    how = f"terminated by signal {number}" if number else "interrupted"
    say(f"{how}{done}", sys.stderr)
    return BY_SIGNAL + number if number else INTERRUPTED


def _run(request: Request, batch: Batch) -> int:
    """Compute all scenes, print their outcomes, and return the exit status."""
    paths, problems = scene_paths(batch.scenes)
    for problem in problems:
        _refuse(problem)
    names = result_names(paths)
    if isinstance(names, str):
        return _refuse(names)
    if batch.out.exists() and not batch.out.is_dir():
        return _refuse(f'-o: "{batch.out}" is a file: name a folder')
    if request.tables:
        from kinelast.outputs.table import require_formats

        require_formats(request.tables)
    if request.animate:
        from kinelast.outputs.pictures import require_rendering

        require_rendering()
    tasks = [Task(path, batch.out / name, plain(str(name), 200)) for path, name in zip(paths, names, strict=True)]
    outcomes: list[tuple[Task, Outcome]] = []
    begin, status = time.monotonic(), BAD_INPUT if problems else FINE
    try:
        with listener(batch.quiet) as progress:
            work, jobs = SceneWork(request, batch), batch.jobs
            apart = jobs != 1 and len(tasks) > 1 and not batch.sweep  # a sweep runs its own designs in parallel
            coming = side_by_side(tasks, work, jobs, progress) if apart else one_by_one(tasks, work, progress)
            for task, outcome in zip(tasks, coming, strict=True):
                outcomes.append((task, outcome))
                status = max(status, outcome.status)
                _tell(task, outcome, batch.quiet)
                if outcome.interrupted:
                    raise KeyboardInterrupt
    except (KeyboardInterrupt, StoppedError) as stop:
        with ignored_interrupts():
            kept = "finished scenes are kept, continue with --resume"
            status = _stopped(stop, f" after {len(outcomes)} of {len(tasks)} scenes; {kept}")
            _close(outcomes, len(tasks), len(problems), batch, begin, "parquet" in request.tables)
        return status
    _close(outcomes, len(tasks), len(problems), batch, begin, "parquet" in request.tables)
    return status


def _close(
    outcomes: Sequence[tuple[Task, Outcome]], tasks: int, refused: int, batch: Batch, begin: float, parquet: bool
) -> None:
    """Print the number of finished, failed and skipped scenes, and write a table of all scenes.

    For a single scene, and for structures and sweeps, do nothing. `refused` is the number of invalid scene arguments.
    If `parquet` is True, the table is also written as Parquet.
    """
    if tasks + refused < 2 or batch.structure or batch.sweep or batch.design is not None:
        return
    if outcomes:
        _summarize(outcomes, batch.out, parquet)
    states = Counter(outcome.state for _, outcome in outcomes)
    states[FAILED] += refused
    if not batch.quiet:
        counts = ", ".join(f"{states[state]} {state}" for state in ("done", "failed", "skipped"))
        say(f"{counts}, {time.monotonic() - begin:.1f} s", sys.stderr)


def _tell(task: Task, outcome: Outcome, quiet: bool) -> None:
    """Print the outcome of a scene. If `quiet` is True, print only questions and errors."""
    for question in outcome.questions:
        say(question, sys.stderr)
    if outcome.status >= BAD_INPUT:
        say(_named_once(outcome.line, task), sys.stderr)
    elif not quiet:
        say(outcome.line, sys.stdout)


def _named_once(line: str, task: Task) -> str:
    """Remove the name of the scene from an error message if the path of the scene follows the name."""
    head = f"{task.name}: "
    return line.removeprefix(head) if line.startswith(f"{head}{plain(str(task.path), 600)}: ") else line


def _summarize(outcomes: Sequence[tuple[Task, Outcome]], out: Path, parquet: bool) -> None:
    """Write the table of all scenes, also as Parquet if `parquet` is True."""
    from kinelast.outputs.batch import summary_row, write_batch

    rows = {}
    for task, outcome in outcomes:
        name = str(task.folder.relative_to(out))
        rows[name] = summary_row(replace(outcome, line=_named_once(outcome.line, task)), name)
    try:
        out.mkdir(parents=True, exist_ok=True)
        seconds = {name: outcome.seconds for name, (_, outcome) in zip(rows, outcomes, strict=True)}
        write_batch(out, {row[0]: row for row in rows.values()}, seconds, parquet)
    except (RequestError, OSError, ValueError) as error:
        say(f"deflection-report: summary of all scenes: {error}", sys.stderr)
