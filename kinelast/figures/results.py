"""What was found out about one scene, and the figures that everything written is made of."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import FIELDS, Deflection, Extreme, Kind, extremes, marked
from elastic.assessment import (
    Exceedance,
    PathDeviation,
    euler_ratio,
    exceedances,
    path_deviation,
    period_of,
    slenderness,
    stress_range,
)
from elastic.vibration import Frequencies, natural_frequencies
from kinelast.figures.divided_links import divided_links
from kinelast.scene.data import ELASTODYNAMIC, Scene
from kinelast.threads import one_thread
from rigid import Mechanism, Motion, Reals, drive_efforts

if TYPE_CHECKING:
    from fem_check import Comparison
    from fem_check.solid.comparison import SolidComparison
    from kinelast.figures.comparisons import NonlinearCheck
    from kinelast.figures.theory import Answer

EXTREME_FIELDS = tuple(key for key, field in FIELDS.items() if field.main and field.kind is not Kind.LOAD)
FEW = 16  # positions that tell too little of a cycle
WELL = 1e6  # condition up to which a position counts in the largest values: beyond, round-off grows into them
NOISE = 1e-12  # share of the scene's forces and displacements below which a figure is round-off
INSTANTS = 12  # positions at which natural frequencies are found: they change slowly over the cycle
STATIONS = np.linspace(0.0, 1.0, 101)  # where the swing of stresses is looked at


@dataclass(frozen=True, eq=False)
class Whole:
    """What a run of very many positions comes to, where only some of them are at hand.

    Attributes
    ----------
    positions, singular, locked, ill
        How many there are, have no figures, of these as friction may lock, and are left out of the largest values.
    swings
        Of the normal stress [Pa], as of `elastic.assessment.stress_range` at `STATIONS`.
    shown
        The same run at fewer, even positions.
    """

    positions: int
    singular: int
    locked: int
    ill: int
    swings: Any
    shown: Results


@dataclass(frozen=True, eq=False)
class Results:
    """A scene, its deflection, and the finite element check where one was asked for.

    Attributes
    ----------
    left_out
        Number of the run's positions that the mechanism does not reach and that were left out on request.
    whole
        Where these are but the positions of a long run at which something is largest: what the whole comes to.
    answer
        The theory that was taken, and its errors; None where the quasi-static answer was asked for as it is.
        Of a long run it is that of the even positions.
    nonlinear, solid
        Further checks, where they were asked for.
    """

    scene: Scene
    deflection: Deflection
    comparison: Comparison | None = None
    left_out: int = 0
    whole: Whole | None = None
    answer: Answer | None = None
    nonlinear: NonlinearCheck | None = None
    solid: SolidComparison | None = None

    @property
    def shown(self) -> Results:
        """The run at even positions."""
        return self if self.whole is None else self.whole.shown

    @property
    def vibrates(self) -> bool:
        """Whether the answer is that of vibrating links."""
        return self.answer is not None and self.answer.theory == ELASTODYNAMIC

    @property
    def quasi_static(self) -> Deflection:
        """The deflection of links that do not vibrate."""
        return self.answer.quasi_static if self.answer and self.vibrates else self.deflection

    @cached_property
    def counts(self) -> tuple[int, int, int]:
        """How many positions there are, are singular, and are left out of the largest values."""
        if self.whole is not None:
            return self.whole.positions, self.whole.singular - self.whole.locked, self.whole.ill
        lost = int(np.count_nonzero(self.singular)) - self.locked_count
        return len(self.motion.time), lost, int(np.count_nonzero(self.ill))

    @cached_property
    def locked_count(self) -> int:
        """How many positions have no figures because friction may lock the mechanism there."""
        if self.whole is not None:
            return self.whole.locked
        return int(np.count_nonzero(np.broadcast_to(self.deflection.forces.locked, self.motion.columns)))

    @cached_property
    def swings(self) -> Any:
        """Swing of the normal stress in the left and the right fibre [Pa], shape (2, beams, stations)."""
        if self.whole is not None:
            return self.whole.swings
        return stress_range(self.counted_deflection, STATIONS) if self.scene.labels else ()

    @property
    def motion(self) -> Motion:
        """The motion that the deflection belongs to."""
        return self.deflection.motion

    @property
    def mechanism(self) -> Mechanism:
        """The scene's mechanism."""
        return self.scene.mechanism

    @cached_property
    def drive_words(self) -> list[tuple[str, str, str, str]]:
        """As of `drive_words`: every figure with a place in the cycle asks for them."""
        return drive_words(self.mechanism)

    @cached_property
    def extremes(self) -> dict[str, Extreme]:
        """Value of largest magnitude along every beam, per field and stress, shape (beams, positions)."""
        return extremes_of(self.deflection, EXTREME_FIELDS)

    @cached_property
    def euler_ratio(self) -> Reals:
        """Compression over Euler's load, shape (beams, positions)."""
        none = np.zeros((0, *self.motion.columns))
        return euler_ratio(self.deflection) if self.mechanism.beams else none

    @cached_property
    def slenderness(self) -> list[float]:
        """Length over radius of gyration of every beam; nan of a rigid one."""
        return [float(value) for value in slenderness(self.deflection)[:, 0]] if self.mechanism.beams else []

    @cached_property
    def deviations(self) -> dict[str, PathDeviation]:
        """Of every named point that moves, shape (positions,)."""
        return {point: _wide(self, link, point) for point, link in points_of(self.mechanism)}

    @cached_property
    def displacements(self) -> dict[str, Any]:
        """Of every named point that moves [m], complex, shape (positions,)."""
        return {point: deviation.displacement for point, deviation in self.deviations.items()}

    @cached_property
    @one_thread()
    def frequencies(self) -> Frequencies | None:
        """Natural frequencies at some of the positions, nan if unknown; None where no link has beams."""
        if not self.mechanism.beams:
            return None
        if self.whole is not None:
            return self.shown.frequencies
        try:
            return natural_frequencies(self.motion, self.scene.sections, positions=INSTANTS, joints=self.scene.joints)
        except np.linalg.LinAlgError:  # far from any machine's sizes: the deflection is known all the same
            return Frequencies(np.full((1, 1), np.nan), np.zeros(1, int), np.nan)

    @cached_property
    def period(self) -> float:
        """Duration of the cycle [s]; nan where the motion is none."""
        if self.whole is not None:
            return self.shown.period
        period = period_of(self.motion)
        run = self.scene.run
        once = run.turn and not self.left_out and len(self.mechanism.drives) == 1 and len(self.motion.time) > FEW
        return run.duration if math.isnan(period) and once else period

    @cached_property
    def exceedances(self) -> list[Exceedance]:
        """Figures that leave the range in which the theory holds."""
        if not self.mechanism.beams:
            return []
        found: dict[str, Any] = {**self.extremes, "euler_ratio": self.euler_ratio}
        known = None if self.whole is not None or self.ill.any() else found
        own = exceedances(self.counted_deflection, found=known)
        return [*own, *divided_links(self.scene, self.quasi_static, self.counted)]

    @cached_property
    def efforts(self) -> Reals:
        """Moment [N m] or force [N] of every drive, shape (drives, positions)."""
        return drive_efforts(self.motion, self.deflection.forces)

    @cached_property
    def singular(self) -> Any:
        """Whether a position has no figures: nearly singular, or friction may lock there, shape (positions,)."""
        return self.deflection.lost

    @cached_property
    def counted(self) -> Any:
        """Whether a position counts in the largest values, shape (positions,): conditioned up to `WELL`.

        Where no position is so well conditioned, all that could be computed count.
        """
        well = (self.motion.condition <= WELL) & ~self.singular
        return well if well.any() else ~self.singular

    @cached_property
    def scales(self) -> dict[str, float]:
        """By unit, the greatest forces, moments of them, displacements and stresses over the counted positions."""

        def greatest(*values: Any) -> float:
            known = [np.where(self.counted & np.isfinite(each), np.abs(each), 0.0) for each in values]
            return max((float(each.max(initial=0.0)) for each in known), default=0.0)

        found, forces = {name: extreme.value for name, extreme in self.extremes.items()}, self.deflection.forces
        force = greatest(forces.force, forces.ground_force, found["N"], found["V"])
        length = float(np.max(self.deflection.length, initial=0.0))
        return {
            "N": force,
            "N m": force * length,
            "m": greatest(found["u"], found["w"], *self.displacements.values()),
            "Pa": greatest(*(found[key] for key in found if FIELDS[key].kind is Kind.STRESS)),
        }

    def rounded(self, values: Any, unit: str) -> Any:
        """Values with zero in place of what is round-off beside the scene's `scales`."""
        return np.where(np.abs(values) <= NOISE * self.scales.get(unit, 0.0), 0.0, values)

    @cached_property
    def ill(self) -> Any:
        """Whether a position was computed and yet does not count, shape (positions,)."""
        return ~self.singular & ~self.counted

    @cached_property
    def counted_deflection(self) -> Deflection:
        """The deflection with nan at the positions that do not count."""
        return marked(self.deflection, self.ill) if self.ill.any() else self.deflection


def extremes_of(deflection: Deflection, fields: Sequence[str]) -> dict[str, Extreme]:
    """Values of largest magnitude along every beam, also where there are none."""
    if not deflection.sections:
        none = np.zeros((0, *deflection.motion.columns))
        return {field: Extreme(none, none) for field in fields}
    return extremes(deflection, fields)


def _wide(results: Results, link: int, point: str) -> PathDeviation:
    """Deviation of a point at every position, also where it is the same at all."""
    columns = results.motion.columns
    found = path_deviation(results.deflection, results.mechanism.links[link].name, point)
    along, normal = (np.broadcast_to(part, columns) for part in (found.along, found.normal))
    return PathDeviation(along, normal, np.broadcast_to(found.displacement, columns))


def points_of(mechanism: Mechanism) -> Iterator[tuple[str, int]]:
    """Every named point that moves, once, with the number of a link it belongs to."""
    seen = set(mechanism.links[0].points)
    for number, link in enumerate(mechanism.links[1:], 1):
        for point in link.points:
            if point not in seen:
                seen.add(point)
                yield point, number


def drive_words(mechanism: Mechanism) -> list[tuple[str, str, str, str]]:
    """Per drive: its name, what its coordinate is called, and the units of coordinate and effort."""
    kinds = {True: ("angle", "rad", "N m"), False: ("slide", "m", "N")}
    words = [(drive.name, *kinds[drive.turns]) for drive in mechanism.drives]
    names = [name for name, *_ in words]
    if len(set(names)) < len(names):
        words = [(f"{word[0]}.{number}", *word[1:]) for number, word in enumerate(words, 1)]
    return words


def joint_words(results: Results) -> list[tuple[str, str]]:
    """Per joint of the solution: its name and that of the link whose load is given, the parent feels the opposite."""
    links = results.mechanism.links
    return [(joint.name, links[joint.child].name) for joint in results.motion.structure.joints]
