"""The output of a machine: the point or the angle that it is there for, as its scene names it or as its form tells."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kinelast.figures.cycle import Cycle, points_of
from kinelast.figures.peaks import NOISE
from kinelast.figures.registry import FIGURES, items_of
from kinelast.scene.data import Scene
from kinelast.scene.limits import OUTPUT_ERROR, Output
from kinelast.scene.motion import require_tables
from rigid import GROUND

INSTANTS = 72  # of the run, at which the output is guessed
SAME = 1e-6  # share by which errors may differ that are equal but for round-off


def output_of(scene: Scene) -> Output | None:
    """The output that a scene names; else as far as it can be told from its form; None where it cannot.

    The same for a report, a design, a speed: the guess asks for the scene alone, without vibration, at `INSTANTS`. Of
    the traced points, which belong to one link alone, the one that strays most; else of what slides on the ground, or
    else turns on it, without being driven. What nothing displaces is not what the machine is there for. Where a limit
    of the output has a unit, that tells whether it is a point's or an angle.
    """
    if scene.output is not None:
        return scene.output
    times = scene.course.reached(scene.course.times(INSTANTS))
    if not len(times):
        return None
    moved_at = scene.course.at(times)
    require_tables(scene, moved_at)
    cycle = Cycle(scene, moved_at, wanted=frozenset(("u", "w")))
    unit = next((limit.unit for limit in scene.limits if limit.figure == OUTPUT_ERROR), "")
    moved = _sizes(cycle, "displacement")
    along = [np.nanmax(np.abs(each.value), initial=0.0) for each in cycle.maxima.values()] if scene.labels else []
    noise = NOISE * max([*along, *moved.values()], default=0.0)
    for names in (_traced(scene), slid(scene)) if unit != "rad" else ():
        if name := _farthest({name: moved[name] for name in names if moved[name] > noise}):
            return Output(next(link.name for link in scene.mechanism.links[1:] if name in link.points), name, True)
    turned = _sizes(cycle, "angle_error")
    name = _farthest({name: turned[name] for name in _turning(scene)}) if unit != "m" else ""
    return Output(name, guessed=True) if name else None


def _sizes(cycle: Cycle, key: str) -> dict[str, float]:
    """Magnitudes of a figure by item; zero of what is not known."""
    figure = next(figure for figure in FIGURES if figure.key == key)
    sizes = np.nan_to_num(np.abs(cycle.of(figure).value)).tolist()
    return dict(zip(items_of(cycle.scene, figure.of), sizes, strict=True))


def _farthest(sizes: Mapping[str, float]) -> str:
    """The name of the largest; of those that are as large to round-off the first; empty where all are zero."""
    most = max(sizes.values(), default=0.0)
    return next((name for name, size in sizes.items() if size and size >= (1 - SAME) * most), "")


def _traced(scene: Scene) -> list[str]:
    """Moving points of one link alone that no slider is at."""
    mechanism = scene.mechanism
    carried = [point for link in mechanism.links for point in link.points]
    at_sliders = {slider.point for slider in mechanism.sliders}
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
    return [link.name for link in links if ground.points.keys() & link.points and link.name not in driven]
