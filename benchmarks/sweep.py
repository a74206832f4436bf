"""What a sweep costs: a chunk of designs, all that is not computing, a million four-bars, a thousand cores on paper.

`python benchmarks/sweep.py [COUNT]` sweeps so many four-bars at 72 positions (1,000,000), and finds the greatest value of
every field over the links and the cycle exactly. The rest takes a minute.
"""

from __future__ import annotations

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
from sweeping import POSITIONS, four_bars, identity, tree  # before numpy: one thread

from kinelast.designs import store
from kinelast.designs.running import run_plan
from kinelast.designs.store import CSV, PARQUET, encoded

JOBS, CORES = 2, 1000
CHUNKS = 200  # of which nothing is computed, to see what else they cost


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
    """What a chunk costs besides computing, per store and way, also as a share of the second that it takes."""
    rows = []
    for name in (CSV, PARQUET):
        store.SMALL = 10**9 if name == CSV else 0
        content = processor_seconds(lambda name=name: encoded(name, 0, ready.columns, ready.units, ready.reasons))
        for way, options in ways():
            with tempfile.TemporaryDirectory() as folder, options as more:
                count = CHUNKS * len(ready.reasons)
                run_plan(4 * len(ready.reasons), ready, Path(folder) / "warm", {}, len(ready.reasons), **more)
                start = time.perf_counter()
                run_plan(count, ready, Path(folder) / "sweep", {}, len(ready.reasons), **more)
                each = (time.perf_counter() - start) / CHUNKS
                size = sum(map(len, tree(Path(folder) / "sweep").values())) / CHUNKS
            rows.append(
                {
                    "store": name,
                    "way": way,
                    "computed [s]": seconds,
                    "encoded, where it is computed [ms]": 1e3 * content,
                    "a chunk of which nothing is computed [ms]": 1e3 * each,
                    "share of the whole [%]": 100 * each / (each + seconds),
                    "kB a chunk": size / 1e3,
                }
            )
    return rows


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

        self.cluster = LocalCluster(JOBS, threads_per_worker=1, processes=True, dashboard_address=None)
        return {"scheduler": self.cluster.scheduler_address}

    def __exit__(self, *_: object) -> None:
        self.cluster.close()


def ways() -> list[tuple[str, Any]]:
    """Ways to compute chunks."""
    return [("this process", Local(1)), (f"{JOBS} processes", Local(JOBS)), (f"dask, {JOBS} workers", Cluster())]


def swept(count: int) -> dict[str, Any]:
    """A row of the table: so many designs, computed and kept."""
    evaluation = four_bars(count)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        own = resource.getrusage(resource.RUSAGE_SELF)
        start = time.perf_counter()
        outcome = run_plan(count, evaluation, Path(folder) / "sweep", identity(evaluation), evaluation.chunk, jobs=JOBS)
        taken = time.perf_counter() - start
        after, self = resource.getrusage(resource.RUSAGE_CHILDREN), resource.getrusage(resource.RUSAGE_SELF)
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    assert outcome.kept == count
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
    """How many cores one process can hand chunks to and keep them, and what a billion designs take on a thousand."""
    rows = []
    for cost in costs:
        if cost["store"] == PARQUET and cost["way"] != "this process":
            each = cost["a chunk of which nothing is computed [ms]"] / 1e3
            for chunk in (seconds, 10 * seconds):
                bytes_a_second = CORES * cost["kB a chunk"] / 1e3 / seconds
                # A longer chunk has as many more rows: what is sent and kept of it grows, what is done once does not.
                most = chunk / each if chunk == seconds else None
                rows.append(
                    {
                        "way": cost["way"],
                        "chunk [s]": chunk,
                        "cores that one process keeps busy": most,
                        f"MB a second of {CORES} cores": bytes_a_second,
                    }
                )
    return rows


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    evaluation = four_bars(count)
    columns, reasons = evaluation(0, evaluation.chunk)
    seconds = processor_seconds(lambda: evaluation(0, evaluation.chunk))
    costs = chunk_costs(seconds, Ready(dict(columns), evaluation.units, list(map(str, reasons))))
    tables = {"chunks": costs}
    if count:
        store.SMALL = 100_000
        tables["swept"] = [swept(count)]
    measuring.report(
        "sweep", "What a sweep costs beside computing its designs", tables, [f"{evaluation.chunk} designs a chunk"]
    )


if __name__ == "__main__":
    main()
