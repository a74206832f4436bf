"""The deflection-report command: scenes in, one folder of results for each out.

Nothing heavy is imported before it is needed: `--help` answers at once.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from kinelast.cli.options import parsed
from kinelast.cli.terminal import fill_closed_streams, progress, say
from kinelast.outcome import BAD_INPUT, BUG, FAILED, FINE, Outcome, Task
from kinelast.scene.error import plain
from kinelast.stopping import StoppedError, stoppable

if TYPE_CHECKING:
    from kinelast.cli.terminal import Report
    from kinelast.request import Request

BY_SIGNAL, INTERRUPTED = 128, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    argv
        The arguments; those of the process where left out.

    Returns
    -------
    The exit status: 0 fine, 1 a check failed, 2 bad input, 3 an error of the program itself, 130 interrupted, 128 and
    the number of the signal that ended the run.
    """
    fill_closed_streams()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # before numpy is loaded: last digits do not depend on --jobs
    try:
        options = parsed(sys.argv[1:] if argv is None else argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else BAD_INPUT
    try:
        with stoppable():
            return _answer(options)
    except KeyboardInterrupt:
        return _stopped(INTERRUPTED, "")
    except StoppedError as stop:
        return _stopped(BY_SIGNAL + stop.number, "")
    except OSError as error:
        return _refuse(plain(f"{error.filename or ''} {error.strerror or error}".strip(), 300))
    except Exception:
        import traceback

        say(f"deflection-report: the program failed, please report this:\n{traceback.format_exc()}", sys.stderr)
        return BUG


def _answer(options: argparse.Namespace) -> int:
    """Do what is asked."""
    if options.version:
        return _version()
    if options.list:
        return _list()
    if not options.scenes:
        return _refuse("no scene was given: name a .toml file or a shipped scene, see --list")
    return _run(options)


def _refuse(message: str) -> int:
    say(f"deflection-report: {message}", sys.stderr)
    return BAD_INPUT


def _stopped(status: int, done: str) -> int:
    how = "interrupted" if status == INTERRUPTED else f"ended by signal {status - BY_SIGNAL}"
    say(f"{how}{done}; finished scenes are kept, --resume goes on from there", sys.stderr)
    return status


def _version() -> int:
    from importlib import metadata

    print(f"kinelast {metadata.version('kinelast')}")
    return FINE


def _list() -> int:
    import tomllib

    from kinelast.scene.shipped import shipped_scenes, shipped_structures

    scenes, structures = shipped_scenes(), shipped_structures()
    width = max(map(len, (*scenes, *structures)), default=0)
    for name, path in (*scenes.items(), *structures.items()):
        note = " (--structure)" if name in structures else ""
        title = tomllib.loads(path.read_text(encoding="utf-8")).get("title", "")
        say(f"{name:{width}}  {title}{note}", sys.stdout)
    return FINE


def _run(options: argparse.Namespace) -> int:
    """Compute all scenes, one line of output for each."""
    try:
        Path.cwd()
    except OSError:  # which libraries do not survive being imported in
        return _refuse("the working folder is gone: go to one that is there")
    from kinelast.tasks import result_names, scene_paths

    paths, problems = scene_paths(options.scenes)
    for problem in problems:
        _refuse(problem)
    names = result_names(paths)
    if isinstance(names, str):
        return _refuse(names)
    if options.out.exists() and not options.out.is_dir():
        return _refuse(f'-o: "{options.out}" is a file: name a folder')
    tasks = [Task(path, options.out / name, plain(str(name), 200)) for path, name in zip(paths, names, strict=True)]
    others = _structures if options.structure else _sweeps if options.sweep or options.design is not None else None
    if others:
        return others(tasks, options, BAD_INPUT if problems else FINE)
    request = _request(options)
    if isinstance(request, str):
        return _refuse(request)
    return max(BAD_INPUT if problems else FINE, _batch(tasks, options, request, len(problems)))


def _batch(tasks: Sequence[Task], options: argparse.Namespace, request: Request, refused: int) -> int:
    """Compute scenes, print how each went, and in the end how all went; the exit status."""
    outcomes: list[tuple[Task, Outcome]] = []
    begin, status = time.monotonic(), FINE
    try:
        with progress(options) as report:
            for task, outcome in zip(tasks, _outcomes(tasks, options, request, report), strict=True):
                outcomes.append((task, outcome))
                status = max(status, outcome.status)
                for question in outcome.questions:
                    say(question, sys.stderr)
                if outcome.status >= BAD_INPUT:
                    say(_named_once(outcome.line, task), sys.stderr)
                elif not options.quiet:
                    say(outcome.line, sys.stdout)
                if outcome.interrupted:
                    raise KeyboardInterrupt
    except (KeyboardInterrupt, StoppedError) as stop:
        status = INTERRUPTED if isinstance(stop, KeyboardInterrupt) else BY_SIGNAL + stop.number
        _stopped(status, f" after {len(outcomes)} of {len(tasks)} scenes")
    if len(tasks) + refused > 1:
        _summarize(outcomes, options)
        states = Counter(outcome.state for _, outcome in outcomes)
        states[FAILED] += refused
        if not options.quiet:
            counts = ", ".join(f"{states[state]} {state}" for state in ("done", "failed", "skipped"))
            say(f"{counts}, {time.monotonic() - begin:.1f} s", sys.stderr)
    return status


def _summarize(outcomes: Sequence[tuple[Task, Outcome]], options: argparse.Namespace) -> None:
    """A table of all scenes, where there is anything to tell."""
    from dataclasses import replace

    from kinelast.outputs.tables import summary_row, write_index, write_parquet, write_summary
    from kinelast.request import RequestError

    if not (outcomes or options.out.is_dir()):
        return
    rows = {}
    for task, outcome in outcomes:
        name = str(task.folder.relative_to(options.out))
        rows[name] = summary_row(replace(outcome, line=_named_once(outcome.line, task)), name)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        whole = write_summary(options.out, {row[0]: row for row in rows.values()})
        seconds = {name: outcome.seconds for name, (_, outcome) in zip(rows, outcomes, strict=True)}
        write_index(options.out, whole, seconds)
        write_parquet(options.out, whole)
    except (RequestError, OSError, ValueError) as error:
        say(f"deflection-report: summary of all scenes: {error}", sys.stderr)


def _named_once(line: str, task: Task) -> str:
    """An error without the scene's name before its file."""
    head = f"{task.name}: "
    return line.removeprefix(head) if line.startswith(f"{head}{plain(str(task.path), 600)}: ") else line


def _structures(tasks: Sequence[Task], options: argparse.Namespace, status: int) -> int:
    """The structure of every scene, printed and put into its folder."""
    from kinelast.structure.output import structure_outcome

    for task in tasks:
        outcome, text = structure_outcome(task)
        status = max(status, outcome.status)
        if outcome.status:
            say(_named_once(outcome.line, task), sys.stderr)
        elif not options.quiet:
            say(text, sys.stdout)
            say(outcome.line, sys.stdout)
    return status


def _sweeps(tasks: Sequence[Task], options: argparse.Namespace, status: int) -> int:
    """The designs of every scene's sweep, or one of them as a scene, one line of output for each scene."""
    from kinelast.sweep.output import Asked, try_design, try_sweep

    jobs = options.jobs or _cores()
    asked = Asked(options.positions, jobs, options.resume, options.most, options.scheduler, options.pages)

    def tell(sentence: str) -> None:
        if not options.quiet:
            say(sentence, sys.stderr)

    try:
        with progress(options) as report:
            for task in tasks:
                if options.design is None:
                    outcome = try_sweep(task, asked, report, tell)
                else:
                    outcome = try_design(task, options.design)
                status = max(status, outcome.status)
                if outcome.status >= BAD_INPUT:
                    say(_named_once(outcome.line, task), sys.stderr)
                elif not options.quiet:
                    say(outcome.line, sys.stdout)
    except (KeyboardInterrupt, StoppedError) as stop:
        return _stopped(INTERRUPTED if isinstance(stop, KeyboardInterrupt) else BY_SIGNAL + stop.number, "")
    return status


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


def _request(options: argparse.Namespace) -> Request | str:
    """What is asked of every scene, or what is wrong with that."""
    with _uncollected():
        from kinelast.request import Request, RequestError
        from kinelast.run import require_pictures

    unknown = _unknown_diagram(options.animate)
    if unknown:
        return unknown
    request = Request(
        fields=options.fields,
        stations=options.stations,
        check=next((one for one in options.check if isinstance(one, int)), None),
        nonlinear="nonlinear" in options.check,
        solid="solid" in options.check,
        theory=options.theory,
        accuracy=options.accuracy,
        speeds=options.speeds,
        animate=options.animate,
        frames=options.frames,
        picture=options.format,
        fps=options.fps,
        size=options.size,
        style=options.style,
        exaggeration=options.exaggeration,
        background=options.background,
        show=options.show,
        mesh=options.mesh,
        stills=options.stills,
        positions=options.positions,
        refine=options.refine,
        reachable=options.reachable,
        sensitivities=options.sensitivities,
        tolerances=options.tolerances,
        samples=options.samples,
        optimize=options.optimize,
        units=options.units,
        changes=tuple(options.set),
    )
    try:
        require_pictures(request)
    except RequestError as error:
        return str(error)
    return request


def _unknown_diagram(names: Sequence[str]) -> str:
    """What to say of the first diagram that there is none of; empty where there are all."""
    if not names:
        return ""
    from animations import DIAGRAMS
    from elastic import FIELDS
    from kinelast.scene.error import likely

    for name in names:
        if name not in (*DIAGRAMS, *FIELDS):
            near = likely(name, DIAGRAMS).partition("; there is")[0]  # all are listed anyhow
            return f'--animate: there is no diagram "{name}"{near}; all: {", ".join(DIAGRAMS)}'
    return ""


def _outcomes(
    tasks: Sequence[Task], options: argparse.Namespace, request: Request, report: Report
) -> Iterator[Outcome]:
    """The outcomes in the order of the scenes."""
    jobs = min(options.jobs or _cores(), len(tasks))
    if jobs > 1:
        from kinelast.cli.workers import side_by_side

        yield from side_by_side(tasks, jobs, request, options.resume, report)
        return
    from kinelast.run import try_scene

    def tell(sentence: str) -> None:
        if not options.quiet:
            say(sentence, sys.stderr)

    for number, task in enumerate(tasks):
        report(task.name, number, len(tasks))
        yield try_scene(task, request, options.resume, report, tell)


def _cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


if __name__ == "__main__":
    sys.exit(main())
