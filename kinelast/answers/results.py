"""The results of a scene: deflection, figures (numbers such as the largest stress) and checks by other methods."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from elastic import Deflection, Extreme, without_positions
from elastic.assessment import VALIDITY_RANGES, Exceedance, exceedances, period_of, slenderness
from elastic.vibration import Frequencies
from kinelast.answers.checks import NonlinearCheck, NotMade
from kinelast.answers.refusals import yield_words
from kinelast.figures.cycle import Cycle
from kinelast.figures.figure_error import FigureError
from kinelast.figures.main_figures import MainFigure, worst_of
from kinelast.figures.measured import with_bodies
from kinelast.figures.output import output_of
from kinelast.figures.peaks import Peak, RunFigures, run_figures
from kinelast.figures.registry import limits_of
from kinelast.scene.data import QUASI_STATIC, Scene, Theory, scene_deflection, scene_motion
from kinelast.tasks.progress import SILENT, Progress, one_thread
from kinelast.values.figure import Limit, drive_words, joint_words
from kinelast.values.numbers import coordinate, percent, quantity
from rigid import ConstantSpeed, Mechanism, Motion, Reals
from rigid.arrays import distinct, without

if TYPE_CHECKING:
    from fem_check import Comparison, MomentumBalance
    from fem_check.solid import SolidComparison
    from kinelast.answers.answer import Answer

ASKED_FOR = "the quasi-static theory was chosen"
WORST = {"deflection": "deflection", "buckling": "buckling", "yield": "stress"}
"""For each kind of exceeded limit of the theory, the figure with the exceeding value."""
MAX_HALVINGS = 12  # maximum number of halvings of the time steps around a nearly critical load
ONE_TURN = 2 * math.pi * (1 + 1e-9)  # [rad] a drive that rotates by more passes the same angle again
MIN_MULTIPLE = 2.0  # a growth of vibration per cycle above this factor is printed as a factor, not in percent


class Results(Struct, frozen=True, eq=False, dict=True, weakref=True):
    """The results of a scene: quasi-static deflection, answer of the theory of motion, checks by other methods.

    Attributes
    ----------
    left_out
        Number of unreachable positions that were omitted on request.
    run
        Figures of the run, if the run has more positions or instants than `deflection`. Otherwise None.
    answer
        Answer of the theory of motion, with its errors. None if the quasi-static theory was chosen and its error was
        not estimated.
    balances
        Momentum balances of the whole machine by theory, if requested.
    nonlinear, solid
        Results of the nonlinear check and of the check with plane bodies, if requested.
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
        """Words on the link that buckles, the drive position, and load relative to critical load; "" if none buckles.

        Displacements are undefined beyond the critical load. If the answer includes vibration, this property is always
        empty, because a load that exceeds the critical load for a short time need not buckle the link. Such a load is
        judged by limits and findings.
        """
        if self.vibrates or not self.scene.labels:
            return ""
        known = self.run.peaks["buckling"] if self.run else list(self.cycle.buckling_ratio.value)
        sizes = [each.value if isinstance(each, Peak) else float(each) for each in known]
        beam = int(np.argmax(np.nan_to_num(sizes)))
        if not sizes[beam] >= 1.0:
            return ""
        if self.run:
            drive: Sequence[float] = self.run.peaks["buckling"][beam].drive
            time = self.run.peaks["buckling"][beam].time
        else:
            position = self.cycle.buckling_ratio.position[beam]
            drive, time = self.motion.drive[:, position].tolist(), float(self.motion.time[position])
        where = [f"{name} at {coordinate(value, unit, self.scene.shown_in)}"
                 for (name, _, unit, _), value in zip(self.drive_words, drive, strict=True)]  # fmt: skip
        if self.several_turns:
            where = [f"t = {quantity(time, 's')}"]
        link = self.mechanism.links[self.mechanism.beams[beam][0]].name
        return f"{', '.join([f'{link} buckles', *where])}: the load is {sizes[beam]:.3g} times critical"

    @cached_property
    def yields(self) -> str:
        """Words on the largest stress as a multiple of the yield strength; empty if no link yields."""
        return yield_words(self.scene, [peak.value for peak in self.figures.peaks["safety"]])

    @property
    def vibrates(self) -> bool:
        """Whether the answer includes vibration."""
        return self.answer is not None and self.answer.theory != QUASI_STATIC

    @cached_property
    @one_thread()
    def instability(self) -> str:
        """Words on the growth of vibration and the speed below which vibration is stable; empty if it is stable."""
        vibrating = self.answer.vibrating if self.answer else None
        if vibrating is None or vibrating.stable:
            return ""
        from elastic.elastodynamics import stable_below

        growth, laws = vibrating.growth, self.scene.laws
        grows = f"by {percent(growth - 1)}" if growth < MIN_MULTIPLE else f"{growth:.2g} times"
        grows += " in this run" if math.isnan(self.period) else " a cycle"
        grows = f"grows {grows}" if math.isfinite(growth) else "grows faster than the time steps can follow"
        if math.isnan(self.period):
            return f"unstable: vibration {grows}"
        sole = laws[0].speed if len(laws) == 1 and isinstance(laws[0], ConstantSpeed) else None
        at = "at this speed" if sole is None else f"at {quantity(abs(float(sole)), 'rad/s', 3, self.scene.shown_in)}"
        given = self.scene.course.at, self.period, self.scene.sections, self.scene.joints, vibrating.damping
        ratio = stable_below(*given)
        if math.isnan(ratio):
            return f"unstable {at}: vibration {grows}, and at lower speeds too"
        border = f"{percent(ratio)} of it"
        if sole is not None:
            border = quantity(ratio * abs(float(sole)), "rad/s", 3, self.scene.shown_in)
        return f"unstable {at}: vibration {grows}; stable below {border}"

    @cached_property
    def one_position(self) -> bool:
        """Whether only one position is computed although the drives move."""
        if len(self.motion.time) != 1 or self.left_out:
            return False
        drives = self.scene.course.at(np.linspace(0.0, float(self.scene.run.duration), 4)[:-1]).drive
        return bool(np.any([np.ptp(part) for part in drives]))

    @cached_property
    def several_turns(self) -> bool:
        """Whether a drive rotates by more than one turn, so that its angle does not identify a position."""
        turning = [drive.turns for drive in self.mechanism.drives]
        return bool(np.any(np.ptp(self.motion.drive[turning], axis=-1) > ONE_TURN)) if any(turning) else False

    @property
    def error_unknown(self) -> str:
        """The reason why the errors in the figures are unknown; empty if they are known."""
        if not self.scene.labels:
            return self.answer.unknown if self.answer else ""
        if self.buckles:
            return self.buckles
        return ASKED_FOR if self.answer is None else self.instability or self.answer.unknown

    @cached_property
    def errors(self) -> Mapping[str, Sequence[FigureError]]:
        """The errors in the figures by key, one for each item. Errors measured by checks replace the estimates."""
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
    def main_figures(self) -> list[MainFigure]:
        """The main figures, with errors measured by checks in place of estimates."""
        figures = self.answer.main_figures if self.answer else ()
        return [replace(each, error=self.errors[each.key][each.item]) for each in figures]

    @cached_property
    def worst(self) -> MainFigure | None:
        """The main figure with the largest relative error, see `worst_of`; None if there are no main figures."""
        return worst_of(self.main_figures)

    @property
    def error(self) -> float:
        """The largest relative error in any main figure; nan if an error is unknown."""
        if self.answer is None:
            return math.nan
        return self.worst.share if self.worst else math.nan if self.error_unknown else 0.0

    @property
    def accurate(self) -> bool | None:
        """Whether the requested accuracy is reached; None if none was requested."""
        return self.answer.reaches(self.error) if self.answer else None

    @property
    def quasi_static(self) -> Deflection:
        """The quasi-static deflection."""
        return self.answer.quasi_static if self.answer else self.deflection

    @cached_property
    def cycle(self) -> Cycle:
        """The `Cycle` of the deflection, from which the figures are computed."""
        known = self.answer.cycle if self.answer else None
        if known is not None and known.given is self.deflection:
            return dataclasses.replace(known, sampled=False)  # the copy keeps the figures computed so far
        quasi_static = (known.quasi_static or known) if known is not None and known.motion is self.motion else None
        return Cycle(self.scene, self.motion, self.deflection, tabled=True, quasi_static=quasi_static)

    @cached_property
    def figures(self) -> RunFigures:
        """The figures of the run, with errors if errors were estimated."""
        figures = self.run or run_figures(self.cycle, output_of(self.scene, self.quasi_static))
        if self.answer is None:
            return figures
        closer = self.answer.off.closer
        return (figures.with_motion(closer) if closer else figures).with_errors(self.errors)

    @property
    def counts(self) -> tuple[int, int, int]:
        """The numbers of all positions, of singular positions, and of ill-conditioned positions that are excluded."""
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
        """The name, coordinate, unit and effort unit of each drive, see `kinelast.values.figure.drive_words`."""
        return drive_words(self.mechanism)

    @cached_property
    def joint_words(self) -> list[tuple[str, str]]:
        """The name of each joint and the link on which its force acts, see `values.figure.joint_words`."""
        return joint_words(self.mechanism)

    @cached_property
    def slenderness(self) -> list[float]:
        """The slenderness of each beam: length divided by radius of gyration; nan for rigid beams."""
        return [float(value) for value in slenderness(self.deflection)[:, 0]] if self.mechanism.beams else []

    @cached_property
    def displacements(self) -> dict[str, Any]:
        """The complex displacement of each moving point [m], shape (positions,)."""
        return {point: deviation.displacement for point, deviation in self.cycle.deviations.items()}

    @property
    def frequencies(self) -> Frequencies | None:
        """The natural frequencies at some positions, see `Cycle.frequencies`."""
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
        """The exceeded limits of beam theory. Each contains the peak at which it is exceeded most, if there is one."""
        if not self.mechanism.beams:
            return []
        peaks = self.figures.peaks
        sizes = {name: np.array([[peak.value] for peak in peaks[name]]) for name in WORST.values()}
        fields = {key: Extreme(sizes[name], sizes[name]) for key, name in (("w", "deflection"), ("mises", "stress"))}
        past = exceedances(self.cycle.well_conditioned, known={**fields, "buckling": sizes["buckling"]})
        placed = [(one, peaks[WORST[one.kind]][one.beam or 0] if one.kind in WORST else None) for one in past]
        if not any(math.isnan(peak.value) for peak in peaks["buckling"]):
            return placed
        words, bound = (
            "buckling: the load at which the mechanism buckles cannot be found",
            VALIDITY_RANGES["buckling"].watch,
        )
        return [*placed, (Exceedance("buckling", None, None, math.nan, bound, False, words), None)]


def answered(plain: Results, theory: Theory, judged: bool, progress: Progress = SILENT) -> Results:
    """Return the results of a scene by a theory of motion, given its quasi-static results.

    The error of the quasi-static theory, if this is chosen, is estimated only if `judged` is true.

    Raises
    ------
    SceneError
        The theory cannot solve the scene, as described in `kinelast.answers.theory.answer`.
    """
    scene, whole = plain.scene, at_critical_load(at_breaks(plain), plain.scene.course.at)
    if whole.buckles:
        here, whole = (replace(each, deflection=without_positions(each.deflection)) for each in (plain, whole))
        run = run_figures(here.cycle, output_of(scene, plain.deflection))
        return replace(here, run=run.with_instants(run_figures(whole.cycle, run.output)))
    if theory.plain and not judged:
        if whole is plain:
            return plain
        run = with_breaks(plain, run_figures(plain.cycle, output_of(scene, plain.deflection)))
        return replace(plain, run=run.with_averages(whole.cycle))
    from kinelast.answers.theory import answer, answer_at

    best = answer(whole.cycle, theory, plain.period, progress)
    if not (theory.plain or plain.left_out) and len(best.missed_peaks):
        whole, first = _with_instants(whole, best.missed_peaks, scene.course.at), best
        if first.vibrating:
            best = answer_at(first, whole.cycle, theory)
        if not first.vibrating or (theory.name is None and first.enough and not best.enough):
            best = answer(whole.cycle, theory, plain.period, progress, first.vibrating)
    # the stages and the coarser solution need more memory than all other results
    best = replace(best, stages={}, vibrating=best.vibrating and replace(best.vibrating, coarser=None))
    if whole is plain:
        return replace(plain, deflection=best.deflection, answer=best)
    here = replace(plain, deflection=best.at(plain.deflection), answer=replace(best, quasi_static=plain.deflection))
    return replace(here, run=with_breaks(here, run_figures(here.cycle, output_of(scene, plain.deflection))))


def at_breaks(plain: Results) -> Results:
    """Return quasi-static results at the positions and just before and after all breaks of the drive laws and loads.

    If there are no breaks, `plain` is returned.
    """
    course, times = plain.scene.course, plain.motion.time
    if plain.left_out or len(times) < 2 or len(course.with_breaks(times)) == len(times):
        return plain
    return _with_instants(plain, course.breaks.sides, course.at)


def _with_instants(plain: Results, instants: Reals, motion_at: Callable[[Reals], Motion]) -> Results:
    """Return quasi-static results at the positions of `plain` and at additional instants [s]."""
    times = plain.scene.course.with_breaks(distinct(np.append(plain.motion.time, instants)))
    return replace(plain, deflection=scene_deflection(plain.scene, motion_at(times)))


def at_critical_load(plain: Results, motion_at: Callable[[Reals], Motion]) -> Results:
    """Return quasi-static results. Instants are added if a link buckles only between the positions.

    The time steps before and after the largest load of a link are halved until the load in between is certainly below
    the critical load, or is found to exceed it (see `Cycle.buckling_gain`). If no link buckles between the positions,
    `plain` is returned.

    Parameters
    ----------
    motion_at
        Function that returns the motion of the mechanism at given times [s].
    """
    run, finer = plain.scene.run, plain
    if plain.left_out or len(plain.motion.time) < 2:
        return plain
    for _ in range(MAX_HALVINGS):
        cycle, times = finer.cycle, finer.motion.time
        load, at = cycle.buckling_ratio.value, cycle.buckling_ratio.position
        near = at[(load < 1.0) & (load + cycle.buckling_gain >= 1.0)]
        if finer.buckles or not len(near):
            break
        ends = np.concatenate([times[-1:] - run.duration, times, times[:1] + run.duration]) if run.turn else times
        middles = (ends[1:] + ends[:-1]) / 2
        around = middles[np.clip(np.add.outer(near, (0, 1) if run.turn else (-1, 0)), 0, len(middles) - 1)].ravel()
        around = around % run.duration if run.turn else around
        finer = _with_instants(finer, around[plain.scene.course.breaks.far(around)], motion_at)
    return finer if finer.buckles else plain


def with_breaks(results: Results, run: RunFigures) -> RunFigures:
    """Return the figures `run`, merged with those just before and after breaks and at added instants of the answer."""
    scene, answer, instants = results.scene, results.answer, results.scene.course.breaks.sides
    if answer:
        instants = distinct(np.append(instants, without(answer.cycle.motion.time, results.motion.time)))
    if results.buckles or not len(instants):
        return run
    plain = scene_deflection(scene, scene.course.at(instants))
    bent = answer.at(plain) if answer else plain
    found = run.with_instants(run_figures(Cycle(scene, plain.motion, bent, tabled=True), run.output))
    return found.with_averages(answer.cycle) if answer else found


def results_in_full(scene: Scene) -> Results:
    """Return the results of a scene by the theory chosen in it, including the errors in the figures.

    Raises
    ------
    SceneError
        A position is out of reach, or the chosen theory cannot solve the scene.
    """
    return answered(Results(scene, scene_deflection(scene, scene_motion(scene))), scene.theory, judged=True)
