"""Tables of a batch: summary.csv, index.html and, on request, summary.parquet, with a row for each scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinelast.outputs.outbox import rewritten
from kinelast.outputs.page import MARK, index_page
from kinelast.outputs.table import Column, Table, csv_bytes, csv_rows, parquet_bytes
from kinelast.outputs.words import OUTCOMES, limit_rows
from kinelast.scene.error import plain
from kinelast.tasks.task import Outcome

HEAD = (("scene", ""), ("state", ""), ("status", ""), ("verdict", ""), ("decides", ""), ("used", "1"),
        ("largest_deflection", "m"), ("beam", ""),
        ("largest_chord", "m"), ("bent_beam", ""), ("largest_stress", "Pa"), ("stressed_beam", ""), ("safety", "1"),
        ("output_error", "m"), ("output_error", "rad"), ("output", ""), ("condition", "1"), ("grade", ""),
        ("check", ""), ("message", ""))  # fmt: skip


def summary_row(outcome: Outcome, name: str) -> list[Any]:
    """Return a scene's row of summary.csv, with None for unknown figures."""
    figures: Mapping[str, Any] = outcome.figures
    deflection, stress = figures.get("largest_deflection") or {}, figures.get("largest_stress") or {}
    safety = figures["strength"][stress["label"]]["safety_factor"]["value"] if stress else None
    condition = figures["run"]["largest_condition"]["value"] if figures else None
    check = (figures.get("check") or {"passed": None})["passed"]
    grade = figures["reliability"]["level"] if figures else ""
    passed = "" if check is None else "agrees" if check else "differs"
    chord, output = figures.get("largest_chord") or {}, figures.get("output") or {}
    judged = figures["acceptance"]["verdict"] if figures else ""
    decides, used = _decides(figures) if judged else ("", None)
    errors = [output.get("value") if output.get("unit") == unit else None for unit in ("m", "rad")]
    cells = [name, outcome.state, outcome.status, judged, decides, used,
             deflection.get("value"), deflection.get("label"), chord.get("value"), chord.get("label"),
             stress.get("value"), stress.get("label"), safety, *errors, output.get("name"), condition, grade, passed,
             "" if figures else outcome.line]  # fmt: skip
    return [plain(cell, 300) if isinstance(cell, str) else cell for cell in cells]


def _decides(figures: Mapping[str, Any]) -> tuple[str, float | None]:
    """Return the limit that decides the verdict and its used share, or the link that buckles."""
    if figures["buckles"]:
        return figures["buckles"], None
    worst = OUTCOMES[figures["acceptance"]["verdict"]]
    return next((words, used) for words, used, outcome in limit_rows(figures) if outcome == worst)


def write_batch(
    out: Path, rows: Mapping[str, Sequence[Any]], seconds: Mapping[str, float], others: Sequence[str] = ()
) -> None:
    """Write the tables of a batch. Rows of other scenes stay if their folders still exist.

    Parameters
    ----------
    rows, seconds
        Rows (see `summary_row`) and computing times, by the scenes' folders in `out`.
    others
        Further formats. Parquet is written if requested or if an older file exists.

    Raises
    ------
    RequestError
        A file with one of these names was not written by this program.
    OSError
        A file cannot be written.
    """
    path, head = out / "summary.csv", _table([]).headings

    def merged() -> bytes:
        before = csv_rows(path)[1:] if path.exists() else []
        kept = {row[0]: _read(row) for row in before if len(row) == len(HEAD) and (out / row[0]).is_dir()}
        return csv_bytes(_table([*{**kept, **rows}.values()]))

    rewritten(path, lambda: (csv_rows(path) or [[]])[0] == head, merged)
    whole = csv_rows(path)[1:]
    index = out / "index.html"
    rewritten(index, lambda: MARK in index.read_bytes(), lambda: index_page(out, head, whole, seconds))
    parquet = out / "summary.parquet"
    if "parquet" in others or (parquet.exists() and find_spec("pyarrow")):
        about = {"kinelast": "summary"}
        rewritten(parquet, lambda: _marked(parquet), lambda: parquet_bytes(_table(list(map(_read, whole))), about))


def _table(rows: Sequence[Sequence[Any]]) -> Table:
    cells = list(zip(*rows, strict=True)) or [()] * len(HEAD)
    return Table(tuple(Column(name, values, unit) for (name, unit), values in zip(HEAD, cells, strict=True)))


def _read(row: Sequence[str]) -> list[Any]:
    """Convert the cells of a row of summary.csv back to values."""
    return [
        (float(cell) if cell else None) if unit else int(cell) if name == "status" else cell or None
        for (name, unit), cell in zip(HEAD, row, strict=True)
    ]


def _marked(path: Path) -> bool:
    from pyarrow import parquet

    return b"kinelast" in (parquet.read_schema(path).metadata or {})
