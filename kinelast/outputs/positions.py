"""Tables of values at each position: results (positions.csv), motion (motion.csv) and fields (fields.npz)."""

import shutil
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, sample
from kinelast.figures.results import Results
from kinelast.outputs.table import Column, Table, csv_bytes
from kinelast.scene.data import Scene
from kinelast.scene.error import likely
from kinelast.scene.figure import drive_words, points_of
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.cam_courses import cam_outline
from kinelast.tasks.request import RequestError
from rigid import Motion, acceleration_of, position_of, transmission_angles, velocity_of

PROFILE = 1440  # number of points of a cam profile, four per degree
PER_TIME = ("", "/s", "/s^2")  # unit suffixes of a coordinate, a rate and an acceleration


def position_table(results: Results) -> Table:
    """Return the table positions.csv, in the units of the report."""
    motion, deflection = results.motion, results.deflection
    columns: dict[str, tuple[Any, str]] = {"time": (motion.time, "s")}
    for (name, coordinate, unit, _), values in zip(results.drive_words, motion.drive, strict=True):
        columns[f"{name}.{coordinate}"] = values, unit
    for beam, label in enumerate(results.scene.labels):
        for field, extreme in results.cycle.extremes.items():
            columns[f"{label}.{field}_max"] = extreme.value[beam], FIELDS[field].unit
        columns[f"{label}.euler_ratio"] = results.cycle.euler_ratio[beam], "1"
    for point, moved in results.cycle.deviations.items():
        columns |= _vector(f"{point}.d{{}}", moved.displacement, "m")
        columns[f"{point}.off_path"] = moved.normal, "m"
    forces = deflection.forces
    for (joint, link), force, moment in zip(results.joint_words, forces.force, forces.moment, strict=True):
        columns |= _vector(f"{joint}.F{{}}_on_{link}", force, "N")
        if np.ndim(moment):
            columns[f"{joint}.M_on_{link}"] = moment, "N m"
    for (name, *_, unit), values in zip(results.drive_words, results.cycle.efforts, strict=True):
        columns[f"{name}.effort"] = values, unit
    for part in PARTS:
        columns |= part.columns(results.cycle)
    columns |= _vector("ground.F{}", forces.ground_force, "N")
    columns["ground.M"] = forces.ground_moment, "N m"
    columns["condition"] = motion.condition, "1"
    return _table(columns, results)


def cam_tables(scene: Scene) -> dict[str, Table]:
    """Return a table with the profile of each cam over one turn, by file name.

    Coordinates are in the axes of the cam. At the start, these axes coincide with the axes of the ground. The rows are
    in the order in which the follower passes over the profile. The table also contains the pitch curve if the follower
    has a roller, and the flank `outer` if the cam is a groove.
    """
    tables = {}
    for name, cam in scene.cams.items():
        flanks = cam_outline(scene, name, PROFILE)
        turned = 2.0 * np.pi * np.sign(cam.speed) * np.arange(PROFILE) / PROFILE
        columns: dict[str, tuple[Any, str]] = {"angle": (turned, "rad")}
        if cam.roller is not None:
            columns |= _vector("pitch.{}", flanks[0].pitch, "m")
        columns |= _vector("profile.{}", flanks[0].profile, "m")
        columns["profile.radius"] = flanks[0].radius, "m"
        if len(flanks) > 1:
            columns |= _vector("outer.{}", flanks[1].profile, "m")
            columns["outer.radius"] = flanks[1].radius, "m"
        columns["pressure_angle"] = flanks[0].pressure_angle, "rad"
        made = (Column(key, np.ravel(values), unit) for key, (values, unit) in columns.items())
        tables[f"cam_{name}"] = Table(tuple(made)).in_units(scene.report_units)
    return tables


def motion_table(results: Results) -> Table:
    """Return the table motion.csv, in the units of the report.

    Positions, velocities and accelerations are those of rigid links. Displacements, forces and efforts (moments or
    forces of the drives) come from the deflection analysis.
    """
    motion = results.motion
    columns = {**motion_columns(motion), **_displaced(results), **_effort_columns(results), **_force_columns(results)}
    return _table(columns, results)


def motion_columns(motion: Motion) -> dict[str, tuple[Any, str]]:
    """Return the columns of a rigid motion with their units, by name: drives, links, points and joints.

    In the names of the columns, `theta` is the angle of a link, without jumps of a full turn. The coordinate of a drive
    or joint is called `angle` if it turns, and `slide` if it slides.
    """
    links = motion.mechanism.links
    columns: dict[str, tuple[Any, str]] = {"time": (motion.time, "s")}
    courses = zip(motion.drive, motion.drive_rate, motion.drive_acceleration, strict=True)
    for (name, coordinate, unit, _), course in zip(drive_words(motion.mechanism), courses, strict=True):
        for word, values, per in zip((coordinate, "rate", "acceleration"), course, PER_TIME, strict=True):
            columns[f"{name}.{word}"] = values, unit + per
    angle = np.unwrap(np.angle(motion.direction))
    for number, link in enumerate(links[1:], 1):
        course = angle[number], motion.angular_velocity[number], motion.angular_acceleration[number]
        for word, values, per in zip(("theta", "omega", "alpha"), course, PER_TIME, strict=True):
            columns[f"{link.name}.{word}"] = values, f"rad{per}"
    for point, link_number in points_of(motion.mechanism):
        for prefix, of, per in zip(("", "v", "a"), (position_of, velocity_of, acceleration_of), PER_TIME, strict=True):
            columns |= _vector(f"{point}.{prefix}{{}}", of(motion, link_number, point), f"m{per}")
    for place in motion.places:
        joint = place.joint
        word, unit = ("angle", "rad") if joint.turns else ("slide", "m")
        if f"{joint.name}.{word}" not in columns:
            coordinate = joint.coordinate(motion)
            columns[f"{joint.name}.{word}"] = np.unwrap(coordinate) if joint.turns else coordinate, unit
    for dyad in transmission_angles(motion):
        columns[f"{dyad.joint}.transmission_angle"] = dyad.angle, "rad"
    return columns


def _displaced(results: Results) -> dict[str, tuple[Any, str]]:
    """Return the columns with the displacements of points."""
    columns: dict[str, tuple[Any, str]] = {}
    for point, moved in results.displacements.items():
        columns |= _vector(f"{point}.d{{}}", moved, "m")
    return columns


def _effort_columns(results: Results) -> dict[str, tuple[Any, str]]:
    """Return the columns with the effort and power of each drive."""
    columns: dict[str, tuple[Any, str]] = {}
    words = zip(results.drive_words, results.cycle.efforts, results.motion.drive_rate, strict=True)
    for (name, *_, unit), effort, rate in words:
        columns[f"{name}.effort"], columns[f"{name}.power"] = (effort, unit), (effort * rate, "W")
    return columns


def joint_loads(results: Results) -> dict[tuple[str, int], tuple[Any, Any]]:
    """Return the force [N] and moment [N m] of each joint on each connected link, by joint name and link number.

    Forces are complex numbers. If more than two links meet at a pin, force and moment are the total load of the pin on
    the link. The moment is 0 if the joint transmits no moment.
    """
    loads: dict[tuple[str, int], tuple[Any, Any]] = {}
    forces = results.deflection.forces
    for place, force, moment in zip(results.motion.places, forces.force, forces.moment, strict=True):
        for link, sign in ((place.joint.child, 1.0), (place.joint.parent, -1.0)):
            before = loads.get((place.joint.name, link), (0.0, 0.0))
            loads[place.joint.name, link] = before[0] + sign * force, before[1] + sign * moment
    return loads


def _force_columns(results: Results) -> dict[str, tuple[Any, str]]:
    """Return the columns with joint forces, joint moments, and the shaking force and moment on the ground.

    Joint forces are given in the axes of the ground and in the axes of the link.
    """
    motion, forces = results.motion, results.deflection.forces
    columns: dict[str, tuple[Any, str]] = {}
    for (name, link), (force, moment) in joint_loads(results).items():
        on = f"_on_{motion.mechanism.links[link].name}"
        columns |= _vector(f"{name}.F{{}}{on}", force, "N")
        if link:
            own = force * np.conj(motion.direction[link])
            columns[f"{name}.Falong{on}"], columns[f"{name}.Facross{on}"] = (own.real, "N"), (own.imag, "N")
        if np.ndim(moment):
            columns[f"{name}.M{on}"] = moment, "N m"
    columns |= _vector("ground.F{}", forces.ground_force, "N")
    columns["ground.M"] = forces.ground_moment, "N m"
    return columns


def _table(columns: Mapping[str, tuple[Any, str]], results: Results) -> Table:
    """Return a table with the given columns, converted to the units of the report."""
    wide = results.motion.columns
    made = (Column(name, np.broadcast_to(values, wide), unit) for name, (values, unit) in columns.items())
    return Table(tuple(made)).in_units(results.scene.report_units)


def _vector(name: str, values: Any, unit: str) -> dict[str, tuple[Any, str]]:
    return {name.format("x"): (np.real(values), unit), name.format("y"): (np.imag(values), unit)}


def tables_of_positions(results: Results, with_motion: bool, patterns: Sequence[str]) -> dict[str, Table]:
    """Return the tables with one row per position, by file name.

    Raises
    ------
    RequestError
        A pattern of column names matches no column.
    """
    tables = {"positions": position_table(results)}
    if with_motion:
        tables["motion"] = motion_table(results)
    names = [column.name for table in tables.values() for column in table.columns]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            behind = "" if with_motion else "; --motion adds the columns of motion.csv"
            raise RequestError(f'--columns: no column matches "{pattern}"{likely(pattern, names)}{behind}')
    return {name: table.chosen(patterns) for name, table in tables.items()}


def append_table(path: Path, table: Table, first: bool) -> None:
    """Append the rows of a table to a CSV file. If `first` is true, write a new file with headings."""
    with path.open("wb" if first else "ab") as file:
        file.write(csv_bytes(table, head=first))


class FieldFile:
    """Numpy file (npz) with the main fields (quantities along beams), written chunk by chunk.

    The array `t` contains the times [s], shape (positions,). For each beam, `LABEL/x` contains equally spaced stations
    [m], shape (stations,). Each field of a beam is an array such as `LABEL/N`, shape (positions, stations). Temporary
    files collect the chunks.
    """

    def __init__(self, path: Path, positions: int, stations: int) -> None:
        self._path, self._shape = path, (positions, stations)
        self._xi = np.linspace(0.0, 1.0, stations)
        self._parts: dict[str, Path] = {}

    def add(self, results: Results) -> None:
        """Append the fields at the next chunk of positions."""
        labels = results.scene.labels
        self._append("t", results.motion.time, self._shape[:1])
        for label, length in zip(labels, results.deflection.length, strict=True):
            if f"{label}/x" not in self._parts:
                self._append(f"{label}/x", self._xi * length.item(), self._shape[1:])
        for field in (key for key, each in FIELDS.items() if each.main):
            for label, values in zip(labels, sample(results.deflection, field, self._xi), strict=True):
                self._append(f"{label}/{field}", values, self._shape)

    def close(self) -> None:
        """Combine the temporary files in one file."""
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
    """Write the main fields of a run to a file, see `FieldFile`."""
    file = FieldFile(path, len(results.motion.time), stations)
    file.add(results)
    file.close()
