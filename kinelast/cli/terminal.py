"""What the command says and shows: lines that any terminal bears, and a bar where a run takes longer than a second."""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from kinelast.scene.error import plain

SOON, SELDOM = 1.0, 10.0  # [s] until there is a bar, and between two lines where there is no terminal
Report = Callable[[str, int, int], None]
"""What is being done, how much of it is done, and how much is to be done."""


def say(text: str, stream: TextIO | None) -> None:
    """Print lines: control characters escaped, a question mark for what the terminal has no letter for.

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
    """Lead a stream nowhere, also what it holds and would write at the end of the process."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def fill_closed_streams() -> None:
    """Open what the caller has closed of the standard streams, lest a file of results takes its number."""
    for _ in range(3):
        spare = os.open(os.devnull, os.O_RDWR)
        if spare > 2:
            os.close(spare)
            return


@contextmanager
def progress(options: argparse.Namespace) -> Iterator[Report]:
    """What to report progress to: after a second a bar on a terminal, elsewhere a line now and then."""
    if options.quiet:
        yield lambda stage, done, total: None
        return
    if not sys.stderr or not sys.stderr.isatty():
        yield _now_and_then()
        return
    bar = _Bar()
    timer = threading.Timer(SOON, bar.show)
    timer.daemon = True
    timer.start()
    try:
        yield bar.report
    finally:
        timer.cancel()
        bar.stop()


def _now_and_then() -> Report:
    told = time.monotonic()

    def report(stage: str, done: int, total: int) -> None:
        nonlocal told
        if time.monotonic() > told + SELDOM and done < total:
            told = time.monotonic()
            say(f"{stage}: {done} of {total}", sys.stderr)

    return report


class _Bar:
    """A bar that is there from a moment on."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._now: tuple[str, int, int] = ("", 0, 0)
        self._lock = threading.Lock()
        self._over = False

    def show(self) -> None:
        """Let the bar appear."""
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
        both = sys.stdout is not None and sys.stdout.isatty()  # lines that go to a file are not caught for the terminal
        with self._lock:
            if self._over:
                return
            console = Console(stderr=True)
            self._bar = Progress(*columns, TimeElapsedColumn(), console=console, transient=True, redirect_stdout=both)
            self._task = self._bar.add_task("", total=None)
            self._bar.start()
        self.report(*self._now)

    def report(self, stage: str, done: int, total: int) -> None:
        """Note how far things are."""
        self._now = stage, done, total
        if self._bar is not None:
            words = plain(stage, 60).replace("[", r"\[")
            self._bar.update(self._task, description=words, completed=done, total=total or None)

    def stop(self) -> None:
        """Away with the bar."""
        with self._lock:
            self._over = True
            if self._bar is not None:
                self._bar.stop()
