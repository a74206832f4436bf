"""Progress callbacks, handling of stop signals, and the number of threads for linear algebra."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


class Progress:
    """A progress callback that does nothing. Subclasses show a bar or print lines."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Report progress: the stage of a run, the amount of work done, and the total amount."""

    def tell(self, sentence: str) -> None:
        """Print a message for the user."""

    def within(self, name: str) -> Progress:
        """Return a callback that reports to this callback, with a name in front of each stage and message."""
        return _NamedProgress(self, name)


class _NamedProgress(Progress):
    def __init__(self, whole: Progress, name: str) -> None:
        self._whole, self._name = whole, name

    def __call__(self, stage: str, done: int, total: int) -> None:
        self._whole(f"{self._name}: {stage}", done, total)

    def tell(self, sentence: str) -> None:
        self._whole.tell(f"{self._name}: {sentence}")


SILENT = Progress()


def lasting(seconds: float) -> str:
    """Return an estimated duration as text with two significant digits, such as "3.5 hours"."""
    for size, unit in ((365.25 * 86400, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{float(f'{seconds:.2g}'):g} s"


SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


AGAIN = 0.5  # [s] if a library has suppressed a `StoppedError`, the error is raised again after this time
_received: list[int] = []
"""Numbers of the signals received so far."""


class StoppedError(BaseException):
    """Exception that is raised if a signal stops the process. `number` is the number of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def stoppable() -> Iterator[None]:
    """Raise `StoppedError` on signals that end the process, and KeyboardInterrupt on an interrupt.

    Signals that the process already ignores stay ignored. The import of a C library may replace or suppress an
    exception. After a stop signal, any exception is therefore converted to `StoppedError` or KeyboardInterrupt (see
    `stops_kept`). A suppressed `StoppedError` is raised again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: Any) -> NoReturn:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_IGN)  # a second stop signal must not interrupt the cleanup
        _received.append(number)
        if alarms:
            signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
        raise StoppedError(number)

    def interrupt(number: int, _frame: Any) -> NoReturn:
        _received.append(number)
        raise KeyboardInterrupt

    def stop_again(_number: int, _frame: Any) -> None:
        if not _is_handled(StoppedError):
            raise StoppedError(_received[-1])

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
        _received.clear()


@contextmanager
def stops_kept() -> Iterator[None]:
    """Convert any exception after a stop signal to `StoppedError` or KeyboardInterrupt.

    The conversion is needed because a library may replace the exception of the signal by another exception.
    """
    try:
        yield
    except Exception as error:
        if _received:
            raise (KeyboardInterrupt if _received[-1] == signal.SIGINT else StoppedError(_received[-1])) from error
        raise


def _is_handled(kind: type[BaseException]) -> bool:
    """Return True if an exception of type `kind` is being handled, directly or as the context of another exception."""
    error = sys.exception()
    while error is not None and not isinstance(error, kind):
        error = error.__context__
    return error is not None


@contextmanager
def ignored_interrupts() -> Iterator[None]:
    """Ignore keyboard interrupts during cleanup."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)


@contextmanager
def signals_held_back(held: Collection[signal.Signals] = (signal.SIGINT, *SIGNALS)) -> Iterator[None]:
    """Block stop signals during steps that must not be interrupted.

    Processes that start during these steps also block the signals.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, held)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit linear algebra to one thread. This function is a context manager and also a decorator.

    The command deflection-report limits the number of threads by environment variables, before it imports numpy. In a
    Python session, numpy may already be imported, so that environment variables would have no effect.
    """
    if os.environ.get("OMP_NUM_THREADS") == "1":
        yield
        return
    controller = _controller("scipy.linalg" in sys.modules)
    with controller.limit(limits=1, user_api="blas") if controller else nullcontext():
        yield


@lru_cache(maxsize=2)
def _controller(_: bool) -> ThreadpoolController | None:
    """Return the thread controller, or None if the package threadpoolctl is not installed.

    The argument is True if scipy is loaded. It is only the key of the cache. Loading scipy adds a library for linear
    algebra, so that a new controller is necessary.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ModuleNotFoundError:
        return None
    return ThreadpoolController()
