"""The motion of a scene: by the laws of its drives, or integrated where a drive is an effort."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.error import SceneError
from rigid import SINGULAR, Mechanism, MechanismError, Motion, Reals, motion
from rigid.analysis import ReachError, require_reach
from rigid.dynamics import TableError, motion_during
from rigid.topology import assembled, flat_triangles


def scene_times(scene: Scene, positions: int | None = None) -> Reals:
    """Instants of a scene's run [s], shape (positions,); `positions` overrides how many."""
    count = scene.run.positions if positions is None else positions
    if count < 1:
        raise ValueError(f"expected at least 1 position, got {count}")
    return np.linspace(0.0, scene.run.duration, count, endpoint=not scene.run.turn)


def scene_motion(scene: Scene, positions: int | None = None, partial: bool = False) -> Motion:
    """The motion of a scene's mechanism over its run.

    Parameters
    ----------
    positions
        Overrides how many positions are looked at.
    partial
        Let positions that cannot be reached be nan, instead of raising.

    Raises
    ------
    SceneError
        The drives ask for positions that cannot be reached: names where and at which joint it stops. A motion that
        cannot go on. A table that ends too soon.
    """
    course = scene_motion_at(scene, scene_times(scene, positions))
    if not partial:
        try:
            require_reach(course)
        except ReachError as error:
            table = "links" if error.kind == "unreachable" else "drives[1]"
            raise SceneError(scene.path, table, "", str(error)) from None
    _require_tables(scene, course)
    return course


def scene_motion_at(scene: Scene, time: Any) -> Motion:
    """The motion of a scene's mechanism at any instants [s], shape (positions,), as far as it reaches them."""
    time = np.asarray(time, float)
    try:
        if scene.course is not None:
            return motion_during(scene.course, time)
        laws = [law for law in scene.laws if not isinstance(law, DriveEffort)]
        coordinates, rates, accelerations = (np.array(part) for part in zip(*(law(time) for law in laws), strict=True))
        return motion(scene.mechanism, coordinates, rates, accelerations, time)
    except MechanismError as error:
        raise SceneError(scene.path, _table(scene.mechanism, error), "", str(error)) from None
    except TableError as error:
        raise SceneError(scene.path, "drives", "", str(error)) from None


def _require_tables(scene: Scene, course: Motion) -> None:
    """Raise where a load's table ends before what it is against does."""
    for number, load in enumerate(scene.mechanism.loads, 1):
        law = getattr(load, "law", None)
        if law is not None:
            try:
                law(course)
            except TableError as error:
                raise SceneError(scene.path, f"loads[{number}]", "table", str(error)) from None


def require_determined(scene: Scene) -> None:
    """Raise where the drives do not tell the motion, or bars in one line make the mechanism singular for ever."""
    mechanism = scene.mechanism
    start = [law.start if isinstance(law, DriveEffort) else law(np.zeros(1))[0].item() for law in scene.laws]
    try:
        first = motion(mechanism, np.array(start)[:, None])
        if (first.condition <= SINGULAR).all():
            return
        _require_no_flat_triangle(scene)
    except MechanismError as error:
        _require_no_flat_triangle(scene)
        raise SceneError(scene.path, _table(mechanism, error), "", str(error)) from None


def _require_no_flat_triangle(scene: Scene) -> None:
    """Raise where three links pinned to one another lie in one line: no drawing and no drive can help that."""
    try:
        flat = flat_triangles(assembled(scene.mechanism))
    except MechanismError:  # what does not close is told elsewhere
        return
    if flat:
        names = ", ".join(f'"{name}"' for name in flat[0])
        problem = f"{names} are pinned to one another in one line, which is singular in every position: "
        raise SceneError(scene.path, f"links.{flat[0][0]}", "", problem + "make them one link with three points")


def _table(mechanism: Mechanism, error: MechanismError) -> str:
    """The table that an error of the mechanism is about."""
    if error.kind in ("drawing", "drives"):
        return "points" if error.kind == "drawing" else "drives"
    for slider in mechanism.sliders:
        if error.joints == (slider.name,):
            return f"{'slots' if slider.link == f'{slider.name} block' else 'sliders'}.{slider.name}"
    links = [name for name in error.links if " " not in name]
    return f"links.{links[0]}" if len(links) == 1 else "links"
