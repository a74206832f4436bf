"""The deflection-report command: scenes in, one folder of results for each out.

Nothing heavy is imported before it is needed: `--help` answers at once.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from kinelast.options import parsed

if TYPE_CHECKING:
    from kinelast.folder import Request
    from kinelast.run import Outcome

FINE, BAD_INPUT, INTERRUPTED = 0, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    argv
        The arguments; those of the process where left out.

    Returns
    -------
    The exit status: 0 fine, 1 a check failed, 2 bad input, 3 an error of the program itself, 130 interrupted.
    """
    try:
        options = parsed(sys.argv[1:] if argv is None else argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else BAD_INPUT
    try:
        return _answer(options)
    except BrokenPipeError:  # whoever reads the output has seen enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FINE
    except KeyboardInterrupt:
        print("interrupted; finished scenes are kept, --resume goes on from there", file=sys.stderr)
        return INTERRUPTED


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
    _say(f"deflection-report: {message}", sys.stderr)
    return BAD_INPUT


def _say(line: str, stream: TextIO) -> None:
    """Print a line, with a question mark for what the terminal has no letter for."""
    encoding = stream.encoding or "utf-8"
    print(line.encode(encoding, "replace").decode(encoding), file=stream, flush=True)


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
        _say(f"{name:{width}}  {title}{note}", sys.stdout)
    return FINE


def _run(options: argparse.Namespace) -> int:
    """Compute all scenes, one line of output for each."""
    paths, problems = _resolved(options.scenes)
    for problem in problems:
        _refuse(problem)
    names = [path.stem for path in paths]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        both = " and ".join(str(path) for path in paths if path.stem == twice[0])
        return _refuse(f'two scenes are named "{twice[0]}" and would share a folder: {both}')
    if options.structure:
        return _structures(paths, options, BAD_INPUT if problems else FINE)
    if options.out.exists() and not options.out.is_dir():
        return _refuse(f'-o: "{options.out}" is a file: name a folder')
    request = _request(options)
    if isinstance(request, str):
        return _refuse(request)
    status = BAD_INPUT if problems else FINE
    with _progress(options, len(paths)) as report:
        for path, outcome in zip(paths, _outcomes(paths, options, request, report), strict=True):
            status = max(status, outcome.status)
            if outcome.status >= BAD_INPUT:
                _say(_named_once(outcome.line, path), sys.stderr)
            elif not options.quiet:
                _say(outcome.line, sys.stdout)
    return status


def _named_once(line: str, path: Path) -> str:
    """An error without the scene's name before its file."""
    return line.removeprefix(f"{path.stem}: ") if line.startswith(f"{path.stem}: {path}: ") else line


def _structures(paths: Sequence[Path], options: argparse.Namespace, status: int) -> int:
    """The structure of every scene, printed and put into its folder."""
    from kinelast.structure.output import structure_outcome

    for path in paths:
        text, line = structure_outcome(path, options.out)
        if not text:
            status = BAD_INPUT
            _say(_named_once(line, path), sys.stderr)
        elif not options.quiet:
            _say(text, sys.stdout)
            _say(line, sys.stdout)
    return status


def _resolved(scenes: Sequence[str]) -> tuple[list[Path], list[str]]:
    """The files of the scenes, and what is wrong with those that have none."""
    paths, problems = [], []
    for scene in scenes:
        path = Path(scene)
        if path.suffix == ".toml" or path.is_file():
            paths.append(path)
            continue
        from difflib import get_close_matches

        from kinelast.scene.shipped import shipped_scenes, shipped_structures

        shipped = {**shipped_structures(), **shipped_scenes()}
        if scene in shipped:
            paths.append(shipped[scene])
            continue
        close = get_close_matches(scene, shipped, 1)
        advice = f'did you mean "{close[0]}"?' if close else "--list shows the shipped scenes"
        problems.append(f'"{scene}" is neither a .toml file nor a shipped scene: {advice}')
    return paths, problems


def _request(options: argparse.Namespace) -> Request | str:
    """What is asked of every scene, or what is wrong with that."""
    from kinelast.folder import Request, RequestError
    from kinelast.run import require_pictures

    unknown = _unknown_diagram(options.animate)
    if unknown:
        return unknown
    request = Request(
        fields=options.fields,
        stations=options.stations,
        check=options.check,
        animate=options.animate,
        frames=options.frames,
        picture=options.format,
        mesh=options.mesh,
        positions=options.positions,
        refine=options.refine,
        reachable=options.reachable,
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


Report = Callable[[str, int, int], None]


def _outcomes(paths: list[Path], options: argparse.Namespace, request: Request, report: Report) -> Iterator[Outcome]:
    """The outcomes in the order of the scenes."""
    from kinelast.run import try_scene

    if options.jobs == 1 or len(paths) < 2:
        for number, path in enumerate(paths):
            report(path.stem, number, len(paths))
            yield try_scene(path, options.out, request, options.resume, report)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from functools import partial

    work = partial(try_scene, out=options.out, request=request, resume=options.resume)
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(options.jobs, len(paths)), spawn, _one_thread) as pool:
        try:
            for number, outcome in enumerate(pool.map(work, paths), 1):
                report("scenes", number, len(paths))
                yield outcome
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _one_thread() -> None:
    """Keep the linear algebra of a worker on one core: the scenes run side by side already."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")


@contextmanager
def _progress(options: argparse.Namespace, scenes: int) -> Iterator[Report]:
    """A bar on a terminal where the run may take a while; elsewhere the lines of output are progress enough."""
    long = scenes > 1 or options.check or options.animate or options.mesh
    if options.quiet or not long or not sys.stderr.isatty():
        yield lambda stage, done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    both = sys.stdout.isatty()  # lines that go to a file must not be caught for the terminal
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=both) as bar:
        task = bar.add_task("", total=None)

        def report(stage: str, done: int, total: int) -> None:
            bar.update(task, description=stage, completed=done, total=total)

        yield report
