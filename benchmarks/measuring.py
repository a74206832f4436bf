"""How the benchmarks measure and write down: medians on one core, tables, data, figures.

Import this before numpy: it keeps the linear algebra on one core.
"""

from __future__ import annotations

import csv
import gc
import json
import os
import platform
import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

RESULTS = Path(__file__).parent / "results"
LEAST = float(os.environ.get("BENCHMARK_SECONDS", "0.3"))  # of measuring per figure
Row = Mapping[str, Any]


def in_turn(calls: Mapping[Any, Callable[[], Any]], least: float = LEAST, rounds: int = 5) -> dict[Any, float]:
    """Median seconds of calls that take turns, so that what slows the machine slows them all.

    Every call is warmed up once, then measured in at least `rounds` rounds, and for `least` seconds each on average.
    """
    for call in calls.values():
        call()
    taken: dict[Any, list[float]] = {name: [] for name in calls}
    end = time.perf_counter() + least * len(calls)
    gc.collect()
    gc.disable()
    try:
        while len(next(iter(taken.values()))) < rounds or time.perf_counter() < end:
            for name, call in calls.items():
                start = time.perf_counter()
                call()
                taken[name].append(time.perf_counter() - start)
    finally:
        gc.enable()
    return {name: statistics.median(times) for name, times in taken.items()}


def seconds(call: Callable[[], Any], least: float = LEAST, rounds: int = 5) -> float:
    """Median seconds of a call, warmed up."""
    return in_turn({"": call}, least, rounds)[""]


def peak_bytes(call: Callable[[], Any]) -> int:
    """Most memory that a call holds at once beyond what was there before; measured in a run of its own."""
    call()
    gc.collect()
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def machine() -> dict[str, str]:
    """What the figures were measured on."""
    model = platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        model = names[0] if names else model
    versions = {}
    for name in ("numpy", "scipy", "scikit-fem", "pyvista", "matplotlib"):
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {
        "processor": f"{model}, {os.cpu_count()} cores, one used",
        "system": f"{platform.system()} {platform.machine()}, {' '.join(platform.libc_ver())}".strip(),
        "python": platform.python_version(),
        **versions,
        "date": datetime.now(UTC).date().isoformat(),
    }


def report(name: str, claim: str, tables: Mapping[str, Sequence[Row]], notes: Sequence[str] = ()) -> None:
    """Print tables and write them: one JSON file of everything, one CSV file a table."""
    RESULTS.mkdir(exist_ok=True)
    here = machine()
    print(f"\n# {claim}\n")
    for title, rows in tables.items():
        print(f"{title}\n{as_text(rows)}\n")
        file = RESULTS / (f"{name}.csv" if len(tables) == 1 else f"{name}-{title.split(':')[0].replace(' ', '_')}.csv")
        with file.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, list(rows[0]))
            writer.writeheader()
            writer.writerows([{key: _plain(value) for key, value in row.items()} for row in rows])
    for note in notes:
        print(note)
    print("; ".join(f"{key} {value}" for key, value in here.items()))
    content = {"claim": claim, "machine": here, "notes": list(notes), "tables": tables}
    (RESULTS / f"{name}.json").write_text(json.dumps(content, indent=1, default=_plain) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    return float(f"{value:.4g}") if isinstance(value, float) else value.item() if hasattr(value, "item") else value


def as_text(rows: Sequence[Row]) -> str:
    """A table in Markdown."""
    head = list(rows[0])
    cells = [head, *([_cell(row[key]) for key in head] for row in rows)]
    widths = [max(len(line[k]) for line in cells) for k in range(len(head))]
    lines = [
        "| " + " | ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) + " |" for line in cells
    ]
    return "\n".join([lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]])


def _cell(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else "" if value is None else str(value)


@contextmanager
def figure(name: str, columns: int = 1, size: tuple[float, float] = (7.0, 4.5)) -> Iterator[Any]:
    """Axes to draw on, written as SVG."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    matplotlib.rcParams |= {"svg.hashsalt": name, "svg.fonttype": "path", "font.size": 9}
    drawing, axes = pyplot.subplots(1, columns, figsize=size, layout="constrained")
    yield axes
    for axis in [axes] if columns == 1 else axes:
        axis.grid(True, which="both", alpha=0.25)
    RESULTS.mkdir(exist_ok=True)
    drawing.savefig(RESULTS / f"{name}.svg", metadata={"Date": None})
    pyplot.close(drawing)
