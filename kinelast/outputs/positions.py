"""positions.csv and fields.npz: figures and fields at every position."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, sample
from kinelast.figures.results import Results
from kinelast.outputs.table import Column, Table, csv_bytes, write_table


def position_table(results: Results) -> Table:
    """The columns of positions.csv, each of shape (positions,), in the units of the report."""
    motion, deflection = results.motion, results.deflection
    columns: dict[str, tuple[Any, str]] = {"time": (motion.time, "s")}
    for (name, coordinate, unit, _), values in zip(results.drive_words, motion.drive, strict=True):
        columns[f"{name}.{coordinate}"] = values, unit
    for beam, label in enumerate(results.scene.labels):
        for field, extreme in results.extremes.items():
            columns[f"{label}.{field}_max"] = extreme.value[beam], FIELDS[field].unit
        columns[f"{label}.euler_ratio"] = results.euler_ratio[beam], "1"
    for point, moved in results.displacements.items():
        columns |= _vector(f"{point}.d{{}}", moved, "m")
        columns[f"{point}.off_path"] = results.deviations[point].normal, "m"
    forces = deflection.forces
    for (joint, link), force, moment in zip(results.joint_words, forces.force, forces.moment, strict=True):
        columns |= _vector(f"{joint}.F{{}}_on_{link}", force, "N")
        if np.ndim(moment):
            columns[f"{joint}.M_on_{link}"] = moment, "N m"
    for (name, *_, unit), values in zip(results.drive_words, results.efforts, strict=True):
        columns[f"{name}.effort"] = values, unit
    columns |= _vector("ground.F{}", forces.ground_force, "N")
    columns["ground.M"] = forces.ground_moment, "N m"
    columns["condition"] = motion.condition, "1"
    return Table(
        tuple(Column(name, np.broadcast_to(values, motion.columns), unit) for name, (values, unit) in columns.items())
    ).in_units(results.scene.report_units)


def _vector(name: str, values: Any, unit: str) -> dict[str, tuple[Any, str]]:
    return {name.format("x"): (np.real(values), unit), name.format("y"): (np.imag(values), unit)}


def write_positions(path: Path, results: Results, others: Sequence[str] = ()) -> None:
    """A row a position, as CSV and in other formats."""
    write_table(path, position_table(results), others)


def append_positions(path: Path, results: Results, first: bool) -> None:
    """Rows behind those that are there, below their headings where they are the first."""
    with path.open("wb" if first else "ab") as file:
        file.write(csv_bytes(position_table(results), head=first))


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
        import zipfile

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
