"""Run all benchmarks and write their results and the tables of pages of docs: `python benchmarks/all.py`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

NAMES = (
    "error_against_run_time",
    "rungs",
    "peers",
    "growth",
    "what_is_skipped",
    "beam_theory",
    "start_up",
    "page",
    "animation",
    "tables",
)


def main() -> int:
    """Number of benchmarks that failed."""
    failed = 0
    for name in NAMES:
        print(f"== {name}", flush=True)
        failed += subprocess.run([sys.executable, Path(__file__).parent / f"{name}.py"], check=False).returncode != 0
    return failed


if __name__ == "__main__":
    sys.exit(main())
