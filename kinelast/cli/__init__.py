"""The deflection-report command: options, messages, and parallel computation of scenes."""

import signal
import sys


def main() -> int:
    """Run the command with the arguments of the process. An early interrupt ends it silently."""
    try:
        from kinelast.cli.command import main

        status = main(sys.argv[1:])
    except KeyboardInterrupt:
        return 130
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the results are complete
    return status
