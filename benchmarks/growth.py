"""Time and memory per unit of work for more positions, links, designs and stations.

The program computes in chunks of its own width. "At once" is one batch for comparison, as far as memory allows.
"""

from collections.abc import Callable
from typing import Any

import measuring
import numpy as np
from jobs import Job, chain, four_bars, steel_four_bar

from elastic import PRIMARY, deflection, sample
from rigid import motion_in_chunks

MAX_AT_ONCE = 100_000  # positions in one batch
MANY_UNITS = 200_000  # fewer rounds beyond this


def in_chunks(job: Job) -> None:
    for course in motion_in_chunks(job.mechanism, job.drive, job.rate):
        chunk = deflection(course, job.sections)
        del chunk


def at_once(job: Job) -> None:
    deflection(job.motion(), job.sections)


def row(name: str, count: int, units: int, job: Job, run: Callable[[Job], Any] = in_chunks) -> dict[str, Any]:
    rounds = 3 if units > MANY_UNITS else 5
    time = measuring.seconds(lambda: run(job), measuring.MIN_SECONDS / 2, rounds)
    peak = measuring.peak_bytes(lambda: run(job))
    return {name: count, "ns a unit": time / units * 1e9, "bytes a unit": peak / units, "peak MB": peak / 1e6}


def main() -> None:
    counts = [10**k for k in range(1, 7)]
    positions = [row("positions", n, n, steel_four_bar(n)) for n in counts]
    for line, n in zip(positions, counts, strict=True):
        once = row("positions", n, n, steel_four_bar(n), at_once) if n <= MAX_AT_ONCE else {}
        line |= {f"{key}, at once": once.get(key) for key in ("ns a unit", "peak MB")}
    dyads = [1, 2, 5, 12, 25, 49]
    links = [row("links", 2 * k + 2, (2 * k + 1) * 4000, chain(k, 4000)) for k in dyads]
    designs = [row("designs", n, 72 * n, four_bars(n)) for n in (1, 10, 100, 1_000, 10_000, 100_000)]
    solved = deflection(steel_four_bar(1000).motion(), steel_four_bar().sections)
    stations = []
    for n in (11, 31, 101, 301, 1001):
        xi = np.linspace(0, 1, n)

        def all_fields(xi: Any = xi) -> Any:
            for field in PRIMARY:
                sample(solved, field, xi)

        time, values = measuring.seconds(all_fields), 1000 * n * 6 * 3
        stations.append({"stations": n, "ns a value": time / values * 1e9, "us a position": time / 1000 * 1e6})
    small, many = positions[0], positions[3]
    fixed = small["ns a unit"] * 10 - many["ns a unit"] * 10
    notes = [
        "units: positions; links times positions; designs times positions (72 each)",
        f"fixed cost of the calls for the four-bar: {fixed / 1e6:.2f} ms",
    ]
    tables = {"positions": positions, "links": links, "designs": designs, "stations": stations}
    measuring.report("growth", "Growth: all six fields of all links as polynomials", tables, notes)
    with measuring.figure("growth", 2, (9, 4)) as (time, memory):
        for name, rows in list(tables.items())[:3]:
            time.loglog([r[name] for r in rows], [r["ns a unit"] for r in rows], "o-", ms=4, label=name)
            memory.loglog([r[name] for r in rows], [r["peak MB"] for r in rows], "o-", ms=4, label=name)
        once = [r for r in positions if r["ns a unit, at once"]]
        for axis, value in ((time, "ns a unit, at once"), (memory, "peak MB, at once")):
            axis.loglog([r["positions"] for r in once], [r[value] for r in once], "--", label="positions at once")
        time.set(xlabel="number", ylabel="time a unit [ns]")
        memory.set(xlabel="number", ylabel="peak memory [MB]")
        time.legend()
        memory.legend()


if __name__ == "__main__":
    main()
