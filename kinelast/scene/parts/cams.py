"""Cams that give drives their motions: table, builder and figures."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import reduce
from math import nan, pi
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from kinelast.scene.error import SceneError, fault, known_name, known_point, require_absent
from kinelast.scene.figure import LEAST, Figure, Kind, RangeCheck, each, items_of, least
from kinelast.scene.names import drive_names
from kinelast.scene.numbers import quantity, real, require, vector
from kinelast.scene.part import Assembly, Part
from kinelast.scene.parts.cam_courses import (
    CAM,
    CAM_NEEDS,
    FACED,
    HELD,
    KEY,
    PRESSED,
    ROLLED,
    cam_columns,
    cam_faults,
    cam_findings,
    cam_flanks,
    cam_force,
    cam_lag,
    cam_preload,
    cam_pressure,
    cam_row,
    cam_torque,
)
from kinelast.scene.quantities import CamSpeed, PressureAngle, Size, Stress
from kinelast.scene.tables import Place, StrictTable
from machine.cams import HERTZ_RANGE, INNER, Cam, CamCourse, CamPush, cam_course, contact_modulus
from rigid import GROUND, Load, Mechanism, MechanismError, motion
from rigid.kinematics import by_laws

if TYPE_CHECKING:
    from elastic import Largest
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene

LOOKED_AT = np.array([0.0, 0.137, 0.293, 0.471, 0.683])  # parts of a run, at which a cam has to move its follower
UNMOVED = 1e-9  # of the distance from the shaft by the drive's coordinate
WHOLE = 1e-9  # of a turn or a motion, by which a cam may miss its start
SMOOTH = 1e-6  # of a speed, by which it may be another one there
INSTANTS = 257  # of a run, at which the motion is held against that a turn of the cam later
POISSON = 0.3  # of metals, where a material tells none


class CamTable(StrictTable, frozen=True, kw_only=True):
    """A cam that moves a drive: its profile follows from the motion of the follower; limits of its contact."""

    follower: str  #: link moved by the cam
    centre: str | Place  #: camshaft centre: a ground point, or `[x, y]` in the drawing
    roller: str | None = None  #: roller centre, a point of the follower; or use `face`
    roller_radius: Size | None = None  #: needed for `pressure` [0: knife edge]
    face: tuple[str, str] | None = None  #: two points of the follower: ends of a flat face
    drive: str | None = None  #: link or slider of its drive [the only drive]
    #: camshaft speed, positive counter-clockwise, whole turns in a run [one turn in a run]
    speed: CamSpeed | None = None
    #: `"inner"`: cam inside the path; `"outer"`: ring around it; `"both"`: groove
    flank: Literal["inner", "outer", "both"] = "inner"
    push: bool = True  #: `false`: force along the drive coordinate instead of at the contact
    width: Size | None = None  #: contact width [no pressure]
    material: str | None = None  #: cam material, under `[materials]` or a standard name [no pressure]
    follower_material: str | None = None  #: material of roller or face [as `material`]
    pressure: Stress | None = None  #: upper limit of Hertz's pressure [none]
    pressure_angle: PressureAngle | None = None  #: upper limit, such as `"30 deg"` [none]
    radius: Size | None = None  #: least convex radius of curvature [none]
    hollow_radius: Size | None = None  #: least concave radius, such as that of the cutter [none]


def _built(assembly: Assembly) -> dict[str, Cam]:
    """Cams by their names.

    Raises
    ------
    SceneError
        A part does not exist, the follower's contact is missing or ambiguous, or the cam does not close.
    """
    cams = {name: _cam(f"cams.{name}", table, assembly) for name, table in CAMS.tables(assembly.table).items()}
    giver: dict[int, str] = {}
    for name, cam in cams.items():
        if (first := giver.setdefault(cam.drive, name)) != name:
            problem = f'has its motion from the cam "{first}" already; a groove, flank = "both", has two flanks'
            raise fault(f"cams.{name}", "drive", f'the drive "{drive_names(assembly.mechanism)[cam.drive]}" {problem}')
    return cams


def _cam(where: str, table: CamTable, assembly: Assembly) -> Cam:
    scene, mechanism = assembly.table, assembly.mechanism
    moving = [link.name for link in mechanism.links[1:] if link.name in scene.links]
    known_name(where, "follower", table.follower, moving, "moving link")
    drive = _driven_by(where, table, assembly)
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
    speed = _speed(where, table, assembly.duration)
    _require_closed(where, assembly, speed)
    form |= {"follower": table.follower, "flank": table.flank, **_touching(where, table, assembly)}
    return Cam(mechanism.index[table.follower], drive, centre, speed, **form)


def _driven_by(where: str, table: CamTable, assembly: Assembly) -> int:
    """Number of the drive that has its motion from a cam."""
    names = drive_names(assembly.mechanism)
    if table.drive is None and len(names) > 1:
        drives = ", ".join(f'"{name}"' for name in names)
        raise fault(where, "drive", f"the key is missing: which of the drives {drives} has its motion from the cam")
    if table.drive is not None:
        known_name(where, "drive", table.drive, names, "drive")
    number = 0 if table.drive is None else names.index(table.drive)
    if not callable(assembly.laws[number]):
        problem = f'the drive "{names[number]}" is an effort: a cam gives a motion, by speed, law or motion'
        raise fault(where, "drive", problem)
    for key in ("motor", "cylinder"):
        if getattr(assembly.table.drives[number], key) is not None:
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
    """Raise if a roller is no point of its link, does not move, or lies on the shaft as drawn."""
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


def _speed(where: str, table: CamTable, duration: Any) -> Any:
    """Speed of a cam's shaft [rad/s]: the given one, with whole turns in the run, or one turn in it."""
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


def _require_closed(where: str, assembly: Assembly, speed: Any) -> None:
    """Raise unless a turn of the cam brings the drives back to the same coordinates and speeds."""
    mechanism, duration = assembly.mechanism, assembly.duration
    turn = 2.0 * pi / abs(speed)
    times = np.linspace(0.0, 1.0, INSTANTS) * np.maximum(duration - turn, 0.0)
    for name, drive, law in zip(drive_names(mechanism), mechanism.drives, assembly.laws, strict=True):
        if not callable(law):
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


def _touching(where: str, table: CamTable, assembly: Assembly) -> dict[str, Any]:
    """Width and modulus of the contact, if known."""
    known_data: dict[str, Any] = {} if table.width is None else {"width": real(table.width)}
    if table.pressure is not None:
        for key in ("width", "material"):
            if getattr(table, key) is None:
                raise fault(where, key, "the key is missing: pressure is by the width and the material of the contact")
        if table.roller is not None and table.roller_radius is None:
            raise fault(where, "roller_radius", "the key is missing: a knife edge presses without bounds")
    if table.material is None:
        require_absent(where, table, ("follower_material",), "belongs beside material, that of the cam")
        return known_data
    pairs: list[Any] = []
    yields: list[Any] = []
    for key, name in (("material", table.material), ("follower_material", table.follower_material or table.material)):
        known = assembly.materials_of([name])
        known_name(where, key, name, known, "material")
        poisson = assembly.poisson_of(known[name], name)
        pairs += [real(known[name].E), POISSON if poisson is None else poisson]
        yields.append(nan if (least := known[name].yield_stress) is None else real(least))
    return {**known_data, "modulus": contact_modulus(*pairs), "yield_stress": np.fmin(yields[0], yields[1])}


def _loads(assembly: Assembly, cams: dict[str, Cam]) -> list[Load]:
    """Forces of the cams that push at their contacts."""
    pushing = {name: cam for name, cam in cams.items() if CAMS.tables(assembly.table)[name].push}
    if not pushing:
        return []
    known = tuple(law for law in assembly.laws if callable(law))
    differ = np.zeros(np.broadcast_shapes(*(cam.designs for cam in pushing.values())))
    return [CamPush((*pushing.values(),), known, (*pushing,), differ)]


def require_moved(scene: Scene) -> None:
    """Raise if the drive of a cam does not move the follower at their contact."""
    cams = CAMS.of(scene)
    laws = [law for law in scene.laws if callable(law)]
    if not cams or len(laws) < len(scene.laws):
        return
    times = LOOKED_AT * float(scene.run.duration)
    with suppress(MechanismError):
        moved = motion(scene.mechanism, *by_laws(laws, times), times)
        for name, cam in cams.items():
            course = cam_course(moved, cam)
            if (np.abs(course.influence) <= UNMOVED * np.abs(course.follower)).all():
                problem = f'the drive "{drive_names(scene.mechanism)[cam.drive]}" does not move "{cam.points[0]}"'
                raise SceneError(scene.path, f"cams.{name}", "drive", f'{problem} of the link "{cam.follower}"')


OfCam = Callable[["Cycle", str], Any]
"""From a cycle and the name of a cam to values at every position."""
HALF = 0.5  # power of the loads that a pressure along a line goes with


def _of_cams(values: OfCam, of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """Largest magnitudes of values of all cams of a kind."""
    return each(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _least_of_cams(values: Callable[[CamCourse], Any], of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """Least values of the flanks of all cams of a kind."""

    def of_cam(cycle: Cycle, name: str) -> Any:
        return reduce(np.fmin, (values(flank) for flank in cam_flanks(cycle, name)))

    return _least_values(of_cam, of)


def _least_values(values: OfCam, of: Kind) -> Callable[[Cycle], Largest]:
    """Least values of all cams of a kind over the positions that count."""
    return least(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _cam_units(turns: str, slides: str, of: Kind) -> Callable[[Scene], list[str]]:
    """Units of figures of cams by the drives that they move."""
    return lambda scene: [
        turns if scene.mechanism.drives[scene.parts[KEY][name].drive].turns else slides for name in items_of(scene, of)
    ]


def _over_yield(scene: Scene, pressures: Any) -> Any:
    yields = [np.ravel(scene.parts[KEY][name].yield_stress)[0] for name in items_of(scene, PRESSED)]
    return pressures / np.array(yields)


CAMS: Part[Cam] = Part(
    KEY, "cams of drives", CamTable, _built,
    (
        Figure("cam_pressure_angle", "pressure angle of a cam", "rad", CAM,
               _of_cams(lambda cycle, name: cam_flanks(cycle, name)[0].pressure_angle), power=0.0,
               limit="pressure_angle"),
        Figure("cam_pitch_radius", "least radius of curvature of a cam's pitch curve", "m", ROLLED,
               _least_of_cams(lambda flank: np.abs(1.0 / flank.pitch_curvature), ROLLED), LEAST, power=0.0),
        Figure("cam_radius", "least radius of curvature of a cam where it bulges", "m", CAM,
               _least_of_cams(lambda flank: flank.convex_radius), LEAST, power=0.0,
               limit="radius"),
        Figure("cam_hollow_radius", "least radius of curvature of a cam where it is hollow", "m", CAM,
               _least_of_cams(lambda flank: flank.hollow_radius), LEAST, power=0.0,
               limit="hollow_radius"),
        Figure("cam_least_distance", "least distance of a cam's profile from its shaft", "m", CAM,
               _least_of_cams(lambda flank: np.abs(flank.contact)), LEAST, power=0.0),
        Figure("cam_distance", "greatest distance of a cam's profile from its shaft", "m", CAM,
               _of_cams(lambda cycle, name: np.abs(cam_flanks(cycle, name)[-1].contact)), power=0.0),
        Figure("cam_face_margin", "distance of the contact from the end of a flat face", "m", FACED,
               _least_of_cams(lambda flank: flank.face_margin, FACED), LEAST, power=0.0),
        Figure("cam_force", "force of a cam on its follower", "N", CAM, _of_cams(cam_force)),
        Figure("cam_least_force", "least force of a cam on its follower", "N", HELD,
               _least_values(cam_force, HELD), LEAST),
        Figure("cam_preload", "effort that keeps a follower on its cam", _cam_units("N m", "N", HELD), HELD,
               _of_cams(cam_preload, HELD)),
        Figure("cam_lag", "lag of the drive behind its cam, as the links bend", _cam_units("rad", "m", CAM),
               CAM, _of_cams(cam_lag)),
        Figure("cam_pressure", "pressure between a cam and its follower", "Pa", PRESSED,
               _of_cams(cam_pressure, PRESSED), power=HALF,
               limit="pressure"),
        Figure("cam_torque", "torque of a cam's shaft", "N m", CAM, _of_cams(cam_torque)),
    ),
    row=cam_row,
    findings=cam_findings,
    faults=cam_faults,
    needs=CAM_NEEDS,
    columns=cam_columns,
    checks=(RangeCheck(HERTZ_RANGE, PRESSED, "cam_pressure", quantity=_over_yield),),
    loads=_loads,
    on_axis=True,
)  # fmt: skip
