"""What a scene is once it is read: a mechanism, its drives and its run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import Any

from elastic import JointCompliance, Section
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.scene.limits import Limit, Output
from rigid import Mechanism
from rigid.dynamics import INTERRUPTED, ForwardError, IntegratedMotion, forward


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
        The duration is one turn of a drive at constant speed, or one round of a repeated law, and its end, which is its
        start, is not repeated.
    tolerance
        Relative, of a step where a motion is integrated.
    steps
        After so many an integration is given up.
    """

    positions: int
    duration: float
    turn: bool
    tolerance: float = 1e-10
    steps: int = 2000


QUASI_STATIC, ELASTODYNAMIC = "quasi-static", "elastodynamic"


@dataclass(frozen=True)
class Theory:
    """How the motion of the links' deflection is to be treated.

    Attributes
    ----------
    name
        "quasi-static" or "elastodynamic"; None where the accuracy chooses.
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
        """Whether the quasi-static answer is what is asked for, however far it is off."""
        return self.name == QUASI_STATIC

    @property
    def demanded(self) -> bool:
        """Whether vibration is asked for, by name or by an accuracy."""
        return self.name == ELASTODYNAMIC or self.accuracy is not None


@dataclass(frozen=True)
class Material:
    """What links are made of, as given: Young's modulus [Pa], density [kg/m^3], yield stress [Pa], Poisson's ratio.

    The last two are None where they are not known.
    """

    E: float
    density: float
    yield_stress: float | None
    poisson: float | None = None


@dataclass(frozen=True)
class Making:
    """What a beam is made of, by the names in the file: section, its shape and sizes [m], material or nothing."""

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
    path
        Of the file, or what stands for it.
    mechanism
        Geometry, mass, drives, loads and springs. The block of a slot is a link of its own.
    sections, labels
        One per beam, in the order of `mechanism.beams`: its rigidities and dimensions (rigidities infinite for rigid
        links), and the name of its link, followed by .1, .2 where that has several beams.
    joints
        By name, the joints that give way or do not fit.
    materials
        By name, those that the file describes.
    laws
        One per drive: time [s] to coordinate, rate and acceleration; or an effort, and the motion follows.
    run
        Instants to look at.
    outlines
        Corners of the links' drawings in their own axes [m], by link; only links that have one.
    limits, output
        What the answer is held against, and what the machine is there for where the file says so.
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
    path: str
    mechanism: Mechanism
    sections: tuple[Section, ...]
    labels: tuple[str, ...]
    joints: Mapping[str, JointCompliance]
    materials: Mapping[str, Material]
    laws: tuple[DriveLaw | DriveEffort, ...]
    run: Run
    outlines: Mapping[str, tuple[Any, ...]]
    limits: tuple[Limit, ...] = ()
    output: Output | None = None
    made_of: tuple[Making, ...] = ()
    text: str = field(default="", repr=False)
    theory: Theory = Theory()
    report_units: str = "SI"

    def __repr__(self) -> str:
        return f'Scene("{self.name}": {self._told})'

    def _repr_html_(self) -> str:
        """What a notebook shows of it."""
        links = ", ".join(link.name for link in self.mechanism.links[1:])
        return f"<p><b>{escape(self.title)}</b>: {self._told}<br>links: <code>{escape(links)}</code></p>"

    @property
    def _told(self) -> str:
        """How much of what there is."""
        counts = {"link": len(self.mechanism.links), "beam": len(self.labels), "drive": len(self.laws)}
        counts["position"] = self.run.positions
        return ", ".join(f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items())

    @cached_property
    def course(self) -> IntegratedMotion | None:
        """The motion where a drive is an effort, as `integrated`; None where laws tell the motion."""
        return self.integrated()[0] if self.is_integrated else None

    @property
    def is_integrated(self) -> bool:
        """Whether a drive is an effort, from which the motion follows."""
        return any(isinstance(law, DriveEffort) for law in self.laws)

    @property
    def interrupted(self) -> float | None:
        """Up to which time a user let the motion be integrated [s]; None where it was not interrupted."""
        stop = self.__dict__.get("_integrated", (None, None))[1]
        return float(stop.time) if stop is not None and stop.kind == INTERRUPTED else None

    def integrated(
        self, on_step: Callable[[float], None] | None = None
    ) -> tuple[IntegratedMotion, ForwardError | None]:
        """The motion under the drives' efforts over the run, and what stops it where it cannot go on to the end.

        It is found once; `on_step` is called meanwhile with the time that is reached.

        Raises
        ------
        MechanismError
            It cannot begin.
        """
        if "_integrated" not in self.__dict__:
            self.__dict__["_integrated"] = self._integrate(on_step)
        found: tuple[IntegratedMotion, ForwardError | None] = self.__dict__["_integrated"]
        return found

    def _integrate(self, on_step: Callable[[float], None] | None) -> tuple[IntegratedMotion, ForwardError | None]:
        drives = [law.effort if isinstance(law, DriveEffort) else law for law in self.laws]
        begin = [(law.start, law.speed) if isinstance(law, DriveEffort) else (0.0, 0.0) for law in self.laws]
        start, rate = zip(*begin, strict=True)
        run = self.run
        try:
            return forward(self.mechanism, drives, start, rate, run.duration, run.tolerance, run.steps, on_step), None
        except ForwardError as error:
            if error.course is None:
                raise
            return error.course, error
