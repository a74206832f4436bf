"""Start processes that end with the test, wait for them, and imitate a full disk.

A process left by a failed test would warn during a later test.
"""

import errno
import os
import signal
import subprocess
import time
from contextlib import suppress

STARTED: list[subprocess.Popen] = []


def started(command, **options):
    """Start a process in its own group."""
    STARTED.append(subprocess.Popen(command, start_new_session=True, **options))
    return STARTED[-1]


def end_all():
    """End the groups of all started processes and close their pipes."""
    while STARTED:
        run = STARTED.pop()
        if run.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)
            run.wait()
        for pipe in filter(None, (run.stdin, run.stdout, run.stderr)):
            pipe.close()


def wait_for(condition, seconds=60.0):
    """Wait until `condition` returns a true value; fail after some seconds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "timeout"
        time.sleep(0.005)


def full_disk(*_, **__):
    """Raise the error of a full disk."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
