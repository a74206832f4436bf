"""Files with values at each position of a run.

positions.csv contains results, motion.csv contains motion and forces, and fields.npz contains fields (quantities along
beams). Other tables contain the profiles of cams.
"""

import shutil
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, sample
from kinelast.answers.results import Results
from kinelast.outputs.table import Column, Table, csv_bytes
from kinelast.scene.data import Scene
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.cam_courses import cam_outline
from kinelast.tasks.request import RequestError
from kinelast.values.error import likely
from kinelast.values.figure import drive_words, points_of
from rigid import Motion, acceleration_of, position_of, transmission_angles, velocity_of

PROFILE = 1440  # number of points of a cam profile: four points per degree
PER_TIME = ("", "/s", "/s^2")  # endings of the units of a coordinate, its first and its second time derivative


def position_table(results: Results) -> Table:
    """Return the content of positions.csv, in the units of the report."""
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
    for (joint, link), (force, moment) in zip(results.joint_words, forces.in_joints, strict=True):
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
    """Return one table for each cam, by file name. The table contains the points of the profile over one turn.

    Coordinates are in the axes of the cam, which coincide with the axes of the ground at the start of the run. The
    table lists the points in the order in which the follower touches them. If the follower has a roller, the table also
    contains the pitch curve. If the cam is a groove, the table also contains the second flank, called `outer`.
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
    """Return the content of motion.csv, in the units of the report.

    Positions, velocities and accelerations are those of rigid links. The deflection analysis yields the displacements,
    the joint forces, and the efforts. The effort of a drive is its moment or its force.
    """
    motion = results.motion
    columns = {**motion_columns(motion), **_displaced(results), **_effort_columns(results), **_force_columns(results)}
    return _table(columns, results)


def motion_columns(motion: Motion) -> dict[str, tuple[Any, str]]:
    """Return the columns on the motion of drives, rigid links, points and joints: values and unit, by column name.

    A column name with `theta` means the angle of a link. The angle has no jumps of a full turn. The coordinate of a
    drive or joint is called `angle` if the drive or joint turns, and `slide` if it slides.
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
    """Return the columns with the displacements of points: values and unit, by column name."""
    columns: dict[str, tuple[Any, str]] = {}
    for point, moved in results.displacements.items():
        columns |= _vector(f"{point}.d{{}}", moved, "m")
    return columns


def _effort_columns(results: Results) -> dict[str, tuple[Any, str]]:
    """Return the columns with the effort (moment or force) and the power of each drive."""
    columns: dict[str, tuple[Any, str]] = {}
    words = zip(results.drive_words, results.cycle.efforts, results.motion.drive_rate, strict=True)
    for (name, *_, unit), effort, rate in words:
        columns[f"{name}.effort"], columns[f"{name}.power"] = (effort, unit), (effort * rate, "W")
    return columns


def joint_loads(results: Results) -> dict[tuple[str, int], tuple[Any, Any]]:
    """Return the force [N] and moment [N m] that a joint exerts on a connected link, by joint name and link number.

    Forces are complex numbers. If a pin connects more than two links, the force and the moment on a link are the sums
    of the loads from all other links. The moment is 0 if the joint transmits no moment.
    """
    loads: dict[tuple[str, int], tuple[Any, Any]] = {}
    forces = results.deflection.forces
    for place, (force, moment) in zip(results.motion.places, forces.in_joints, strict=True):
        for link, sign in ((place.joint.child, 1.0), (place.joint.parent, -1.0)):
            before = loads.get((place.joint.name, link), (0.0, 0.0))
            loads[place.joint.name, link] = before[0] + sign * force, before[1] + sign * moment
    return loads


def _force_columns(results: Results) -> dict[str, tuple[Any, str]]:
    """Return the columns with joint forces, joint moments, and the shaking force and moment on the ground.

    A joint force has four components: two in the axes of the ground and two in the axes of the link. A joint force on
    the ground has only two components.
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
    """Return a table in the units of the report. `columns` contains the values in SI units and the units."""
    wide = results.motion.columns
    made = (Column(name, np.broadcast_to(values, wide), unit) for name, (values, unit) in columns.items())
    return Table(tuple(made)).in_units(results.scene.report_units)


def _vector(name: str, values: Any, unit: str) -> dict[str, tuple[Any, str]]:
    return {name.format("x"): (np.real(values), unit), name.format("y"): (np.imag(values), unit)}


def tables_of_positions(results: Results, with_motion: bool, patterns: Sequence[str]) -> dict[str, Table]:
    """Return positions.csv and, if `with_motion` is True, motion.csv as tables, by file name without extension.

    If there are `patterns`, the tables contain only the columns with matching names.

    Raises
    ------
    RequestError
        One of the patterns matches no column name.
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
    """Append the rows of a table to a CSV file. If `first` is True, write a new file with headings and rows."""
    with path.open("wb" if first else "ab") as file:
        file.write(csv_bytes(table, head=first))


class FieldFile:
    """NumPy file (npz) with the main fields (quantities along beams) of a long run.

    The positions of the run are divided into chunks. `add` appends a chunk to temporary files, and `close` combines the
    temporary files in the npz file.

    The npz file contains the array `t`, times [s], shape (positions,). For the beam with the label LABEL, it contains
    the array `LABEL/x`, equally spaced locations along the beam [m], shape (stations,). It also contains an array for
    each field of the beam, such as `LABEL/N`, shape (positions, stations).
    """

    def __init__(self, path: Path, positions: int, stations: int) -> None:
        self._path, self._shape = path, (positions, stations)
        self._xi = np.linspace(0.0, 1.0, stations)
        self._parts: dict[str, Path] = {}

    def add(self, results: Results) -> None:
        """Append the times and fields of one chunk of positions to the temporary files."""
        labels = results.scene.labels
        self._append("t", results.motion.time, self._shape[:1])
        for label, length in zip(labels, results.deflection.length, strict=True):
            if f"{label}/x" not in self._parts:
                self._append(f"{label}/x", self._xi * length.item(), self._shape[1:])
        for field in (key for key, each in FIELDS.items() if each.main):
            for label, values in zip(labels, sample(results.deflection, field, self._xi), strict=True):
                self._append(f"{label}/{field}", values, self._shape)

    def close(self) -> None:
        """Write the npz file from the temporary files, and remove the temporary files."""
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
    """Write the main fields of a whole run to an npz file. `FieldFile` describes the content."""
    file = FieldFile(path, len(results.motion.time), stations)
    file.add(results)
    file.close()
