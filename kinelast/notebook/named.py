"""Motion and deflection of a scene that know its names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, Deflection, sample
from kinelast.runs.compute import computed
from kinelast.scene.data import Scene
from kinelast.scene.document import read_scene
from kinelast.scene.motion import scene_motion
from kinelast.tasks.paths import scene_paths
from kinelast.tasks.request import Request
from rigid import Motion, acceleration_of, position_of, velocity_of
from rigid.arrays import Complexes, Reals

STATIONS = 101


def load(scene: str | Path) -> Scene:
    """The scene in a file, or a shipped one by its name.

    Raises
    ------
    SceneError
        The file holds a mistake.
    ValueError
        There is no such file or scene, or more than one.

    Examples
    --------
    >>> load("steel_four_bar")
    Scene("steel_four_bar": 4 links, 3 beams, 1 drive, 360 positions)
    """
    paths, problems = scene_paths([str(scene)])
    if problems:
        raise ValueError(problems[0])
    if len(paths) != 1:
        raise ValueError(f'"{scene}" holds {len(paths)} scenes: name one of them')
    return read_scene(paths[0])


@dataclass(frozen=True)
class PointMotion:
    """A point over the cycle: place [m], velocity [m/s] and acceleration [m/s^2], complex, shape (positions,)."""

    position: Complexes
    velocity: Complexes
    acceleration: Complexes

    def __repr__(self) -> str:
        return f"PointMotion({len(self.position)} positions: position, velocity, acceleration)"


@dataclass(frozen=True)
class LinkMotion:
    """A link over the cycle: angle [rad], without jumps, angular velocity and acceleration, shape (positions,)."""

    angle: Reals
    angular_velocity: Reals
    angular_acceleration: Reals

    def __repr__(self) -> str:
        return f"LinkMotion({len(self.angle)} positions: angle, angular_velocity, angular_acceleration)"


class BeamFields:
    """The fields along a beam by their keys, `w`, `M` and so on, at 101 stations: shape (positions, stations).

    `x` is the way of the stations along the beam [m], shape (stations,).
    """

    def __init__(self, deflection: SceneDeflection, label: str, beam: int) -> None:
        self._deflection, self._label, self._beam = deflection, label, beam
        self.x = np.linspace(0.0, 1.0, STATIONS) * float(deflection.length[beam, 0])

    def __getattr__(self, key: str) -> Any:
        """A field at all positions and stations."""
        if key not in FIELDS:
            raise AttributeError(f'there is no field "{key}": choose from {", ".join(FIELDS)}')
        return sample(self._deflection, key, STATIONS)[self._beam]

    def __dir__(self) -> list[str]:
        return ["x", *FIELDS]

    def __repr__(self) -> str:
        return f"BeamFields({self._label}, {self.x[-1]:.6g} m: {', '.join(FIELDS)})"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SceneMotion(Motion):
    """A motion that finds its points and links by name, as in `motion["B"].position`; points first."""

    scene: Scene

    def __getitem__(self, name: str) -> PointMotion | LinkMotion:
        links = self.mechanism.links
        for number, link in enumerate(links):
            if name in link.points:
                at = number, name
                return PointMotion(*(of(self, *at) for of in (position_of, velocity_of, acceleration_of)))
        if name in self.mechanism.index:
            number = self.mechanism.index[name]
            angle = np.unwrap(np.angle(self.direction[number]))
            return LinkMotion(angle, self.angular_velocity[number], self.angular_acceleration[number])
        raise _unknown(name, [*{point: None for link in links for point in link.points}, *self.mechanism.index])

    def __repr__(self) -> str:
        return f'Motion("{self.scene.name}": {_told(self)})'

    def _repr_html_(self) -> str:
        names = {point: None for link in self.mechanism.links for point in link.points}
        links = list(self.mechanism.index)[1:]
        return _html(self.scene, f"motion, {_told(self)}", {"points": names, "links": links})


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SceneDeflection(Deflection):
    """A deflection that finds its beams by name, as in `deflection["coupler"].w`."""

    scene: Scene

    def __getitem__(self, label: str) -> BeamFields:
        if label not in self.scene.labels:
            raise _unknown(label, self.scene.labels)
        return BeamFields(self, label, self.scene.labels.index(label))

    def __repr__(self) -> str:
        return f'Deflection("{self.scene.name}": {len(self.sections)} beams, {_told(self.motion)})'

    def _repr_html_(self) -> str:
        told = f"deflection, {len(self.sections)} beams, {_told(self.motion)}"
        return _html(self.scene, told, {"beams": self.scene.labels, "fields": FIELDS})


def motion(scene: Scene, positions: int | None = None) -> SceneMotion:
    """The motion of a scene over its run; `positions` overrides how many.

    Raises
    ------
    SceneError
        The drives ask for positions that cannot be reached.
    """
    return _motion(scene, scene_motion(scene, positions))


def deflection(scene: Scene, positions: int | None = None) -> SceneDeflection:
    """The deflection of a scene over its run, by the theory that it asks for; `positions` overrides how many.

    Raises
    ------
    SceneError
        As `motion`; a block leaves its beam; vibration is asked for and cannot be answered.
    """
    return named_deflection(scene, computed(scene, Request(positions=positions)).deflection)


def named_deflection(scene: Scene, bent: Deflection) -> SceneDeflection:
    """The same deflection, with the names of its scene."""
    parts = {each.name: getattr(bent, each.name) for each in fields(bent)}
    return SceneDeflection(**{**parts, "motion": _motion(scene, bent.motion)}, scene=scene)


def _motion(scene: Scene, course: Motion) -> SceneMotion:
    return SceneMotion(**{each.name: getattr(course, each.name) for each in fields(course)}, scene=scene)


def _told(course: Motion) -> str:
    return f"{len(course.time)} positions in {course.time[-1] - course.time[0]:.4g} s"


def _html(scene: Scene, told: str, names: dict[str, Iterable[str]]) -> str:
    rows = "".join(f"<br>{kind}: <code>{escape(', '.join(each))}</code>" for kind, each in names.items())
    return f"<p><b>{escape(scene.title)}</b>: {escape(told)}{rows}</p>"


def _unknown(name: str, known: Iterable[str]) -> KeyError:
    return KeyError(f'there is no "{name}": choose from {", ".join(known)}')
