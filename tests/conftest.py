"""Random tests draw the same cases on every machine, and as long as they take; one browser serves all pages.

A line now and then on how far things are would come of a busy machine alone: no test waits for one but that of them.
"""

import signal

import one_thread  # noqa: F401 - before numpy
import processes
import pytest
from browser import started
from hypothesis import HealthCheck, settings

TIMED = [HealthCheck.too_slow]  # which depends on what else the machine does
settings.register_profile("steady", derandomize=True, deadline=None, database=None, suppress_health_check=TIMED)
settings.load_profile("steady")
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as of what a shell starts in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:  # as by nohup
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(autouse=True)
def no_lines_in_between(monkeypatch):
    """Without a terminal nothing is said of how far things are, but in the test of that."""
    monkeypatch.setattr("kinelast.cli.terminal.SELDOM", float("inf"))


@pytest.fixture(autouse=True)
def no_process_is_left():
    """Whatever way a test ends, its processes do."""
    yield
    processes.end_all()


@pytest.fixture(scope="session")
def driver():
    """A headless Chromium; the test is skipped where there is none."""
    opened = started()
    yield opened
    opened.quit()
