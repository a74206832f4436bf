"""From a scene to its page, summary and table: how long a scene takes in a batch, and how large its files are.

`python benchmarks/page.py` writes its results as "page"; `python benchmarks/page.py NAME` under another name, to put
two versions side by side: only the command is used.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import measuring

from kinelast.cli.command import main as command
from kinelast.tasks.task import shipped_scenes

BATCH = 50
ROUNDS = 5


def processor_seconds(call: Callable[[Path], object], folder: Path) -> float:
    """Median of what a call takes of the processor, warmed up: others on the machine do not count.

    Every call has a folder of its own, as a first run has.
    """
    call(folder / "warm")
    taken = []
    for number in range(ROUNDS):
        start = time.process_time()
        call(folder / str(number))
        taken.append(time.process_time() - start)
    return statistics.median(taken)


def scenes(folder: Path) -> list[dict[str, object]]:
    """Every shipped scene alone, all imports made before."""
    rows = []
    for name in shipped_scenes():
        own = folder / name
        taken = processor_seconds(lambda out, name=name: command([name, "--quiet", "-o", str(out)]), own)
        sizes = {file: (own / "0" / name / file).stat().st_size / 1000 for file in ("report.html", "positions.csv")}
        rows.append(
            {"scene": name, "ms": 1000 * taken, "page kB": sizes["report.html"], "table kB": sizes["positions.csv"]}
        )
    return rows


def batch(folder: Path) -> list[dict[str, object]]:
    """Copies of the steel four-bar with other speeds, on one core in one process, by either theory of motion."""
    text = shipped_scenes()["steel_four_bar"].read_text(encoding="utf-8")
    files = []
    for number in range(BATCH):
        files.append(folder / f"four_bar_{number:03}.toml")
        files[-1].write_text(text.replace('"100 rad/s"', f'"{100 + number / 10} rad/s"'), encoding="utf-8")
    rows = []
    for theory in ("quasi-static", "elastodynamic"):
        arguments = [*map(str, files), "--quiet", "--theory", theory]
        taken = processor_seconds(lambda out, given=arguments: command([*given, "-o", str(out)]), folder / theory)
        rows.append({"four-bars": BATCH, "theory": theory, "s": taken, "ms a scene": 1000 * taken / BATCH})
    return rows


def main() -> None:
    name = sys.argv[1] if len(sys.argv) > 1 else "page"
    with tempfile.TemporaryDirectory() as folder:
        tables = {"scenes": scenes(Path(folder)), "batch": batch(Path(folder))}
    measuring.report(name, "A scene with page, summary and table, and the size of its files", tables)


if __name__ == "__main__":
    main()
