"""positions.csv and fields.npz: what the figures are at every position."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, sample
from kinelast.figures.results import Results, drive_words, joint_words
from rigid import Reals


def position_columns(results: Results) -> dict[str, Reals]:
    """The columns of positions.csv, each of shape (positions,), under names that carry their unit."""
    motion, deflection = results.motion, results.deflection
    columns: dict[str, Any] = {"time [s]": motion.time}
    for (name, coordinate, unit, _), values in zip(drive_words(results.mechanism), motion.drive, strict=True):
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
    for (name, *_, unit), values in zip(drive_words(results.mechanism), results.efforts, strict=True):
        columns[f"{name}.effort [{unit}]"] = values
    _add_vector(columns, "ground.F{} [N]", forces.ground_force)
    columns["ground.M [N m]"] = forces.ground_moment
    columns["condition [1]"] = motion.condition
    return {name: np.broadcast_to(values, motion.columns) for name, values in columns.items()}


def _add_vector(columns: dict[str, Any], name: str, values: Any) -> None:
    columns[name.format("x")], columns[name.format("y")] = np.real(values), np.imag(values)


def write_positions(path: Path, results: Results) -> None:
    """One row a position, all digits; a cell is empty where there is no number."""
    columns = position_columns(results)
    rows = np.array(list(columns.values())).T.tolist()
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        file.writelines(",".join("" if value != value else repr(value) for value in row) + "\n" for row in rows)  # noqa: PLR0124


def write_fields(path: Path, results: Results, stations: int) -> None:
    """All fields at equally spaced stations, in numpy's npz format, field by field so that memory stays small.

    Arrays: `t` [s], shape (positions,); per beam `LABEL/x` [m], shape (stations,), and `LABEL/N` and so on by the keys
    of the main fields, shape (positions, stations).
    """
    xi = np.linspace(0.0, 1.0, stations)
    labels = results.scene.labels
    with zipfile.ZipFile(path, "w") as archive:
        _put(archive, "t", results.motion.time)
        for label, length in zip(labels, results.deflection.length, strict=True):
            _put(archive, f"{label}/x", xi * length.item())
        for field in (key for key, each in FIELDS.items() if each.main):
            for label, values in zip(labels, sample(results.deflection, field, xi), strict=True):
                _put(archive, f"{label}/{field}", values)


def _put(archive: zipfile.ZipFile, name: str, values: Any) -> None:
    with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
        np.lib.format.write_array(file, np.ascontiguousarray(values))
