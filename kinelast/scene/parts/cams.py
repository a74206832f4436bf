"""Cams that move drives: table in the scene, function that builds the cams, and results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import reduce
from math import nan, pi
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from kinelast.scene.part import Assembly, Part
from kinelast.scene.parts import cam_courses as courses
from kinelast.scene.parts.cam_courses import CAM, FACED, HELD, KEY, PRESSED, ROLLED, cam_flanks
from kinelast.scene.tables import Place, StrictTable
from kinelast.values.error import SceneError, fault, known_name, known_point, require_absent
from kinelast.values.figure import LEAST, Figure, Kind, RangeCheck, drive_names, each, items_of, least
from kinelast.values.numbers import quantity, real, require, vector
from kinelast.values.quantities import CamSpeed, PressureAngle, Size, Stress
from machine.cams import HERTZ_RANGE, INNER, Cam, CamFlank, CamPush, cam_flank, contact_modulus
from rigid import GROUND, Load, Mechanism, MechanismError, Motion, motion
from rigid.kinematics import by_laws

if TYPE_CHECKING:
    from elastic import Largest
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from symbols import Mark

TEST_TIMES = np.array([0.0, 0.137, 0.293, 0.471, 0.683])  # [duration] a cam must move its follower at one of these
MIN_INFLUENCE = 1e-9  # smallest motion of the contact per unit of the drive, relative to the distance from the shaft
MAX_GAP = 1e-9  # largest change in a coordinate over a turn of the cam, relative to a turn or the stroke
MAX_JUMP = 1e-6  # largest change in a rate over a turn of the cam, relative to the largest rate
INSTANTS = 257  # number of times at which the motion is compared with the motion one turn of the cam later
POISSON = 0.3  # Poisson's ratio if the material does not give one


class CamTable(StrictTable, frozen=True, kw_only=True):
    """A cam that moves a drive, with limits. Its profile follows from the motion of the follower."""

    follower: str  #: link moved by the cam
    centre: str | Place  #: camshaft centre: a ground point, or `[x, y]` in the drawing
    roller: str | None = None  #: roller centre, a point of the follower; or use `face`
    roller_radius: Size | None = None  #: radius of the roller, needed for `pressure` [0: knife edge]
    face: tuple[str, str] | None = None  #: two points of the follower: ends of a flat face
    drive: str | None = None  #: link or slider of the drive that the cam moves [the only drive]
    #: camshaft speed, with a whole number of turns in a run [one turn per run]
    speed: CamSpeed | None = None
    #: `"inner"`: cam inside the path of the follower; `"outer"`: ring around the path; `"both"`: groove
    flank: Literal["inner", "outer", "both"] = "inner"
    #: `false`: the drive force acts along the coordinate instead of at the contact
    push: bool = True
    width: Size | None = None  #: width of the contact [pressure is not computed]
    #: material of the cam [pressure is not computed]
    material: str | None = None
    follower_material: str | None = None  #: material of the roller or face [same as `material`]
    pressure: Stress | None = None  #: maximum Hertzian pressure [no limit]
    pressure_angle: PressureAngle | None = None  #: maximum pressure angle [no limit]
    radius: Size | None = None  #: minimum convex radius [no limit]
    #: minimum concave radius, which depends on the cutter [no limit]
    hollow_radius: Size | None = None


def _built(assembly: Assembly) -> dict[str, Cam]:
    """Return the cams by name.

    Raises
    ------
    SceneError
        A link, point or drive is unknown, the contact is missing or ambiguous, or a profile does not close.
    """
    cams = {name: _cam(f"cams.{name}", table, assembly) for name, table in CAMS.tables(assembly.table).items()}
    giver: dict[int, str] = {}
    for name, cam in cams.items():
        if (first := giver.setdefault(cam.drive, name)) != name:
            problem = f'is already moved by the cam "{first}"; for a groove with two flanks use flank = "both"'
            raise fault(f"cams.{name}", "drive", f'the drive "{drive_names(assembly.mechanism)[cam.drive]}" {problem}')
    return cams


def _cam(where: str, table: CamTable, assembly: Assembly) -> Cam:
    scene, mechanism = assembly.table, assembly.mechanism
    moving = [link.name for link in mechanism.links[1:] if link.name in scene.links]
    known_name(where, "follower", table.follower, moving, "moving link")
    drive = _driven_by(where, table, assembly)
    link = mechanism.links[mechanism.index[table.follower]]
    if (table.roller is None) == (table.face is None):
        raise fault(where, "roller", "expected either roller (its centre) or face (two points of a flat face)")
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
        require(np.abs(end - start) > 0.0, where, "face", "expected two different points")
        require_absent(where, table, ("roller_radius",), "belongs to a roller")
        if table.flank != INNER:
            raise fault(where, "flank", "a flat face needs the inner flank: remove flank, or give a roller")
        form = {"face": (start, end), "points": table.face}
    speed = _speed(where, table, assembly.duration)
    _require_closed(where, assembly, speed)
    form |= {"follower": table.follower, "flank": table.flank, **_touching(where, table, assembly)}
    return Cam(mechanism.index[table.follower], drive, centre, speed, **form)


def _driven_by(where: str, table: CamTable, assembly: Assembly) -> int:
    """Return the index of the drive that a cam moves."""
    names = drive_names(assembly.mechanism)
    if table.drive is None and len(names) > 1:
        drives = ", ".join(f'"{name}"' for name in names)
        raise fault(where, "drive", f"the key is missing: name the drive that the cam moves, one of {drives}")
    if table.drive is not None:
        known_name(where, "drive", table.drive, names, "drive")
    number = 0 if table.drive is None else names.index(table.drive)
    if not callable(assembly.laws[number]):
        problem = f'the drive "{names[number]}" is an effort: a cam needs a drive with speed, law or motion'
        raise fault(where, "drive", problem)
    for key in ("motor", "cylinder"):
        if getattr(assembly.table.drives[number], key) is not None:
            problem = f'the drive "{names[number]}" has a {key}: remove the {key} or the cam'
            raise fault(where, "drive", problem)
    return number


def _shaft(where: str, table: CamTable, mechanism: Mechanism) -> Any:
    """Return the position of a camshaft [m]."""
    if isinstance(table.centre, str):
        known_point(where, "centre", table.centre, mechanism.links[0].points, GROUND)
        return mechanism.links[0].points[table.centre]
    return vector(table.centre)


def _require_apart(where: str, table: CamTable, mechanism: Mechanism, centre: Any) -> None:
    """Raise SceneError if a roller centre is not a moving point of the follower, or the roller covers the camshaft."""
    assert table.roller is not None
    ground, points = mechanism.links[0].points, mechanism.links[mechanism.index[table.follower]].points
    known_point(where, "roller", table.roller, points, table.follower)
    if table.roller in ground:
        raise fault(where, "roller", f'"{table.roller}" is a point of the ground: a cam cannot move it')
    drawn = mechanism.drawing.get(table.roller)
    if drawn is None:
        return
    reach, radius = abs(drawn - centre), real(table.roller_radius or 0.0)
    require(reach > MAX_GAP * (abs(drawn) + abs(centre)), where, "roller",
            f'"{table.roller}" is drawn at the centre of the camshaft: change centre')  # fmt: skip
    if table.flank == INNER:

        def problem(of: Any) -> str:
            size, apart = (quantity(float(of(each)), "m") for each in (radius, reach))
            return f"a roller of {size} covers the camshaft, {apart} from its drawn centre"

        require(reach > radius, where, "roller_radius", problem)


def _speed(where: str, table: CamTable, duration: Any) -> Any:
    """Return the speed of a camshaft [rad/s], by default one turn per run."""
    if table.speed is None:
        return 2.0 * pi / duration
    speed = real(table.speed)
    turns = abs(speed) * duration / (2.0 * pi)

    def problem(of: Any) -> str:
        one = 60.0 / of(duration)
        turns_made = f"makes {of(turns):.6g} turns in the run of {of(duration):.6g} s"
        return f"{turns_made}, expected whole turns: {one:.8g} rpm is one"

    require((turns > 0.5) & (abs(turns - np.round(turns)) <= MAX_GAP * turns), where, "speed", problem)
    return speed


def _require_closed(where: str, assembly: Assembly, speed: Any) -> None:
    """Raise SceneError if a drive has another coordinate or rate after a turn of the cam."""
    mechanism, duration = assembly.mechanism, assembly.duration
    turn = 2.0 * pi / abs(speed)
    times = np.linspace(0.0, 1.0, INSTANTS) * np.maximum(duration - turn, 0.0)
    for name, drive, law in zip(drive_names(mechanism), mechanism.drives, assembly.laws, strict=True):
        if not callable(law):
            raise fault(where, "drive", f'the drive "{name}" is an effort: the motion of a cam mechanism must be given')
        (first, before, _), (second, after, _) = law(times), law(np.minimum(times + turn, duration))
        what, unit, size = ("angle", "deg", 180.0 / pi) if drive.turns else ("slide", "mm", 1e3)
        missed = second - first
        if drive.turns:
            missed = missed - 2.0 * pi * np.round(missed / (2.0 * pi))
        gap, reach, jump, fastest = (_largest(each) for each in (missed, first, after - before, before))
        head = f'the {what} of the drive "{name}" is up to'
        tail = f"{unit} off after a turn of the cam: end its law at its start, or give the cam another speed"

        def problem(of: Any, gap: Any = gap, size: float = size, head: str = head, tail: str = tail) -> str:
            return f"{head} {of(gap) * size:.4g} {tail}"

        require(gap <= MAX_GAP * (1.0 + np.abs(reach) if drive.turns else reach), where, "speed", problem)
        corner = f'the drive "{name}" has a different speed after a turn of the cam: the profile would have a corner'
        require(jump <= MAX_JUMP * np.maximum(fastest, MAX_JUMP), where, "speed", corner)


def _largest(values: Any) -> Any:
    """Return the largest magnitude along the last axis; shape (designs, 1) for several designs."""
    return np.max(np.abs(values), axis=-1, keepdims=np.ndim(values) > 1)


def _touching(where: str, table: CamTable, assembly: Assembly) -> dict[str, Any]:
    """Return those arguments of `Cam` for the contact that are known: width, elastic modulus and yield stress."""
    known_data: dict[str, Any] = {} if table.width is None else {"width": real(table.width)}
    if table.pressure is not None:
        for key in ("width", "material"):
            if getattr(table, key) is None:
                raise fault(where, key, "the key is missing: pressure needs the width and the material of the contact")
        if table.roller is not None and table.roller_radius is None:
            raise fault(where, "roller_radius", "the key is missing: the pressure of a knife edge is unlimited")
    if table.material is None:
        require_absent(where, table, ("follower_material",), "needs material, the material of the cam")
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
    """Return the load on the mechanism due to the contact forces of the cams with `push`."""
    pushing = {name: cam for name, cam in cams.items() if CAMS.tables(assembly.table)[name].push}
    if not pushing:
        return []
    known = tuple(law for law in assembly.laws if callable(law))
    differ = np.zeros(np.broadcast_shapes(*(cam.designs for cam in pushing.values())))
    ground = assembly.mechanism.links[0]
    return [CamPush((*pushing.values(),), known, (ground.name, next(iter(ground.points))), (*pushing,), differ)]


def require_moved(scene: Scene) -> None:
    """Raise SceneError if the drive of a cam does not move the follower at the contact."""
    cams = CAMS.of(scene)
    laws = [law for law in scene.laws if callable(law)]
    if not cams or len(laws) < len(scene.laws):
        return
    times = TEST_TIMES * float(scene.run.duration)
    with suppress(MechanismError):
        moved = motion(scene.mechanism, *by_laws(laws, times), times)
        for name, cam in cams.items():
            course = cam_flank(moved, cam)
            if (np.abs(course.influence) <= MIN_INFLUENCE * np.abs(course.follower)).all():
                problem = f'the drive "{drive_names(scene.mechanism)[cam.drive]}" does not move "{cam.points[0]}"'
                raise SceneError(scene.path, f"cams.{name}", "drive", f'{problem} of the link "{cam.follower}"')


OfCam = Callable[["Cycle", str], Any]
"""Function of a cycle and the name of a cam that returns a value per position."""
PRESSURE_EXPONENT = 0.5  # the Hertzian pressure of a line contact grows with the square root of the load


def _of_cams(values: OfCam, of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """Return a function that finds, for each cam of the kind `of`, the largest magnitude."""
    return each(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _least_of_cams(values: Callable[[CamFlank], Any], of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """Return a function that finds, for each cam of the kind `of`, the smallest value over all positions and flanks."""

    def of_cam(cycle: Cycle, name: str) -> Any:
        return reduce(np.fmin, (values(flank) for flank in cam_flanks(cycle, name)))

    return _least_values(of_cam, of)


def _least_values(values: OfCam, of: Kind) -> Callable[[Cycle], Largest]:
    """Return a function that finds, for each cam of the kind `of`, the smallest value over the included positions."""
    return least(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _cam_units(turns: str, slides: str, of: Kind) -> Callable[[Scene], list[str]]:
    """Return a function that lists a unit for each cam: `turns` if its drive rotates, else `slides`."""
    return lambda scene: [
        turns if scene.mechanism.drives[scene.parts[KEY][name].drive].turns else slides for name in items_of(scene, of)
    ]


def _over_yield(scene: Scene, pressures: Any) -> Any:
    yields = [np.ravel(scene.parts[KEY][name].yield_stress)[0] for name in items_of(scene, PRESSED)]
    return pressures / np.array(yields)


OUTLINE = 180  # number of points of a drawn cam
RIM = 1.12  # radius of the rim of a drawn ring or groove, relative to the largest radius of the cam


def _symbols(scene: Scene) -> Iterator[Mark]:
    """Yield the drawing symbols of each cam: its body, which rotates with the shaft, and its roller."""
    from symbols import LINK, ROLLER, SHADE, SOFT, UNDER, Anchor, Line, Mark

    for name, cam in CAMS.of(scene).items():
        flanks = courses.cam_outline(scene, name, OUTLINE)
        profiles = [np.ravel(flank.profile) for flank in flanks]
        reach = max(float(np.nanmax(np.abs(each))) for each in (*profiles, np.ravel(flanks[0].pitch)))
        lines = tuple(Line(offset=each[np.isfinite(each)], closed=True) for each in profiles)
        at = Anchor(GROUND, local=complex(np.ravel(cam.centre)[0]))

        def turn(motion: Motion, cam: Cam = cam) -> Any:
            return np.exp(1j * cam.speed * courses.cam_pace(scene, cam, motion) * motion.time)

        rim = (0.0, RIM * reach if True in cam.flanks else 0.0)
        yield Mark("cam", at, lines, rim, x_axis_of=turn, stroke=SOFT, fill=SHADE, level=UNDER)
        if cam.roller is not None and (radius := float(np.ravel(cam.radius)[0])):
            yield Mark(ROLLER, Anchor(cam.follower, cam.points[0]), radius=(0.0, radius), stroke=LINK)


CAMS: Part[Cam] = Part(
    KEY, "cams that move drives", CamTable, _built,
    (
        Figure("cam_pressure_angle", "pressure angle of a cam", "rad", CAM,
               _of_cams(lambda cycle, name: cam_flanks(cycle, name)[0].pressure_angle), power=0.0,
               limit="pressure_angle"),
        Figure("cam_pitch_radius", "smallest radius of curvature of a cam's pitch curve", "m", ROLLED,
               _least_of_cams(lambda flank: np.abs(1.0 / flank.pitch_curvature), ROLLED), LEAST, power=0.0),
        Figure("cam_radius", "smallest convex radius of curvature of a cam", "m", CAM,
               _least_of_cams(lambda flank: flank.convex_radius), LEAST, power=0.0,
               limit="radius"),
        Figure("cam_hollow_radius", "smallest concave radius of curvature of a cam", "m", CAM,
               _least_of_cams(lambda flank: flank.hollow_radius), LEAST, power=0.0,
               limit="hollow_radius"),
        Figure("cam_least_distance", "smallest distance of a cam's profile from its shaft", "m", CAM,
               _least_of_cams(lambda flank: np.abs(flank.contact)), LEAST, power=0.0),
        Figure("cam_distance", "largest distance of a cam's profile from its shaft", "m", CAM,
               _of_cams(lambda cycle, name: np.abs(cam_flanks(cycle, name)[-1].contact)), power=0.0),
        Figure("cam_face_margin", "distance of the contact from the end of a flat face", "m", FACED,
               _least_of_cams(lambda flank: flank.face_margin, FACED), LEAST, power=0.0),
        Figure("cam_force", "force of a cam on its follower", "N", CAM, _of_cams(courses.cam_force)),
        Figure("cam_least_force", "smallest force of a cam on its follower", "N", HELD,
               _least_values(courses.cam_force, HELD), LEAST),
        Figure("cam_preload", "effort that keeps a follower on its cam", _cam_units("N m", "N", HELD), HELD,
               _of_cams(courses.cam_preload, HELD)),
        Figure("cam_lag", "lag of the drive behind its cam due to bending", _cam_units("rad", "m", CAM),
               CAM, _of_cams(courses.cam_lag)),
        Figure("cam_pressure", "pressure between a cam and its follower", "Pa", PRESSED,
               _of_cams(courses.cam_pressure, PRESSED), power=PRESSURE_EXPONENT,
               limit="pressure"),
        Figure("cam_torque", "torque of a camshaft", "N m", CAM, _of_cams(courses.cam_torque)),
    ),
    row=courses.cam_row,
    findings=courses.cam_findings,
    faults=courses.cam_faults,
    needs=courses.CAM_NEEDS,
    columns=courses.cam_columns,
    checks=(RangeCheck(HERTZ_RANGE, PRESSED, "cam_pressure", ("cam_pressure",), _over_yield),),
    loads=_loads,
    symbols=_symbols,
    on_axis=True,
)  # fmt: skip
