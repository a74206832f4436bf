"""Settings and fixtures of all tests.

Random tests draw the same cases on every machine and have no deadline. One browser serves all tests of a process.
"""

import signal

import one_thread  # noqa: F401 - before numpy
import processes
import pytest
from browser import started
from hypothesis import HealthCheck, settings

TIMED = [HealthCheck.too_slow]  # it depends on the load of the machine
settings.register_profile("steady", derandomize=True, deadline=None, database=None, suppress_health_check=TIMED)
settings.load_profile("steady")
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # a shell sets this for background jobs
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:  # nohup sets this
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(tryfirst=True)  # before pytest deselects by marker
def pytest_collection_modifyitems(items):
    """Mark each exhaustive test as slow too: `-m "not slow"` is the quick suite."""
    for item in items:
        if item.get_closest_marker("exhaustive"):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(autouse=True)
def no_lines_in_between(monkeypatch):
    """Print no progress lines: a slow machine would add them to any output. The test of progress resets this."""
    monkeypatch.setattr("kinelast.cli.terminal.LINE_INTERVAL", float("inf"))


@pytest.fixture(autouse=True)
def no_process_is_left():
    """End the processes that a test has started, even if it fails."""
    yield
    processes.end_all()


@pytest.fixture(scope="session")
def driver():
    """Return a headless Chromium; skip the test if there is no Chromium."""
    opened = started()
    yield opened
    opened.quit()
