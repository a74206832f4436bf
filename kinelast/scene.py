"""Scenes: a mechanism, its drives and its run, as described in one small file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from elastic import RIGID, Section
from kinelast.scene_drives import DriveLaw, build_drives, build_slider
from kinelast.scene_error import SceneError, fault
from kinelast.scene_files import shipped_scenes
from kinelast.scene_format import SceneTable
from kinelast.scene_links import Body, build_links, drawn_places
from kinelast.scene_loads import build_load
from kinelast.scene_parse import parse_scene, parse_toml
from kinelast.scene_sections import CrossSection
from rigid import (
    ConstantSpeed,
    Mechanism,
    MechanismError,
    Motion,
    PinDrive,
    ReachError,
    Reals,
    SegmentedLaw,
    motion,
    require_reach,
)

__all__ = [
    "Run",
    "Scene",
    "SceneError",
    "read_scene",
    "scene_from_dict",
    "scene_from_text",
    "scene_motion",
    "scene_times",
    "shipped_scenes",
]


@dataclass(frozen=True)
class Run:
    """Which instants of the motion are looked at.

    Attributes
    ----------
    positions
        How many, from the start on.
    duration
        [s].
    turn
        The duration is one turn of a drive at constant speed, and its end, which is its start, is not repeated.
    """

    positions: int
    duration: float
    turn: bool


@dataclass(frozen=True, eq=False)
class Scene:
    """A mechanism that is ready to move.

    Attributes
    ----------
    name, title, source
        Stem of the file, and what the scene says of itself.
    path
        Of the file, or what stands for it.
    mechanism
        Geometry, mass, drives and loads.
    sections, cross_sections, labels
        One per beam, in the order of `mechanism.beams`: rigidities (infinite for rigid links), all that is known of
        the cross-section, and the name of its link, followed by .1, .2 where that has several beams.
    laws
        One per drive: time [s] to coordinate, rate and acceleration.
    run
        Instants to look at.
    outlines
        Corners of the links' drawings in their own axes [m], by link; only links that have one.
    """

    name: str
    title: str
    source: str
    path: str
    mechanism: Mechanism
    sections: tuple[Section, ...]
    cross_sections: tuple[CrossSection, ...]
    labels: tuple[str, ...]
    laws: tuple[DriveLaw, ...]
    run: Run
    outlines: Mapping[str, tuple[complex, ...]]


def read_scene(path: str | Path) -> Scene:
    """The scene in a TOML file.

    Raises
    ------
    SceneError
        The file cannot be read or holds a mistake.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(str(path), "", "", "there is no such file") from None
    except OSError as error:
        raise SceneError(str(path), "", "", f"not readable: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SceneError(str(path), "", "", f"not a text in UTF-8, byte {error.start + 1}") from None
    return scene_from_text(text, path.stem, str(path))


def scene_from_text(text: str, name: str = "scene", path: str = "") -> Scene:
    """The scene in a TOML text; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        The text holds a mistake.
    """
    try:
        raw = parse_toml(text)
    except SceneError as error:
        raise _of(path, error) from None
    return scene_from_dict(raw, name, path)


def scene_from_dict(raw: Mapping[str, Any], name: str = "scene", path: str = "") -> Scene:
    """The scene in the tables of a TOML file; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        A table or a key is wrong.
    """
    try:
        table = parse_scene(raw)
        return _build(table, name, path)
    except SceneError as error:
        raise _of(path, error) from None


def _of(path: str, error: SceneError) -> SceneError:
    return SceneError(path, error.table, error.key, error.problem)


def _build(table: SceneTable, name: str, path: str) -> Scene:
    places = drawn_places(table)
    bodies = build_links(table, places)
    links = {key: body.link for key, body in bodies.items()}
    sliders = {key: build_slider(key, entry, links, places) for key, entry in table.sliders.items()}
    drives, laws = build_drives(table, links, sliders, places)
    run = _run(table, drives, laws)
    loads = tuple(build_load(number, load, links, run.duration) for number, load in enumerate(table.loads, 1))
    gravity = complex(*(table.run.gravity or (0.0, 0.0)))
    mechanism = Mechanism(tuple(links.values()), drives, places, tuple(sliders.values()), gravity, loads)
    beams = [(body, k) for body in (bodies[link.name] for link in mechanism.links) for k in range(len(body.sections))]
    scene = Scene(
        name,
        table.title or name.replace("_", " "),
        table.source,
        path,
        mechanism,
        tuple(RIGID if body.rigid else body.sections[k].elastic for body, k in beams),
        tuple(body.sections[k] for body, k in beams),
        tuple(_label(body, k) for body, k in beams),
        laws,
        run,
        {key: body.outline for key, body in bodies.items() if body.outline},
    )
    _move(scene, scene_times(scene)[:1])
    return scene


def _label(body: Body, number: int) -> str:
    return body.link.name if len(body.sections) == 1 else f"{body.link.name}.{number + 1}"


def _run(table: SceneTable, drives: Any, laws: tuple[DriveLaw, ...]) -> Run:
    """As said; else one turn of the first drive that turns steadily; else as long as the longest law."""
    steady = [law.speed for drive, law in zip(drives, laws, strict=True)
              if isinstance(drive, PinDrive) and isinstance(law, ConstantSpeed) and law.speed]  # fmt: skip
    lasting = [law.duration for law in laws if isinstance(law, SegmentedLaw)]
    positions = table.run.positions
    if table.run.duration is not None:
        run = Run(positions, float(table.run.duration), False)
    elif steady:
        run = Run(positions, 2 * pi / abs(steady[0]), True)
    elif lasting:
        run = Run(positions, max(lasting), False)
    else:
        problem = 'the key is missing: no drive turns steadily, so say how long to run, as in "50 ms"'
        raise fault("run", "duration", problem)
    for number, law in enumerate(laws, 1):
        if isinstance(law, SegmentedLaw) and law.final_speed and run.duration > law.duration * (1 + 1e-12):
            problem = (
                f"ends at full speed after {law.duration:g} s, but the run lasts {run.duration:g} s: add a segment"
            )
            raise fault(f"drives[{number}]", "law", problem)
    return run


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
        The drives ask for positions that cannot be reached; names where and at which joint it stops.
    """
    course = _move(scene, scene_times(scene, positions))
    if not partial:
        try:
            require_reach(course)
        except ReachError as error:
            table = "links" if "cannot be assembled" in str(error) else "drives[1]"
            raise SceneError(scene.path, table, "", str(error)) from None
    return course


def _move(scene: Scene, time: Reals) -> Motion:
    coordinates, rates, accelerations = (
        np.array(part) for part in zip(*(law(time) for law in scene.laws), strict=True)
    )
    try:
        return motion(scene.mechanism, coordinates, rates, accelerations, time)
    except MechanismError as error:
        raise SceneError(scene.path, _table(scene.mechanism, str(error)), "", str(error)) from None


def _table(mechanism: Mechanism, message: str) -> str:
    """The table that a message of the mechanism is about, by the first thing that it names."""
    quoted = re.findall(r'"([^"]*)"', message)
    if "is not drawn" in message or "are drawn in line" in message:
        return "points"
    if "drive" in message.partition(":")[0]:
        return "drives"
    for slider in mechanism.sliders:
        if f'the slider "{slider.name}"' in message:
            return f"sliders.{slider.name}"
    links = [f"links.{name}" for name in quoted if name in mechanism.index]
    return links[0] if len(links) == 1 else "links"
