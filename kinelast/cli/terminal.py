"""Terminal interface of the command: parsed arguments, printed lines and a progress bar."""

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
exit status: 0 fine, 1 a limit is not kept or cannot be judged, a requested accuracy is not reached, or a check failed,
2 bad input (the other scenes are still computed), 3 an error of the program, 130 interrupted, 128 plus the number of a
signal that terminated the run (143: SIGTERM)

examples:
  deflection-report steel_four_bar
  deflection-report quick_return --structure
  deflection-report mine.toml --check --animate deflection --frames 120 -o results
  deflection-report steel_four_bar --accuracy "2 %" --check nonlinear
  deflection-report designs --jobs 0 --resume --quiet
"""


def parsed(argv: Sequence[str]) -> tuple[Request, Batch]:
    """Convert arguments to a request and a batch.

    Raises
    ------
    SystemExit
        After printing help or an error message.
    """
    known = options_of(Batch, Request)
    parser = _parser(known)
    words, behind = _parted(argv)
    space, unknown = parser.parse_known_intermixed_args(_with_bare(words, known))
    given: dict[str, Any] = {name: tuple(value) if known[name].many else value for name, value in vars(space).items()}
    given["scenes"] = (*given.get("scenes", ()), *behind)
    if unknown:
        _refuse(parser, unknown[0].partition("=")[0])
    _require_fitting(parser, given, known)
    mine = options_of(Request)
    return (
        Request(**{name: value for name, value in given.items() if name in mine}),
        Batch(**{name: value for name, value in given.items() if name not in mine}),
    )


def _parted(argv: Sequence[str]) -> tuple[Sequence[str], Sequence[str]]:
    """Return the arguments before "--" and the scenes after it."""
    at = argv.index("--") if "--" in argv else len(argv)
    return argv[:at], argv[at + 1 :]


def _parser(known: dict[str, Option]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="deflection-report",
        usage="deflection-report SCENE ... [options]",
        description="How much the links of a moving planar mechanism bend, turn and stretch under their own inertia.",
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
    """Return a reader that raises its message as an error of argparse."""

    def value(text: str) -> Any:
        try:
            return read(text)
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return value


def _with_bare(argv: Sequence[str], known: dict[str, Option]) -> list[str]:
    """Return the arguments, with the default value after a bare --check that a scene follows."""
    bare = {flag: option.bare for option in known.values() if option.bare is not None for flag in option.flags}
    following = (*argv[1:], "")
    return [
        f"{word}={','.join(map(str, bare[word]))}" if word in bare and not are_checks(after) else word
        for word, after in zip(argv, following, strict=False)
    ]


def _refuse(parser: argparse.ArgumentParser, word: str) -> NoReturn:
    """Exit with a message on an unknown option."""
    flags = [flag for action in parser._actions for flag in action.option_strings if flag.startswith("--")]
    parser.error(f'unknown option "{word}"{likely(word, flags) or "; --help lists all options"}')


def _require_fitting(parser: argparse.ArgumentParser, given: dict[str, Any], known: dict[str, Option]) -> None:
    """Exit with a message if options do not fit together."""
    for name in given:
        option = known[name]
        if option.belongs and not given.get(option.belongs):
            flag, needed = ((known[key].flags or (f"--{key}",))[0] for key in (name, option.belongs))
            parser.error(f"{flag} needs {needed}")
    if "changes" in given and given.keys() & {"sweep", "design"}:
        parser.error("--set is for reports: a sweep varies numbers by [sweep]")
    if "changes" in given and "structure" in given:
        parser.error("--set is for reports: change the numbers of a structure in its file")
    if sum(isinstance(check, int) for check in set(given.get("checks", ()))) > 1:
        parser.error("--check: expected one number of elements")
    if "theory" in given and "accuracy" in given:
        parser.error("--accuracy chooses the theory: leave out --theory or --accuracy")


BAR_DELAY, SELDOM = 1.0, 10.0  # [s] until the bar appears, and between lines without a terminal
MAX_COUNTED_PARTS = 100  # steps of a stage; more than this are printed as a percentage


def say(text: str, stream: TextIO | None) -> None:
    """Print lines. Control characters are escaped, and characters that the terminal lacks become question marks.

    Output to a closed pipe or a full disk stops without an error.
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
    """Redirect a stream to the null device, including its buffered text."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def fill_closed_streams() -> None:
    """Open closed standard streams, so that no result file gets their numbers."""
    for _ in range(3):
        spare = os.open(os.devnull, os.O_RDWR)
        if spare > 2:
            os.close(spare)
            return


@contextmanager
def listener(quiet: bool) -> Iterator[Progress]:
    """Yield a progress listener: a bar on a terminal, otherwise a line every `SELDOM` seconds."""
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
    """Progress listener that only prints sentences."""

    def tell(self, sentence: str) -> None:
        """Print a sentence."""
        say(sentence, sys.stderr)


class _Lines(Sentences):
    """Progress listener that prints a line every `SELDOM` seconds."""

    def __init__(self) -> None:
        self._start = self._last = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Print the stage, its share and the elapsed time."""
        now = time.monotonic()
        if now > self._last + SELDOM and done < total:
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
    """Progress listener that shows a bar once `show` is called."""

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
        both = sys.stdout is not None and sys.stdout.isatty()  # leave output to a file alone
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
        """Record the progress."""
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
