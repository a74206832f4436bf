"""Processes that a test starts: they and their pipes end with it.

One that is left by a test that fails would be told, as a warning, of whichever test is running when it is collected.
"""

import os
import signal
import subprocess
from contextlib import suppress

STARTED: list[subprocess.Popen] = []


def started(command, **options):
    """A process in a group of its own."""
    STARTED.append(subprocess.Popen(command, start_new_session=True, **options))
    return STARTED[-1]


def end_all():
    """End the groups of all processes that were started, and close their pipes."""
    while STARTED:
        run = STARTED.pop()
        if run.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)
            run.wait()
        for pipe in filter(None, (run.stdin, run.stdout, run.stderr)):
            pipe.close()
