"""The results of a scene: its deflection, figures and checks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import Deflection, Extreme, marked
from elastic.assessment import LIMITS, Exceedance, exceedances, period_of, slenderness
from elastic.vibration import Frequencies
from kinelast.figures.checks import NonlinearCheck, NotMade
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import FigureError, GradedFigure, worst_of
from kinelast.figures.measured import with_bodies
from kinelast.figures.output import output_of
from kinelast.figures.peaks import Peak, RunFigures, run_figures
from kinelast.figures.ranges import yield_words
from kinelast.figures.registry import limits_of
from kinelast.scene.data import QUASI_STATIC, Scene, Theory, scene_deflection, scene_motion
from kinelast.scene.figure import Limit, drive_words, joint_words
from kinelast.scene.numbers import coordinate, percent, quantity
from kinelast.tasks.progress import SILENT, Progress, one_thread
from rigid import ConstantSpeed, Mechanism, Motion, Reals

if TYPE_CHECKING:
    from fem_check import Comparison, MomentumBalance
    from fem_check.solid import SolidComparison
    from kinelast.figures.answer import Answer


ASKED_FOR = "the quasi-static theory was chosen"
WORST = {"deflection": "deflection", "axial force": "buckling", "yield": "stress"}  # figure of each kind of caution
MIN_MULTIPLE = 2.0  # growth per cycle from which it is printed as a multiple, not in percent


@dataclass(frozen=True, eq=False)
class Results:
    """A scene with its deflection, its theory and its checks.

    Attributes
    ----------
    left_out
        Number of unreachable positions that were omitted on request.
    run
        Figures of the run, if the run has more positions than the deflection.
    answer
        Answer of the theory of motion, with its errors. None if the quasi-static theory was chosen and its error was
        not
        estimated.
    balances
        Momentum balances of the whole machine by theory, if requested.
    nonlinear, solid
        Results of the other checks, if requested.
    """

    scene: Scene
    deflection: Deflection
    comparison: Comparison | None = None
    left_out: int = 0
    run: RunFigures | None = None
    answer: Answer | None = None
    balances: Mapping[str, MomentumBalance] = field(default_factory=dict)
    nonlinear: NonlinearCheck | NotMade | None = None
    solid: SolidComparison | NotMade | None = None

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits of the scene."""
        return limits_of(self.scene)

    @cached_property
    def buckles(self) -> str:
        """The link that buckles without vibration, the drive position and the load, in words; empty if no link buckles.

        Displacements are undefined beyond the critical load. A load that exceeds the critical load only temporarily,
        due to vibration, does not necessarily buckle the link; it is judged by limits and findings.
        """
        if self.vibrates or not self.scene.labels:
            return ""
        known = self.run.peaks["buckling"] if self.run else list(self.cycle.pressed.value)
        sizes = [each.value if isinstance(each, Peak) else float(each) for each in known]
        beam = int(np.argmax(np.nan_to_num(sizes)))
        if not sizes[beam] >= 1.0:
            return ""
        if self.run:
            drive: Sequence[float] = self.run.peaks["buckling"][beam].drive
        else:
            drive = self.motion.drive[:, self.cycle.pressed.position[beam]].tolist()
        where = [f"{name} at {coordinate(value, unit, self.scene.shown_in)}"
                 for (name, _, unit, _), value in zip(self.drive_words, drive, strict=True)]  # fmt: skip
        link = self.mechanism.links[self.mechanism.beams[beam][0]].name
        return f"{', '.join([f'{link} buckles', *where])}: the load is {sizes[beam]:.3g} times critical"

    @cached_property
    def yields(self) -> str:
        """The largest stress as a multiple of the yield strength, in words; empty if no link yields."""
        return yield_words(self.scene, [peak.value for peak in self.figures.peaks["safety"]])

    @property
    def vibrates(self) -> bool:
        """Whether the answer includes vibration."""
        return self.answer is not None and self.answer.theory != QUASI_STATIC

    @cached_property
    @one_thread()
    def instability(self) -> str:
        """The growth of vibration and the speed below which it is stable, in words; empty if it is stable."""
        vibrating = self.answer.vibrating if self.answer else None
        if vibrating is None or vibrating.stable:
            return ""
        from elastic.elastodynamics import stable_below

        growth, laws = vibrating.growth, self.scene.laws
        grows = f"by {percent(growth - 1)}" if growth < MIN_MULTIPLE else f"{growth:.2g} times"
        grows = f"grows {grows} a cycle" if math.isfinite(growth) else "grows faster than the time steps can follow"
        sole = laws[0].speed if len(laws) == 1 and isinstance(laws[0], ConstantSpeed) else None
        at = "at this speed" if sole is None else f"at {quantity(abs(float(sole)), 'rad/s', 3, self.scene.shown_in)}"
        given = self.scene.course.at, self.period, self.scene.sections, self.scene.joints, vibrating.damping
        ratio = stable_below(*given) if math.isfinite(self.period) else math.nan
        if math.isnan(ratio):
            return f"unstable {at}: vibration {grows}, and at lower speeds too"
        border = (
            percent(ratio) + " of it"
            if sole is None
            else quantity(ratio * abs(float(sole)), "rad/s", 3, self.scene.shown_in)
        )
        return f"unstable {at}: vibration {grows}; stable below {border}"

    @cached_property
    def one_position(self) -> bool:
        """Whether only one position of a moving mechanism is computed."""
        if len(self.motion.time) != 1 or self.left_out:
            return False
        drives = self.scene.course.at(np.linspace(0.0, float(self.scene.run.duration), 4)[:-1]).drive
        return bool(np.any([np.ptp(part) for part in drives]))

    @property
    def error_unknown(self) -> str:
        """The reason why the errors of the figures are unknown; empty if they are known or no link bends."""
        if not self.scene.labels:
            return ""
        if self.buckles:
            return self.buckles
        return ASKED_FOR if self.answer is None else self.instability or self.answer.unknown

    @cached_property
    def errors(self) -> Mapping[str, Sequence[FigureError]]:
        """The errors of the figures by key, for all items. Errors measured by checks replace the estimates."""
        if self.answer is None:
            return {}
        errors = self.answer.errors
        if isinstance(self.nonlinear, NonlinearCheck):
            found = self.nonlinear.measured
            errors = {key: [found.in_place(key, *each) for each in enumerate(rows)] for key, rows in errors.items()}
        if self.solid is not None and not isinstance(self.solid, NotMade):
            change = np.abs(self.solid.peak - self.solid.largest)
            own = self.solid.refinement * self.solid.largest.max(initial=0.0)
            errors = with_bodies(errors, (change + own).tolist(), (self.solid.difference + own).tolist(), own)
        return errors

    @cached_property
    def graded(self) -> list[GradedFigure]:
        """The main figures with their errors."""
        figures = self.answer.graded if self.answer else ()
        return [replace(each, error=self.errors[each.key][each.item]) for each in figures]

    @cached_property
    def worst(self) -> GradedFigure | None:
        """The main figure with the largest relative error; None if no error is known."""
        return worst_of(self.graded)

    @property
    def error(self) -> float:
        """The largest relative error of the main figures; nan if one is unknown."""
        if self.answer is None:
            return math.nan
        return self.worst.share if self.worst else math.nan if self.error_unknown else 0.0

    @property
    def accurate(self) -> bool | None:
        """Whether the requested accuracy is reached; None if no accuracy is requested."""
        return self.answer.reaches(self.error) if self.answer else None

    @property
    def quasi_static(self) -> Deflection:
        """The quasi-static deflection."""
        return self.answer.quasi_static if self.answer else self.deflection

    @cached_property
    def cycle(self) -> Cycle:
        """The cycle of the computed positions."""
        known = self.answer.cycle if self.answer else None
        if known is not None and known.given is self.deflection:
            return replace(known, sampled=False)  # reuse the figures found so far
        quasi_static = (known.quasi_static or known) if known is not None and known.motion is self.motion else None
        return Cycle(self.scene, self.motion, self.deflection, tabled=True, quasi_static=quasi_static)

    @cached_property
    def figures(self) -> RunFigures:
        """The figures of the run, with their errors if these are known."""
        figures = self.run or run_figures(self.cycle, output_of(self.scene, self.quasi_static))
        if self.answer is None:
            return figures
        closer = self.answer.off.closer
        return (figures.with_motion(closer) if closer else figures).with_errors(self.errors)

    @property
    def counts(self) -> tuple[int, int, int]:
        """The numbers of all positions, of singular positions, and of positions excluded from the largest values."""
        run = self.figures
        return run.positions, run.singular - run.locked, run.ill if run.well else 0

    @property
    def motion(self) -> Motion:
        """The motion of the rigid links."""
        return self.deflection.motion

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the scene."""
        return self.scene.mechanism

    @cached_property
    def drive_words(self) -> list[tuple[str, str, str, str]]:
        """Names, coordinates, units and efforts of the drives, from `kinelast.scene.figure.drive_words`."""
        return drive_words(self.mechanism)

    @cached_property
    def joint_words(self) -> list[tuple[str, str]]:
        """Names of the joints and their links, from `kinelast.scene.figure.joint_words`."""
        return joint_words(self.mechanism)

    @cached_property
    def slenderness(self) -> list[float]:
        """The length / radius of gyration of each beam; nan for rigid beams."""
        return [float(value) for value in slenderness(self.deflection)[:, 0]] if self.mechanism.beams else []

    @cached_property
    def displacements(self) -> dict[str, Any]:
        """The complex displacement of each moving point [m], shape (positions,)."""
        return {point: deviation.displacement for point, deviation in self.cycle.deviations.items()}

    @property
    def frequencies(self) -> Frequencies | None:
        """The natural frequencies at some positions, from `Cycle.frequencies`."""
        return self.cycle.frequencies

    @cached_property
    def period(self) -> float:
        """The duration of the cycle [s]; nan if the motion is not periodic."""
        run = self.scene.run
        if run.no_cycle:
            return math.nan
        return float(run.duration) if run.turn and not self.left_out else period_of(self.motion)

    @cached_property
    def exceedances(self) -> list[tuple[Exceedance, Peak | None]]:
        """The figures that are outside the range of the theory, with their peaks."""
        if not self.mechanism.beams:
            return []
        peaks = self.figures.peaks
        sizes = {name: np.array([[peak.value] for peak in peaks[name]]) for name in WORST.values()}
        fields = {key: Extreme(sizes[name], sizes[name]) for key, name in (("w", "deflection"), ("mises", "stress"))}
        past = exceedances(self.cycle.well_conditioned, known={**fields, "euler_ratio": sizes["buckling"]})
        placed = [(one, peaks[WORST[one.kind]][one.beam or 0] if one.kind in WORST else None) for one in past]
        if not any(math.isnan(peak.value) for peak in peaks["buckling"]):
            return placed
        words, bound = "buckling: the load at which the mechanism buckles cannot be found", LIMITS["axial force"].watch
        return [*placed, (Exceedance("axial force", None, None, math.nan, bound, False, words), None)]


def answered(plain: Results, theory: Theory, judged: bool, progress: Progress = SILENT) -> Results:
    """Return the results according to a theory of motion, starting from the quasi-static results.

    If the quasi-static theory is chosen and `judged`, its error is estimated.

    Raises
    ------
    SceneError
        The theory cannot solve the scene, as described in `kinelast.figures.theory.answer`.
    """
    scene, whole = plain.scene, at_breaks(plain)
    if whole.buckles:
        here, whole = (
            replace(each, deflection=marked(each.deflection, np.ones(each.motion.columns, bool)))
            for each in (plain, whole)
        )
        run = run_figures(here.cycle, output_of(scene, plain.deflection))
        return replace(here, run=run.with_instants(run_figures(whole.cycle, run.output)))
    if theory.plain and not judged:
        if whole is plain:
            return plain
        run = with_breaks(plain, run_figures(plain.cycle, output_of(scene, plain.deflection)))
        return replace(plain, run=run.with_averages(whole.cycle))
    from kinelast.figures.theory import answer, answer_at

    best = answer(whole.cycle, theory, plain.period, theory.plain, progress)
    if not (theory.plain or plain.left_out) and len(best.missed_peaks):
        whole = _with_instants(whole, best.missed_peaks)
        if best.vibrating:
            best = answer_at(best, whole.cycle, theory)
        else:
            best = answer(whole.cycle, theory, plain.period, theory.plain, progress)
    best = replace(best, stages={})  # the stages take more memory than everything else
    if whole is plain:
        return replace(plain, deflection=best.deflection, answer=best)
    here = replace(plain, deflection=best.at(plain.deflection), answer=replace(best, quasi_static=plain.deflection))
    return replace(here, run=with_breaks(here, run_figures(here.cycle, output_of(scene, plain.deflection))))


def at_breaks(plain: Results) -> Results:
    """Return quasi-static results at the positions and on both sides of all breaks of the laws.

    If there are no breaks, the results are returned unchanged.
    """
    course, times = plain.scene.course, plain.motion.time
    if plain.left_out or len(times) < 2 or len(course.with_breaks(times)) == len(times):
        return plain
    return _with_instants(plain, course.breaks.sides)


def _with_instants(plain: Results, instants: Reals) -> Results:
    """Return quasi-static results at the positions and at additional instants [s]."""
    times = plain.scene.course.with_breaks(np.union1d(plain.motion.time, instants))
    return replace(plain, deflection=scene_deflection(plain.scene, plain.scene.course.at(times)))


def with_breaks(results: Results, run: RunFigures) -> RunFigures:
    """Return the figures of a run, including instants on both sides of law breaks and at the peaks of the answer."""
    scene, answer, instants = results.scene, results.answer, results.scene.course.breaks.sides
    if answer:
        instants = np.union1d(instants, np.setdiff1d(answer.cycle.motion.time, results.motion.time))
    if results.buckles or not len(instants):
        return run
    plain = scene_deflection(scene, scene.course.at(instants))
    bent = answer.at(plain) if answer else plain
    found = run.with_instants(run_figures(Cycle(scene, plain.motion, bent, tabled=True), run.output))
    return found.with_averages(answer.cycle) if answer else found


def results_in_full(scene: Scene) -> Results:
    """Return the results of a scene as in its report, including the errors of the figures.

    Raises
    ------
    SceneError
        A position is out of reach, or the chosen theory cannot solve the scene.
    """
    return answered(Results(scene, scene_deflection(scene, scene_motion(scene))), scene.theory, judged=True)
