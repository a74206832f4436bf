"""The output of a machine: a point or an angle, as its scene names it or as its form tells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from elastic import Deflection, cycle_maxima, displacement_of, largest
from elastic.assessment import angle_error
from kinelast.figures.cycle import NOISE, points_of
from kinelast.scene.data import Scene, require_tables, scene_deflection
from kinelast.scene.error import SceneError
from kinelast.scene.limits import OUTPUT_ERROR, Output
from rigid import GROUND

INSTANTS = 72  # of the run, at which the output is guessed
SAME = 1e-6  # share by which errors may differ that are equal but for round-off


def output_of(scene: Scene) -> Output | None:
    """The output that a scene names; else as far as it can be told from its form; None where it cannot.

    The same for a report, a design, a speed: the guess asks for the scene alone, without vibration, at `INSTANTS`. Of
    the traced points, which belong to one link alone, the one that strays most; else of what slides on the ground, or
    else turns on it, without being driven. A point that nothing displaces is no output. Where a limit
    of the output has a unit, that tells whether it is a point's or an angle.
    """
    if scene.output is not None:
        return scene.output
    bent = _deflection(scene)
    if bent is None:
        return None
    unit = next((limit.unit for limit in scene.limits if limit.figure == OUTPUT_ERROR), "")
    owners = dict(points_of(scene.mechanism))
    noise: float | None = None
    for names in (_traced(scene), slid(scene)) if unit != "rad" else ():
        moved = {name: _size(displacement_of(bent, owners[name], name)) for name in names}
        noise = _noise(bent) if noise is None and names else noise
        if name := _farthest({name: size for name, size in moved.items() if size > (noise or 0.0)}):
            return Output(scene.mechanism.links[owners[name]].name, name, guessed=True)
    turned = {link: _angle(scene, bent, link) for link in _turning(scene)} if unit != "m" else {}
    name = _farthest(turned)
    return Output(name, guessed=True) if name else None


def _deflection(scene: Scene) -> Deflection | None:
    """At so many instants of the run as are reached; None where none is."""
    times = scene.course.times(INSTANTS)
    try:
        moved = scene.course.at(times)
    except SceneError:
        times = scene.course.reached(times)
        if not len(times):
            return None
        moved = scene.course.at(times)
    require_tables(scene, moved)
    return scene_deflection(scene, moved)


def _size(values: Any) -> float:
    """Largest magnitude over the positions; zero where none is known."""
    return float(np.nan_to_num(largest(np.atleast_1d(np.abs(values))).value))


def _noise(bent: Deflection) -> float:
    """Displacements that are round-off beside those of the links."""
    along = cycle_maxima(bent, ("u", "w")).values() if bent.sections else ()
    return NOISE * max((float(np.nanmax(each.value, initial=0.0)) for each in along), default=0.0)


def _angle(scene: Scene, bent: Deflection, link: str) -> float:
    points = scene.mechanism.links[scene.mechanism.index[link]].points
    return max(_size(angle_error(bent, link, point)) for point in points)


def _farthest(sizes: Mapping[str, float]) -> str:
    """The name of the largest; of those that are as large to round-off the first; empty where all are zero."""
    most = max(sizes.values(), default=0.0)
    return next((name for name, size in sizes.items() if size and size >= (1 - SAME) * most), "")


def _traced(scene: Scene) -> list[str]:
    """Moving points of one link alone that no slider is at."""
    mechanism = scene.mechanism
    carried = [point for link in mechanism.links for point in link.points]
    at_sliders = mechanism.slider_points.values()
    return [name for name, _ in points_of(mechanism) if carried.count(name) == 1 and name not in at_sliders]


def slid(scene: Scene) -> list[str]:
    """Moving points that slide on the ground without being driven."""
    mechanism = scene.mechanism
    driven, moving = {drive.name for drive in mechanism.drives if not drive.turns}, dict(points_of(mechanism))
    free = (slider for slider in mechanism.sliders if slider.on == GROUND and slider.name not in driven)
    return [slider.point for slider in free if slider.point in moving]


def _turning(scene: Scene) -> list[str]:
    """Links that turn on the ground without being driven."""
    driven = {drive.name for drive in scene.mechanism.drives if drive.turns}
    ground, *links = scene.mechanism.links
    pins = ground.points.keys() - scene.mechanism.welded_points
    return [link.name for link in links if pins & link.points.keys() and link.name not in driven]
