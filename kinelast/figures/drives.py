"""Figures of drives: effort, speed, power and energy of a cycle, the use of motors and cylinders, and of cams."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from typing import Any

import numpy as np

from elastic import Largest, displacement_of
from kinelast.figures.cycle import NOISE, Cycle, drive_words
from kinelast.figures.entry import (
    AVERAGE,
    CAM,
    DRIVE,
    FACED,
    HELD,
    LEAST,
    PRESSED,
    ROLLED,
    Figure,
    Kind,
    averaged,
    each,
    items_of,
    least,
)
from kinelast.scene.data import Scene
from kinelast.scene.drive_values import effort, load_inertia, over_time, power, rate
from machine.cams import CamCourse, CamPush, cam_course, line_pressure
from machine.drives import mean, mean_positive, root_mean_square
from rigid import ConstantSpeed
from rigid.arrays import Reals
from rigid.plane import dot

PerDrive = Callable[[Cycle, int], Reals]


def _each(values: PerDrive) -> Callable[[Cycle], list[Reals]]:
    """Values of all drives, from those of a drive by its number."""
    return lambda cycle: [values(cycle, number) for number in range(len(cycle.scene.mechanism.drives))]


def _over_time(measure: Callable[..., Reals], values: PerDrive) -> Callable[[Cycle], Any]:
    """Figures that average values of the drives over the positions that count."""
    return averaged(_each(lambda cycle, number: over_time(cycle, measure, values(cycle, number))))


def energy_taken(values: Any, weight: Any) -> Reals:
    """Energy that a power takes [J]."""
    whole: Reals = mean_positive(values, weight) * np.sum(weight, axis=-1)
    return whole


def energy_given(values: Any, weight: Any) -> Reals:
    """Energy that a power gives back [J]."""
    return energy_taken(-np.asarray(values), weight)


def _units(turns: str, slides: str) -> Callable[[Scene], list[str]]:
    return lambda scene: [turns if drive.turns else slides for drive in scene.mechanism.drives]


def _effort_units(scene: Scene) -> list[str]:
    return [unit for *_, unit in drive_words(scene.mechanism)]


DRIVE_FIGURES: tuple[Figure, ...] = (
    Figure("drive_rms", "effort of a drive, root mean square", _effort_units, DRIVE,
           _over_time(root_mean_square, effort), AVERAGE),
    Figure("drive_mean", "effort of a drive, mean", _effort_units, DRIVE, _over_time(mean, effort), AVERAGE),
    Figure("drive_speed", "speed of a drive", _units("rad/s", "m/s"), DRIVE, each(_each(rate)), rigid=True),
    Figure("drive_power", "power of a drive", "W", DRIVE, each(_each(power))),
    Figure("drive_mean_power", "mean power of a drive", "W", DRIVE, _over_time(mean, power), AVERAGE),
    Figure("energy_taken", "energy of a drive, taken in a cycle", "J", DRIVE, _over_time(energy_taken, power), AVERAGE),
    Figure("energy_given", "energy of a drive, given back in a cycle", "J", DRIVE, _over_time(energy_given, power),
           AVERAGE),
    Figure("load_inertia", "inertia of the links, reduced to a drive", _units("kg m^2", "kg"), DRIVE,
           each(_each(lambda cycle, number: cycle.once(load_inertia, number))), rigid=True),
)  # fmt: skip


OfCam = Callable[[Cycle, str], Any]
"""From a cycle and the name of a cam to values at every position."""
HALF = 0.5  # power of the loads that a pressure along a line goes with


def cam_flanks(cycle: Cycle, name: str) -> list[CamCourse]:
    """Flanks of a cam over a cycle: one, or of a groove the inner and the outer one."""
    return cycle.once(_flanks, name)


def _flanks(cycle: Cycle, name: str) -> list[CamCourse]:
    cam = cycle.scene.cams[name]
    law, pace = cycle.scene.laws[cam.drive], np.ones(1)
    if isinstance(law, ConstantSpeed):  # which may be passed at other speeds than the scene's
        pace = rate(cycle, cam.drive) / law.speed
    return [cam_course(cycle.motion, cam, pace, outer) for outer in cam.flanks]


def cam_outline(scene: Scene, name: str, count: int) -> list[CamCourse]:
    """Flanks of a cam over one turn of it at so many positions, its end, which is its start, left out."""
    cam = scene.cams[name]
    times = 2.0 * np.pi / abs(float(np.ravel(cam.speed)[0])) * np.arange(count) / count
    moved = scene.course.at(times)
    return [cam_course(moved, cam, outer=outer) for outer in cam.flanks]


def cam_force(cycle: Cycle, name: str) -> Reals:
    """Force with which a cam presses on its follower [N], shape (..., positions); negative where it would pull.

    Of a groove along the outward normal: negative where its outer flank presses.
    """
    pushes, cam = cycle.once(_pushes), cycle.scene.cams[name]
    rest = cam_flanks(cycle, name)[0].force(effort(cycle, cam.drive))
    return np.asarray(rest + pushes.get(name, 0.0))


def _pushes(cycle: Cycle) -> dict[str, Reals]:
    """Forces of the cams that push where they touch [N], by their names: for these the drives have no effort."""
    for load in cycle.scene.mechanism.loads:
        if isinstance(load, CamPush):
            return dict(zip(load.names, load.pressing(cycle.motion), strict=True))
    return {}


def cam_torque(cycle: Cycle, name: str) -> Reals:
    """Torque of a cam's shaft [N m], shape (..., positions)."""
    return cam_flanks(cycle, name)[0].torque(cam_force(cycle, name))


def cam_pressure(cycle: Cycle, name: str) -> Reals:
    """Hertz's pressure between a cam and its follower [Pa], shape (..., positions); nan where none presses."""
    flanks, force, cam = cam_flanks(cycle, name), cam_force(cycle, name), cycle.scene.cams[name]
    signs = (-1.0 if outer and len(flanks) > 1 else 1.0 for outer in cam.flanks)
    pressures = [
        line_pressure(sign * force, cam.width, flank.relative_curvature, cam.modulus)
        for sign, flank in zip(signs, flanks, strict=True)
    ]
    return np.asarray(reduce(np.fmax, pressures))


def _preload(cycle: Cycle, name: str) -> Reals:
    flank = cam_flanks(cycle, name)[0]
    with np.errstate(invalid="ignore"):  # an infinite force where there is no lever
        return flank.preload(flank.lever * cam_force(cycle, name))


def cam_lag(cycle: Cycle, name: str) -> Reals:
    """Coordinate of the drive by which a bent follower is off on its cam [rad or m], shape (..., positions).

    By that the contact is where the cam has it, while the answer holds the drive where its law has it.
    """
    cam, flank = cycle.scene.cams[name], cam_flanks(cycle, name)[0]
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
    """Reasons why cams do not work, in words, each with whether it is so, shape (...).

    Parameters
    ----------
    figures
        By key, values of every item; those of `CAM_NEEDS` are looked at, where they are.
    """
    known = {
        key: dict(zip(items_of(scene, kind), figures[key], strict=True))
        for key, kind in CAM_NEEDS.items()
        if key in figures
    }
    for name in scene.cams:
        angle, radius, margin, least_force, force = (np.asarray(known.get(key, {}).get(name, np.nan))
                                                     for key in CAM_NEEDS)  # fmt: skip
        yield f"the cam {name} cannot push its follower", np.abs(angle) >= ACROSS
        yield f"the cam {name} cannot be made", radius <= 0.0
        yield f"the contact on the cam {name} runs off the face", margin < 0.0
        yield f"the follower leaves the cam {name}", least_force < -NOISE * np.abs(force)


def _of_cams(values: OfCam, of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """Largest magnitudes of values of the cams of a kind."""
    return each(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _least_of_cams(values: Callable[[CamCourse], Any], of: Kind = CAM) -> Callable[[Cycle], Largest]:
    """The least of values of the flanks of the cams of a kind."""

    def of_cam(cycle: Cycle, name: str) -> Any:
        return reduce(np.fmin, (values(flank) for flank in cam_flanks(cycle, name)))

    return _least_values(of_cam, of)


def _least_values(values: OfCam, of: Kind) -> Callable[[Cycle], Largest]:
    """The least of values of the cams of a kind, over the positions that count."""
    return least(lambda cycle: [values(cycle, name) for name in items_of(cycle.scene, of)])


def _cam_units(turns: str, slides: str, of: Kind) -> Callable[[Scene], list[str]]:
    """Units of figures of cams by the drives that they move."""
    return lambda scene: [
        turns if scene.mechanism.drives[scene.cams[name].drive].turns else slides for name in items_of(scene, of)
    ]


CAM_FIGURES: tuple[Figure, ...] = (
    Figure("cam_pressure_angle", "pressure angle of a cam", "rad", CAM,
           _of_cams(lambda cycle, name: cam_flanks(cycle, name)[0].pressure_angle), power=0.0),
    Figure("cam_pitch_radius", "least radius of curvature of a cam's pitch curve", "m", ROLLED,
           _least_of_cams(lambda flank: np.abs(1.0 / flank.pitch_curvature), ROLLED), LEAST, power=0.0),
    Figure("cam_radius", "least radius of curvature of a cam where it bulges", "m", CAM,
           _least_of_cams(lambda flank: flank.convex_radius), LEAST, power=0.0),
    Figure("cam_hollow_radius", "least radius of curvature of a cam where it is hollow", "m", CAM,
           _least_of_cams(lambda flank: flank.hollow_radius), LEAST, power=0.0),
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
           _of_cams(_preload, HELD)),
    Figure("cam_lag", "lag of the drive behind its cam, as the links bend", _cam_units("rad", "m", CAM),
           CAM, _of_cams(cam_lag)),
    Figure("cam_pressure", "pressure between a cam and its follower", "Pa", PRESSED,
           _of_cams(cam_pressure, PRESSED), power=HALF),
    Figure("cam_torque", "torque of a cam's shaft", "N m", CAM, _of_cams(cam_torque)),
)  # fmt: skip
