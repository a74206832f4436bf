"""Terminal interface of the command `deflection-report`: options, output streams, and progress."""

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NoReturn, TextIO

from kinelast.tasks import Option, OptionError, are_checks
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.request import GROUPS, Batch, Request, options_of
from kinelast.values.error import likely, plain

EPILOG = """\
exit status: 0 success, 1 a limit is not met or cannot be judged, a requested accuracy is not reached, or a check
fails, 2 invalid input (other scenes are still computed), 3 an error in the program, 130 interrupted, 128 plus the
number of the signal that terminated the run (143: SIGTERM)

examples:
  deflection-report steel_four_bar
  deflection-report quick_return --structure
  deflection-report mine.toml --check --animate deflection --frames 120 -o results
  deflection-report steel_four_bar --accuracy "2 %" --check nonlinear
  deflection-report designs --jobs 0 --resume --quiet
"""


def parsed(argv: Sequence[str]) -> tuple[Request, Batch]:
    """Convert command-line arguments to `Request` (options for each scene) and `Batch` (options for the run).

    Raises
    ------
    SystemExit
        The help or an error message has been printed.
    """
    known = options_of(Batch, Request)
    parser = _parser(known)
    words, behind = _parted(argv)
    space, unknown = parser.parse_known_intermixed_args(_with_bare(words, known))
    given: dict[str, Any] = {name: tuple(value) if known[name].many else value for name, value in vars(space).items()}
    given["scenes"] = (*given.get("scenes", ()), *behind)
    if unknown:
        _refuse(parser, unknown[0].partition("=")[0])
    _require_consistent(parser, given, known)
    mine = options_of(Request)
    return (
        Request(**{name: value for name, value in given.items() if name in mine}),
        Batch(**{name: value for name, value in given.items() if name not in mine}),
    )


def _parted(argv: Sequence[str]) -> tuple[Sequence[str], Sequence[str]]:
    """Return the arguments before "--", and the arguments after "--", which are names of scenes."""
    at = argv.index("--") if "--" in argv else len(argv)
    return argv[:at], argv[at + 1 :]


def _parser(known: dict[str, Option]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="deflection-report",
        usage="deflection-report SCENE ... [options]",
        description="Computes how much the links of a moving planar mechanism deform under inertia and loads.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,
    )
    groups = {group: parser.add_argument_group(group) for group in GROUPS}
    for name, option in known.items():
        shown = f"{option.help} [{option.default}]" if option.default else option.help
        words: dict[str, Any] = {"help": shown.replace("%", "%%")}
        if option.takes_value:
            words |= {"metavar": option.metavar or None, "type": _typed(option.read), "choices": option.choices or None}
        if not option.flags[0].startswith("-"):
            words["nargs"] = "*"
        else:
            words["dest"] = name
            if option.bare is not None:
                words |= {"nargs": "?", "const": option.bare, "action": "extend"}
            elif option.many:
                words["action"] = "append"
            elif not option.takes_value:
                words["action"] = "store_true"
        groups[option.group].add_argument(*option.flags, **words)
    return parser


def _typed(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a function that calls `read` and raises `ArgumentTypeError` if `read` raises `OptionError`."""

    def value(text: str) -> Any:
        try:
            return read(text)
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return value


def _with_bare(argv: Sequence[str], known: dict[str, Option]) -> list[str]:
    """Return a copy of the arguments in which options without a value, such as --check, have their default value.

    Without this value, argparse would interpret a scene after --check as the value of --check.
    """
    bare = {flag: option.bare for option in known.values() if option.bare is not None for flag in option.flags}
    following = (*argv[1:], "")
    return [
        f"{word}={','.join(map(str, bare[word]))}" if word in bare and not are_checks(after) else word
        for word, after in zip(argv, following, strict=False)
    ]


def _refuse(parser: argparse.ArgumentParser, word: str) -> NoReturn:
    """Print a message about the unknown option `word`, and exit."""
    flags = [flag for action in parser._actions for flag in action.option_strings if flag.startswith("--")]
    parser.error(f'unknown option "{word}"{likely(word, flags) or "; --help lists all options"}')


def _require_consistent(parser: argparse.ArgumentParser, given: dict[str, Any], known: dict[str, Option]) -> None:
    """Print a message and exit if two options exclude each other, or if an option needs another option."""
    for name in given:
        option = known[name]
        if option.belongs and not given.get(option.belongs):
            flag, needed = ((known[key].flags or (f"--{key}",))[0] for key in (name, option.belongs))
            parser.error(f"{flag} needs {needed}")
    asked = [name for name, value in given.items() if value is not None and value is not False]
    task = next((name for name in ("sweep", "design", "structure") if name in asked), "")
    outputs = [name for name in asked if known[name].writes or name in ("animate", "columns")]
    written = [name for name in outputs if name in Request.__struct_fields__]
    if task and written:
        flag = (known[written[0]].flags or (f"--{written[0]}",))[0]
        parser.error(f"{flag} belongs to a report, which --{task} does not write: run the command twice")
    if "changes" in given and given.keys() & {"sweep", "design"}:
        parser.error("--set only applies to reports: the numbers of a sweep are under [sweep]")
    if "changes" in given and "structure" in given:
        parser.error("--set only applies to reports: change the numbers of a structure in its file")
    if sum(isinstance(check, int) for check in set(given.get("checks", ()))) > 1:
        parser.error("--check: expected one number of elements")
    if "theory" in given and "accuracy" in given:
        parser.error("--accuracy chooses the theory: leave out --theory or --accuracy")


# [s] time before the progress bar appears. Without a terminal: time between two lines of progress.
BAR_DELAY, LINE_INTERVAL = 1.0, 10.0
# if a stage of a run has at least this many steps, its progress is printed as a percentage
MAX_COUNTED_PARTS = 100


def say(text: str, stream: TextIO | None) -> None:
    """Print text to a stream. If writing fails, discard the text and all later output to the stream.

    Writing fails, for example, if the stream is a closed pipe or a file on a full disk. Control characters in the text
    are escaped. Characters that the encoding of the stream does not contain become question marks.
    """
    if stream is None:
        return
    encoding = stream.encoding or "utf-8"
    lines = "\n".join(plain(line, len(line)) for line in text.split("\n"))
    try:
        print(lines.encode(encoding, "replace").decode(encoding), file=stream, flush=True)
    except (OSError, ValueError) as error:
        _mute(stream)
        if not isinstance(error, BrokenPipeError) and stream is not sys.stderr:
            say(f"deflection-report: printing failed: {error}", sys.stderr)


def _mute(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that buffered text and all later output are discarded."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def fill_closed_streams() -> None:
    """Connect each closed standard stream (stdin, stdout or stderr) to the null device.

    Otherwise the operating system could give the file descriptor of a closed stream to a result file. Text for the
    closed stream would then be written to the result file.
    """
    for _ in range(3):
        spare = os.open(os.devnull, os.O_RDWR)
        if spare > 2:
            os.close(spare)
            return


@contextmanager
def listener(quiet: bool) -> Iterator[Progress]:
    """Yield a progress callback for a run.

    On a terminal, the callback shows a progress bar. Without a terminal, the callback prints a line of progress every
    `LINE_INTERVAL` seconds. If `quiet` is True, the callback prints nothing.
    """
    if quiet:
        yield SILENT
        return
    if not sys.stderr or not sys.stderr.isatty():
        yield _Lines()
        return
    bar = _Bar()
    timer = threading.Timer(BAR_DELAY, bar.show)
    timer.daemon = True
    timer.start()
    try:
        yield bar
    finally:
        timer.cancel()
        bar.stop()


class Sentences(Progress):
    """Progress callback that prints messages to stderr but does not print progress."""

    def tell(self, sentence: str) -> None:
        """Print a message."""
        say(sentence, sys.stderr)


class _Lines(Sentences):
    """Progress callback that prints a line of progress every `LINE_INTERVAL` seconds."""

    def __init__(self) -> None:
        self._start = self._last = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Print the stage of the run, the finished fraction of the stage, and the elapsed time of the run."""
        now = time.monotonic()
        if now > self._last + LINE_INTERVAL and done < total:
            self._last = now
            share = (
                ""
                if total == 1
                else f" {done} of {total},"
                if total < MAX_COUNTED_PARTS
                else f" {100 * done / total:.0f} %,"
            )
            say(f"{stage},{share} {now - self._start:.0f} s", sys.stderr)


class _Bar(Sentences):
    """Progress callback that shows a progress bar. The bar is hidden until `show` is called."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._now: tuple[str, int, int] = ("", 0, 0)
        self._lock = threading.Lock()
        self._over = False

    def show(self) -> None:
        """Show the progress bar."""
        from rich import progress as bars
        from rich.console import Console

        columns = (
            bars.SpinnerColumn(),
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.MofNCompleteColumn(),
        )
        both = sys.stdout is not None and sys.stdout.isatty()  # if stdout is a file, rich must not redirect it
        with self._lock:
            if self._over:
                return
            console = Console(stderr=True)
            self._bar = bars.Progress(
                *columns, bars.TimeElapsedColumn(), console=console, transient=True, redirect_stdout=both
            )
            self._task = self._bar.add_task("", total=None)
            self._bar.start()
        self(*self._now)

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Store the progress and, if the progress bar is visible, update the bar."""
        self._now = stage, done, total
        if self._bar is not None:
            words = plain(stage, 60).replace("[", r"\[")
            self._bar.update(self._task, description=words, completed=done, total=total or None)

    def stop(self) -> None:
        """Remove the progress bar."""
        with self._lock:
            self._over = True
            if self._bar is not None:
                self._bar.stop()
