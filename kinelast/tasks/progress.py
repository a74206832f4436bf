"""Progress of a run: its listener, the signals that end it, and the threads of its linear algebra."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


class Progress:
    """A listener who keeps it to himself; the command's shows a bar, or prints a line now and then."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Hear the stage of a run, how much of it is done, and how much is to be done."""

    def tell(self, sentence: str) -> None:
        """Hear a sentence for the user, on how long something takes or on kept results."""

    def within(self, name: str) -> Progress:
        """A listener to a part of the work, that hears its stages under a name."""
        return _Part(self, name)


class _Part(Progress):
    def __init__(self, whole: Progress, name: str) -> None:
        self._whole, self._name = whole, name

    def __call__(self, stage: str, done: int, total: int) -> None:
        self._whole(f"{self._name}: {stage}", done, total)

    def tell(self, sentence: str) -> None:
        self._whole.tell(f"{self._name}: {sentence}")


SILENT = Progress()


def lasting(seconds: float) -> str:
    """A duration in words."""
    for size, unit in ((365.25 * 86400, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class StoppedError(BaseException):
    """The process was told to end, by the signal `number`."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def stoppable() -> Iterator[None]:
    """Let signals that end the process raise `StoppedError` once; one that it was started to ignore stays ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: Any) -> NoReturn:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_IGN)  # while it cleans up
        raise StoppedError(number)

    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number, handler in before.items():
            if handler != signal.SIG_IGN:
                signal.signal(number, stop)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)


@contextmanager
def ignored_interrupts() -> Iterator[None]:
    """Ignore the keyboard's interrupt, while the work that it has ended is tidied up."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Hold back all signals that end the process, while a few steps are made that belong together."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, *SIGNALS})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Hold the keyboard's interrupt back; processes that are started meanwhile never see it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def one_thread() -> Iterator[None]:
    """The linear algebra of numpy and scipy keeps to one thread meanwhile; a decorator too.

    The command has set that before numpy was loaded; who asks from Python has numpy loaded already.
    """
    if os.environ.get("OMP_NUM_THREADS") == "1":
        yield
        return
    with _controller("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas"):
        yield


@lru_cache(maxsize=2)
def _controller(_: bool) -> ThreadpoolController:
    """Made once, and once more where scipy has brought a library of its own."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
