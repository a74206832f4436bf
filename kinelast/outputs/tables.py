"""positions.csv and fields.npz: what the figures are at every position."""

from __future__ import annotations

import csv
import re
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from elastic import FIELDS, sample
from kinelast.figures.results import Results, joint_words
from kinelast.figures.trust import verdict
from kinelast.numbers import REPORT_UNITS
from kinelast.outcome import Outcome
from kinelast.outputs.outbox import held
from kinelast.request import RequestError
from kinelast.scene.error import plain
from rigid import Reals


def position_columns(results: Results) -> dict[str, Reals]:
    """The columns of positions.csv, each of shape (positions,), under names that carry their unit."""
    motion, deflection = results.motion, results.deflection
    columns: dict[str, Any] = {"time [s]": motion.time}
    for (name, coordinate, unit, _), values in zip(results.drive_words, motion.drive, strict=True):
        columns[f"{name}.{coordinate} [{unit}]"] = values
    for beam, label in enumerate(results.scene.labels):
        for field, extreme in results.extremes.items():
            columns[f"{label}.{field}_max [{FIELDS[field].unit}]"] = extreme.value[beam]
        columns[f"{label}.euler_ratio [1]"] = results.euler_ratio[beam]
    for point, moved in results.displacements.items():
        _add_vector(columns, f"{point}.d{{}} [m]", moved)
        columns[f"{point}.off_path [m]"] = results.deviations[point].normal
    forces = deflection.forces
    for (joint, link), force, moment in zip(joint_words(results), forces.force, forces.moment, strict=True):
        _add_vector(columns, f"{joint}.F{{}}_on_{link} [N]", force)
        if np.ndim(moment):
            columns[f"{joint}.M_on_{link} [N m]"] = moment
    for (name, *_, unit), values in zip(results.drive_words, results.efforts, strict=True):
        columns[f"{name}.effort [{unit}]"] = values
    _add_vector(columns, "ground.F{} [N]", forces.ground_force)
    columns["ground.M [N m]"] = forces.ground_moment
    columns["condition [1]"] = motion.condition
    columns = _in_units(columns, results.scene.report_units)
    shape = motion.columns
    return {
        name: values if np.shape(values) == shape else np.broadcast_to(values, shape)
        for name, values in columns.items()
    }


def _in_units(columns: dict[str, Any], system: str) -> dict[str, Any]:
    """Columns in the units of the report, which their names tell."""
    if system not in REPORT_UNITS:
        return columns
    found = {}
    for name, values in columns.items():
        words, _, unit = name.removesuffix("]").rpartition(" [")
        factor, shown = REPORT_UNITS[system].get(unit, (1.0, unit))
        found[f"{words} [{shown}]"] = values * factor if factor != 1.0 else values
    return found


def _add_vector(columns: dict[str, Any], name: str, values: Any) -> None:
    columns[name.format("x")], columns[name.format("y")] = np.real(values), np.imag(values)


def write_positions(path: Path, results: Results, more: bool = False) -> None:
    """One row a position, all digits; a cell is empty where there is no number. `more`: rows after others."""
    columns = position_columns(results)
    head = b"" if more else (",".join(columns) + "\n").encode()
    with path.open("ab" if more else "wb") as file:
        file.write(head + _lines(np.array(list(columns.values())).T))


def _lines(table: Reals) -> bytes:
    """Rows of numbers as lines: shortest digits that give them back; nothing for nan."""
    if np.isinf(table).any():  # for which JSON has no word
        rows = (",".join("" if value != value else repr(value) for value in row) for row in table.tolist())  # noqa: PLR0124
        return ("\n".join(rows) + "\n").encode()
    encode = msgspec.json.Encoder().encode
    lines = [encode(row)[1:-1] for row in table.tolist()]
    if np.isnan(table).any():
        lines = [line.replace(b"null", b"") for line in lines]
    return b"\n".join(lines) + b"\n"


class FieldFile:
    """All fields at equally spaced stations, in numpy's npz format, written as many positions at a time as there are.

    Arrays: `t` [s], shape (positions,); per beam `LABEL/x` [m], shape (stations,), and `LABEL/N` and so on by the
    keys of the main fields, shape (positions, stations). They grow in files of their own beside the one that they make
    in the end.
    """

    def __init__(self, path: Path, positions: int, stations: int) -> None:
        self._path, self._shape = path, (positions, stations)
        self._xi = np.linspace(0.0, 1.0, stations)
        self._parts: dict[str, Path] = {}

    def add(self, results: Results) -> None:
        """The fields at the next positions."""
        labels = results.scene.labels
        self._append("t", results.motion.time, self._shape[:1])
        for label, length in zip(labels, results.deflection.length, strict=True):
            if f"{label}/x" not in self._parts:
                self._append(f"{label}/x", self._xi * length.item(), self._shape[1:])
        for field in (key for key, each in FIELDS.items() if each.main):
            for label, values in zip(labels, sample(results.deflection, field, self._xi), strict=True):
                self._append(f"{label}/{field}", values, self._shape)

    def close(self) -> None:
        """Make one file of all."""
        with zipfile.ZipFile(self._path, "w") as archive:
            for name, part in self._parts.items():
                with part.open("rb") as source, archive.open(f"{name}.npy", "w", force_zip64=True) as target:
                    shutil.copyfileobj(source, target, 1 << 20)
                part.unlink()

    def _append(self, name: str, values: Any, shape: tuple[int, ...]) -> None:
        new = name not in self._parts
        part = self._parts.setdefault(name, self._path.with_name(f"{self._path.name}.{len(self._parts)}"))
        with part.open("ab") as file:
            if new:
                header = {"descr": "<f8", "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(file, header)
            file.write(np.ascontiguousarray(values, "<f8").tobytes())


def write_fields(path: Path, results: Results, stations: int) -> None:
    """The fields of a run at hand, as a `FieldFile`."""
    file = FieldFile(path, len(results.motion.time), stations)
    file.add(results)
    file.close()


HEAD = ("scene", "state", "status", "accepted", "largest_deflection [m]", "beam", "largest_chord [m]", "bent_beam",
        "largest_stress [Pa]", "stressed_beam", "safety [1]", "output_error [m]", "output_error [rad]", "output",
        "condition [1]", "grade", "check", "message")  # fmt: skip
FORMULA = re.compile(r"'?(?:[=@+]|-(?![\d.]+(?:e[-+]?\d+)?$))")  # what a spreadsheet would take a text for
INERT = re.compile(rf"'(?:{FORMULA.pattern})")  # the same behind the quote that hinders it
ACCEPTED = {None: "", True: "yes", False: "no"}


def summary_row(outcome: Outcome, name: str) -> list[str]:
    """A scene's row of summary.csv; a cell is empty where there is no figure."""
    figures: Mapping[str, Any] = outcome.figures
    deflection, stress = figures.get("largest_deflection") or {}, figures.get("largest_stress") or {}
    safety = figures["strength"][stress["label"]]["safety_factor"]["value"] if stress else None
    condition = figures["run"]["largest_condition"]["value"] if figures else None
    check = (figures.get("check") or {"passed": None})["passed"]
    grade = verdict(figures["trust"])[0] if figures else ""
    passed = "" if check is None else "agrees" if check else "differs"
    chord, output = figures.get("largest_chord") or {}, figures.get("output") or {}
    accepted = ACCEPTED[figures["acceptance"]["passed"]] if figures else ""
    errors = [output.get("value") if output.get("unit") == unit else None for unit in ("m", "rad")]
    cells = [name, outcome.state, outcome.status, accepted, deflection.get("value"), deflection.get("label"),
             chord.get("value"), chord.get("label"), stress.get("value"), stress.get("label"), safety, *errors,
             output.get("name"), condition, grade, passed, "" if figures else outcome.line]  # fmt: skip
    return ["" if cell is None else plain(str(cell), 300) for cell in cells]


def write_summary(out: Path, rows: Mapping[str, Sequence[str]]) -> list[Sequence[str]]:
    """A row a scene into OUT/summary.csv, instead of older rows of these scenes, beside those of others still there.

    Returns
    -------
    All rows that are there now.

    Raises
    ------
    RequestError
        A summary.csv of somebody else is there.
    OSError
        It cannot be written.
    """
    path = out / "summary.csv"
    with held(path) as hidden:
        known: dict[str, Sequence[str]] = {}
        if path.exists():
            with path.open(encoding="utf-8", newline="") as file:
                head, *before = list(csv.reader(file)) or [[]]
            if tuple(head) != HEAD:
                raise RequestError(f'"{plain(str(path), 300)}" was not written by this program: it is left as it is')
            rows_before = ([cell[INERT.match(cell) is not None :] for cell in row] for row in before)
            known = {row[0]: row for row in rows_before if len(row) == len(HEAD) and (out / row[0]).is_dir()}
        part = out / f"{hidden}.part"
        with part.open("w", encoding="utf-8", newline="") as file:
            whole = {**known, **rows}
            cells = ([f"'{cell}" if FORMULA.match(cell) else cell for cell in row] for row in whole.values())
            csv.writer(file, lineterminator="\n").writerows([HEAD, *cells])
        part.replace(path)
    return list(whole.values())


def write_parquet(out: Path, rows: Sequence[Sequence[str]]) -> None:
    """OUT/summary.parquet where pyarrow is installed: the rows of summary.csv, what has a unit as numbers.

    Raises as `write_summary`.
    """
    if find_spec("pyarrow") is None:
        return
    import pyarrow as pa
    from pyarrow import parquet

    path = out / "summary.parquet"
    with held(path) as hidden:
        if path.exists() and b"kinelast" not in (parquet.read_schema(path).metadata or {}):
            raise RequestError(f'"{plain(str(path), 300)}" was not written by this program: it is left as it is')
        kinds = {name: "float64" if name.endswith("]") else "int64" if name == "status" else "string" for name in HEAD}
        schema = pa.schema(list(kinds.items()), metadata={"kinelast": "summary"})
        cells = ([cell or None for cell in column] for column in zip(*rows, strict=True))
        arrays = [pa.array(column).cast(kind) for column, kind in zip(cells, kinds.values(), strict=True)]
        part = out / f"{hidden}.part"
        parquet.write_table(pa.table(arrays, schema=schema), part)
        part.replace(path)


def write_index(out: Path, rows: Sequence[Sequence[str]], seconds: Mapping[str, float] | None = None) -> None:
    """OUT/index.html: the rows of summary.csv and the seconds that scenes took as a page; raises as `write_summary`."""
    from kinelast.outputs.page.index import MARK, index_page

    path = out / "index.html"
    with held(path) as hidden:
        if path.exists() and MARK not in path.read_bytes():
            raise RequestError(f'"{plain(str(path), 300)}" was not written by this program: it is left as it is')
        part = out / f"{hidden}.part"
        part.write_bytes(index_page(out, HEAD, rows, seconds))
        part.replace(path)
