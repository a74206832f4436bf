"""Motion and deflection of a scene for notebooks, with points, links and beams by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from elastic import FIELDS, Deflection, sample
from kinelast.runs import computed
from kinelast.scene.data import Scene, scene_motion
from kinelast.scene.document import Document, read_scene
from kinelast.tasks import Option, OptionError
from kinelast.tasks.request import Request, options_of
from kinelast.tasks.task import scene_paths
from kinelast.values.error import MissingFileError, likely
from rigid import Load, Mechanism, Motion, acceleration_of, position_of, velocity_of
from rigid.arrays import Complexes, Reals

STATIONS = 101  # number of evenly spaced stations per beam, including both ends
MAX_SHOWN = 60  # maximum number of characters of an argument in a message


def load(scene: str | Path) -> Scene:
    """Read a scene from a file. Shipped scenes can be given by name.

    Raises
    ------
    SceneError
        The file contains an error.
    FileNotFoundError
        There is no file or scene with this name.
    ValueError
        `scene` is a folder with several scenes.
    TypeError
        `scene` is not a text or a path.

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
        raise ValueError(f'"{scene}" contains {len(paths)} scenes: name one of them')
    return read_scene(paths[0])


def with_loads(scene: Scene | Document, *loads: Load) -> Scene:
    """Return a scene with additional loads.

    The attribute `text` of the new scene is empty, because the scene file does not contain the additional loads.

    Parameters
    ----------
    loads
        Loads such as `rigid.PointLoad` and `rigid.LineLoad`. The attribute `law` of a load is a function. The function
        takes the motion, and returns a factor for each position, shape (positions,).

    Raises
    ------
    MechanismError
        The link or the point of a load does not exist.
    """
    given = scene_of(scene)
    mechanism = replace(given.mechanism, loads=(*given.mechanism.loads, *loads))
    return replace(given, course=replace(given.course, mechanism=mechanism), text="")


class PointMotion(Struct, frozen=True):
    """Position [m], velocity [m/s] and acceleration [m/s^2] of a point, complex, shape (positions,)."""

    position: Complexes
    velocity: Complexes
    acceleration: Complexes

    def __repr__(self) -> str:
        return f"PointMotion({len(self.position)} positions: position [m], velocity [m/s], acceleration [m/s^2])"


class LinkMotion(Struct, frozen=True):
    """Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s^2] of a link, shape (positions,).

    The angle has no jumps of a full turn.
    """

    angle: Reals
    angular_velocity: Reals
    angular_acceleration: Reals

    def __repr__(self) -> str:
        fields = "angle [rad], angular_velocity [rad/s], angular_acceleration [rad/s^2]"
        return f"LinkMotion({len(self.angle)} positions: {fields})"


class BeamFields:
    """Fields along a beam at 101 stations. Each field, such as `w` or `M`, is an attribute.

    Fields have the shape (positions, stations). `x` is the distance of each station from the start of the beam [m],
    shape (stations,).
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
        """Positions on the axis of the rigid beam [m], complex, shape (positions, stations)."""
        return rigid_line(self._deflection.motion, self._beam)

    @property
    def displacement(self) -> Complexes:
        """Displacement of the beam axis in ground axes [m], complex, shape (positions, stations)."""
        along = self.line[:, -1:] - self.line[:, :1]
        return along / np.abs(along) * (self.u + 1j * self.w)

    def __dir__(self) -> list[str]:
        return ["x", "line", "displacement", *FIELDS]

    def __repr__(self) -> str:
        return f"BeamFields({self._label}, {self.x[-1]:.6g} m: {', '.join(FIELDS)})"


def rigid_line(course: Motion, beam: int) -> Complexes:
    """Return positions on the axis of a rigid beam [m], complex, shape (positions, stations)."""
    at, ends = course.mechanism.beams[beam]
    start, end = (np.broadcast_to(position_of(course, at, name), course.columns) for name in (ends.start, ends.end))
    return start[:, None] + (end - start)[:, None] * np.linspace(0.0, 1.0, STATIONS)


class PartsByName:
    """Base class of objects with named parts as items, and with tab completion of the names."""

    def __iter__(self) -> Iterator[str]:
        raise NotImplementedError

    def keys(self) -> list[str]:
        """Return the names of the parts."""
        return [*self]

    def _ipython_key_completions_(self) -> list[str]:
        return [*self]


class SceneMotion(PartsByName, Motion, frozen=True, kw_only=True):
    """Motion with points and links by name, such as `motion["B"].position`.

    If a point and a link have the same name, the name refers to the point.
    """

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


class SceneDeflection(PartsByName, Deflection, frozen=True, kw_only=True):
    """Deflection with beams by name, such as `deflection["coupler"].w`."""

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
    """Return the motion of the rigid links during the run of a scene.

    `positions` is the number of positions (default: as in the scene).

    Raises
    ------
    SceneError
        A position is unreachable.
    TypeError, ValueError
        `scene` is neither a scene nor a document, or `positions` is not a valid number.
    """
    given, asked = scene_of(scene), request_of(positions=positions)
    return _motion(given, scene_motion(given, asked.positions))


def deflection(scene: Scene | Document, positions: int | None = None) -> SceneDeflection:
    """Return the deflection of the links during the run of a scene, by the theory that the scene requests.

    `positions` is the number of positions (default: as in the scene).

    Raises
    ------
    SceneError
        A position is unreachable, a block leaves its beam, or the vibration has no solution.
    """
    given = scene_of(scene)
    return named_deflection(given, computed(given, request_of(positions=positions)).deflection)


def named_deflection(scene: Scene, bent: Deflection) -> SceneDeflection:
    """Return a deflection with beams by name. `scene` contains the names."""
    return SceneDeflection(**{**asdict(bent), "motion": _motion(scene, bent.motion)}, scene=scene)


def _motion(scene: Scene, course: Motion) -> SceneMotion:
    return SceneMotion(**asdict(course), scene=scene)


def _extent(course: Motion) -> str:
    return f"{len(course.time)} positions in {course.time[-1] - course.time[0]:.4g} s"


def names_html(scene: Scene, words: str, names: Mapping[str, Iterable[str]]) -> str:
    """Return HTML with the title of a scene, the text `words`, and a line with the names for each kind of part."""
    rows = "".join(f"<br>{kind}: <code>{escape(', '.join(each))}</code>" for kind, each in names.items())
    return f"<p><b>{escape(scene.title)}</b>: {escape(words)}{rows}</p>"


def point_names(mechanism: Mechanism) -> list[str]:
    """Return the names of all points without duplicates."""
    return [*dict.fromkeys(point for link in mechanism.links for point in link.points)]


def unknown_name(name: object, known: Iterable[str]) -> str:
    """Return a message about an unknown name. The message lists all known names."""
    return f'there is no "{name}": choose from {", ".join(known)}'


def scene_of(given: object) -> Scene:
    """Return the scene of a document. A scene is returned unchanged. Raise TypeError for other objects."""
    if isinstance(given, Document):
        return given.scene
    if isinstance(given, Scene):
        return given
    advice = f"; load({shown(given)}) reads it" if isinstance(given, str | Path) else ""
    raise TypeError(f'expected a scene, as of load("steel_four_bar"), got {shown(given)}{advice}')


def request_of(**asked: Any) -> Request:
    """Return a request with the given options.

    A value can also be a text as on the command line. None means the default.

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
    """Return words that suggest the most similar choice, or an empty string."""
    hint = likely(text, option.choices)
    return hint if hint.startswith("; did") else ""


def shown(given: object) -> str:
    """Return the `repr` of an argument for a message. A long text is shortened."""
    text = repr(given)
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}... (a {type(given).__name__})"
