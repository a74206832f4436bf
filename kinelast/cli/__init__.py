"""The deflection-report command: options, messages, and parallel computation of scenes."""

import gc
import signal
import sys


def main() -> int:
    """Run the command with the arguments of the process. An interrupt before the command starts prints no message."""
    try:
        gc.disable()  # the import creates many objects, but no garbage
        from kinelast.cli.command import main

        gc.enable()
        status = main(sys.argv[1:])
    except KeyboardInterrupt:
        return 130
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the results are complete: ignore interrupts while Python exits
    return status
