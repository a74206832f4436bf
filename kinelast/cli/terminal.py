"""Terminal interface of the command: arguments, printed lines and a progress bar."""

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NoReturn, TextIO

from kinelast.scene.error import likely, plain
from kinelast.tasks import Option, OptionError, are_checks
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.request import GROUPS, Batch, Request, options_of

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
    """Convert command-line arguments to the options for each scene and the options for the run.

    Raises
    ------
    SystemExit
        After the help or an error message has been printed.
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
    """Return the arguments before the argument "--", and the scenes after this argument."""
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
    """Return a function that calls `read`, and converts `OptionError` to an error of argparse."""

    def value(text: str) -> Any:
        try:
            return read(text)
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return value


def _with_bare(argv: Sequence[str], known: dict[str, Option]) -> list[str]:
    """Write the default value of an option such as --check into the arguments if the user gives no value.

    Otherwise argparse would take a scene that follows the option as the value of the option.
    """
    bare = {flag: option.bare for option in known.values() if option.bare is not None for flag in option.flags}
    following = (*argv[1:], "")
    return [
        f"{word}={','.join(map(str, bare[word]))}" if word in bare and not are_checks(after) else word
        for word, after in zip(argv, following, strict=False)
    ]


def _refuse(parser: argparse.ArgumentParser, word: str) -> NoReturn:
    """Exit with a message about an unknown option."""
    flags = [flag for action in parser._actions for flag in action.option_strings if flag.startswith("--")]
    parser.error(f'unknown option "{word}"{likely(word, flags) or "; --help lists all options"}')


def _require_consistent(parser: argparse.ArgumentParser, given: dict[str, Any], known: dict[str, Option]) -> None:
    """Exit with a message if two options exclude each other, or if an option needs another option that is missing."""
    for name in given:
        option = known[name]
        if option.belongs and not given.get(option.belongs):
            flag, needed = ((known[key].flags or (f"--{key}",))[0] for key in (name, option.belongs))
            parser.error(f"{flag} needs {needed}")
    if "changes" in given and given.keys() & {"sweep", "design"}:
        parser.error("--set only applies to reports: the numbers of a sweep are under [sweep]")
    if "changes" in given and "structure" in given:
        parser.error("--set only applies to reports: change the numbers of a structure in its file")
    if sum(isinstance(check, int) for check in set(given.get("checks", ()))) > 1:
        parser.error("--check: expected one number of elements")
    if "theory" in given and "accuracy" in given:
        parser.error("--accuracy chooses the theory: leave out --theory or --accuracy")


BAR_DELAY, LINE_INTERVAL = 1.0, 10.0  # [s] delay of the bar; interval of progress lines without a terminal
MAX_COUNTED_PARTS = 100  # progress through this many or more steps is printed as a percentage


def say(text: str, stream: TextIO | None) -> None:
    """Print lines. If a pipe is closed or a disk is full, discard this text and all later output to the stream.

    Control characters are escaped. Characters that the terminal cannot show become question marks.
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
    """Redirect a stream to the null device. Text in the buffer of the stream is discarded too."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def fill_closed_streams() -> None:
    """Open closed standard streams as the null device.

    Otherwise a result file could get the file descriptor of a standard stream.
    """
    for _ in range(3):
        spare = os.open(os.devnull, os.O_RDWR)
        if spare > 2:
            os.close(spare)
            return


@contextmanager
def listener(quiet: bool) -> Iterator[Progress]:
    """Yield a progress callback.

    On a terminal, the callback shows a bar. Otherwise it prints a line every `LINE_INTERVAL` seconds. If `quiet` is
    True, it prints nothing.
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
    """Progress callback that prints messages, but no progress."""

    def tell(self, sentence: str) -> None:
        """Print a message."""
        say(sentence, sys.stderr)


class _Lines(Sentences):
    """Progress callback that prints a line every `LINE_INTERVAL` seconds."""

    def __init__(self) -> None:
        self._start = self._last = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Print the stage, the fraction done, and the elapsed time."""
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
    """Progress callback that shows a bar. The bar appears when `show` is called."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._now: tuple[str, int, int] = ("", 0, 0)
        self._lock = threading.Lock()
        self._over = False

    def show(self) -> None:
        """Show the bar."""
        from rich import progress as bars
        from rich.console import Console

        columns = (
            bars.SpinnerColumn(),
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.MofNCompleteColumn(),
        )
        both = sys.stdout is not None and sys.stdout.isatty()  # stdout to a file must not pass through rich
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
        """Store the progress, and update the bar."""
        self._now = stage, done, total
        if self._bar is not None:
            words = plain(stage, 60).replace("[", r"\[")
            self._bar.update(self._task, description=words, completed=done, total=total or None)

    def stop(self) -> None:
        """Remove the bar."""
        with self._lock:
            self._over = True
            if self._bar is not None:
                self._bar.stop()
