"""A scene once it is read: a mechanism, its drives and its run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any

from elastic import JointCompliance, Section
from kinelast.scene.course import Course, Run
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.scene.limits import Limit, Output
from rigid import Mechanism

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


@dataclass(frozen=True)
class Material:
    """Material of links, as given: Young's modulus [Pa], density [kg/m^3], yield stress [Pa], Poisson's ratio.

    The last two are None where they are not known.
    """

    E: float
    density: float
    yield_stress: float | None
    poisson: float | None = None


@dataclass(frozen=True)
class SectionSource:
    """Source of a beam's section, by the names in the file: section, its shape and sizes [m], material or nothing."""

    section: str
    shape: str
    sizes: Mapping[str, tuple[float, ...]]
    material: str


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
    limits, output
        Bounds of the answer's figures, and the output of the machine where the file names it.
    made_of
        Section and material of every beam, in the order of `sections`.
    text
        The file as it was read; empty where the scene comes from tables.
    theory
        Of the deflection: without or with vibration.
    report_units
        Of page and tables: "SI", "mm" or "in".
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
    output: Output | None = None
    made_of: tuple[SectionSource, ...] = ()
    text: str = field(default="", repr=False)
    theory: Theory = Theory()
    report_units: str = "SI"

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
