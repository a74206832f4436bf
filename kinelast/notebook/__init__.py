"""Motion and deflection of a scene, with points, links and beams by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from elastic import FIELDS, Deflection, sample
from kinelast.runs import computed
from kinelast.scene.data import Scene, scene_motion
from kinelast.scene.document import Document, read_scene
from kinelast.scene.error import MissingFileError, likely
from kinelast.tasks import Option, OptionError
from kinelast.tasks.request import Request, options_of
from kinelast.tasks.task import scene_paths
from rigid import Load, Mechanism, Motion, acceleration_of, position_of, velocity_of
from rigid.arrays import Complexes, Reals

STATIONS = 101  # stations per beam, evenly spaced from end to end
MAX_SHOWN = 60  # maximum number of characters of an argument in a message


def load(scene: str | Path) -> Scene:
    """Return the scene of a file, or a shipped scene by its name.

    Raises
    ------
    SceneError
        The file contains an error.
    FileNotFoundError
        No file or scene has this name.
    ValueError
        The folder contains several scenes.

    Examples
    --------
    >>> load("steel_four_bar")
    Scene("steel_four_bar": 4 links, 3 beams, 1 drive, 360 positions)
    """
    if not isinstance(scene, str | Path):
        raise TypeError(f"expected the name of a scene or the path of its file, got {shown(scene)}")
    paths, problems = scene_paths([str(scene)])
    if problems:
        raise MissingFileError("", "", "", problems[0])
    if len(paths) != 1:
        raise ValueError(f'"{scene}" holds {len(paths)} scenes: name one of them')
    return read_scene(paths[0])


def with_loads(scene: Scene | Document, *loads: Load) -> Scene:
    """Return a scene with additional loads. The copy has no text, since its file does not contain them.

    Parameters
    ----------
    loads
        Same as in `rigid.PointLoad` and `rigid.LineLoad`; `law` is a function of the motion, shape (positions,).

    Raises
    ------
    MechanismError
        A load is on a link or at a point that does not exist.
    """
    given = scene_of(scene)
    mechanism = replace(given.mechanism, loads=(*given.mechanism.loads, *loads))
    return replace(given, course=replace(given.course, mechanism=mechanism), text="")


@dataclass(frozen=True)
class PointMotion:
    """Position [m], velocity [m/s] and acceleration [m/s^2] of a point, complex, shape (positions,)."""

    position: Complexes
    velocity: Complexes
    acceleration: Complexes

    def __repr__(self) -> str:
        return f"PointMotion({len(self.position)} positions: position [m], velocity [m/s], acceleration [m/s^2])"


@dataclass(frozen=True)
class LinkMotion:
    """Angle [rad], without jumps, angular velocity [rad/s] and acceleration [rad/s^2] of a link, shape (positions,)."""

    angle: Reals
    angular_velocity: Reals
    angular_acceleration: Reals

    def __repr__(self) -> str:
        fields = "angle [rad], angular_velocity [rad/s], angular_acceleration [rad/s^2]"
        return f"LinkMotion({len(self.angle)} positions: {fields})"


class BeamFields:
    """Fields along a beam by their keys, such as `w` and `M`, at 101 stations, shape (positions, stations).

    `x` is the distance of the stations from the start of the beam [m], shape (stations,).
    """

    def __init__(self, deflection: SceneDeflection, label: str, beam: int) -> None:
        self._deflection, self._label, self._beam = deflection, label, beam
        self.x = np.linspace(0.0, 1.0, STATIONS) * float(deflection.length[beam, 0])

    def __getattr__(self, key: str) -> Any:
        """Return a field at all positions and stations."""
        if key not in FIELDS:
            raise AttributeError(f'there is no field "{key}": choose from {", ".join(FIELDS)}')
        return sample(self._deflection, key, STATIONS)[self._beam]

    @property
    def line(self) -> Complexes:
        """Axis of the rigid beam [m], complex, shape (positions, stations)."""
        return rigid_line(self._deflection.motion, self._beam)

    @property
    def displacement(self) -> Complexes:
        """Displacement of the axis in the ground's axes [m], complex, shape (positions, stations)."""
        along = self.line[:, -1:] - self.line[:, :1]
        return along / np.abs(along) * (self.u + 1j * self.w)

    def __dir__(self) -> list[str]:
        return ["x", "line", "displacement", *FIELDS]

    def __repr__(self) -> str:
        return f"BeamFields({self._label}, {self.x[-1]:.6g} m: {', '.join(FIELDS)})"


def rigid_line(course: Motion, beam: int) -> Complexes:
    """Return the axis of a rigid beam at every position [m], complex, shape (positions, stations)."""
    at, ends = course.mechanism.beams[beam]
    start, end = (np.broadcast_to(position_of(course, at, name), course.columns) for name in (ends.start, ends.end))
    return start[:, None] + (end - start)[:, None] * np.linspace(0.0, 1.0, STATIONS)


class PartsByName:
    """Something with parts by name, as items, with tab completion."""

    def __iter__(self) -> Iterator[str]:
        raise NotImplementedError

    def keys(self) -> list[str]:
        """Names of the parts."""
        return [*self]

    def _ipython_key_completions_(self) -> list[str]:
        return [*self]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SceneMotion(PartsByName, Motion):
    """Motion with points and links by name: `motion["B"].position`. A point precedes a link of the same name."""

    scene: Scene

    def __iter__(self) -> Iterator[str]:
        yield from dict.fromkeys((*point_names(self.mechanism), *self.mechanism.index))

    def __getitem__(self, name: str) -> PointMotion | LinkMotion:
        links = self.mechanism.links
        for number, link in enumerate(links):
            if name in link.points:
                at = number, name
                return PointMotion(*(of(self, *at) for of in (position_of, velocity_of, acceleration_of)))
        if name in self.mechanism.index:
            return self.link(name)
        raise KeyError(unknown_name(name, self))

    def link(self, name: str) -> LinkMotion:
        """Return the motion of a link, even if a point has the same name."""
        number = self.mechanism.index[name]
        angle = np.unwrap(np.angle(self.direction[number]))
        return LinkMotion(angle, self.angular_velocity[number], self.angular_acceleration[number])

    def __repr__(self) -> str:
        return f'Motion("{self.scene.name}": {_extent(self)})'

    def _repr_html_(self) -> str:
        names = {"points": point_names(self.mechanism), "links": [*self.mechanism.index][1:]}
        return names_html(self.scene, f"motion, {_extent(self)}", names)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SceneDeflection(PartsByName, Deflection):
    """Deflection with beams by name: `deflection["coupler"].w`."""

    scene: Scene

    def __iter__(self) -> Iterator[str]:
        yield from self.scene.labels

    def __getitem__(self, label: str) -> BeamFields:
        if label not in self.scene.labels:
            raise KeyError(unknown_name(label, self))
        return BeamFields(self, label, self.scene.labels.index(label))

    def __repr__(self) -> str:
        return f'Deflection("{self.scene.name}": {len(self.sections)} beams, {_extent(self.motion)})'

    def _repr_html_(self) -> str:
        words = f"deflection, {len(self.sections)} beams, {_extent(self.motion)}"
        return names_html(self.scene, words, {"beams": self.scene.labels, "fields": FIELDS})


def motion(scene: Scene | Document, positions: int | None = None) -> SceneMotion:
    """Return the motion of a scene over its run. `positions` overrides their number.

    Raises
    ------
    SceneError
        The drives require positions that are out of reach.
    TypeError, ValueError
        The argument is not a scene, or not a number of positions.
    """
    given, asked = scene_of(scene), request_of(positions=positions)
    return _motion(given, scene_motion(given, asked.positions))


def deflection(scene: Scene | Document, positions: int | None = None) -> SceneDeflection:
    """Return the deflection of a scene over its run, by the theory it requests. `positions` overrides their number.

    Raises
    ------
    SceneError
        The drives require positions that are out of reach, a block leaves its beam, or vibration has no solution.
    """
    given = scene_of(scene)
    return named_deflection(given, computed(given, request_of(positions=positions)).deflection)


def named_deflection(scene: Scene, bent: Deflection) -> SceneDeflection:
    """Return a deflection with names from its scene."""
    parts = {each.name: getattr(bent, each.name) for each in fields(bent)}
    return SceneDeflection(**{**parts, "motion": _motion(scene, bent.motion)}, scene=scene)


def _motion(scene: Scene, course: Motion) -> SceneMotion:
    return SceneMotion(**{each.name: getattr(course, each.name) for each in fields(course)}, scene=scene)


def _extent(course: Motion) -> str:
    return f"{len(course.time)} positions in {course.time[-1] - course.time[0]:.4g} s"


def names_html(scene: Scene, words: str, names: Mapping[str, Iterable[str]]) -> str:
    """Return the title of a scene with words, and a line of names for each kind of parts."""
    rows = "".join(f"<br>{kind}: <code>{escape(', '.join(each))}</code>" for kind, each in names.items())
    return f"<p><b>{escape(scene.title)}</b>: {escape(words)}{rows}</p>"


def point_names(mechanism: Mechanism) -> list[str]:
    """Return the names of all points, each once."""
    return [*dict.fromkeys(point for link in mechanism.links for point in link.points)]


def unknown_name(name: object, known: Iterable[str]) -> str:
    """Return the message about an unknown name, with all known names."""
    return f'there is no "{name}": choose from {", ".join(known)}'


def scene_of(given: object) -> Scene:
    """Return a scene, or the scene of a document. Raises TypeError for anything else."""
    if isinstance(given, Document):
        return given.scene
    if isinstance(given, Scene):
        return given
    advice = f"; load({shown(given)}) reads it" if isinstance(given, str | Path) else ""
    raise TypeError(f'expected a scene, as of load("steel_four_bar"), got {shown(given)}{advice}')


def request_of(**asked: Any) -> Request:
    """Build a request from named options; None means the default. Values may be text as on the command line.

    Raises
    ------
    ValueError
        An option does not accept its value.
    """
    known, given = options_of(Request), {}
    for name, value in asked.items():
        option, text = known[name], f"{value}"
        if value is None:
            continue
        if option.choices and value not in option.choices:
            raise ValueError(f"{name}: expected one of {', '.join(option.choices)}, got {text}{_near(text, option)}")
        try:
            given[name] = value if option.choices else option.read(text)
        except OptionError as error:
            raise ValueError(f"{name}: {error}") from None
    return Request(**given)


def _near(text: str, option: Option) -> str:
    """Return a hint at the most similar choice, or an empty text."""
    hint = likely(text, option.choices)
    return hint if hint.startswith("; did") else ""


def shown(given: object) -> str:
    """Return the repr of an argument, shortened for a message."""
    text = repr(given)
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}... (a {type(given).__name__})"
