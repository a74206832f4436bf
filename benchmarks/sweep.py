"""What a sweep costs: a chunk of designs, all that is not computing, a million four-bars, a thousand cores on paper.

`python benchmarks/sweep.py [COUNT]` sweeps so many four-bars at 72 positions (1,000,000; 0: none), and finds the
greatest value of every field over the links and the cycle exactly. The rest takes a minute.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from sweeping import CHUNK, POSITIONS, four_bars, identity, tree  # before numpy: one thread

from kinelast.sweep import store
from kinelast.sweep.running import run_plan
from kinelast.sweep.store import CSV, PARQUET, encoded

JOBS = 2
DESIGNS = CHUNK
FEW_AND_MANY = 40, 240  # chunks of which nothing is computed: what one more of them costs
HERE = "this process"


@dataclass(frozen=True)
class Ready:
    """Chunks that are there without being computed: what they cost is what a sweep costs besides computing."""

    columns: dict[str, Any]
    units: dict[str, str]
    reasons: list[str] = field(default_factory=list)

    def __call__(self, first: int, last: int) -> tuple[dict[str, Any], list[str]]:
        """Whatever is asked for."""
        return self.columns, self.reasons


def processor_seconds(call: Callable[[], Any], rounds: int = 5) -> float:
    """Median of the processor's time that a call takes: others on the machine have no part in it."""
    call()
    taken = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return float(np.median(taken))


def chunk_costs(seconds: float, ready: Ready) -> list[dict[str, Any]]:
    """What a chunk costs besides computing, per store and way, also as a share of what it takes in all."""
    rows = []
    for name in (CSV, PARQUET):
        store.MAX_CSV = 10**9 if name == CSV else 0
        content = processor_seconds(lambda name=name: encoded(name, 0, ready.columns, ready.units, ready.reasons))
        for way, options in ways():
            with tempfile.TemporaryDirectory() as folder, options as more:
                few, many = (kept_chunks(Path(folder) / str(count), count, ready, more) for count in FEW_AND_MANY)
                size = sum(map(len, tree(Path(folder) / str(FEW_AND_MANY[0])).values())) / FEW_AND_MANY[0]
            wall, own = (np.array(many) - np.array(few)) / (FEW_AND_MANY[1] - FEW_AND_MANY[0])
            here = own - content * (way == HERE)
            rows.append(
                {
                    "store": name,
                    "way": way,
                    "computed, processor [s]": seconds,
                    "encoded there, processor [ms]": 1e3 * content,
                    "handed out and kept here, processor [ms]": 1e3 * here,
                    "share of that [%]": 100 * (content + here) / seconds,
                    "wall, nothing computed [ms]": 1e3 * wall,
                    "kB": size / 1e3,
                }
            )
    return rows


def kept_chunks(folder: Path, count: int, ready: Ready, options: dict[str, Any]) -> tuple[float, float]:
    """Seconds on the wall, and of the processor here, that it takes to keep so many chunks."""
    designs = len(ready.reasons)
    begin, own = time.perf_counter(), time.process_time()
    run_plan(count * designs, ready, folder, {}, designs, **options)
    return time.perf_counter() - begin, time.process_time() - own


class Local:
    """So many processes of this machine."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def __enter__(self) -> dict[str, Any]:
        return {"jobs": self.jobs}

    def __exit__(self, *_: object) -> None:
        pass


class Cluster:
    """Workers of a dask scheduler on this machine."""

    def __enter__(self) -> dict[str, Any]:
        from distributed import LocalCluster

        self.cluster = LocalCluster(JOBS, threads_per_worker=1, processes=True, dashboard_address=":0")
        return {"scheduler": self.cluster.scheduler_address}

    def __exit__(self, *_: object) -> None:
        self.cluster.close()


def ways() -> list[tuple[str, Any]]:
    """Ways to compute chunks."""
    return [(HERE, Local(1)), (f"{JOBS} processes", Local(JOBS)), (f"dask, {JOBS} workers", Cluster())]


def swept(count: int) -> dict[str, Any]:
    """A row of the table: so many designs, computed and kept."""
    evaluation = four_bars(count)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        own = resource.getrusage(resource.RUSAGE_SELF)
        start = time.perf_counter()
        outcome = run_plan(count, evaluation, Path(folder) / "sweep", identity(evaluation), CHUNK, jobs=JOBS)
        taken = time.perf_counter() - start
        for process in multiprocessing.active_children():
            process.join()  # which counts what it took
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


def on_paper(seconds: float, costs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """How many cores one process can hand chunks to and keep them, by what a chunk costs it."""
    rows = []
    for cost in costs:
        if cost["store"] == PARQUET and cost["way"] != HERE:
            rate = 1e3 / cost["handed out and kept here, processor [ms]"]
            rows.append(
                {
                    "way": cost["way"],
                    "chunks a second, at most": rate,
                    "cores that keeps busy": rate * seconds,
                    "a billion designs on that many [h]": 1e9 / DESIGNS / rate / 3600,
                    "MB a second to keep": rate * cost["kB"] / 1e3,
                }
            )
    return rows


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    rows = {"swept": [swept(count)]} if count else {}
    evaluation = four_bars(1_000_000)
    columns, reasons = evaluation(0, DESIGNS)
    seconds = processor_seconds(lambda: evaluation(0, DESIGNS))
    costs = chunk_costs(seconds, Ready(dict(columns), evaluation.units, list(map(str, reasons))))
    tables = {"chunks": costs, "on paper": on_paper(seconds, costs), **rows}
    notes = [f"{DESIGNS} designs a chunk; load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"]
    measuring.report("sweep", "What a sweep costs beside computing its designs", tables, notes)


if __name__ == "__main__":
    main()
