"""Courses of cams over a cycle: flanks, forces, torque, pressure, and whether the cams work."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import displacement_of
from kinelast.scene.drive_values import effort, rate
from kinelast.scene.figure import NOISE, Kind
from machine.cams import BOTH, Cam, CamCourse, CamPush, cam_course, line_pressure
from rigid import ConstantSpeed
from rigid.arrays import Reals
from rigid.plane import dot

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene

KEY = "cams"


def _pressed(cam: Cam) -> bool:
    """Whether the pressure of the contact is known; a knife edge has none."""
    known = not (np.isnan(cam.width).any() or np.isnan(cam.modulus).any())
    return known and not (cam.roller is not None and np.equal(cam.radius, 0.0).all())


def _cams(name: str, has: Callable[[Cam], bool]) -> Kind:
    """The cams of which a condition holds."""
    return Kind(name, lambda scene: [name for name, cam in scene.parts[KEY].items() if has(cam)])


CAM = _cams("cam", lambda _: True)
ROLLED = _cams("cam with a roller", lambda cam: cam.roller is not None)
FACED = _cams("cam with a face", lambda cam: cam.face is not None)
HELD = _cams("open cam", lambda cam: cam.flank != BOTH)
PRESSED = _cams("pressed cam", _pressed)


def cam_flanks(cycle: Cycle, name: str) -> list[CamCourse]:
    """Flanks of a cam over a cycle: one, or the inner and the outer one of a groove."""
    return cycle.once(_flanks, name)


def _flanks(cycle: Cycle, name: str) -> list[CamCourse]:
    cam = cycle.scene.parts[KEY][name]
    law, pace = cycle.scene.laws[cam.drive], np.ones(1)
    if isinstance(law, ConstantSpeed):  # which may be passed at other speeds than the scene's
        pace = rate(cycle, cam.drive) / law.speed
    return [cam_course(cycle.motion, cam, pace, outer) for outer in cam.flanks]


def cam_outline(scene: Scene, name: str, count: int) -> list[CamCourse]:
    """Flanks of a cam at `count` angles over one turn, without the end of the turn."""
    cam = scene.parts[KEY][name]
    times = 2.0 * np.pi / abs(float(np.ravel(cam.speed)[0])) * np.arange(count) / count
    moved = scene.course.at(times)
    return [cam_course(moved, cam, outer=outer) for outer in cam.flanks]


def cam_force(cycle: Cycle, name: str) -> Reals:
    """Force with which a cam presses on its follower [N], shape (..., positions); negative if it would have to pull.

    For a groove along the outward normal: negative if the outer flank presses.
    """
    pushes, cam = cycle.once(_pushes), cycle.scene.parts[KEY][name]
    rest = cam_flanks(cycle, name)[0].force(effort(cycle, cam.drive))
    return np.asarray(rest + pushes.get(name, 0.0))


def _pushes(cycle: Cycle) -> dict[str, Reals]:
    """Contact forces of the cams that push [N], by name; their drives have no effort."""
    for load in cycle.scene.mechanism.loads:
        if isinstance(load, CamPush):
            return dict(zip(load.names, load.pressing(cycle.motion), strict=True))
    return {}


def cam_torque(cycle: Cycle, name: str) -> Reals:
    """Torque of a cam's shaft [N m], shape (..., positions)."""
    return cam_flanks(cycle, name)[0].torque(cam_force(cycle, name))


def cam_pressure(cycle: Cycle, name: str) -> Reals:
    """Hertz's pressure between a cam and its follower [Pa], shape (..., positions); nan without contact."""
    flanks, force, cam = cam_flanks(cycle, name), cam_force(cycle, name), cycle.scene.parts[KEY][name]
    signs = (-1.0 if outer and len(flanks) > 1 else 1.0 for outer in cam.flanks)
    pressures = [
        line_pressure(sign * force, cam.width, flank.relative_curvature, cam.modulus)
        for sign, flank in zip(signs, flanks, strict=True)
    ]
    return np.asarray(reduce(np.fmax, pressures))


def cam_preload(cycle: Cycle, name: str) -> Reals:
    """Effort that keeps a follower on its cam [N m or N], shape (..., positions)."""
    flank = cam_flanks(cycle, name)[0]
    with np.errstate(invalid="ignore"):  # an infinite force where there is no lever
        return flank.preload(flank.lever * cam_force(cycle, name))


def cam_lag(cycle: Cycle, name: str) -> Reals:
    """Lag of the drive behind its cam because links bend [rad or m], shape (..., positions).

    With this lag the follower would touch the cam; the answer holds the drive at its law.
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


ACROSS = 0.5 * np.pi * (1.0 - 1e-9)  # [rad], a pressure angle from which a cam does not move its follower
CAM_NEEDS = {  # figures that tell whether a cam works, and their items
    "cam_pressure_angle": CAM,
    "cam_radius": CAM,
    "cam_face_margin": FACED,
    "cam_least_force": HELD,
    "cam_force": CAM,
}


def cam_faults(scene: Scene, figures: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Reasons why cams do not work, each with a flag of shape (...).

    Parameters
    ----------
    figures
        Values of every item by key; those of `CAM_NEEDS` are used, if there.
    """
    known = {
        key: dict(zip(kind.names(scene), figures[key], strict=True))
        for key, kind in CAM_NEEDS.items()
        if key in figures
    }
    for name in scene.parts[KEY]:
        angle, radius, margin, least_force, force = (np.asarray(known.get(key, {}).get(name, np.nan))
                                                     for key in CAM_NEEDS)  # fmt: skip
        yield f"the cam {name} cannot push its follower", np.abs(angle) >= ACROSS
        yield f"the cam {name} cannot be made", radius <= 0.0
        yield f"the contact on the cam {name} runs off the face", margin < 0.0
        yield f"the follower leaves the cam {name}", least_force < -NOISE * np.abs(force)
