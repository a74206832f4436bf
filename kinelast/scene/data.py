"""A scene once it is read: a mechanism, its drives and its run; its motion, its deflection, and their requirements."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import Any

import numpy as np

from elastic import Deflection, JointCompliance, Section, deflection
from elastic.links import members_of
from kinelast.scene.course import Course, CourseByLaws, Run, table_of
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.scene.error import SceneError
from kinelast.scene.limits import FigureBound, Limit, Output
from kinelast.scene.names import drive_names
from kinelast.scene.numbers import REPORT_UNITS, ToldIn
from kinelast.scene.sections import Material, SectionSource
from kinelast.scene.units import shown
from machine.cams import Cam, cam_course
from machine.joints import JointParts
from machine.life import FatigueTask
from rigid import SINGULAR, Mechanism, MechanismError, Motion, ReachError, TableError, motion, require_reach
from rigid.kinematics import by_laws

LOOKED_AT = np.array([0.0, 0.137, 0.293, 0.471, 0.683])  # parts of a run, at which a cam has to move its follower
UNMOVED = 1e-9  # of the distance from the shaft by the drive's coordinate
ACCURACY = 0.05  # where none is asked for
QUASI_STATIC, ELASTODYNAMIC, GEOMETRICALLY_EXACT = "quasi-static", "elastodynamic", "geometrically-exact"


@dataclass(frozen=True)
class Theory:
    """How the motion of the links' deflection is to be treated.

    Attributes
    ----------
    name
        "quasi-static", "elastodynamic" or "geometrically-exact"; None where the accuracy chooses.
    accuracy
        How far the answer may be off, as a share; None where nothing is asked for, which is 5 %.
    damping_ratio
        Of the lowest natural frequency, for beams without a beta of their own.
    damping
        Kelvin and Voigt's beta of every beam [s]; nan where its material does not tell.
    """

    name: str | None = None
    accuracy: float | None = None
    damping_ratio: float = 0.01
    damping: tuple[float, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether the quasi-static answer is asked for, however far it is off."""
        return self.name == QUASI_STATIC

    @property
    def demanded(self) -> bool:
        """Whether vibration is asked for, by name or by an accuracy."""
        return self.name in (ELASTODYNAMIC, GEOMETRICALLY_EXACT) or self.accuracy is not None


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """A mechanism that is ready to move.

    Attributes
    ----------
    name, title, source
        Stem of the file, and what the scene says of itself.
    course
        The mechanism with the laws or efforts of its drives, and its run. The block of a slot is a link of its own.
    sections, labels
        One per beam, in the order of `mechanism.beams`: its rigidities and dimensions (rigidities infinite for rigid
        links), and the name of its link, followed by .1, .2 where that has several beams.
    joints
        By name, the joints that give way or do not fit.
    materials
        By name, those that the file describes.
    outlines
        Corners of the links' drawings in their own axes [m], by link; only links that have one.
    limits, bounds, output
        Bounds of the answer's figures by keys of their own, and by the names of figures; see
        `kinelast.figures.registry.limits_of`. The output of the machine where the file names it.
    made_of
        Section and material of every beam, in the order of `sections`.
    text
        The file as it was read; empty where the scene comes from tables.
    theory
        Of the deflection: without or with vibration.
    report_units, written
        Of page, tables and words: "SI", "mm" or "in"; and the units that the file writes angles and speeds in, by SI
        unit, of words and page.
    cams
        By their names.
    settled
        Distance from rest within which the output has settled after a stop [m or rad]; None where the file says none.
    parts
        Further parts by kind and name, see `kinelast.scene.part`.
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
    text: str = field(default="", repr=False)
    theory: Theory = Theory()
    report_units: str = "SI"
    written: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    cams: Mapping[str, Cam] = field(default_factory=dict)
    settled: Any = None
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def fatigue(self) -> FatigueTask | None:
        """The question of fatigue, or None."""
        return self.parts["fatigue"].get("")

    @property
    def bearings(self) -> Mapping[str, JointParts]:
        """Parts of the joints with a table, by the name of the pin or slider."""
        return self.parts["bearings"]

    def __repr__(self) -> str:
        return f'Scene("{self.name}": {self._told})'

    def _repr_html_(self) -> str:
        """Title, counts and links, for a notebook."""
        links = ", ".join(link.name for link in self.mechanism.links[1:])
        return f"<p><b>{escape(self.title)}</b>: {self._told}<br>links: <code>{escape(links)}</code></p>"

    @property
    def _told(self) -> str:
        """Counts of links, beams, drives and positions."""
        counts = {"link": len(self.mechanism.links), "beam": len(self.labels), "drive": len(self.laws)}
        counts["position"] = self.run.positions
        return ", ".join(f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items())

    @cached_property
    def member_names(self) -> tuple[str, ...]:
        """Of every beam the name of its member: its link's, and from where to where it goes where that has several."""
        mechanism, members = self.mechanism, members_of(self.mechanism)
        owners = [mechanism.beams[run.beams[0]][0] for run in members.runs]
        names = []
        for run, at in zip(members.runs, owners, strict=True):
            first, last = (mechanism.beams[run.beams[end]][1] for end in (0, -1))
            start, end = first.end if run.turned[0] else first.start, last.start if run.turned[-1] else last.end
            more = f" from {start} to {end}" if owners.count(at) > 1 else ""
            names.append(mechanism.links[at].name + more)
        return tuple(names[number] for number in members.number)

    @property
    def told_in(self) -> ToldIn:
        """Units that its quantities are told in, in words and on the page."""
        return {**REPORT_UNITS.get(self.report_units, {}), **self.written}

    @property
    def mechanism(self) -> Mechanism:
        """Geometry, mass, drives, loads and springs."""
        return self.course.mechanism

    @property
    def laws(self) -> tuple[DriveLaw | DriveEffort, ...]:
        """One per drive, as of `Course`."""
        return self.course.laws

    @property
    def run(self) -> Run:
        """Instants to look at."""
        return self.course.run

    @property
    def path(self) -> str:
        """Of the file, or the name in place of one."""
        return self.course.path


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
    if not isinstance(scene, Scene):
        raise TypeError(f'expected a scene, as of load("steel_four_bar"), got {shown(scene)}')
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
        require_reach(moved, scene.told_in.get("m", (1.0, "m")))
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


def require_moved(scene: Scene) -> None:
    """Raise where the drive that a cam moves does not move the follower where they touch."""
    if not scene.cams or not isinstance(scene.course, CourseByLaws):
        return
    times = LOOKED_AT * float(scene.run.duration)
    with suppress(MechanismError):
        moved = motion(scene.mechanism, *by_laws(scene.course.laws, times), times)
        for name, cam in scene.cams.items():
            course = cam_course(moved, cam)
            if (np.abs(course.influence) <= UNMOVED * np.abs(course.follower)).all():
                problem = f'the drive "{drive_names(scene.mechanism)[cam.drive]}" does not move "{cam.points[0]}"'
                raise SceneError(scene.path, f"cams.{name}", "drive", f'{problem} of the link "{cam.follower}"')


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
