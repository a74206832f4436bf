"""The deflection-report command: its options, its messages, and scenes side by side."""

import signal
import sys


def main() -> int:
    """Run the command with the arguments of the process; an interrupt before it begins ends it without a word."""
    try:
        from kinelast.cli.command import main

        status = main(sys.argv[1:])
    except KeyboardInterrupt:
        return 130
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to be interrupted but the end
    return status
