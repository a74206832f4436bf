"""What a scene is once it is read: a mechanism, its drives and its run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from elastic import JointCompliance, Section
from kinelast.scene.drives import DriveEffort, DriveLaw
from rigid import Mechanism
from rigid.dynamics import IntegratedMotion, forward


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
    """

    positions: int
    duration: float
    turn: bool
    tolerance: float = 1e-10


@dataclass(frozen=True)
class Material:
    """What links are made of, as given: Young's modulus [Pa], density [kg/m^3], yield stress [Pa] or None."""

    E: float
    density: float
    yield_stress: float | None


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
        Geometry, mass, drives, loads and springs. The block of a slot is a link of its own.
    sections, labels
        One per beam, in the order of `mechanism.beams`: what it resists with (infinite for rigid links), and the name
        of its link, followed by .1, .2 where that has several beams.
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
    outlines: Mapping[str, tuple[complex, ...]]

    @cached_property
    def course(self) -> IntegratedMotion | None:
        """The motion as integrated over the run where a drive is an effort; None where laws tell the motion.

        Raises
        ------
        MechanismError
            The motion cannot go on.
        """
        if not any(isinstance(law, DriveEffort) for law in self.laws):
            return None
        drives = [law.effort if isinstance(law, DriveEffort) else law for law in self.laws]
        begin = [(law.start, law.speed) if isinstance(law, DriveEffort) else (0.0, 0.0) for law in self.laws]
        start, rate = zip(*begin, strict=True)
        return forward(self.mechanism, drives, start, rate, self.run.duration, self.run.tolerance)
