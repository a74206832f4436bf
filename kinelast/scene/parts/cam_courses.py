"""Values of cams over a cycle: flanks (profiles in contact), forces, torque and pressure.

Also reasons why cams fail, findings on cams, and rows of the summary.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import displacement_of
from kinelast.scene.drive_values import effort, load_inertia
from kinelast.values.figure import DRIVE, NOISE, Kind, items_of
from kinelast.values.numbers import quantity
from kinelast.values.reading import CAUTION, OPEN, POOR, Finding, Reader, Reading, reading
from machine.cams import BOTH, Cam, CamFlank, CamPush, cam_flank, cut_depth, line_pressure
from rigid import ConstantSpeed, Motion
from rigid.arrays import Flags, Reals
from rigid.plane import dot

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene

KEY = "cams"
MIN_POSITIONS = 7  # number of positions that is necessary to differentiate a lag twice
RESOLVED = 0.7  # smallest ratio of a resolved estimate at every second position to that at all positions
# Larger changes by vibration require caution, relative to the smallest contact force, or to the largest in a groove.
MAX_CHANGE = 0.05
MIN_CHANGE = 0.001  # smaller changes in the contact force by vibration are not reported, relative to the largest force


def _pressed(cam: Cam) -> bool:
    """Return True if the contact pressure of a cam can be computed. A knife edge has no finite pressure."""
    known = not (np.isnan(cam.width).any() or np.isnan(cam.modulus).any())
    return known and not (cam.roller is not None and np.equal(cam.radius, 0.0).all())


def _cams(name: str, has: Callable[[Cam], bool]) -> Kind:
    """Return a kind of item. Its items are the cams that satisfy the condition `has`."""
    return Kind(name, lambda scene: [name for name, cam in scene.parts[KEY].items() if has(cam)], "cam")


CAM = _cams("cam", lambda _: True)
ROLLED = _cams("cam with a roller", lambda cam: cam.roller is not None)
FACED = _cams("cam with a face", lambda cam: cam.face is not None)
HELD = _cams("open cam", lambda cam: cam.flank != BOTH)
PRESSED = _cams("pressed cam", _pressed)


def cam_flanks(cycle: Cycle, name: str) -> list[CamFlank]:
    """Return the flanks of a cam over a cycle: one flank, or the inner and outer flanks of a groove."""
    return cycle.once(_flanks, name)


def _flanks(cycle: Cycle, name: str) -> list[CamFlank]:
    cam = cycle.scene.parts[KEY][name]
    pace = cam_pace(cycle.scene, cam, cycle.motion)
    return [cam_flank(cycle.motion, cam, pace, outer) for outer in cam.flanks]


def cam_pace(scene: Scene, cam: Cam, motion: Motion) -> Any:
    """Return the drive speed in a motion, divided by the drive speed in the scene. Broadcasts to (..., positions)."""
    law = scene.laws[cam.drive]
    return motion.drive_rate[cam.drive] / law.speed if isinstance(law, ConstantSpeed) else np.ones(1)


def cam_outline(scene: Scene, name: str, count: int) -> list[CamFlank]:
    """Return the flanks of a cam at `count` evenly spaced angles of one turn. The end of the turn is left out."""
    cam = scene.parts[KEY][name]
    times = 2.0 * np.pi / abs(float(np.ravel(cam.speed)[0])) * np.arange(count) / count
    moved = scene.course.at(times)
    return [cam_flank(moved, cam, outer=outer) for outer in cam.flanks]


def cam_force(cycle: Cycle, name: str) -> Reals:
    """Return the contact force of a cam on its follower [N], shape (..., positions).

    The force is negative where the cam would have to pull the follower. For a groove, it is positive along the outward
    normal, and therefore negative where the outer flank presses.
    """
    pushes, cam = cycle.once(_pushes), cycle.scene.parts[KEY][name]
    rest = cam_flanks(cycle, name)[0].force(effort(cycle, cam.drive))
    return np.asarray(rest + pushes.get(name, 0.0))


def _pushes(cycle: Cycle) -> dict[str, Reals]:
    """Return the contact forces [N] of the cams with `push`, by name. Drives moved by these cams have no effort."""
    for load in cycle.scene.mechanism.loads:
        if isinstance(load, CamPush):
            return dict(zip(load.names, load.pressing(cycle.motion), strict=True))
    return {}


def cam_torque(cycle: Cycle, name: str) -> Reals:
    """Torque of a camshaft [N m], shape (..., positions)."""
    return cam_flanks(cycle, name)[0].torque(cam_force(cycle, name))


def cam_pressure(cycle: Cycle, name: str) -> Reals:
    """Hertzian pressure between a cam and its follower [Pa], shape (..., positions); nan without contact."""
    flanks, force, cam = cam_flanks(cycle, name), cam_force(cycle, name), cycle.scene.parts[KEY][name]
    signs = (-1.0 if outer and len(flanks) > 1 else 1.0 for outer in cam.flanks)
    pressures = [
        line_pressure(sign * force, cam.width, flank.relative_curvature, cam.modulus)
        for sign, flank in zip(signs, flanks, strict=True)
    ]
    return np.asarray(reduce(np.fmax, pressures))


def cam_preload(cycle: Cycle, name: str) -> Reals:
    """Drive effort that keeps a follower on its cam [N m or N], shape (..., positions)."""
    flank = cam_flanks(cycle, name)[0]
    with np.errstate(invalid="ignore"):  # if the lever is zero, the force is infinite
        return flank.preload(flank.lever * cam_force(cycle, name))


def cam_lag(cycle: Cycle, name: str) -> Reals:
    """Lag of a drive behind its cam due to the bending of links [rad or m], shape (..., positions).

    With this lag, the bent follower would just touch the cam. The computed motion does not include the lag.
    """
    cam, flank = cycle.scene.parts[KEY][name], cam_flanks(cycle, name)[0]
    ends = [displacement_of(cycle.deflection, cam.follower, point) for point in cam.points]
    if cam.face is None:
        moved = ends[0]
    else:
        share = flank.along / np.abs(cam.face[1] - cam.face[0])
        moved = (1.0 - share) * ends[0] + share * ends[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-dot(flank.normal, moved) / flank.lever)


def force_by_vibration(cycle: Cycle, name: str) -> tuple[float, bool]:
    """Estimate by how much vibration of the links against a cam changes its contact force [N].

    All computed vibration is that of a drive that follows its law exactly. In fact, the drive lags behind the cam by q
    because links bend. The estimate is the largest value of J q''/r, where J is the inertia of the links, reduced to
    the drive, and r the lever of the contact force. It is at most the largest contact force.

    Returns
    -------
    Estimate, and whether it is resolved. If it is not, e.g. because the acceleration of the drive jumps, it grows with
    the number of positions, and is then a lower bound. It is 0 if there are too few positions or no elastic links.
    """
    cam, flank, time = cycle.scene.parts[KEY][name], cam_flanks(cycle, name)[0], cycle.motion.time
    if len(time) < MIN_POSITIONS or not cycle.scene.labels:
        return 0.0, True
    lag = cam_lag(cycle, name)
    with np.errstate(divide="ignore", invalid="ignore"):
        per_acceleration = np.broadcast_to(load_inertia(cycle, cam.drive) / flank.lever, lag.shape)
    changes = [
        _largest_size(per_acceleration[::step][1:-1] * _second_derivative(lag[::step], time[::step])) for step in (1, 2)
    ]
    largest = _largest_size(cam_force(cycle, name))
    return min(changes[0], largest), bool(changes[1] >= RESOLVED * changes[0]) and changes[0] < largest


def _second_derivative(values: Reals, time: Reals) -> Reals:
    """Return the second time derivatives at all positions but the first and the last, shape (positions - 2,)."""
    steps = np.diff(time)
    return np.asarray(2.0 * np.diff(np.diff(values) / steps) / (steps[1:] + steps[:-1]))


def _largest_size(values: Any) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


MAX_PRESSURE_ANGLE = 0.5 * np.pi * (1.0 - 1e-9)  # [rad] from this pressure angle on, a cam cannot move its follower
CAM_NEEDS = {  # results that show whether a cam works, and the kind of item of each result
    "cam_pressure_angle": CAM,
    "cam_radius": CAM,
    "cam_face_margin": FACED,
    "cam_least_force": HELD,
    "cam_force": CAM,
}


def cam_faults(scene: Scene, figures: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield reasons why cams fail, each with flags of shape (...) that are True for the designs that fail.

    Parameters
    ----------
    figures
        Values of the figures (results) in `CAM_NEEDS` for all items, by key.
    """
    known = {
        key: dict(zip(kind.names(scene), figures[key], strict=True))
        for key, kind in CAM_NEEDS.items()
        if key in figures
    }
    for name in scene.parts[KEY]:
        angle, radius, margin, least_force, force = (np.asarray(known.get(key, {}).get(name, np.nan))
                                                     for key in CAM_NEEDS)  # fmt: skip
        yield f"the cam {name} cannot push its follower", np.abs(angle) >= MAX_PRESSURE_ANGLE
        yield f"the cam {name} cannot be made", radius <= 0.0
        yield f"the contact on the cam {name} runs off the face", margin < 0.0
        yield f"the follower leaves the cam {name}", least_force < -NOISE * np.abs(force)


HEADING = "Cams"


def cam_row(reader: Reader, name: str) -> dict[str, Any]:
    """Return the row of a cam in the summary.

    `counts` contains the number of positions with undercut, and the number of positions with lost contact. `cut` is the
    largest depth to which the follower, in any position, overlaps the profile. If `cut` is positive, the cam cannot be
    made.
    """
    scene, counted = reader.scene, reader.results.cycle.counted
    cam, faults = scene.cams[name], {"undercut": _undercut(reader.cycle, name), "contact_lost": _lost(reader, name)}
    return {
        "follower": scene.mechanism.links[cam.link].name,
        "drive": items_of(scene, DRIVE)[cam.drive],
        "flank": cam.flank,
        "speed": reading(np.ravel(cam.speed)[0], "rad/s"),
        "cut": reading(max(float(cut_depth(flank).max(initial=0.0)) for flank in cam_flanks(reader.cycle, name)), "m"),
        **{fault: reader.marks(there) for fault, there in faults.items()},
        "counts": {fault: int(np.sum(there & counted)) for fault, there in faults.items()},
    }


def _undercut(cycle: Cycle, name: str) -> Flags:
    """Return a flag for each position: True if the cam is undercut, shape (positions,)."""
    return np.any([flank.undercut for flank in cam_flanks(cycle, name)], axis=0)


def _lost(reader: Reader, name: str) -> Flags:
    """Return a flag for each position: True if an open cam would have to pull its follower, shape (positions,)."""
    force = cam_force(reader.cycle, name) if name in items_of(reader.scene, HELD) else np.ones(1)
    noise = NOISE * float(np.nanmax(np.abs(force), initial=0.0))
    return np.broadcast_to(force < -noise, reader.results.motion.columns)


def cam_findings(reader: Reader) -> Iterator[Finding]:
    """Yield findings on cams that cannot be manufactured, and on cams that lose contact with their followers."""
    counted = reader.results.cycle.counted

    def size(found: Reading | None, sign: float = 1.0) -> str:
        if found is None or found.value is None:
            return "none"
        return quantity(sign * found.value, found.unit, shown_in=reader.scene.shown_in)

    for name in reader.scene.cams:
        angle, margin = (reader.of_item(key, name) for key in ("cam_pressure_angle", "cam_face_margin"))
        if angle and angle.value is not None and abs(angle.value) >= MAX_PRESSURE_ANGLE:
            text = f"The cam {name} cannot push its follower: the pressure angle is 90°."
            yield Finding(POOR, HEADING, f"{text} Let the drive move the follower away from the cam.")
            continue
        if margin and margin.value is not None and margin.value < 0.0:
            text = f"The contact on the cam {name} runs off the face by {size(margin, -1.0)}"
            yield Finding(POOR, HEADING, f"{text}: make the face longer by at least this amount, or shift it.")
        if (_undercut(reader.cycle, name) & counted).any():
            radius = size(reader.of_item("cam_radius", name))
            text = f"The cam {name} cannot be made: its profile is undercut (smallest radius {radius})."
            roller = "a smaller roller or " if name in ROLLED.names(reader.scene) else ""
            yield Finding(POOR, HEADING, f"{text} Use {roller}a larger cam, or a law with less acceleration.")
        lost = _lost(reader, name) & counted
        if lost.any():
            part = "throughout" if lost.sum() == counted.sum() else "in part of"
            spring = f"a spring with {size(reader.of_item('cam_preload', name))} along the drive holds it."
            text = f"The follower leaves the cam {name} {part} the run: {spring}"
            yield Finding(CAUTION, HEADING, f"{text} Pulling forces are those of a grooved cam.")
        (change, resolved), forces = force_by_vibration(reader.cycle, name), np.abs(cam_force(reader.cycle, name))
        if change > MIN_CHANGE * np.nanmax(forces):
            by = f"by {'about' if resolved else 'at least'} {quantity(change, 'N', 2, reader.scene.shown_in)}"
            text = f"Vibration of the links against the cam {name} changes its contact force {by}."
            reason = "The errors do not include this: in the computed vibration, the drive follows its law exactly."
            least = (np.nanmin if name in HELD.names(reader.scene) else np.nanmax)(forces)
            level = CAUTION if change > MAX_CHANGE * least or not resolved else OPEN
            yield Finding(level, HEADING, f"{text} {reason}", f"vibration changes the force of {name} {by}")


def cam_columns(cycle: Cycle) -> dict[str, tuple[Any, str]]:
    """Return the columns on cams for positions.csv, as values with unit by name."""
    columns: dict[str, tuple[Any, str]] = {}
    for name in cycle.scene.parts[KEY]:
        columns[f"{name}.pressure_angle"] = cam_flanks(cycle, name)[0].pressure_angle, "rad"
        columns[f"{name}.force"] = cam_force(cycle, name), "N"
        columns[f"{name}.pressure"] = cam_pressure(cycle, name), "Pa"
        columns[f"{name}.torque"] = cam_torque(cycle, name), "N m"
    return columns
