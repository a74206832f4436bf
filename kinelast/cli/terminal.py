"""Output of the command: lines that any terminal bears, and a bar where a run takes longer than a second."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from kinelast.scene.error import plain
from kinelast.tasks.progress import SILENT, Progress

SOON, SELDOM = 1.0, 10.0  # [s] until there is a bar, and between two lines where there is no terminal


def say(text: str, stream: TextIO | None) -> None:
    """Print lines: control characters escaped, a question mark for letters that the terminal has not.

    A stream that takes no more, as a pipe that was closed or a disk that is full, is given no more.
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
            say(f"deflection-report: nothing more can be printed: {error}", sys.stderr)


def _mute(stream: TextIO) -> None:
    """Lead a stream nowhere, also the text in its buffer that would be written at the end of the process."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def fill_closed_streams() -> None:
    """Open the standard streams that the caller has closed, lest a file of results takes the number of one."""
    for _ in range(3):
        spare = os.open(os.devnull, os.O_RDWR)
        if spare > 2:
            os.close(spare)
            return


@contextmanager
def listener(quiet: bool) -> Iterator[Progress]:
    """Whom to report progress to: after a second a bar on a terminal, elsewhere a line now and then."""
    if quiet:
        yield SILENT
        return
    if not sys.stderr or not sys.stderr.isatty():
        yield _NowAndThen()
        return
    bar = _Bar()
    timer = threading.Timer(SOON, bar.show)
    timer.daemon = True
    timer.start()
    try:
        yield bar
    finally:
        timer.cancel()
        bar.stop()


class Sentences(Progress):
    """A listener who passes on sentences alone."""

    def tell(self, sentence: str) -> None:
        """Say a sentence."""
        say(sentence, sys.stderr)


class _NowAndThen(Sentences):
    """A line now and then."""

    def __init__(self) -> None:
        self._told = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Say how far things are, where it is long since that was said."""
        if time.monotonic() > self._told + SELDOM and done < total:
            self._told = time.monotonic()
            say(f"{stage}: {done} of {total}", sys.stderr)


class _Bar(Sentences):
    """A bar that is there from a moment on."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._now: tuple[str, int, int] = ("", 0, 0)
        self._lock = threading.Lock()
        self._over = False

    def show(self) -> None:
        """Let the bar appear."""
        from rich import progress as bars
        from rich.console import Console

        columns = (
            bars.SpinnerColumn(),
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.MofNCompleteColumn(),
        )
        both = sys.stdout is not None and sys.stdout.isatty()  # lines that go to a file are not caught for the terminal
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
        """Note how far things are."""
        self._now = stage, done, total
        if self._bar is not None:
            words = plain(stage, 60).replace("[", r"\[")
            self._bar.update(self._task, description=words, completed=done, total=total or None)

    def stop(self) -> None:
        """Erase the bar."""
        with self._lock:
            self._over = True
            if self._bar is not None:
                self._bar.stop()
