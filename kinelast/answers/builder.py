"""Construction of answers for a scene. An answer is a deflection by one theory of motion, with its errors."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Deflection
from elastic.assessment import beyond_beam_theory, euler_ratio
from elastic.elastodynamics import Elastodynamic, Vibration, including, moved_to
from kinelast.answers.answer import Answer
from kinelast.answers.bounds import largest_rotation
from kinelast.answers.theory_settings import THEORY
from kinelast.figures.between import Between
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import Estimate
from kinelast.figures.figure_error import LARGE, TIME, VIBRATION
from kinelast.figures.main_figures import MainFigure, main_figures_of
from kinelast.figures.measures import magnitudes
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of
from kinelast.scene.data import GEOMETRICALLY_EXACT, QUASI_STATIC, Scene, Theory
from kinelast.values.figure import Figure
from rigid import counted

LOAD_UNITS = {"m", "rad", "Pa", "N", "N m"}  # units of displacements, rotations, stresses, forces and moments


class AnswerBuilder(Struct, frozen=True, eq=False, dict=True):
    """Builder of the answers for a scene, from solutions with and without vibration.

    Attributes
    ----------
    quasi_static
        `Cycle` with the quasi-static deflection at the positions of the run.
    theory
        Theory and accuracy that the scene requests.
    """

    quasi_static: Cycle
    theory: Theory

    @property
    def scene(self) -> Scene:
        """The scene of the quasi-static answer."""
        return self.quasi_static.scene

    @property
    def plain(self) -> Deflection:
        """The quasi-static deflection."""
        return self.quasi_static.deflection

    @cached_property
    def figures(self) -> list[Figure]:
        """The figures of a run, except for figures that are computed only on request."""
        return [figure for figure in figures_of(output_of(self.scene, self.plain)) if not figure.asked]

    def rigid(self) -> Answer:
        """Return the answer for a scene in which all links are rigid."""
        return self.built(QUASI_STATIC, None, {}, {})

    def unknown(self, why: str) -> Answer:
        """Return the quasi-static answer with an unknown error; `why` is the reason."""
        return self.built(QUASI_STATIC, None, {}, {}, why)

    def at_rest(self) -> Answer:
        """Return the quasi-static answer for a machine at rest if the geometrically exact theory cannot solve it.

        The relative error is estimated as (largest rotation)^2 + compressive force / Euler load.
        """
        rotation = largest_rotation(self.cycle(self.plain))
        ratio = np.nanmax(euler_ratio(self.plain), initial=0.0)
        large = {LARGE: float(rotation**2 + ratio)}
        return self.built(QUASI_STATIC, None, {}, large)

    def bound_of_large(self, bent: Deflection) -> float:
        """Return a bound on the effect of large displacement.

        If an accuracy is requested, the bound also covers the forces, relative to the largest force in the same member.
        """
        requested = self.theory.accuracy is not None
        per_rotation = THEORY.force_bound_per_rotation if requested else THEORY.bound_per_rotation
        return per_rotation * largest_rotation(self.cycle(bent))

    def built(
        self,
        name: str,
        vibrating: Elastodynamic | None,
        stages: Mapping[str, Elastodynamic],
        shares: Mapping[str, float],
        unknown: str = "",
    ) -> Answer:
        """Return the answer by a theory.

        Parameters
        ----------
        name
            Name of the theory.
        vibrating
            Solution with vibration, or None if vibration is not solved. The quasi-static answer uses only its errors.
        stages
            Solutions in which one more source of error is corrected, by cause.
        shares
            Errors by cause, relative to the largest displacement.
        unknown
            Reason why the errors are unknown; empty if they are known. If friction may lock the mechanism, this is the
            reason, because forces are unbounded between a locked position and the next one.
        """
        if locked := int(np.count_nonzero(self.plain.forces.locked)):
            unknown = f"friction may lock the mechanism at {counted(locked, 'position')}"
        cycle = self.cycle(self.plain if name == QUASI_STATIC or vibrating is None else vibrating.deflection)
        corrected = {cause: self.cycle(stage.deflection) for cause, stage in stages.items()}
        settled = vibrating.discretization_error if vibrating else 0.0
        forces = settled + vibrating.force_error if vibrating and TIME in shares else 0.0
        bent = beyond_beam_theory(cycle.deflection) if self.scene.labels else cycle.deflection
        closer = self._between.of(cycle, None if name == QUASI_STATIC else vibrating)
        rings = (
            closer is not None and VIBRATION in stages and vibrating is not None and self._between.may_peak(vibrating)
        )
        moving = self._between.of(cycle, vibrating) if rings else None
        inertia = None if name == QUASI_STATIC else self._inertia_beyond_beam_theory(vibrating)
        off = Estimate(corrected, self.cycle(bent), shares, unknown, settled, forces, closer, moving, inertia)
        main_figures = main_figures_of(self.scene, cycle, self.figures, off)
        missed = shares.get(VIBRATION, math.nan if vibrating is None else math.inf)
        if not unknown and VIBRATION not in shares:
            missed = self.change_by_vibration(
                [cycle, *corrected.values()][-1] if name == QUASI_STATIC else cycle, main_figures
            )
        finer = LARGE in stages or VIBRATION in shares
        return Answer(
            name, self.theory, cycle, self.plain, vibrating, stages, self.figures, off, main_figures, missed, finer
        )

    def _inertia_beyond_beam_theory(self, vibrating: Elastodynamic | None) -> tuple[Cycle, Cycle] | None:
        """Return two linear answers (deflections) with an estimate of the deflections that beam theory neglects.

        The first neglects the inertia of these deflections, and the second includes it. Return None if there is no
        stable vibration, or if beam theory neglects nothing.
        """
        if vibrating is None or vibrating.vibration is None or not vibrating.stable:
            return None
        if vibrating.vibration in self._inertia:
            return self._inertia[vibrating.vibration]
        linear = vibrating if vibrating.exact is None else moved_to(replace(vibrating, exact=None), self.plain)
        before, cycles = beyond_beam_theory(linear.deflection), None
        if before is not linear.deflection:
            cycles = self.cycle(before), self.cycle(including(beyond_beam_theory, vibrating).deflection)
        self._inertia[vibrating.vibration] = cycles
        return cycles

    @cached_property
    def _inertia(self) -> dict[Vibration, tuple[Cycle, Cycle] | None]:
        """Cache of `_inertia_beyond_beam_theory`: several theories may start from the same vibration."""
        return {}

    def at_positions(self, known: Answer) -> Answer:
        """Return a known answer at the positions of `quasi_static`. Vibration is not solved again."""
        vibrating = known.vibrating and moved_to(known.vibrating, self.plain)
        stages = {cause: moved_to(stage, self.plain) for cause, stage in known.stages.items()}
        shares = dict(known.off.shares)
        if LARGE in shares and vibrating and known.theory != GEOMETRICALLY_EXACT:
            shares[LARGE] = max(shares[LARGE], self.bound_of_large(vibrating.deflection))
        return self.built(known.theory, vibrating, stages, shares, known.unknown)

    def change_by_vibration(self, moving: Cycle, main_figures: Sequence[MainFigure]) -> float:
        """Return the largest relative change that vibration causes in a main figure.

        Only displacements, stresses and forces are considered. Safety factors, lives and load ratios are left out,
        because they are not proportional to the loads. The residual amplitude after a stop is left out too, because it
        consists of vibration only.
        """
        keys = {each.key for each in main_figures}
        chosen = {figure.key: figure for figure in self.figures if figure.key in keys and self._of_loads(figure)}
        here, there = (magnitudes(cycle, list(chosen.values())) for cycle in (self.cycle(self.plain), moving))
        moved = [each for each in main_figures if each.key in chosen]
        shares = [abs(there[each.key][each.item] - here[each.key][each.item]) / each.base for each in moved]
        return max(map(float, shares), default=0.0)

    def _of_loads(self, figure: Figure) -> bool:
        """Return whether a figure (result) is a displacement, a stress or a force that is proportional to the loads."""
        in_proportion = figure.power == 1.0 and not figure.remains_of
        return in_proportion and {*figure.units(self.scene)} <= LOAD_UNITS

    @cached_property
    def _between(self) -> Between:
        return Between(self.quasi_static)

    @cached_property
    def _cycles(self) -> dict[int, Cycle]:
        return {}

    def cycle(self, bent: Deflection) -> Cycle:
        """Return the `Cycle` of a deflection. It is cached, so that its figures are computed only once."""
        plain = self.quasi_static
        if id(bent) not in self._cycles:
            known = {"sampled": True} if bent is plain.given else {"quasi_static": plain, "sampled": True, "_known": {}}
            self._cycles[id(bent)] = dataclasses.replace(plain, motion=bent.motion, given=bent, **known)
        return self._cycles[id(bent)]
