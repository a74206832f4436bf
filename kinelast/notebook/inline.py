"""Answers, pictures, films and the page as objects that a notebook shows where they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from kinelast import __version__
from kinelast.figures.results import Results
from kinelast.figures.summary import summary
from kinelast.notebook import (
    BeamFields,
    LinkMotion,
    PointMotion,
    SceneDeflection,
    SceneMotion,
    named_deflection,
    point_names,
    request_of,
    scene_of,
    unknown_name,
)
from kinelast.notebook.values import Figures, figures_of
from kinelast.outputs.batch import headline
from kinelast.outputs.handout import handout
from kinelast.outputs.page import report_page
from kinelast.outputs.positions import joint_loads
from kinelast.outputs.sealed import made_from
from kinelast.runs import computed
from kinelast.scene.data import QUASI_STATIC, Scene
from kinelast.scene.document import Document
from kinelast.tasks.request import Request
from rigid.arrays import Complexes, Reals

T = TypeVar("T")

FRAME = "width:100%;height:48em;border:1px solid #ccd"


class ByName(Mapping[str, T]):
    """Parts of an answer by their names, as items and as attributes, both of which complete by the tab key."""

    def __init__(self, names: Iterable[str], part: Callable[[str], T]) -> None:
        self._names, self._part = tuple(names), part

    def __getitem__(self, name: str) -> T:
        if name not in self._names:
            raise KeyError(unknown_name(name, self._names))
        return self._part(name)

    def __getattr__(self, name: str) -> T:
        if name.startswith("_") or name not in self._names:
            raise AttributeError(unknown_name(name, self._names))
        return self._part(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __dir__(self) -> list[str]:
        return sorted({*(name for name in self._names if name.isidentifier()), "get", "items", "keys", "values"})

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._names]

    def __repr__(self) -> str:
        return f"ByName({', '.join(self._names)})"


@dataclass(frozen=True, repr=False)
class AnsweredPoint(PointMotion):
    """A point of rigid links, and how far it is displaced from there [m], complex, shape (positions,)."""

    displacement: Complexes

    def __repr__(self) -> str:
        return f"AnsweredPoint({len(self.position)} positions: position, velocity, acceleration, displacement)"


@dataclass(frozen=True, repr=False)
class AnsweredJoint:
    """A joint: its force and moment on each of its links, as in motion.csv, shape (positions,).

    Attributes
    ----------
    force
        By link [N], complex, in the ground's axes.
    moment
        By link [N m]; 0 of a joint that lets them turn.
    """

    force: ByName[Complexes]
    moment: ByName[Reals]

    def __repr__(self) -> str:
        return f"AnsweredJoint(force and moment on {', '.join(self.force)})"


@dataclass(frozen=True, repr=False)
class AnsweredDrive:
    """A drive: coordinate [rad or m], rate, acceleration, effort [N m or N] and power [W], shape (positions,)."""

    coordinate: Reals
    rate: Reals
    acceleration: Reals
    effort: Reals

    @property
    def power(self) -> Reals:
        """Power that it gives to the mechanism [W]."""
        return self.effort * self.rate

    def __repr__(self) -> str:
        return f"AnsweredDrive({len(self.coordinate)} positions: coordinate, rate, acceleration, effort, power)"


@dataclass(frozen=True, eq=False, repr=False)
class Answer:
    """A scene answered: its parts by name, and its figures with their errors.

    Attributes
    ----------
    scene, motion, deflection
        The scene, its motion, and the deflection by the theory that was taken.
    figures
        As in summary.json.
    """

    results: Results
    request: Request

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.results.scene

    @cached_property
    def deflection(self) -> SceneDeflection:
        """Deflection of the links, by name."""
        return named_deflection(self.scene, self.results.deflection)

    @property
    def motion(self) -> SceneMotion:
        """Motion of the rigid links, by name."""
        course = self.deflection.motion
        assert isinstance(course, SceneMotion)
        return course

    @property
    def theory(self) -> str:
        """The theory that was taken."""
        return self.results.answer.theory if self.results.answer else QUASI_STATIC

    @property
    def error(self) -> float:
        """Of the worst of the figures that are read, as a share; nan where it is not known."""
        return self.results.error

    @cached_property
    def figures(self) -> Figures:
        """All figures, as in summary.json; those of its table `figures` also directly by name."""
        made = made_from(self.scene.text.encode(), self.request, {})
        whole = {"kinelast": __version__, **summary(self.results), "made_from": made}
        return figures_of(whole, self.scene.told_in)

    @property
    def headline(self) -> str:
        """The line that the command prints."""
        return headline(self.figures)

    @property
    def points(self) -> ByName[AnsweredPoint]:
        """Points by name."""
        displaced, still = self.results.displacements, np.zeros(self.results.motion.columns, complex)

        def point(name: str) -> AnsweredPoint:
            course = self.motion[name]
            assert isinstance(course, PointMotion)
            kinematics = course.position, course.velocity, course.acceleration
            return AnsweredPoint(*kinematics, displacement=displaced.get(name, still))

        return ByName(point_names(self.scene.mechanism), point)

    @property
    def links(self) -> ByName[LinkMotion]:
        """Links by name."""
        return ByName(self.scene.mechanism.index, self.motion.link)

    @property
    def beams(self) -> ByName[BeamFields]:
        """Fields of beams by name."""
        return ByName(self.scene.labels, self.deflection.__getitem__)

    @property
    def joints(self) -> ByName[AnsweredJoint]:
        """Joints by name."""
        links, wide = self.scene.mechanism.links, self.results.motion.columns
        loads: dict[str, dict[str, tuple[Any, Any]]] = {}
        for (name, link), load in joint_loads(self.results).items():
            loads.setdefault(name, {})[links[link].name] = load

        def joint(name: str) -> AnsweredJoint:
            own = loads[name]
            force = ByName(own, lambda link: np.broadcast_to(own[link][0], wide))
            return AnsweredJoint(force, ByName(own, lambda link: np.broadcast_to(own[link][1], wide)))

        return ByName(loads, joint)

    @property
    def drives(self) -> ByName[AnsweredDrive]:
        """Drives by name."""
        course = self.results.motion
        columns = zip(course.drive, course.drive_rate, course.drive_acceleration, self.results.efforts, strict=True)
        names = (name for name, *_ in self.results.drive_words)
        wide = {
            name: [np.broadcast_to(each, course.columns) for each in column]
            for name, column in zip(names, columns, strict=True)
        }
        return ByName(wide, lambda name: AnsweredDrive(*wide[name]))

    def __repr__(self) -> str:
        return f'Answer("{self.scene.name}", {self.theory}: {self.headline})'

    def _repr_html_(self) -> str:
        rows = {kind: getattr(self, kind) for kind in ("points", "links", "beams", "joints", "drives")}
        told = "".join(f"<br>{kind}: <code>{escape(', '.join(names))}</code>" for kind, names in rows.items())
        return f"<p><b>{escape(self.scene.title)}</b>: {escape(self.headline)}{told}</p>"


def answer(
    scene: Scene | Document,
    theory: str | None = None,
    accuracy: float | str | None = None,
    positions: int | None = None,
) -> Answer:
    """The answer to a scene.

    Parameters
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact", instead of the scene's own.
    accuracy
        How far the answer may be off, as in 0.02 or "2 %": takes the cheapest theory that gets there.
    positions
        Overrides how many.

    Raises
    ------
    SceneError
        As `kinelast.deflection`.
    TypeError, ValueError
        What is given is no scene; an option cannot have that value, or not both of theory and accuracy.
    """
    return _answer(scene, theory=theory, accuracy=accuracy, positions=positions)


def _answer(scene: Scene | Document, **asked: Any) -> Answer:
    given, request = scene_of(scene), request_of(**asked)
    if request.theory is not None and request.accuracy is not None:
        raise ValueError("accuracy chooses the theory: leave out accuracy, or theory")
    return Answer(computed(given, request), request)


@dataclass(frozen=True)
class Report:
    """The report of `deflection-report` on a scene: the answer in one line, all figures, and the page."""

    name: str
    headline: str
    figures: Figures
    page: bytes

    def __repr__(self) -> str:
        return f'Report("{self.name}": {self.headline})'

    def _repr_html_(self) -> str:
        """The headline and, in a frame of its own, the page, which asks for nothing."""
        page = escape(self.page.decode())
        frame = f'<iframe sandbox="allow-scripts allow-downloads" style="{FRAME}" srcdoc="{page}"></iframe>'
        return f"<p><b>{escape(self.name)}</b>: {escape(self.headline)}</p>{frame}"


def report(
    scene: Scene | Document,
    positions: int | None = None,
    check: int | None = None,
    accuracy: float | str | None = None,
    theory: str | None = None,
) -> Report:
    """The report on a scene, by the theory that the scene asks for.

    Parameters
    ----------
    positions
        Overrides how many.
    check
        Compare with finite elements, so many to a beam.
    accuracy, theory
        As of `answer`.

    Raises
    ------
    SceneError, TypeError, ValueError
        As `answer`.
    """
    elements = None if check is None else f"{check}"
    told = _answer(scene, positions=positions, checks=elements, accuracy=accuracy, theory=theory)
    page = report_page(told.results, told.figures, told.headline, handout(told.figures))
    return Report(told.scene.name, told.headline, told.figures, page)


def live(scene: Scene | Document | str | Path | None = None) -> Any:
    """The live editor of a scene, shown where a notebook shows it: drawn, dragged and answered in a frame.

    It is the page of `deflection-report --live`, served by the kernel to browsers on the same computer alone. What is
    saved there is `.text` and `.scene` of what is returned; `.widget` is the same for a kernel on another computer; in
    a script `.wait()` serves the page until it is interrupted.

    Parameters
    ----------
    scene
        A scene, whose text is kept in a file that goes with the kernel; a file or a shipped scene by its name, as of
        `--live`; or None for an empty sheet, which can be downloaded alone.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    FileNotFoundError
        There is neither such a file nor such a scene.
    ValueError
        The scene has no text.
    """
    from live import view

    try:
        return view(scene)
    except ModuleNotFoundError as error:
        missing = f'live needs {error.name}: pip install "starlette" "uvicorn"'
        raise ModuleNotFoundError(missing, name=error.name) from None
