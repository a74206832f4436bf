"""The class `Scene`, which contains all data for a computation, and the motion and deflection of a scene."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from msgspec import Struct, field

from elastic import Deflection, JointCompliance, Section, deflection
from elastic.links import members_of
from kinelast.scene.course import Course, Run, table_of
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.scene.limits import FigureBound, Output
from kinelast.scene.sections import Material, SectionSource
from kinelast.values.error import SceneError
from kinelast.values.figure import Kind, Limit, items_of
from kinelast.values.numbers import REPORT_UNITS, DisplayUnits
from kinelast.values.units import shown
from machine.cams import Cam
from machine.joints import JointParts
from machine.life import FatigueTask
from rigid import Mechanism, MechanismError, Motion, ReachError, TableError, motion, require_reach

Result = TypeVar("Result")

ACCURACY = 0.05  # default accuracy
DAMPING_RATIO = 0.01  # default damping ratio, typical of steel links with joints
QUASI_STATIC, ELASTODYNAMIC, GEOMETRICALLY_EXACT = "quasi-static", "elastodynamic", "geometrically-exact"


class Theory(Struct, frozen=True):
    """Theory and accuracy that the user requests for the deflection.

    Attributes
    ----------
    name
        "quasi-static", "elastodynamic" or "geometrically-exact"; None to choose it by the accuracy.
    accuracy
        Largest relative error of the answer; None for the default of 5 %.
    damping_ratio
        Damping ratio at the lowest natural frequency, for beams without a given beta.
    damping
        Kelvin-Voigt coefficient beta of every beam [s], nan if its material does not give one.
    """

    name: str | None = None
    accuracy: float | None = None
    damping_ratio: float = DAMPING_RATIO
    damping: tuple[float, ...] = ()

    @property
    def wanted(self) -> float:
        """The requested accuracy, or `ACCURACY` if none is requested."""
        return ACCURACY if self.accuracy is None else self.accuracy

    @property
    def plain(self) -> bool:
        """True if the user requested the quasi-static theory by its name."""
        return self.name == QUASI_STATIC

    @property
    def demanded(self) -> bool:
        """True if the user requested a theory with vibration, or an accuracy."""
        return self.name in (ELASTODYNAMIC, GEOMETRICALLY_EXACT) or self.accuracy is not None


class Scene(Struct, frozen=True, eq=False, dict=True):
    """A scene with all data for a computation.

    Attributes
    ----------
    name, title, source
        Name of the file without its suffix, and the title and source that the file gives.
    course
        Mechanism, laws or efforts of its drives, and times of the run. Each slot adds a link, which is the block that
        slides in the slot.
    sections, labels
        Section and label of every beam, in the order of `mechanism.beams`. The sections of rigid links have infinite
        rigidities. A label is the name of the link, followed by .1, .2 ... if the link has several beams.
    joints
        Joints with compliance or misalignment, by name.
    materials
        Materials that the scene contains or uses from the library, by name.
    outlines
        Corners of drawn links in link axes [m], by link.
    limits, bounds, output
        Limits that have their own key in the file, limits on results given by the name of the result (see
        `kinelast.figures.registry.limits_of`), and the output. The output is None if the file does not name one.
    made_of
        Section and material of every beam, in the order of `sections`.
    text
        Text of the file; empty if the scene comes from tables.
    theory
        Requested theory of the deflection.
    report_units, written
        Unit system of the report ("SI", "mm" or "in"), and the units of angles, angular speeds and flows in the file,
        by SI unit.
    settled
        Distance from the rest position within which the output counts as settled after a stop [m or rad], or None.
    parts
        Machine parts by kind and name, see `kinelast.scene.part`.
    """

    name: str
    title: str
    source: str
    course: Course
    sections: tuple[Section, ...]
    labels: tuple[str, ...]
    joints: Mapping[str, JointCompliance]
    materials: Mapping[str, Material]
    outlines: Mapping[str, tuple[Any, ...]]
    limits: tuple[Limit, ...] = ()
    bounds: tuple[FigureBound, ...] = ()
    output: Output | None = None
    made_of: tuple[SectionSource, ...] = ()
    text: str = ""
    theory: Theory = Theory()
    report_units: str = "SI"
    written: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    settled: Any = None
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: defaultdict(dict))

    @cached_property
    def _known(self) -> dict[Callable[[Scene], Any], Any]:
        """Results that `once` has computed."""
        return {}

    def once(self, function: Callable[[Scene], Result]) -> Result:
        """Return the result of a function of the scene. It is computed only once."""
        if function not in self._known:
            self._known[function] = function(self)
        return self._known[function]

    @property
    def cams(self) -> Mapping[str, Cam]:
        """Cams by name."""
        return self.parts["cams"]

    @property
    def fatigue(self) -> FatigueTask | None:
        """Fatigue settings, or None."""
        return self.parts["fatigue"].get("")

    @property
    def bearings(self) -> Mapping[str, JointParts]:
        """Bearings, pins and eyes, by the name of the pin or slider."""
        return self.parts["bearings"]

    def __repr__(self) -> str:
        return f'Scene("{self.name}": {self._summary})'

    def _repr_html_(self) -> str:
        """Return the title and the numbers of links, beams, drives and positions as HTML for a notebook."""
        from html import escape

        links = ", ".join(link.name for link in self.mechanism.links[1:])
        return f"<p><b>{escape(self.title)}</b>: {self._summary}<br>links: <code>{escape(links)}</code></p>"

    @property
    def _summary(self) -> str:
        """Summary such as "4 links, 3 beams, 1 drive, 360 positions"."""
        counts = {"link": len(self.mechanism.links), "beam": len(self.labels), "drive": len(self.laws)}
        counts["position"] = self.run.positions
        return ", ".join(f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items())

    @cached_property
    def member_names(self) -> tuple[str, ...]:
        """Name of the member of each beam.

        A member is a straight run of beams of a link. It is named by the link and, if the link has several members, by
        its end points.
        """
        mechanism, members = self.mechanism, members_of(self.mechanism)
        owners = [mechanism.beams[run.beams[0]][0] for run in members.runs]
        names = []
        for run, at in zip(members.runs, owners, strict=True):
            first, last = (mechanism.beams[run.beams[end]][1] for end in (0, -1))
            start, end = first.end if run.turned[0] else first.start, last.start if run.turned[-1] else last.end
            more = f" from {start} to {end}" if owners.count(at) > 1 else ""
            names.append(mechanism.links[at].name + more)
        return tuple(names[number] for number in members.number)

    @cached_property
    def beam_names(self) -> tuple[str, ...]:
        """Display name of each beam: its member and, if the member has several beams, the ends of the beam."""
        parts = Counter(self.member_names)
        return tuple(
            member if parts[member] == 1 else f"{member}, {beam.start} to {beam.end}"
            for member, (_, beam) in zip(self.member_names, self.mechanism.beams, strict=True)
        )

    def shown_items(self, kind: Kind) -> list[str]:
        """Return the display names of all items of a kind, such as beams or joints.

        Result files use the labels of beams instead of these names.
        """
        names = dict(zip(self.labels, self.beam_names, strict=True))
        return [names.get(name, name) for name in items_of(self, kind)]

    @property
    def shown_in(self) -> DisplayUnits:
        """Display units of the report, by SI unit."""
        return {**REPORT_UNITS.get(self.report_units, {}), **self.written}

    @property
    def mechanism(self) -> Mechanism:
        """Geometry, mass, drives, loads and springs."""
        return self.course.mechanism

    @property
    def laws(self) -> tuple[DriveLaw | DriveEffort, ...]:
        """Law or effort of each drive, see `Course`."""
        return self.course.laws

    @property
    def run(self) -> Run:
        """Times of the run."""
        return self.course.run

    @property
    def path(self) -> str:
        """Path of the file, or the name of the scene."""
        return self.course.path


def scene_motion(scene: Scene, positions: int | None = None, partial: bool = False) -> Motion:
    """Return the motion of a scene over its run.

    Parameters
    ----------
    positions
        Number of positions (default: that of the run).
    partial
        If True, unreachable positions give nan instead of an error.

    Raises
    ------
    SceneError
        A position is unreachable (the message names the position and the joint that opens), an integration stops, or a
        table does not cover the run.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f'expected a scene, as of load("steel_four_bar"), got {shown(scene)}')
    moved = scene.course.at(scene.course.times(positions))
    if not partial:
        require_reached(scene, moved)
    require_tables(scene, moved)
    return moved


def scene_deflection(scene: Scene, moved: Motion) -> Deflection:
    """Return the quasi-static deflection of the links in a motion.

    Raises
    ------
    SceneError
        The block of a slider reaches a beam that cannot guide the slider.
    """
    try:
        return deflection(moved, scene.sections, joints=scene.joints)
    except MechanismError as error:
        if error.kind != "section":
            raise
        raise SceneError(scene.path, f"links.{error.links[0]}", "section", str(error)) from None


def require_reached(scene: Scene, moved: Motion) -> None:
    """Raise SceneError if a position is unreachable. The message names the position and the joint that opens."""
    try:
        require_reach(moved, scene.shown_in.get("m", (1.0, "m")))
    except ReachError as error:
        table = "links" if error.kind == "unreachable" else "drives[1]"
        raise SceneError(scene.path, table, "", str(error)) from None


def require_tables(scene: Scene, moved: Motion) -> None:
    """Raise SceneError if the motion goes beyond the ends of a load table."""
    for number, load in enumerate(scene.mechanism.loads, 1):
        law = getattr(load, "law", None)
        if law is not None:
            try:
                law(moved)
            except TableError as error:
                raise SceneError(scene.path, f"loads[{number}]", "table", str(error)) from None


def require_determined(scene: Scene) -> None:
    """Raise SceneError if the drives do not determine the motion, or collinear links make every position singular."""
    mechanism = scene.mechanism
    start = [law.start if isinstance(law, DriveEffort) else law(np.zeros(1))[0].item() for law in scene.laws]
    try:
        first = motion(mechanism, np.array(start)[:, None])
        if not first.may_be_singular or not first.singular.any():
            return
        _require_no_flat_triangle(scene)
    except MechanismError as error:
        _require_no_flat_triangle(scene)
        raise SceneError(scene.path, table_of(mechanism, error), "", str(error)) from None


def _require_no_flat_triangle(scene: Scene) -> None:
    """Raise SceneError if three links that are pinned to each other are collinear. Every position is then singular."""
    from rigid.topology import assembled, flat_triangles

    try:
        flat = flat_triangles(assembled(scene.mechanism))
    except MechanismError:  # loops that do not close are reported elsewhere
        return
    if flat:
        names = ", ".join(f'"{name}"' for name in flat[0])
        problem = f"{names} are pinned to one another in a straight line, which is singular in every position: "
        raise SceneError(scene.path, f"links.{flat[0][0]}", "", problem + "make them one link with three points")
