"""Drives of a scene with their laws or efforts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import pairwise
from math import isclose, isfinite
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import replace

from kinelast.scene.format import SceneTable
from kinelast.scene.links import Points, drawn_direction
from kinelast.scene.loads import MIN_SPACING, factor_law
from kinelast.scene.moved_joint import Drive, coordinate, moved_joint
from kinelast.scene.parts.motors import motor_of
from kinelast.scene.tables import PER_LENGTH, DriveTable
from kinelast.values.error import fault, require_absent
from kinelast.values.numbers import EXPECTED, phase, real, require_unit
from kinelast.values.quantities import Abscissa, Length, PlaneAngle, Time
from kinelast.values.units import Quantity
from rigid import ConstantSpeed, LawError, Link, Reals, RepeatedLaw, Segment, SegmentedLaw, Slider, TableLaw

if TYPE_CHECKING:
    from exchange import Columns
    from rigid.dynamics import Effort

DriveLaw = Callable[[Any], tuple[Reals, Reals, Reals]]


class DriveEffort(Struct, frozen=True, eq=False):
    """A drive given by its effort; its motion follows by integration.

    `effort` [N m or N] acts along the coordinate. The initial coordinate is `start` [rad or m], its rate `speed`.
    """

    effort: Effort
    start: float
    speed: float


def build_drives(
    scene: SceneTable,
    links: Mapping[str, Link],
    sliders: Mapping[str, Slider],
    places: Points,
    files: Mapping[str, str],
) -> tuple[tuple[Drive, ...], tuple[DriveLaw | DriveEffort, ...]]:
    """Return all drives and the law or effort of each drive, in the order of the file.

    Motors add their inertia to drives.

    Parameters
    ----------
    files
        Texts of the motion files, by file name.
    """
    built: list[tuple[Drive, DriveLaw | DriveEffort]] = []
    for number, table in enumerate(scene.drives, 1):
        where = f"drives[{number}]"
        drive = moved_joint(where, "", table, links, sliders)
        if scene.structure_only:
            built.append((drive, ConstantSpeed(0.0, 0.0)))
            continue
        _require_one_motion(where, table)
        motor = motor_of(scene, number)
        drive = drive if motor is None else replace(drive, inertia=motor.reduced_inertia)
        unit = "rad" if drive.turns else "m"
        start = _start(where, table, unit, links, places)
        if table.effort is None:
            motion = motion_of(scene, number, files) if isinstance(table.motion, str) else None
            built.append((drive, _law(where, table, unit, start, motion)))
            continue
        duration = scene.run.duration
        if duration is None:
            raise fault("run", "duration", 'the key is missing: an effort needs the duration of the run, as in "50 ms"')
        built.append((drive, _effort(where, table, unit, start, duration, links, sliders)))
    return tuple(drive for drive, _ in built), tuple(law for _, law in built)


def _require_one_motion(where: str, table: DriveTable) -> None:
    """Raise SceneError if a drive does not have exactly one of the keys speed, law, motion and effort.

    Also raise it if the drive has a key that belongs to another one of these.
    """
    ways = [key for key in ("law", "motion", "effort") if getattr(table, key) is not None]
    if len(ways) > 1 or (not ways and table.speed is None) or (ways and ways != ["effort"] and table.speed is not None):
        raise fault(where, "speed", "expected exactly one of speed, law, motion and effort")
    if table.effort is None:
        problem = "belongs to an effort; for a table of coordinates use motion = [[time, coordinate], ...]"
        require_absent(where, table, ("table", "against", "extend"), problem)
    if table.repeat and ways not in (["law"], ["motion"]):
        raise fault(where, "repeat", "belongs to a law or a motion")


def _start(where: str, table: DriveTable, unit: str, links: Mapping[str, Link], places: Points) -> Any:
    """Return the coordinate of a drive at the start [rad or m]: as given or, by default, as drawn."""
    if table.motion is not None:
        if table.start is not None:
            raise fault(where, "start", "the motion table already gives the start: remove this key")
        return 0.0
    if table.start is not None:
        return coordinate(where, "start", table.start, unit)
    if table.link is None:
        return 0.0
    one, other = (drawn_direction(links[name], places) for name in (table.on, table.link))
    if one is None or other is None:
        raise fault(where, "start", "the key is missing: the drawing does not give the angle of the link")
    return phase(other * one.conjugate())


def _speed(where: str, table: DriveTable, unit: str) -> Any:
    if table.speed is None:
        return 0.0
    require_unit(where, "speed", table.speed, f"{unit}/s")
    if not table.speed.unit and unit == "m" and table.speed.per_length != 1.0:
        raise fault(where, "speed", f"expected {EXPECTED['m/s']}, in quotes with its unit, as the file has units")
    return real(table.speed)


def _law(where: str, table: DriveTable, unit: str, start: Any, motion: MotionTable | None) -> DriveLaw:
    if table.law is None and table.motion is None:
        return ConstantSpeed(start, _speed(where, table, unit))
    law: SegmentedLaw | TableLaw
    if motion is not None:
        law = TableLaw(motion.times, motion.places, table.repeat)
    else:
        law = _segments(where, table, unit, start) if table.law is not None else _motion(where, table, unit)
    return _repeated(where, law) if table.repeat else law


def _repeated(where: str, law: SegmentedLaw | TableLaw) -> RepeatedLaw:
    """Return a law that repeats. Raise SceneError if its final speed differs from its initial speed."""
    first, last = float(law([0.0])[1][0]), law.final_speed
    if not isclose(first, last, rel_tol=1e-9, abs_tol=1e-12):
        raise fault(
            where, "repeat", f"starts at a speed of {first:g} and ends at {last:g}: repeated, the speed would jump"
        )
    return RepeatedLaw(law)


def _segments(where: str, table: DriveTable, unit: str, start: float) -> SegmentedLaw:
    assert table.law is not None
    level, segments = start, []
    for number, piece in enumerate(table.law, 1):
        key = f"law[{number}]"
        if piece.curve == "dwell":
            if piece.to is not None or piece.by is not None:
                raise fault(where, key, "a dwell has no stroke: remove to and by")
            segments.append(Segment("dwell", float(piece.duration)))
            continue
        if (piece.to is None) == (piece.by is None):
            raise fault(where, key, "expected either to, the end of the segment, or by, its stroke")
        if piece.by is not None:
            rise = coordinate(where, f"{key}.by", piece.by, unit)
        else:
            assert piece.to is not None
            rise = coordinate(where, f"{key}.to", piece.to, unit) - level
        segments.append(Segment(piece.curve, float(piece.duration), rise))
        level = level + rise  # not in-place, because the start may be an array
    try:
        return SegmentedLaw(start, tuple(segments))
    except LawError as error:
        raise fault(where, f"law[{error.segment}]", error.problem) from None


def _motion(where: str, table: DriveTable, unit: str) -> TableLaw:
    assert isinstance(table.motion, list)
    times = tuple(float(time) for time, _ in table.motion)
    places = tuple(
        coordinate(where, f"motion[{number}]", place, unit) for number, (_, place) in enumerate(table.motion, 1)
    )
    if times[0] != 0 or any(after - before <= MIN_SPACING * times[-1] for before, after in pairwise(times)):
        raise fault(where, "motion", "expected times that start at 0 and grow from entry to entry")
    return TableLaw(times, places, table.repeat)


MIN_ENTRIES = 4  # smallest number of points for a cubic spline
KINDS = {"rad": ("angle", PlaneAngle), "m": ("place", Length)}  # by unit: name in messages, and class
HEADS = {"angle": "angle [deg]", "place": "place [mm]"}
WORD = re.compile(r"[^\W\d_]+|°")  # "t_ms" contains two words
OTHER_UNITS = {"sec", "secs", "msec", "usec", "gon", "grad"}  # words that are units, although scenes do not accept them


class MotionTable(Struct, frozen=True):
    """A motion from a CSV file: `times` [s] and `places` [rad or m].

    `written` contains pairs of time and coordinate in the units of the file.
    """

    times: tuple[float, ...]
    places: tuple[float, ...]
    written: tuple[tuple[str | float, str | float], ...]


def motion_of(scene: SceneTable, number: int, files: Mapping[str, str]) -> MotionTable:
    """Return the motion of drive `number` (from 1) from its file. `files` contains the texts of all files by name.

    Raises
    ------
    SceneError
        The file contains an error; the message gives its line.
    """
    table = scene.drives[number - 1]
    assert isinstance(table.motion, str)
    try:
        return motion_table(files[table.motion], "rad" if table.turns else "m", PER_LENGTH[scene.units])
    except ValueError as error:
        raise fault(f"drives[{number}]", "motion", f"{table.motion}: {error}") from None


@lru_cache(maxsize=8)
def motion_table(text: str, unit: str, per_length: float = 1.0) -> MotionTable:
    r"""Return the motion from a CSV text. Its headings or cells give the units of times and coordinates.

    Parameters
    ----------
    unit
        SI unit of the coordinate, rad or m.
    per_length
        Metres per length unit of the file; other numbers without a unit are in SI units.

    Raises
    ------
    ValueError
        A line cannot be read, the times do not start at 0 and increase, or there are too few lines. The message gives
        the number of the line.

    Examples
    --------
    >>> motion_table("time [ms],angle [deg]\n0,0\n10,90\n20,45\n30,0", "rad").written[1]
    ('10 ms', '90 deg')
    """
    from exchange import columns_of

    name, kind = KINDS[unit]
    table = columns_of(text, ("time", name))
    for k, (of, head) in enumerate((("time", "time [ms]"), (name, HEADS[name]))):
        _require_units_understood(table, k, of, head)
    columns = [_column(table, k, of, per_length) for k, of in enumerate((Time, kind))]
    (times, written_times), (places, written_places) = columns
    lines = [line for line, _ in table.rows]
    if len(lines) < MIN_ENTRIES:
        raise ValueError(f"expected at least {MIN_ENTRIES} lines of numbers, got {len(lines)}")
    if times[0] != 0.0:
        raise ValueError(f"line {lines[0]}: expected times from 0, got {written_times[0]}: subtract it from all times")
    for line, before, after in zip(lines[1:], times, times[1:], strict=False):
        if after - before <= MIN_SPACING * times[-1]:
            raise ValueError(f"line {line}: expected increasing times: remove the line")
    return MotionTable(tuple(times), tuple(places), tuple(zip(written_times, written_places, strict=True)))


def _require_units_understood(table: Columns, column: int, name: str, head: str) -> None:
    """Raise if a line above a column contains a unit, but not in brackets."""
    if table.heading(column)[1]:
        return
    headings = [(line, cells[column], any(mark in cells[column] for mark in "[({<")) for line, cells in table.headings]
    for line, text, marked in [*headings, *((line, text, False) for line, text in table.titles)]:
        words = WORD.findall(text)
        last = len(words) - 1
        units = [word for at, word in enumerate(words) if _is_unit(word) and (at == last or (at and word != "in"))]
        if marked or (units and (last or len(units[0]) > 1)):
            problem = f'"{text}" seems to contain a unit, but not in a known form for the {name}: write each heading'
            raise ValueError(f'line {line}: {problem} with its unit in brackets, as in "{head}"')


def _is_unit(word: str) -> bool:
    """Return True for a unit of time, angle or length."""
    if word.lower() in OTHER_UNITS:
        return True
    try:
        Abscissa.read(f"1 {word}")
    except ValueError:
        return False
    return True


def _column(
    table: Columns, column: int, kind: type[Quantity], per_length: float
) -> tuple[list[float], list[str | float]]:
    """Return the numbers of a column in SI units, and the same numbers in the form used in a scene file."""
    head, unit = table.heading(column)
    try:
        factor = float(kind.read(f"1 {unit}" if unit else 1.0, per_length))
    except ValueError as error:
        raise ValueError(f"line {head}: {error}; write a unit in brackets, as in [ms] or [deg]") from None
    values: list[float] = []
    written: list[str | float] = []
    for line, cells in table.rows:
        cell = cells[column]
        try:
            number = float(cell)
            value, text = factor * number, f"{cell} {unit}" if unit else number
        except ValueError:
            value, text = _with_unit(kind, cell, line), cell
        if not isfinite(value):
            raise ValueError(f"line {line}: expected {kind.expected}, got {cell}: remove the line")
        values.append(value)
        written.append(text)
    return values, written


def _with_unit(kind: type[Quantity], cell: str, line: int) -> float:
    """Return the value of a cell that has its own unit."""
    try:
        return float(kind.read(cell))
    except ValueError as error:
        raise ValueError(f"line {line}: {error}") from None


def _effort(
    where: str,
    table: DriveTable,
    unit: str,
    start: float,
    duration: float,
    links: Mapping[str, Link],
    sliders: Mapping[str, Slider],
) -> DriveEffort:
    from rigid.dynamics import Effort

    assert table.effort is not None
    size = float(table.effort)
    require_unit(where, "effort", table.effort, "N m" if unit == "rad" else "N")
    factor = factor_law(where, table, duration, links, sliders)
    if factor is None:
        return DriveEffort(Effort(size), start, _speed(where, table, unit))
    curve = factor.curve
    law = replace(factor, curve=lambda place: size * curve(place))
    return DriveEffort(Effort(law), start, _speed(where, table, unit))
