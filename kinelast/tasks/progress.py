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


AGAIN = 0.5  # [s] after which a stop that was swallowed is raised once more
_asked: list[int] = []
"""Signals that have asked this process to end."""


class StoppedError(BaseException):
    """The process was told to end, by the signal `number`."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def stoppable() -> Iterator[None]:
    """Let signals that end the process raise `StoppedError`, and an interrupt `KeyboardInterrupt`.

    One that the process was started to ignore stays ignored. Libraries written in C may make an error of their own of
    what is raised while they are loaded, or clear it and go on: such an error is taken for the stop (`stops_kept`), and
    a `StoppedError` that is gone is raised again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: Any) -> NoReturn:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_IGN)  # while it cleans up
        _asked.append(number)
        if alarms:
            signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
        raise StoppedError(number)

    def interrupt(number: int, _frame: Any) -> NoReturn:
        _asked.append(number)
        raise KeyboardInterrupt

    def stop_again(_number: int, _frame: Any) -> None:
        if not _is_handled(StoppedError):
            raise StoppedError(_asked[-1])

    handlers: dict[int, Any] = {number: stop for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN}
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        handlers[signal.SIGINT] = interrupt
    alarms = hasattr(signal, "setitimer") and signal.getsignal(signal.SIGALRM) == signal.SIG_DFL
    if alarms:
        handlers[signal.SIGALRM] = stop_again
    before = {number: signal.getsignal(number) for number in handlers}
    try:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        with stops_kept():
            yield
    finally:
        if alarms:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, each in before.items():
            signal.signal(number, each or signal.SIG_DFL)
        _asked.clear()


@contextmanager
def stops_kept() -> Iterator[None]:
    """Take any exception for a stop once one was asked for, since libraries make errors of their own of it."""
    try:
        yield
    except Exception as error:
        if _asked:
            raise (KeyboardInterrupt if _asked[-1] == signal.SIGINT else StoppedError(_asked[-1])) from error
        raise


def _is_handled(kind: type[BaseException]) -> bool:
    """Whether an exception of a kind is being handled, or one that came of it: it is tidied up then."""
    error = sys.exception()
    while error is not None and not isinstance(error, kind):
        error = error.__context__
    return error is not None


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
