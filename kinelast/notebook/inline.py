"""Results of a deflection analysis, reports, and the live editor for notebooks."""

import math
from collections.abc import Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from msgspec import Struct, convert
from msgspec.structs import asdict, replace

from kinelast import notebook
from kinelast.answers.results import Results
from kinelast.outputs.page import report_page
from kinelast.outputs.positions import joint_loads
from kinelast.outputs.sealed import made_from
from kinelast.outputs.words import error_words, headline
from kinelast.reports.report import Report, data_of
from kinelast.reports.summary import report_of
from kinelast.runs import computed
from kinelast.scene.data import QUASI_STATIC, Scene
from kinelast.scene.document import Document
from kinelast.tasks.request import Request
from kinelast.values.error import likely
from kinelast.values.numbers import DisplayUnits, quantity
from kinelast.values.reading import Reading
from rigid.arrays import Complexes, Reals

T = TypeVar("T")

FRAME = "width:100%;height:48em;border:1px solid #ccd"


class Value(dict[str, Any]):
    """A number with its unit and error in SI units, as in summary.json. The `repr` uses the units of the scene.

    >>> Value({"value": 0.0016, "unit": "m", "error": 2e-6, "on": "crank"}, {})
    1.6 mm ± 0.12 %
    """

    def __init__(self, entries: Mapping[str, Any], shown_in: DisplayUnits) -> None:
        super().__init__(entries)
        self._display_units = shown_in

    def __repr__(self) -> str:
        return quantity(float(self), self["unit"], shown_in=self._display_units) + error_words(
            convert(self, Reading), self._display_units
        )

    def __float__(self) -> float:
        """Return the number in its SI unit, or nan if it is unknown."""
        return math.nan if self["value"] is None else float(self["value"])


class Figures(dict[str, Any]):
    """Entries of summary.json. `figures["mass"]` is short for `figures["figures"]["mass"]`."""

    def __missing__(self, name: str) -> Any:
        figures = super().get("figures", {})
        if name in figures:
            return figures[name]
        raise KeyError(f'there is no figure "{name}"{likely(name, [*figures, *self])}')


def figures_of(summary: Mapping[str, Any], shown_in: DisplayUnits) -> Figures:
    """Return a copy of a summary in which every number with a unit is a `Value`."""
    return Figures({key: _valued(entry, shown_in) for key, entry in summary.items()})


def _valued(entry: Any, shown_in: DisplayUnits) -> Any:
    if isinstance(entry, list):
        return [_valued(each, shown_in) for each in entry]
    if not isinstance(entry, Mapping):
        return entry
    whole = {key: _valued(each, shown_in) for key, each in entry.items()}
    return Value(whole, shown_in) if {"value", "unit"} <= whole.keys() else whole


class ByName(dict[str, T]):
    """Named parts, e.g. the points of a mechanism, as items and as attributes, with tab completion of the names."""

    def __missing__(self, name: str) -> T:
        raise KeyError(notebook.unknown_name(name, self))

    def __getattr__(self, name: str) -> T:
        if name.startswith("_") or name not in self:
            raise AttributeError(notebook.unknown_name(name, self))
        return self[name]

    def __dir__(self) -> list[str]:
        return sorted({*filter(str.isidentifier, self), "get", "items", "keys", "values"})

    def _ipython_key_completions_(self) -> list[str]:
        return [*self]

    def __repr__(self) -> str:
        return f"ByName({', '.join(self)})"


class AnsweredPoint(notebook.PointMotion, frozen=True):
    """Rigid motion of a point, and its displacement from the rigid position [m], complex, shape (positions,)."""

    displacement: Complexes

    def __repr__(self) -> str:
        fields = "position [m], velocity [m/s], acceleration [m/s^2], displacement [m]"
        return f"AnsweredPoint({len(self.position)} positions: {fields})"


class AnsweredJoint(Struct, frozen=True):
    """Forces and moments of a joint on its links, as in motion.csv, shape (positions,).

    Attributes
    ----------
    force
        Force on each link [N], by link name, complex, in the axes of the ground.
    moment
        Moment on each link [N m], by link name. It is 0 if the joint transmits no moment.
    """

    force: ByName[Complexes]
    moment: ByName[Reals]

    def __repr__(self) -> str:
        return f"AnsweredJoint(force [N] and moment [N m] on {', '.join(self.force)})"


class AnsweredDrive(Struct, frozen=True):
    """Coordinate [rad or m], its time derivatives, effort [N m or N] and power [W] of a drive, shape (positions,)."""

    coordinate: Reals
    rate: Reals
    acceleration: Reals
    effort: Reals

    @property
    def power(self) -> Reals:
        """Power that the drive supplies to the mechanism [W]."""
        return self.effort * self.rate

    def __repr__(self) -> str:
        return f"AnsweredDrive({len(self.coordinate)} positions: coordinate, rate, acceleration, effort, power [W])"


class SceneAnswer(Struct, frozen=True, eq=False, dict=True):
    """Result of the deflection analysis of a scene, with points, links, beams, joints and drives by name.

    Attributes
    ----------
    scene, motion, deflection
        The scene, the rigid motion, and the deflection by the selected theory.
    figures
        Entries of summary.json, e.g. the largest stress with its error.
    """

    results: Results
    request: Request

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.results.scene

    @cached_property
    def deflection(self) -> notebook.SceneDeflection:
        """Deflection of the links, with beams by name."""
        return notebook.named_deflection(self.scene, self.results.deflection)

    @property
    def motion(self) -> notebook.SceneMotion:
        """Motion of the rigid links, with points and links by name."""
        course = self.deflection.motion
        assert isinstance(course, notebook.SceneMotion)
        return course

    @property
    def theory(self) -> str:
        """Name of the selected theory."""
        return self.results.answer.theory if self.results.answer else QUASI_STATIC

    @property
    def error(self) -> float:
        """Largest relative error of the main results, e.g. of the largest stress; nan if an error is unknown."""
        return self.results.error

    @cached_property
    def report(self) -> Report:
        """Report on the results."""
        made = made_from(self.scene.text.encode(), self.request, {})
        return replace(report_of(self.results), made_from=made)

    @cached_property
    def figures(self) -> Figures:
        """Entries of summary.json. The entries of the table `figures` are also available directly by name."""
        return figures_of(data_of(self.report), self.scene.shown_in)

    @property
    def headline(self) -> str:
        """The line that the command deflection-report prints for the scene."""
        return headline(self.report)

    @cached_property
    def points(self) -> ByName[AnsweredPoint]:
        """Points by name."""
        displaced, still = self.results.displacements, np.zeros(self.results.motion.columns, complex)

        return ByName(
            {
                name: AnsweredPoint(**asdict(self.motion[name]), displacement=displaced.get(name, still))
                for name in notebook.point_names(self.scene.mechanism)
            }
        )

    @cached_property
    def links(self) -> ByName[notebook.LinkMotion]:
        """Links by name."""
        return ByName({name: self.motion.link(name) for name in self.scene.mechanism.index})

    @cached_property
    def beams(self) -> ByName[notebook.BeamFields]:
        """Fields along the beams, such as the bending moment, by name of the beam."""
        return ByName({label: self.deflection[label] for label in self.scene.labels})

    @cached_property
    def joints(self) -> ByName[AnsweredJoint]:
        """Joints by name."""
        links, wide = self.scene.mechanism.links, self.results.motion.columns
        loads: dict[str, dict[str, tuple[Any, Any]]] = {}
        for (name, link), load in joint_loads(self.results).items():
            loads.setdefault(name, {})[links[link].name] = load

        def on_links(own: Mapping[str, tuple[Any, Any]], part: int) -> ByName[Any]:
            return ByName({link: np.broadcast_to(load[part], wide) for link, load in own.items()})

        return ByName({name: AnsweredJoint(on_links(own, 0), on_links(own, 1)) for name, own in loads.items()})

    @cached_property
    def drives(self) -> ByName[AnsweredDrive]:
        """Drives by name."""
        course, efforts = self.results.motion, self.results.cycle.efforts
        columns = zip(course.drive, course.drive_rate, course.drive_acceleration, efforts, strict=True)
        return ByName(
            {
                name: AnsweredDrive(*(np.broadcast_to(each, course.columns) for each in column))
                for (name, *_), column in zip(self.results.drive_words, columns, strict=True)
            }
        )

    def __repr__(self) -> str:
        return f'Answer("{self.scene.name}", {self.theory}: {self.headline})'

    def _repr_html_(self) -> str:
        rows = {kind: getattr(self, kind) for kind in ("points", "links", "beams", "joints", "drives")}
        return notebook.names_html(self.scene, self.headline, rows)


def answer(
    scene: Scene | Document,
    theory: str | None = None,
    accuracy: float | str | None = None,
    positions: int | None = None,
) -> SceneAnswer:
    """Return the result of the deflection analysis of a scene.

    Parameters
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact" (default: as requested in the scene).
    accuracy
        Largest accepted relative error, such as 0.02 or "2 %". The cheapest theory that reaches this accuracy is used.
    positions
        Number of positions (default: as in the scene).

    Raises
    ------
    SceneError
        The deflection cannot be computed, for the same reasons as in `kinelast.deflection`.
    TypeError, ValueError
        `scene` is neither a scene nor a document, a value is invalid, or both theory and accuracy are given.
    """
    return _answer(scene, theory=theory, accuracy=accuracy, positions=positions)


def _answer(scene: Scene | Document, **asked: Any) -> SceneAnswer:
    given, request = notebook.scene_of(scene), notebook.request_of(**asked)
    if request.theory is not None and request.accuracy is not None:
        raise ValueError("accuracy chooses the theory: give either accuracy or theory")
    return SceneAnswer(computed(given, request), request)


class ReportPage(Struct, frozen=True):
    """Report on a scene, as written by deflection-report: headline, entries of summary.json, and HTML page."""

    name: str
    headline: str
    figures: Figures
    page: bytes

    def __repr__(self) -> str:
        return f'Report("{self.name}": {self.headline})'

    def _repr_html_(self) -> str:
        """Return HTML with the headline and, in a frame, the page. The page does not load other files."""
        page = escape(self.page.decode())
        frame = f'<iframe sandbox="allow-scripts allow-downloads" style="{FRAME}" srcdoc="{page}"></iframe>'
        return f"<p><b>{escape(self.name)}</b>: {escape(self.headline)}</p>{frame}"


def report(
    scene: Scene | Document,
    positions: int | None = None,
    check: int | None = None,
    accuracy: float | str | None = None,
    theory: str | None = None,
) -> ReportPage:
    """Return the report on a scene.

    Parameters
    ----------
    positions
        Number of positions (default: as in the scene).
    check
        Number of finite elements per beam for a check of the quasi-static deflection (default: no check).
    accuracy, theory
        See `answer`.

    Raises
    ------
    SceneError, TypeError, ValueError
        See `answer`.
    """
    elements = None if check is None else f"{check}"
    solved = _answer(scene, positions=positions, checks=elements, accuracy=accuracy, theory=theory)
    page = report_page(solved.results, solved.report)
    return ReportPage(solved.scene.name, solved.headline, solved.figures, page)


def live(scene: Scene | Document | str | Path | None = None) -> Any:
    """Return the live editor of a scene. A notebook shows the editor in a frame.

    The kernel serves the page of `deflection-report --live` to browsers on the same computer. For a browser on another
    computer, use the attribute `widget`, which is also an editor. The attributes `text` and `scene` contain the saved
    scene. In a script, the method `wait` serves the page until an interrupt.

    Parameters
    ----------
    scene
        A scene, a file, or the name of a shipped scene. The text of a scene is stored in a file until the kernel ends.
        None opens a new scene. A new scene cannot be saved to a file, but the browser can download it.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    NoEditorError
        No installed package provides a live editor.
    FileNotFoundError
        There is no file or scene with this name.
    ValueError
        The scene has no text.
    """
    from kinelast.tasks.task import installed_editor

    try:
        return installed_editor().view(scene)
    except ModuleNotFoundError as error:
        missing = f'live needs {error.name}: pip install "starlette" "uvicorn"'
        raise ModuleNotFoundError(missing, name=error.name) from None
