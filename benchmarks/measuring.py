"""Time and memory of calls, and the files of results: tables, figures, data.

Import this before numpy: it limits the linear algebra to one thread.
"""

import csv
import gc
import json
import os
import platform
import signal
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
MIN_SECONDS = float(os.environ.get("BENCHMARK_SECONDS", "0.3"))  # measured time of a call, all rounds together
Row = Mapping[str, Any]


class TooLongError(BaseException):
    """A call used up its processor time; no handler of `Exception` in the program catches this."""


@contextmanager
def processor_limit(seconds: float) -> Iterator[None]:
    """Raise TooLongError as soon as the block has used so many seconds of the processor."""

    def stop(*_: Any) -> None:
        raise TooLongError(f"more than {seconds:g} s")

    handler = signal.signal(signal.SIGPROF, stop)
    outer, _ = signal.setitimer(signal.ITIMER_PROF, seconds)
    begin = time.process_time()
    try:
        yield
    finally:
        left = max(outer - (time.process_time() - begin), 1e-3) if outer else 0.0
        signal.signal(signal.SIGPROF, handler)
        signal.setitimer(signal.ITIMER_PROF, left)


def seconds(call: Callable[[], Any], least: float = MIN_SECONDS, rounds: int = 5) -> float:
    """Median wall time of a call after one to warm up: at least `rounds` calls, at least `least` seconds in all."""
    call()
    taken: list[float] = []
    end = time.perf_counter() + least
    gc.collect()
    gc.disable()
    try:
        while len(taken) < rounds or time.perf_counter() < end:
            start = time.perf_counter()
            call()
            taken.append(time.perf_counter() - start)
    finally:
        gc.enable()
    return statistics.median(taken)


def processor_seconds(call: Callable[[], Any], rounds: int = 3) -> tuple[float, Any]:
    """Least processor time of a call, and its last result."""
    taken = []
    for _ in range(rounds):
        start = time.process_time()
        found = call()
        taken.append(time.process_time() - start)
    return min(taken), found


def peak_bytes(call: Callable[[], Any]) -> int:
    """Peak memory that a call allocates, measured in a second run of it."""
    call()
    gc.collect()
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def machine() -> dict[str, str]:
    """Processor, system and versions of the packages."""
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
    """Print the tables and write them: all as one JSON file, and each as a CSV file."""
    RESULTS.mkdir(exist_ok=True)
    here = machine()
    print(f"\n# {claim}\n")
    for title, rows in tables.items():
        print(f"{title}\n{as_text(rows)}\n")
        write_rows(RESULTS / (f"{name}.csv" if len(tables) == 1 else f"{name}-{title.replace(' ', '_')}.csv"), rows)
    for note in notes:
        print(note)
    print("; ".join(f"{key} {value}" for key, value in here.items()))
    content = {"claim": claim, "machine": here, "notes": list(notes), "tables": tables}
    (RESULTS / f"{name}.json").write_text(json.dumps(content, indent=1, default=_plain) + "\n", encoding="utf-8")


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as CSV, with a column for every key of any row."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows([{key: _plain(value) for key, value in row.items()} for row in rows])


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Rows of a CSV file as text; no rows without the file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return [*csv.DictReader(stream)]


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
    """Axes of a figure that is then written as SVG."""
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
