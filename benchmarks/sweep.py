"""Sweep a million four-bars of other lengths and depths, and time it.

    python benchmarks/sweep.py [COUNT]

Each design has 72 positions. The sweep finds the largest value of every field over the links and the cycle.
"""

import multiprocessing
import os
import resource
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measuring  # before numpy: one thread, also in the worker processes
import numpy as np

from kinelast import shipped_scenes
from kinelast.designs.evaluate import Evaluation
from kinelast.scene.document import read_document
from kinelast.sweep.running import run_plan

COUNT, JOBS = 1_000_000, 2
POSITIONS = 72
CHUNK = 2000  # designs, about half a second of work
BOUNDS = {  # path: lowest and highest value [m]
    "links.crank.length": (0.08, 0.12),
    "links.coupler.length": (0.27, 0.33),
    "links.rocker.length": (0.23, 0.27),
    "sections.bar.depth": (3e-3, 12e-3),
}
MAXIMA = ("N", "V", "M", "u", "deflection", "phi", "chord", "stress")  # over beams and positions


@dataclass(frozen=True)
class Spread:
    """Designs that fill a box evenly; the number of a design determines its values.

    Multiples of powers of 1/g modulo 1, with g^(d + 1) = g + 1 in d dimensions; for d = 1 the golden ratio.
    """

    count: int
    paths: tuple[str, ...] = tuple(BOUNDS)

    def values(self, first: int, last: int) -> Any:
        """Values of some designs [m], shape (designs, paths)."""
        ratio = 1.0
        for _ in range(60):
            ratio = (1.0 + ratio) ** (1.0 / (len(self.paths) + 1))
        low, high = np.array([BOUNDS[path] for path in self.paths]).T
        step = ratio ** -np.arange(1.0, len(self.paths) + 1)
        return low + (high - low) * (np.arange(first, last)[:, None] * step % 1.0)


def four_bars(count: int, figures: tuple[str, ...] = MAXIMA) -> Evaluation:
    """Evaluation of `count` four-bars and their figures."""
    document = read_document(shipped_scenes()["steel_four_bar"]).with_positions(POSITIONS)
    return Evaluation(document, Spread(count), figures)


def identity(evaluation: Evaluation) -> dict[str, Any]:
    """Input that determines the figures of a sweep."""
    tables, plan = evaluation.document.tables, evaluation.plan
    return {"tables": tables, "figures": list(evaluation.figures or ()), "paths": plan.paths}


def tree(folder: Path) -> dict[str, bytes]:
    """Contents of all files in a folder, by relative path."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def swept(count: int) -> dict[str, Any]:
    """Sweep `count` designs; return a row of the table."""
    evaluation = four_bars(count)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        own = resource.getrusage(resource.RUSAGE_SELF)
        start = time.perf_counter()
        outcome = run_plan(count, evaluation, Path(folder) / "sweep", identity(evaluation), CHUNK, jobs=JOBS)
        taken = time.perf_counter() - start
        for process in multiprocessing.active_children():
            process.join()  # the system counts the time of a child only after it has ended
        after, self = resource.getrusage(resource.RUSAGE_CHILDREN), resource.getrusage(resource.RUSAGE_SELF)
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    assert outcome.kept == count
    print(f"{count} designs in {taken:.1f} s at a load of {load:.1f}", flush=True)
    computed = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "designs": count,
        "positions": POSITIONS,
        "processes": JOBS,
        "load before": load,
        "wall [s]": taken,
        "processors' [s]": computed,
        "of that here, to hand out and keep [s]": self.ru_utime + self.ru_stime - own.ru_utime - own.ru_stime,
        "on quiet cores [s]": computed / JOBS,
        "us a position": 1e6 * computed / count / POSITIONS,
        "memory of all processes [MB]": (self.ru_maxrss + JOBS * after.ru_maxrss) / 1e3,
        "store [MB]": size / 1e6,
    }


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    notes = [f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"]
    measuring.report("sweep", "Sweep of four-bars", {"swept": [swept(count)]}, notes)


if __name__ == "__main__":
    main()
