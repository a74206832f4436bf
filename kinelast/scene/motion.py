"""Motion and deflection of a scene, and their requirements."""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic import Deflection, deflection
from kinelast.scene.course import table_of
from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.error import SceneError
from rigid import SINGULAR, MechanismError, Motion, ReachError, Reals, TableError, motion, require_reach


def scene_times(scene: Scene, positions: int | None = None) -> Reals:
    """Instants of a scene's run [s], as `Course.times`."""
    return scene.course.times(positions)


def scene_motion_at(scene: Scene, time: Any) -> Motion:
    """The motion of a scene's mechanism at any instants [s], shape (positions,), as `Course.at`."""
    return scene.course.at(time)


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
    moved = scene.course.at(scene.course.times(positions))
    if not partial:
        require_reached(scene, moved)
    require_tables(scene, moved)
    return moved


def scene_deflection(scene: Scene, moved: Motion) -> Deflection:
    """The quasi-static deflection of a scene's links in a motion of its mechanism.

    Raises
    ------
    SceneError
        A slider's block comes to a beam whose section it cannot slide on.
    """
    try:
        return deflection(moved, scene.sections, joints=scene.joints)
    except MechanismError as error:
        if error.kind != "section":
            raise
        raise SceneError(scene.path, f"links.{error.links[0]}", "section", str(error)) from None


def require_reached(scene: Scene, moved: Motion) -> None:
    """Raise where drives ask for positions that cannot be reached: names where and at which joint it stops."""
    try:
        require_reach(moved)
    except ReachError as error:
        table = "links" if error.kind == "unreachable" else "drives[1]"
        raise SceneError(scene.path, table, "", str(error)) from None


def require_tables(scene: Scene, moved: Motion) -> None:
    """Raise where the coordinate of a load's table runs past its end."""
    for number, load in enumerate(scene.mechanism.loads, 1):
        law = getattr(load, "law", None)
        if law is not None:
            try:
                law(moved)
            except TableError as error:
                raise SceneError(scene.path, f"loads[{number}]", "table", str(error)) from None


def require_determined(scene: Scene) -> None:
    """Raise where the drives do not tell the motion, or bars in one line make the mechanism singular for ever."""
    mechanism = scene.mechanism
    start = [law.start if isinstance(law, DriveEffort) else law(np.zeros(1))[0].item() for law in scene.laws]
    try:
        first = motion(mechanism, np.array(start)[:, None])
        if not first.may_be_singular or (first.condition <= SINGULAR).all():
            return
        _require_no_flat_triangle(scene)
    except MechanismError as error:
        _require_no_flat_triangle(scene)
        raise SceneError(scene.path, table_of(mechanism, error), "", str(error)) from None


def _require_no_flat_triangle(scene: Scene) -> None:
    """Raise where three links pinned to one another lie in one line: no drawing and no drive can help that."""
    from rigid.topology import assembled, flat_triangles

    try:
        flat = flat_triangles(assembled(scene.mechanism))
    except MechanismError:  # what does not close is told elsewhere
        return
    if flat:
        names = ", ".join(f'"{name}"' for name in flat[0])
        problem = f"{names} are pinned to one another in one line, which is singular in every position: "
        raise SceneError(scene.path, f"links.{flat[0][0]}", "", problem + "make them one link with three points")
