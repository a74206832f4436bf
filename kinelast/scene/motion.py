"""The motion of a scene: by the laws of its drives, or integrated where a drive is an effort."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.error import SceneError
from rigid import SINGULAR, Mechanism, MechanismError, Motion, Posture, Reals, motion, motion_in_chunks
from rigid.analysis import ReachError, require_reach
from rigid.chunks import columns_of
from rigid.dynamics import ForwardError, IntegratedMotion, TableError, motion_during
from rigid.topology import assembled, flat_triangles


def scene_times(scene: Scene, positions: int | None = None) -> Reals:
    """Instants of a scene's run [s], shape (positions,); `positions` overrides how many.

    Of many designs whose runs last differently long, shape (designs, positions).
    """
    count = scene.run.positions if positions is None else positions
    if count < 1:
        raise ValueError(f"expected at least 1 position, got {count}")
    times = np.linspace(0.0, scene.run.duration, count, endpoint=not scene.run.turn, axis=-1)
    return times.reshape(-1, count) if times.ndim > 1 else times


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
        require_reached(scene, course)
    require_tables(scene, course)
    return course


def scene_motion_at(scene: Scene, time: Any) -> Motion:
    """The motion of a scene's mechanism at any instants [s], shape (positions,), as far as it reaches them."""
    time = np.asarray(time, float)
    with _of_scene(scene):
        if scene.is_integrated:
            return motion_during(_course_to(scene, time), time)
        return motion(scene.mechanism, *_drive_columns(scene, time), time)


def scene_motion_in_chunks(scene: Scene, time: Reals) -> Iterator[Motion]:
    """The same as `scene_motion_at`, so many instants at a time as stay in the cache."""
    with _of_scene(scene):
        if scene.is_integrated:
            step, course = columns_of(scene.mechanism, len(time)), _course_to(scene, time)
            yield from (motion_during(course, time[k : k + step]) for k in range(0, len(time), step))
        else:
            yield from motion_in_chunks(scene.mechanism, *_drive_columns(scene, time), time)


def scene_motion_near(scene: Scene, time: Reals, near: Posture) -> Motion:
    """The same as `scene_motion_at`, at instants apart from one another: on the branch of postures near by."""
    with _of_scene(scene):
        if scene.is_integrated:
            return motion_during(_course_to(scene, time), time)
        return motion(scene.mechanism, *_drive_columns(scene, time), time, near)


def reached_by_integration(scene: Scene, time: Reals) -> Reals:
    """Those of some instants that an integrated motion reaches; all where laws tell the motion."""
    with _of_scene(scene):
        return time[time <= scene.integrated()[0].time[-1]] if scene.is_integrated else time


def _course_to(scene: Scene, time: Reals) -> IntegratedMotion:
    """The integrated motion; raises what stops it before the last of some instants."""
    course, stop = scene.integrated()
    if stop is not None and time.max(initial=0.0) > course.time[-1]:
        raise stop
    return course


def _drive_columns(scene: Scene, time: Reals) -> tuple[Any, Any, Any]:
    """Coordinates, rates and accelerations of the drives by their laws, each of shape (drives, positions)."""
    laws = [law for law in scene.laws if not isinstance(law, DriveEffort)]
    coordinates, rates, accelerations = (np.array(part) for part in zip(*(law(time) for law in laws), strict=True))
    return coordinates, rates, accelerations


@contextmanager
def _of_scene(scene: Scene) -> Iterator[None]:
    """Turn what the mechanism says into a mistake of its scene."""
    try:
        yield
    except MechanismError as error:
        raise SceneError(scene.path, _table(scene.mechanism, error), "", f"{error}{_advice(error)}") from None
    except TableError as error:
        raise SceneError(scene.path, "drives", "", str(error)) from None


def _advice(error: MechanismError) -> str:
    """What can be done about an integration that stops."""
    if not isinstance(error, ForwardError) or error.course is None:
        return ""
    more = "; steps under [run] allows more" if error.kind == "steps" else ""
    return f"{more}; --reachable keeps what was reached"


def require_reached(scene: Scene, course: Motion) -> None:
    """Raise where drives ask for positions that cannot be reached: names where and at which joint it stops."""
    try:
        require_reach(course)
    except ReachError as error:
        table = "links" if error.kind == "unreachable" else "drives[1]"
        raise SceneError(scene.path, table, "", str(error)) from None


def require_tables(scene: Scene, course: Motion) -> None:
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
        if not first.suspect or (first.condition <= SINGULAR).all():
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
