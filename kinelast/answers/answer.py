"""The answer: the deflection of a scene by a theory of motion, with the errors in its figures and time histories.

A figure is a result such as the largest deflection of each link.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Deflection, reference_deflection, sample
from elastic.elastodynamics import Elastodynamic, deflection_at
from elastic.links import members_of
from kinelast.figures.cycle import STATIONS, Cycle
from kinelast.figures.errors import Estimate, figure_errors
from kinelast.figures.figure_error import BETWEEN, TIME, FigureError
from kinelast.figures.main_figures import MainFigure, worst_of
from kinelast.scene.data import QUASI_STATIC, Theory
from kinelast.values.figure import Figure
from rigid.arrays import Complexes, Numbers, Reals, distinct

SAFE_SHARE = 0.8  # largest estimated error of a time history, relative to the accuracy; estimates are within about 20 %
NEGLIGIBLE_GAIN = 0.1  # smaller errors by the theory of motion, relative to the accuracy or other errors, are accepted
COURSES, JOINT_FORCES = ("u", "w", "chord", "N", "M"), "joint forces"
FORCES = "N", "M", JOINT_FORCES  # time histories of forces
COMPARED_AT = np.linspace(0.0, 1.0, 5)  # locations along a beam at which time histories are compared
SMALL = 0.1  # smallest reference value of an error, relative to the largest one of all beams or joints


class Answer(Struct, frozen=True, eq=False, dict=True):
    """The deflection by the chosen theory of motion, with errors.

    Attributes
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact".
    requested
        Theory and accuracy that the user requests.
    cycle
        Cycle with the deflection of this answer.
    quasi_static
        Quasi-static deflection, i.e. without vibration.
    vibrating
        Solution with vibration; None if it was not computed.
    stages
        Solutions with vibration in which errors are corrected, by cause of the error, see `off.stages`. They are
        removed from finished results to save memory.
    figures, off
        Figures that the answer is judged by, and the data from which their errors are computed.
    main_figures
        Main figures. The error of the answer is the largest of their relative errors.
    missed
        Largest relative change in a main displacement, stress or force due to vibration and large displacement. It is a
        bound on this change if vibration was not solved, and nan if no bound is known.
    finer
        Whether a more accurate theory is available.
    """

    theory: str
    requested: Theory
    cycle: Cycle
    quasi_static: Deflection
    vibrating: Elastodynamic | None
    stages: Mapping[str, Elastodynamic]
    figures: Sequence[Figure]
    off: Estimate
    main_figures: Sequence[MainFigure]
    missed: float
    finer: bool

    @property
    def deflection(self) -> Deflection:
        """Deflection of the links."""
        return self.cycle.deflection

    def at(self, plain: Deflection) -> Deflection:
        """Return the deflection by this theory at the positions of the quasi-static deflection `plain`."""
        if self.theory == QUASI_STATIC or self.vibrating is None or self.vibrating.vibration is None:
            return plain
        return deflection_at(self.vibrating, plain.motion)

    @property
    def unknown(self) -> str:
        """The reason why the errors are unknown, or an empty string if they are known."""
        return self.off.unknown

    @cached_property
    def errors(self) -> Mapping[str, Sequence[FigureError]]:
        """The errors in the figures: a list with one error for each item, by figure key."""
        return figure_errors(self.cycle, self.figures, self.off)

    @cached_property
    def by_motion(self) -> float:
        """The result of `history_error`; nan if the errors are unknown."""
        known = self.cycle.scene.labels and not self.unknown
        return history_error(self.cycle, self.off) if known else math.nan if self.unknown else 0.0

    @cached_property
    def courses(self) -> Mapping[str, float]:
        """The result of `course_errors`; empty if the errors are unknown."""
        return {} if self.unknown or not self.cycle.scene.labels else course_errors(self.cycle, self.off)

    @property
    def worst_course(self) -> tuple[str, float]:
        """The name and relative error of the least accurate time history; ("", nan) if the errors are unknown."""
        return max(self.courses.items(), key=lambda item: item[1], default=("", math.nan))

    @property
    def error(self) -> float:
        """The largest relative error in any main figure; nan if an error is unknown, 0 if there are no main figures."""
        if self.unknown:
            return math.nan
        worst = worst_of(self.main_figures)
        return worst.share if worst else 0.0

    @property
    def enough(self) -> bool:
        """Whether the answer is good enough, so that a more accurate theory of motion is unnecessary.

        This is the case if every main figure reaches the accuracy, or if the error due to the theory of motion is
        negligible. If other errors alone exceed the default accuracy, the theory of motion only has to reach it by
        itself. If the user requested an accuracy, all time histories must reach it too. Errors `BETWEEN` that lead to
        `missed_peaks` do not count, because the figures will be evaluated there.
        """
        if self.unknown:
            return False
        wanted = self.requested.wanted
        for each in self.main_figures:
            left = each.share - each.share_by_motion
            if self._is_missed(each):
                left -= each.error.parts[BETWEEN] / each.base
            accepted = max(wanted - left, NEGLIGIBLE_GAIN * wanted)
            if self.requested.accuracy is None and left >= wanted:
                accepted = wanted
            if not each.share_by_motion <= accepted:
                return False
        return self.requested.accuracy is None or max(self.courses.values(), default=0.0) <= SAFE_SHARE * wanted

    @property
    def enough_if_resolved(self) -> bool:
        """Whether the answer would be good enough without its discretization error, see `enough`."""
        figures = [replace(each, error=each.error.without([TIME])) for each in self.main_figures]
        stages, shares = (
            {key: each[key] for key in each if key != TIME} for each in (self.off.stages, self.off.shares)
        )
        off = replace(self.off, stages=stages, shares=shares, forces=0.0)
        cycle = self.off.stages.get(TIME, self.cycle)
        return replace(self, cycle=cycle, off=off, main_figures=figures).enough

    @property
    def off_by_motion(self) -> float:
        """The largest relative error due to the theory of motion, in figures or time histories; infinite if unknown."""
        if self.unknown:
            return math.inf
        return max((*(each.share_by_motion for each in self.main_figures), *self.courses.values()), default=0.0)

    @property
    def accurate(self) -> bool | None:
        """Whether the requested accuracy is reached; None if none was requested."""
        return self.reaches(self.error)

    @property
    def missed_peaks(self) -> Reals:
        """Instants [s] around the peaks of main figures that have an error `BETWEEN` above the accuracy."""
        keys = {each.key for each in self.main_figures if self._is_missed(each)}
        figures = [figure for figure in self.figures if figure.key in keys and not figure.of_motion(self.cycle.scene)]
        instants = [np.zeros(0)]
        for cycle in filter(None, (self.off.closer, self.off.moving)):
            time = cycle.motion.time
            for figure in figures:
                near = np.add.outer(cycle.of(figure).position, (-1, 0, 1))
                instants.append(time[np.clip(near, 0, len(time) - 1)].ravel())
        return distinct(np.concatenate(instants))

    def _is_missed(self, figure: MainFigure) -> bool:
        return figure.error.parts.get(BETWEEN, 0.0) > self.requested.wanted * figure.base

    def reaches(self, error: float) -> bool | None:
        """Return whether `error` and the time histories reach the requested accuracy, or None if none was requested."""
        accuracy = self.requested.accuracy
        return None if accuracy is None else error <= accuracy and not self.worst_course[1] > accuracy


def history_error(answer: Cycle, off: Estimate) -> float:
    """Return the largest error in a deflection from the chord at any time.

    The theory of motion and the time elements cause this error. The error is relative to the `reference_deflection` of
    the member to which the beam belongs. `--check nonlinear` measures this error.
    """
    chord = sample(answer.deflection, "chord", STATIONS)
    base = reference_deflection(_greatest_of_members(answer, chord))
    shares = math.fsum(off.shares.values())
    if not off.stages:
        return shares
    final = [*off.stages.values()][-1].deflection
    return shares + _greatest_share(chord, sample(final, "chord", STATIONS), base)


def course_errors(answer: Cycle, off: Estimate) -> dict[str, float]:
    """Return the largest errors in time histories, due to the theory of motion and time elements.

    The time histories are of joint forces and of fields, i.e. quantities along the beams. The error in a member
    (straight run of beams) or joint is relative to the largest value in this member or joint. This reference value is
    at least `SMALL` times the largest value in all members or joints.
    """
    shares, errors = math.fsum(off.shares.values()), {}
    of_forces = shares + max(off.forces - off.shares.get(TIME, 0.0), 0.0)  # forces have a larger discretization error
    known = {name: of_forces if name in FORCES else shares for name in (*COURSES, JOINT_FORCES)}
    if not off.stages:
        return known
    bent, final = answer.deflection, [*off.stages.values()][-1].deflection
    for name in COURSES:
        values = sample(bent, name, COMPARED_AT)
        base = _greatest_of_members(answer, values)
        errors[name] = known[name] + _greatest_share(values, sample(final, name, COMPARED_AT), _not_small(base))
    forces, others = (_joint_forces(each) for each in (bent, final))
    base = np.nan_to_num(np.abs(forces)).max(axis=1, initial=0.0)
    return {**errors, JOINT_FORCES: known[JOINT_FORCES] + _greatest_share(forces, others, _not_small(base))}


def _greatest_of_members(answer: Cycle, values: Reals) -> Reals:
    """Return, for each beam, the largest magnitude of `values` (beams, positions, stations) in the beam's member."""
    greatest: Reals = np.nan_to_num(np.abs(values)).max(axis=(1, 2), initial=0.0)
    return members_of(answer.scene.mechanism).greatest(greatest)


def _not_small(greatest: Reals) -> Reals:
    """Return reference values of errors: the given values, but at least `SMALL` times the largest of them."""
    return np.maximum(greatest, SMALL * greatest.max(initial=0.0))


def _greatest_share(values: Numbers, others: Numbers, base: Reals) -> float:
    """Return the largest difference between two arrays of rows.

    It is relative to the reference value of the row in `base`.
    """
    apart = np.nan_to_num(np.abs(others - values)).max(axis=tuple(range(1, values.ndim)), initial=0.0)
    return float(np.divide(apart, base, out=np.zeros_like(apart), where=base > 0.0).max(initial=0.0))


def _joint_forces(bent: Deflection) -> Complexes:
    """Return the forces in all joints as complex numbers [N], shape (joints, positions)."""
    columns = bent.motion.columns
    forces = [np.broadcast_to(np.asarray(force, complex), columns) for force, _ in bent.forces.in_joints]
    return np.reshape(np.array(forces, complex), (len(forces), *columns))
