"""One scene answered: its deflection, its figures, and the checks that were asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import Deflection, Extreme
from elastic.assessment import Exceedance, PathDeviation, exceedances, period_of, slenderness
from elastic.vibration import Frequencies, natural_frequencies
from kinelast.figures.cycle import Cycle, drive_words, joint_words
from kinelast.figures.divided_links import divided_links
from kinelast.figures.many_beams import too_many_beams
from kinelast.figures.output import output_of
from kinelast.figures.peaks import Peak, RunFigures, run_figures
from kinelast.process.threads import one_thread
from kinelast.scene.data import QUASI_STATIC, Scene
from rigid import Mechanism, Motion, Reals
from rigid.arrays import Flags

if TYPE_CHECKING:
    from fem_check import Balance, Comparison
    from fem_check.solid import SolidComparison
    from kinelast.figures.comparisons import NonlinearCheck, NotMade
    from kinelast.figures.theory import Answer

FEW = 16  # positions that tell too little of a cycle
INSTANTS = 12  # positions at which natural frequencies are found: they change slowly over the cycle
WORST = {"deflection": "deflection", "axial force": "buckling", "yield": "stress"}  # figures that cautions are of


@dataclass(frozen=True, eq=False)
class Results:
    """A scene, its deflection, and the finite element check where one was asked for.

    Attributes
    ----------
    left_out
        Number of the run's positions that the mechanism does not reach and that were left out on request.
    run
        The figures of the run, where it has more positions than the deflection.
    answer
        The theory that was taken, and its errors; None where the quasi-static answer was asked for as it is.
    balances
        Newton's laws for the whole machine by theory, where the check was asked for.
    nonlinear, solid
        Further checks, where they were asked for.
    """

    scene: Scene
    deflection: Deflection
    comparison: Comparison | None = None
    left_out: int = 0
    run: RunFigures | None = None
    answer: Answer | None = None
    balances: Mapping[str, Balance] = field(default_factory=dict)
    nonlinear: NonlinearCheck | NotMade | None = None
    solid: SolidComparison | NotMade | None = None

    @property
    def vibrates(self) -> bool:
        """Whether the answer is that of vibrating links."""
        return self.answer is not None and self.answer.theory != QUASI_STATIC

    @property
    def quasi_static(self) -> Deflection:
        """The deflection of links that do not vibrate."""
        return self.answer.quasi_static if self.answer else self.deflection

    @cached_property
    def cycle(self) -> Cycle:
        """The positions at hand."""
        return Cycle(self.scene, self.motion, self.deflection, tabled=True)

    @cached_property
    def figures(self) -> RunFigures:
        """The figures of the run."""
        return self.run or run_figures(self.cycle, output_of(self.scene), self.quasi_static)

    @property
    def counts(self) -> tuple[int, int, int]:
        """How many positions there are, are singular, and are left out of the largest values."""
        run = self.figures
        return run.positions, run.singular - run.locked, run.ill if run.well else 0

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
    def joint_words(self) -> list[tuple[str, str]]:
        """As of `joint_words`."""
        return joint_words(self.mechanism)

    @property
    def extremes(self) -> dict[str, Extreme]:
        """Value of largest magnitude along every beam, per field and stress, shape (beams, positions)."""
        return self.cycle.extremes

    @property
    def euler_ratio(self) -> Reals:
        """Compression over Euler's load, shape (beams, positions)."""
        return self.cycle.euler_ratio

    @cached_property
    def slenderness(self) -> list[float]:
        """Length over radius of gyration of every beam; nan of a rigid one."""
        return [float(value) for value in slenderness(self.deflection)[:, 0]] if self.mechanism.beams else []

    @property
    def deviations(self) -> dict[str, PathDeviation]:
        """Of every named point that moves, shape (positions,)."""
        return self.cycle.deviations

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
        unknown = Frequencies(np.full((1, 1), np.nan), np.zeros(1, int), np.nan)
        if too_many_beams(self.mechanism):
            return unknown
        try:
            return natural_frequencies(self.motion, self.scene.sections, positions=INSTANTS, joints=self.scene.joints)
        except np.linalg.LinAlgError:  # far from any machine's sizes: the deflection is known all the same
            return unknown

    @cached_property
    def period(self) -> float:
        """Duration of the cycle [s]; nan where the motion is none."""
        run = self.scene.run
        if run.no_cycle:
            return math.nan
        whole = run.turn and not self.left_out and len(self.motion.time) > FEW
        return float(run.duration) if whole else period_of(self.motion)

    @cached_property
    def exceedances(self) -> list[tuple[Exceedance, Peak | None]]:
        """Figures that leave the range in which the theory holds, and where these are largest."""
        if not self.mechanism.beams:
            return []
        peaks = self.figures.peaks
        sizes = {name: np.array([[peak.value] for peak in peaks[name]]) for name in WORST.values()}
        fields = {key: Extreme(sizes[name], sizes[name]) for key, name in (("w", "deflection"), ("mises", "stress"))}
        past = exceedances(self.cycle.well_conditioned, known={**fields, "euler_ratio": sizes["buckling"]})
        placed = [(one, peaks[WORST[one.kind]][one.beam or 0] if one.kind in WORST else None) for one in past]
        return [*placed, *divided_links(self.scene, self.figures.pressed)]

    @property
    def efforts(self) -> Reals:
        """Moment [N m] or force [N] of every drive, shape (drives, positions)."""
        return self.cycle.efforts

    @property
    def singular(self) -> Flags:
        """Whether a position has no figures: nearly singular, or friction may lock there, shape (positions,)."""
        return self.cycle.singular

    @property
    def counted(self) -> Flags:
        """Whether a position counts in the largest values, shape (positions,)."""
        return self.cycle.counted
