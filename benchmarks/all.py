"""Run the benchmarks behind docs/performance.md and put their tables into the docs: `python benchmarks/all.py`."""

import subprocess
import sys
from pathlib import Path

NAMES = ("default_report", "rungs", "growth", "request_costs", "sweep", "beam_theory", "convergence", "tables")


def main() -> int:
    """Return the number of benchmarks that failed."""
    failed = 0
    for name in NAMES:
        print(f"== {name}", flush=True)
        failed += subprocess.run([sys.executable, Path(__file__).parent / f"{name}.py"], check=False).returncode != 0
    return failed


if __name__ == "__main__":
    sys.exit(main())
