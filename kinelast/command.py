"""The deflection-report command: scenes in, one folder of results for each out.

Nothing heavy is imported before it is needed: `--help` answers at once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kinelast.output import Outcome, Request

FINE, CHECK_FAILED, BAD_INPUT, BUG, INTERRUPTED = 0, 1, 2, 3, 130
ELEMENTS = 16
EPILOG = """\
exit status: 0 fine, 1 a check failed, 2 bad input (the other scenes were still computed)

examples:
  deflection-report steel_four_bar
  deflection-report mine.toml --check --animate deflection --frames 120 -o results
  deflection-report designs/*.toml --jobs 4 --resume --quiet
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    argv
        The arguments; those of the process where left out.

    Returns
    -------
    The exit status: 0 fine, 1 a check failed, 2 bad input, 3 an error of the program itself.
    """
    try:
        options = _parser().parse_args(_with_elements(sys.argv[1:] if argv is None else argv))
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else BAD_INPUT
    try:
        if options.version:
            return _version()
        if options.list:
            return _list()
        if not options.scenes:
            return _refuse("no scene was given: name a .toml file or a shipped scene, see --list")
        return _run(options)
    except KeyboardInterrupt:
        print("interrupted; finished scenes are kept, --resume goes on from there", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="deflection-report",
        description="How much the links of a moving planar mechanism bend, turn and stretch under their own inertia.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="a scene file (.toml) or the name of a shipped scene")
    add(
        "-o",
        "--out",
        type=Path,
        default=Path("deflection-report"),
        metavar="OUT",
        help="folder for the results [%(default)s]",
    )
    add("--list", action="store_true", help="list the shipped scenes and stop")
    add("--positions", type=_at_least(2), metavar="N", help="positions over the cycle, instead of the scene's own")
    add("--fields", action="store_true", help="also write all fields along all links (fields.npz)")
    add(
        "--stations",
        type=_at_least(2),
        default=101,
        metavar="N",
        help="stations along a link for --fields [%(default)s]",
    )
    add(
        "--check",
        nargs="?",
        type=_at_least(1),
        const=ELEMENTS,
        metavar="ELEMENTS",
        help=f"compare with finite elements, so many to a beam [{ELEMENTS}] (check.json)",
    )
    add(
        "--animate",
        type=_names,
        default=(),
        metavar="DIAGRAM,...",
        help="movies: deflection, slope, moment, ... (see docs)",
    )
    add("--frames", type=_at_least(1), metavar="N", help="frames of a movie [one a position, 120 at most]")
    add("--format", choices=("mp4", "gif", "png"), default="mp4", help="of the movies; png: stills [%(default)s]")
    add("--mesh", action="store_true", help="also write a mesh for every position, for ParaView (mesh/*.vtu)")
    add("--refine", action="store_true", help="search the largest values between the positions too")
    add("--reachable", action="store_true", help="leave out positions that the mechanism cannot reach")
    add("--jobs", type=_at_least(1), default=1, metavar="N", help="scenes computed side by side [%(default)s]")
    add("--resume", action="store_true", help="skip scenes whose results are there, from the same file and options")
    add("--quiet", action="store_true", help="print nothing but errors")
    add("--version", action="store_true", help="print the version and stop")
    return parser


def _with_elements(argv: Sequence[str]) -> list[str]:
    """The arguments, with the number of elements filled in where a scene follows a bare --check."""
    following = [*argv[1:], ""]
    return [
        f"--check={ELEMENTS}" if word == "--check" and not after.isdecimal() else word
        for word, after in zip(argv, following, strict=True)
    ]


def _at_least(least: int) -> Callable[[str], int]:
    def count(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"expected a whole number from {least} up, not {text!r}")
        return value

    return count


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))


def _refuse(message: str) -> int:
    print(f"deflection-report: {message}", file=sys.stderr)
    return BAD_INPUT


def _version() -> int:
    from importlib import metadata

    print(f"kinelast {metadata.version('kinelast')}")
    return FINE


def _list() -> int:
    import tomllib

    from kinelast.scene_files import shipped_scenes

    scenes = shipped_scenes()
    width = max(map(len, scenes), default=0)
    for name, path in scenes.items():
        print(f"{name:{width}}  {tomllib.loads(path.read_text(encoding='utf-8')).get('title', '')}")
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
    request = _request(options)
    if isinstance(request, str):
        return _refuse(request)
    status = BAD_INPUT if problems else FINE
    with _progress(options, len(paths)) as report:
        for outcome in _outcomes(paths, options, request, report):
            status = max(status, outcome.status)
            if outcome.status >= BAD_INPUT:
                print(outcome.line, file=sys.stderr)
            elif not options.quiet:
                print(outcome.line, flush=True)
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

        from kinelast.scene_files import shipped_scenes

        shipped = shipped_scenes()
        if scene in shipped:
            paths.append(shipped[scene])
            continue
        close = get_close_matches(scene, shipped, 1)
        advice = f'did you mean "{close[0]}"?' if close else "--list shows the shipped scenes"
        problems.append(f'"{scene}" is neither a .toml file nor a shipped scene: {advice}')
    return paths, problems


def _request(options: argparse.Namespace) -> Request | str:
    """What is asked of every scene, or what is wrong with that."""
    from kinelast.output import Request, RequestError, require_pictures

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


Report = Callable[[str, int, int], None]


def _outcomes(paths: list[Path], options: argparse.Namespace, request: Request, report: Report) -> Iterator[Outcome]:
    """The outcomes in the order of the scenes."""
    from kinelast.output import try_scene

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
    import os

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
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def report(stage: str, done: int, total: int) -> None:
            bar.update(task, description=stage, completed=done, total=total)

        yield report
