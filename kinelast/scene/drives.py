"""Drives of a scene, the laws that they follow or the efforts that they are, and the cams that give these motions."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from math import isclose, isfinite, nan, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.scene.error import fault, known_name, require_absent
from kinelast.scene.format import SceneTable
from kinelast.scene.links import Points, drawn_direction, known_point
from kinelast.scene.loads import APART, factor_law
from kinelast.scene.moved_joint import Drive, coordinate, moved_joint
from kinelast.scene.names import drive_names
from kinelast.scene.numbers import phase, quantity, real, require, vector
from kinelast.scene.parts.motors import motor_of
from kinelast.scene.quantities import Abscissa, Angle, Length, Time
from kinelast.scene.sections import materials_of, poisson_of
from kinelast.scene.tables import PER_LENGTH, CamTable, DriveTable
from kinelast.scene.units import Quantity
from machine.cams import INNER, Cam, contact_modulus
from rigid import (
    GROUND,
    ConstantSpeed,
    LawError,
    Link,
    Mechanism,
    Reals,
    RepeatedLaw,
    Segment,
    SegmentedLaw,
    Slider,
    TableLaw,
)

if TYPE_CHECKING:
    from exchange import Columns
    from rigid.dynamics import Effort

DriveLaw = Callable[[Any], tuple[Reals, Reals, Reals]]
SPEEDS = {"rad/s": 'a speed of rotation, as in "100 rad/s" or "3000 rpm"', "m/s": 'a speed, as in "0.2 m/s"'}
EFFORTS = {"rad": ("N m", 'a moment, as in "3 N m"'), "m": ("N", 'a force, as in "2 kN"')}


@dataclass(frozen=True, eq=False)
class DriveEffort:
    """A drive given as an effort; its motion follows.

    `effort` [N m or N] along its coordinate, which is `start` [rad or m] with the rate `speed` at first.
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
    """All drives with their laws or efforts, in the order of the file; with the inertia of their motors.

    Parameters
    ----------
    files
        Texts of the files that motions are in, by their names.
    """
    built: list[tuple[Drive, DriveLaw | DriveEffort]] = []
    for number, table in enumerate(scene.drives, 1):
        where = f"drives[{number}]"
        drive = moved_joint(where, "", table, links, sliders)
        if scene.structure_only:
            built.append((drive, ConstantSpeed(0.0, 0.0)))
            continue
        _require_one_way(where, table)
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
            raise fault("run", "duration", 'the key is missing: with an effort, say how long to run, as in "50 ms"')
        built.append((drive, _effort(where, table, unit, start, duration, links, sliders)))
    return tuple(drive for drive, _ in built), tuple(law for _, law in built)


def _require_one_way(where: str, table: DriveTable) -> None:
    """Raise where a drive is told in no way or in several, or keys of another way are there."""
    ways = [key for key in ("law", "motion", "effort") if getattr(table, key) is not None]
    if len(ways) > 1 or (not ways and table.speed is None) or (ways and ways != ["effort"] and table.speed is not None):
        raise fault(where, "speed", "expected one of speed, law, motion and effort, how the drive moves")
    if table.effort is None:
        places = "belongs to an effort; a motion through places is motion = [[time, place], ...]"
        require_absent(where, table, ("table", "against", "extend"), places)
    if table.repeat and ways not in (["law"], ["motion"]):
        raise fault(where, "repeat", "belongs to a law or a motion")


def _start(where: str, table: DriveTable, unit: str, links: Mapping[str, Link], places: Points) -> Any:
    """Coordinate at the start [rad or m]: as given, else as drawn."""
    if table.motion is not None:
        if table.start is not None:
            raise fault(where, "start", "the motion tells where the drive starts: leave it out")
        return 0.0
    if table.start is not None:
        return coordinate(where, "start", table.start, unit)
    if table.link is None:
        return 0.0
    one, other = (drawn_direction(links[name], places) for name in (table.on, table.link))
    if one is None or other is None:
        raise fault(where, "start", "the key is missing: the drawing does not show at which angle the link starts")
    return phase(other * one.conjugate())


def _speed(where: str, table: DriveTable, unit: str) -> Any:
    if table.speed is None:
        return 0.0
    if table.speed.unit not in ("", f"{unit}/s"):
        problem = f"expected {SPEEDS[f'{unit}/s']}, got {float(table.speed):g} {table.speed.unit}"
        raise fault(where, "speed", problem)
    if not table.speed.unit and unit == "m" and table.speed.per_length != 1.0:
        raise fault(where, "speed", f"expected {SPEEDS['m/s']}, in quotes with its unit where units are given")
    return real(table.speed)


def _law(where: str, table: DriveTable, unit: str, start: Any, motion: MotionTable | None) -> DriveLaw:
    if table.law is None and table.motion is None:
        return ConstantSpeed(start, _speed(where, table, unit))
    law: SegmentedLaw | TableLaw
    if motion is not None:
        law = TableLaw(motion.times, motion.places, table.repeat)
    else:
        law = _segments(where, table, unit, start) if table.law is not None else _motion(where, table, unit)
    return _repeated(where, "repeat", law) if table.repeat else law


def _repeated(where: str, key: str, law: SegmentedLaw | TableLaw) -> RepeatedLaw:
    """A law over and over again; raises where it does not end at the speed at which it starts."""
    first, last = float(law([0.0])[1][0]), law.final_speed
    if not isclose(first, last, rel_tol=1e-9, abs_tol=1e-12):
        raise fault(where, key, f"starts at a speed of {first:g} and ends at {last:g}: repeated, the speed would jump")
    return RepeatedLaw(law)


def _segments(where: str, table: DriveTable, unit: str, start: float) -> SegmentedLaw:
    assert table.law is not None
    level, segments = start, []
    for number, piece in enumerate(table.law, 1):
        key = f"law[{number}]"
        if piece.curve == "dwell":
            if piece.to is not None or piece.by is not None:
                raise fault(where, key, "a dwell stays where it is: leave to and by out")
            segments.append(Segment("dwell", float(piece.duration)))
            continue
        if (piece.to is None) == (piece.by is None):
            raise fault(where, key, "expected either to, where the segment ends, or by, how far it goes")
        if piece.by is not None:
            rise = coordinate(where, f"{key}.by", piece.by, unit)
        else:
            assert piece.to is not None
            rise = coordinate(where, f"{key}.to", piece.to, unit) - level
        segments.append(Segment(piece.curve, float(piece.duration), rise))
        level = level + rise  # which may be an array: the start stays
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
    if times[0] != 0 or any(after - before <= APART * times[-1] for before, after in pairwise(times)):
        raise fault(where, "motion", "expected times that start at 0 and grow from entry to entry")
    return TableLaw(times, places, table.repeat)


LEAST = 4  # entries of a spline
KINDS = {"rad": ("angle", Angle), "m": ("place", Length)}  # of a drive's coordinate
HEADS = {"angle": "angle [deg]", "place": "place [mm]"}
WORD = re.compile(r"[^\W\d_]+|°")  # so that "t_ms" has two
OTHER_UNITS = {"sec", "secs", "msec", "usec", "gon", "grad"}  # that headings have, and scenes do not


@dataclass(frozen=True)
class MotionTable:
    """A motion that stands in a CSV file.

    `times` [s] and `places` [rad or m], and `written`: both as they may stand in a scene, with their units.
    """

    times: tuple[float, ...]
    places: tuple[float, ...]
    written: tuple[tuple[str | float, str | float], ...]


def motion_of(scene: SceneTable, number: int, files: Mapping[str, str]) -> MotionTable:
    """The motion that a drive, counted from 1, has in a file; `files` are their texts by name.

    Raises
    ------
    SceneError
        The file holds a mistake; the message tells its line.
    """
    table = scene.drives[number - 1]
    assert isinstance(table.motion, str)
    try:
        return motion_table(files[table.motion], "rad" if table.turns else "m", PER_LENGTH[scene.units])
    except ValueError as error:
        raise fault(f"drives[{number}]", "motion", f"{table.motion}: {error}") from None


@lru_cache(maxsize=8)
def motion_table(text: str, unit: str, per_length: float = 1.0) -> MotionTable:
    r"""The motion in a CSV text: times and coordinates, in the units of the heading or, of a cell, with its own.

    Parameters
    ----------
    unit
        SI unit of the coordinate, rad or m.
    per_length
        Metres in the unit that bare lengths are in; other bare numbers are in SI units.

    Raises
    ------
    ValueError
        A line cannot be read, times do not start at 0 and grow, or there are too few; the message tells the line.

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
    (times, written), (places, told) = columns
    lines = [line for line, _ in table.rows]
    if len(lines) < LEAST:
        raise ValueError(f"expected {LEAST} lines of numbers at least, got {len(lines)}")
    if times[0] != 0.0:
        raise ValueError(f"line {lines[0]}: expected times that start at 0, got {written[0]}: take it from all of them")
    for line, before, after in zip(lines[1:], times, times[1:], strict=False):
        if after - before <= APART * times[-1]:
            raise ValueError(f"line {line}: expected times that grow from line to line: leave the line out")
    return MotionTable(tuple(times), tuple(places), tuple(zip(written, told, strict=True)))


def _require_units_understood(table: Columns, column: int, name: str, head: str) -> None:
    """Raise where a column tells no unit in brackets, but a line above it holds a word or a mark of one."""
    if table.heading(column)[1]:
        return
    headings = [(line, cells[column], any(mark in cells[column] for mark in "[({<")) for line, cells in table.headings]
    for line, text, marked in [*headings, *((line, text, False) for line, text in table.titles)]:
        words = WORD.findall(text)
        last = len(words) - 1
        units = [word for at, word in enumerate(words) if _is_unit(word) and (at == last or (at and word != "in"))]
        if marked or (units and (last or len(units[0]) > 1)):
            problem = f'"{text}" may hold a unit, and none is understood for the {name}: each column has a heading'
            raise ValueError(f'line {line}: {problem} with its unit in brackets, as in "{head}"')


def _is_unit(word: str) -> bool:
    """Whether a word is one for a unit of time, angle or length."""
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
    """Numbers of a column in SI units, and as they may stand in a scene."""
    head, unit = table.heading(column)
    try:
        factor = float(kind.read(f"1 {unit}" if unit else 1.0, per_length))
    except ValueError as error:
        raise ValueError(f"line {head}: {error}; a unit stands in brackets, as in [ms] or [deg]") from None
    values: list[float] = []
    written: list[str | float] = []
    for line, cells in table.rows:
        cell = cells[column]
        try:
            number = float(cell)
            value, told = factor * number, f"{cell} {unit}" if unit else number
        except ValueError:
            value, told = _with_unit(kind, cell, line), cell
        if not isfinite(value):
            raise ValueError(f"line {line}: expected {kind.expected}, got {cell}: leave the line out")
        values.append(value)
        written.append(told)
    return values, written


def _with_unit(kind: type[Quantity], cell: str, line: int) -> float:
    """A cell that tells its own unit."""
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
    size, (own, expected) = float(table.effort), EFFORTS[unit]
    if table.effort.unit not in ("", own):
        raise fault(where, "effort", f"expected {expected}, got {size:g} {table.effort.unit}")
    factor = factor_law(where, table, duration, links, sliders)
    if factor is None:
        return DriveEffort(Effort(size), start, _speed(where, table, unit))
    curve = factor.curve
    law = replace(factor, curve=lambda place: size * curve(place))
    return DriveEffort(Effort(law), start, _speed(where, table, unit))


WHOLE = 1e-9  # of a turn or a motion, by which a cam may miss its start
SMOOTH = 1e-6  # of a speed, by which it may be another one there
INSTANTS = 257  # of a run, at which the motion is held against that a turn of the cam later
POISSON = 0.3  # of metals, where a material tells none


def build_cams(
    scene: SceneTable, mechanism: Mechanism, laws: Sequence[DriveLaw | DriveEffort], duration: Any
) -> dict[str, Cam]:
    """Cams by their names.

    Raises
    ------
    SceneError
        A part that there is not, a follower that is told in no way or in two, a motion or speed that gives no closed
        cam.
    """
    cams = {name: _cam(f"cams.{name}", table, scene, mechanism, laws, duration) for name, table in scene.cams.items()}
    giver: dict[int, str] = {}
    for name, cam in cams.items():
        if (first := giver.setdefault(cam.drive, name)) != name:
            problem = f'has its motion from the cam "{first}" already; a groove, flank = "both", has two flanks'
            raise fault(f"cams.{name}", "drive", f'the drive "{drive_names(mechanism)[cam.drive]}" {problem}')
    return cams


def _cam(
    where: str,
    table: CamTable,
    scene: SceneTable,
    mechanism: Mechanism,
    laws: Sequence[DriveLaw | DriveEffort],
    duration: Any,
) -> Cam:
    moving = [link.name for link in mechanism.links[1:] if link.name in scene.links]
    known_name(where, "follower", table.follower, moving, "moving link")
    drive = _driven_by(where, table, scene, mechanism, laws)
    link = mechanism.links[mechanism.index[table.follower]]
    if (table.roller is None) == (table.face is None):
        raise fault(where, "roller", "expected either roller, its centre, or face, two points of a flat one")
    centre = _shaft(where, table, mechanism)
    if table.roller is not None:
        _require_apart(where, table, mechanism, centre)
        form: dict[str, Any] = {"roller": link.points[table.roller], "radius": real(table.roller_radius or 0.0)}
        form["points"] = (table.roller,)
    else:
        assert table.face is not None
        for point in table.face:
            known_point(where, "face", point, link.points, link.name)
        start, end = (link.points[point] for point in table.face)
        require(np.abs(end - start) > 0.0, where, "face", "expected two points at two places")
        require_absent(where, table, ("roller_radius",), "belongs to a roller")
        if table.flank != INNER:
            raise fault(
                where, "flank", "a flat face has the cam on the side of its shaft: leave it out, or give a roller"
            )
        form = {"face": (start, end), "points": table.face}
    speed = _cam_speed(where, table, duration)
    _require_closed(where, mechanism, laws, speed, duration)
    form |= {"follower": table.follower, "flank": table.flank, **_touching(where, table, scene)}
    return Cam(mechanism.index[table.follower], drive, centre, speed, **form)


def _driven_by(
    where: str, table: CamTable, scene: SceneTable, mechanism: Mechanism, laws: Sequence[DriveLaw | DriveEffort]
) -> int:
    """Number of the drive that has its motion from a cam."""
    names = drive_names(mechanism)
    if table.drive is None and len(names) > 1:
        told = ", ".join(f'"{name}"' for name in names)
        raise fault(where, "drive", f"the key is missing: which of the drives {told} has its motion from the cam")
    if table.drive is not None:
        known_name(where, "drive", table.drive, names, "drive")
    number = 0 if table.drive is None else names.index(table.drive)
    if isinstance(laws[number], DriveEffort):
        problem = f'the drive "{names[number]}" is an effort: a cam gives a motion, by speed, law or motion'
        raise fault(where, "drive", problem)
    for key in ("motor", "cylinder"):
        if getattr(scene.drives[number], key) is not None:
            problem = f'the drive "{names[number]}" has a {key} of its own: take it away, or the cam'
            raise fault(where, "drive", problem)
    return number


def _shaft(where: str, table: CamTable, mechanism: Mechanism) -> Any:
    """Place of a cam's shaft [m]."""
    if isinstance(table.centre, str):
        known_point(where, "centre", table.centre, mechanism.links[0].points, GROUND)
        return mechanism.links[0].points[table.centre]
    return vector(table.centre)


def _require_apart(where: str, table: CamTable, mechanism: Mechanism, centre: Any) -> None:
    """Raise where a roller is no point of its link, does not move, or lies on the shaft as drawn."""
    assert table.roller is not None
    ground, points = mechanism.links[0].points, mechanism.links[mechanism.index[table.follower]].points
    known_point(where, "roller", table.roller, points, table.follower)
    if table.roller in ground:
        raise fault(where, "roller", f'"{table.roller}" is a point of the ground, which no cam can move')
    drawn = mechanism.drawing.get(table.roller)
    if drawn is None:
        return
    reach, radius = abs(drawn - centre), real(table.roller_radius or 0.0)
    require(reach > WHOLE * (abs(drawn) + abs(centre)), where, "roller",
            f'"{table.roller}" is drawn at the centre of the shaft: give the cam another centre')  # fmt: skip
    if table.flank == INNER:

        def problem(of: Any) -> str:
            size, apart = (quantity(float(of(each)), "m") for each in (radius, reach))
            return f"a roller of {size} covers the shaft, which is {apart} from its centre as drawn"

        require(reach > radius, where, "roller_radius", problem)


def _cam_speed(where: str, table: CamTable, duration: Any) -> Any:
    """Speed of a cam's shaft [rad/s]: as told, whole turns in the run, or one turn in it."""
    if table.speed is None:
        return 2.0 * pi / duration
    speed = real(table.speed)
    turns = abs(speed) * duration / (2.0 * pi)

    def problem(of: Any) -> str:
        one = 60.0 / of(duration)
        return (
            f"makes {of(turns):.6g} turns in the run of {of(duration):.6g} s, expected whole ones: {one:.8g} rpm is one"
        )

    require((turns > 0.5) & (abs(turns - np.round(turns)) <= WHOLE * turns), where, "speed", problem)
    return speed


def _require_closed(
    where: str, mechanism: Mechanism, laws: Sequence[DriveLaw | DriveEffort], speed: Any, duration: Any
) -> None:
    """Raise where a turn of the cam does not bring the drives back to where they were, with the same speeds."""
    turn = 2.0 * pi / abs(speed)
    times = np.linspace(0.0, 1.0, INSTANTS) * np.maximum(duration - turn, 0.0)
    for name, drive, law in zip(drive_names(mechanism), mechanism.drives, laws, strict=True):
        if isinstance(law, DriveEffort):
            raise fault(where, "drive", f'the drive "{name}" is an effort, of which no cam can know the motion')
        (first, before, _), (second, after, _) = law(times), law(np.minimum(times + turn, duration))
        what, unit, size = ("angle", "deg", 180.0 / pi) if drive.turns else ("slide", "mm", 1e3)
        missed = second - first
        if drive.turns:
            missed = missed - 2.0 * pi * np.round(missed / (2.0 * pi))
        off, reach, corner, fastest = (_greatest(each) for each in (missed, first, after - before, before))
        head = f'the {what} of the drive "{name}" is up to'
        tail = f"{unit} off after a turn of the cam: end its law where it starts, or give the cam another speed"

        def problem(of: Any, off: Any = off, size: float = size, head: str = head, tail: str = tail) -> str:
            return f"{head} {of(off) * size:.4g} {tail}"

        require(off <= WHOLE * (1.0 + np.abs(reach) if drive.turns else reach), where, "speed", problem)
        corners = f'the drive "{name}" comes back after a turn of the cam at another speed: the cam would have a corner'
        require(corner <= SMOOTH * np.maximum(fastest, SMOOTH), where, "speed", corners)


def _greatest(values: Any) -> Any:
    """Greatest magnitude over the instants, the last axis: a number, or of many designs shape (designs, 1)."""
    return np.max(np.abs(values), axis=-1, keepdims=np.ndim(values) > 1)


def _touching(where: str, table: CamTable, scene: SceneTable) -> dict[str, Any]:
    """Width of the contact and its modulus, where they are known."""
    told: dict[str, Any] = {} if table.width is None else {"width": real(table.width)}
    if table.pressure is not None:
        for key in ("width", "material"):
            if getattr(table, key) is None:
                raise fault(where, key, "the key is missing: pressure is by the width and the material of the contact")
        if table.roller is not None and table.roller_radius is None:
            raise fault(where, "roller_radius", "the key is missing: a knife edge presses without bounds")
    if table.material is None:
        require_absent(where, table, ("follower_material",), "belongs beside material, that of the cam")
        return told
    pairs: list[Any] = []
    yields: list[Any] = []
    for key, name in (("material", table.material), ("follower_material", table.follower_material or table.material)):
        known = materials_of(scene, [name])
        known_name(where, key, name, known, "material")
        poisson = poisson_of(known[name], name)
        pairs += [real(known[name].E), POISSON if poisson is None else poisson]
        yields.append(nan if (least := known[name].yield_stress) is None else real(least))
    return {**told, "modulus": contact_modulus(*pairs), "yield_stress": np.fmin(yields[0], yields[1])}
