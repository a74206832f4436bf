"""Tables of a batch (a run on several scenes): summary.csv, index.html and, on request, summary.parquet.

Each table has one row per scene (a mechanism with its motion).
"""

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinelast.outputs.outbox import rewritten
from kinelast.outputs.page import MARK, index_page
from kinelast.outputs.table import Column, Table, csv_bytes, csv_rows, parquet_bytes
from kinelast.outputs.words import OUTCOMES, least_safety, limit_rows
from kinelast.reports.report import Report
from kinelast.tasks.task import Outcome
from kinelast.values.error import plain
from kinelast.values.reading import Reading


def _value(found: Reading | None) -> float | None:
    return found.value if found else None


def _output_error(report: Report, unit: str) -> float | None:
    return report.output.value if report.output and report.output.unit == unit else None


def _safety(report: Report) -> Reading | None:
    least = least_safety(report)
    return least[1] if least else None


def _unreliable(report: Report) -> str:
    """Return the names of the results of a scene that are marked as unreliable, separated by commas."""
    shown = {
        "largest_deflection": report.largest_deflection,
        "largest_chord": report.largest_chord,
        "largest_stress": report.largest_stress,
        "safety": _safety(report),
        "output_error": report.output,
    }
    return ", ".join(name for name, found in shown.items() if found and found.unreliable)


def _check(report: Report) -> str:
    passed = report.check.passed if report.check else None
    return "" if passed is None else "agrees" if passed else "differs"


def _decides(report: Report) -> tuple[str, float | None]:
    """Return a phrase about the limit that decides the verdict, and the utilisation of the limit (value / limit).

    If a link buckles, the phrase describes the buckling, and the utilisation is None. If there is no verdict, the
    phrase is empty, and the utilisation is None.
    """
    if report.buckles or not report.acceptance.verdict:
        return report.buckles or "", None
    worst = OUTCOMES[report.acceptance.verdict]
    return next((words, used) for words, used, outcome in limit_rows(report) if outcome == worst)


# name and unit of each column, and function that computes a cell of the column from the report on a scene
COLUMNS: tuple[tuple[str, str, Callable[[Report], Any]], ...] = (
    ("verdict", "", lambda report: report.acceptance.verdict),
    ("decides", "", lambda report: _decides(report)[0]),
    ("used", "1", lambda report: _decides(report)[1]),
    ("largest_deflection", "m", lambda report: _value(report.largest_deflection)),
    ("beam", "", lambda report: report.largest_deflection and report.largest_deflection.label),
    ("largest_chord", "m", lambda report: _value(report.largest_chord)),
    ("bent_beam", "", lambda report: report.largest_chord and report.largest_chord.label),
    ("largest_stress", "Pa", lambda report: _value(report.largest_stress)),
    ("stressed_beam", "", lambda report: report.largest_stress and report.largest_stress.label),
    ("safety", "1", lambda report: _value(_safety(report))),
    ("output_error", "m", lambda report: _output_error(report, "m")),
    ("output_error", "rad", lambda report: _output_error(report, "rad")),
    ("output", "", lambda report: report.output and report.output.name),
    ("condition", "1", lambda report: report.run.largest_condition.value),
    ("grade", "", lambda report: report.reliability.level),
    ("unreliable", "", _unreliable),
    ("check", "", _check),
)
HEAD = (("scene", ""), ("state", ""), ("status", ""), *((name, unit) for name, unit, _ in COLUMNS), ("message", ""))


def summary_row(outcome: Outcome, name: str) -> list[Any]:
    """Return the row of a scene in summary.csv. Unknown values are None."""
    report = outcome.report
    cells = [None] * len(COLUMNS) if report is None else [cell(report) for *_, cell in COLUMNS]
    row = [name, outcome.state, outcome.status, *cells, outcome.line if report is None else ""]
    return [plain(cell, 300) if isinstance(cell, str) else cell for cell in row]


def write_batch(
    out: Path, rows: Mapping[str, Sequence[Any]], seconds: Mapping[str, float], parquet: bool = False
) -> None:
    """Write the tables of a batch.

    The tables keep the rows that earlier batches wrote, if the result folders of the scenes still exist. New rows
    replace those of the same scenes.

    Parameters
    ----------
    rows, seconds
        Row (see `summary_row`) and computing time [s] of each scene. The keys are the names of the result folders in
        `out`.
    parquet
        Whether to write summary.parquet too. If this file already exists and pyarrow is installed, it is updated in any
        case.

    Raises
    ------
    RequestError
        One of the tables already exists but was not written by this program, or another run has locked it.
    OSError
        A file cannot be written.
    """
    path, head = out / "summary.csv", [Column(name, (), unit).heading for name, unit in HEAD]

    def merged() -> bytes:
        before = csv_rows(path.read_bytes())[1:] if path.exists() else []
        kept = {row[0]: _read(row) for row in before if len(row) == len(HEAD) and (out / row[0]).is_dir()}
        return csv_bytes(_table([*{**kept, **rows}.values()]))

    rewritten(path, lambda: (csv_rows(path.read_bytes()) or [[]])[0] == head, merged)
    whole = csv_rows(path.read_bytes())[1:]
    index = out / "index.html"
    rewritten(index, lambda: MARK in index.read_bytes(), lambda: index_page(out, head, whole, seconds))
    other = out / "summary.parquet"
    if parquet or (other.exists() and find_spec("pyarrow")):
        about = {"kinelast": "summary"}
        rewritten(other, lambda: _marked(other), lambda: parquet_bytes(_table(list(map(_read, whole))), about))


def _table(rows: Sequence[Sequence[Any]]) -> Table:
    cells = list(zip(*rows, strict=True)) or [()] * len(HEAD)
    return Table(tuple(Column(name, values, unit) for (name, unit), values in zip(HEAD, cells, strict=True)))


def _read(row: Sequence[str]) -> list[Any]:
    """Convert the cells of a row of summary.csv from text to numbers, and empty cells to None."""
    kinds = [int if name == "status" else float if unit else str for name, unit in HEAD]
    return [kind(cell) if cell else None for kind, cell in zip(kinds, row, strict=True)]


def _marked(path: Path) -> bool:
    from pyarrow import parquet

    return b"kinelast" in (parquet.read_schema(path).metadata or {})
