"""The results that a theory of motion gives for a scene, with the errors of the figures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastic import Deflection
from elastic.elastodynamics import Elastodynamic, deflection_at
from kinelast.figures.courses import course_errors, history_error
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import BETWEEN, NOT_OF_MOTION, Estimate, FigureError, GradedFigure, figure_errors, worst_of
from kinelast.scene.data import ACCURACY, QUASI_STATIC
from kinelast.scene.figure import Figure
from rigid.arrays import Reals

SAFE_SHARE = 0.8  # a time history is accurate up to this stated error / accuracy: errors are right to about 20 %
NEGLIGIBLE_GAIN = 0.1  # a better theory is not worth a gain below this share of the accuracy or remaining error


@dataclass(frozen=True, eq=False)
class Answer:
    """The deflection according to the chosen theory, with errors.

    Attributes
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact".
    cycle
        Cycle with the deflection of this answer.
    quasi_static
        Deflection without vibration.
    vibrating
        Solution with vibration; None if it was not computed.
    stages
        Corrected answers by cause, as in `off`, but with the vibration. Finished results do not keep them.
    figures, off
        The figures, and the data from which their errors are computed.
    graded
        Main figures, which determine the error of the answer.
    accuracy
        Requested accuracy; None if none was requested.
    missed
        Relative change in the most affected graded figure due to vibration and large displacement. If vibration was
        not solved, this is a bound on the change; nan if it is unknown.
    finer
        Whether a more accurate theory is available.
    """

    theory: str
    cycle: Cycle
    quasi_static: Deflection
    vibrating: Elastodynamic | None
    stages: Mapping[str, Elastodynamic]
    figures: Sequence[Figure]
    off: Estimate
    graded: Sequence[GradedFigure]
    accuracy: float | None
    missed: float
    finer: bool

    @property
    def deflection(self) -> Deflection:
        """Deflection of the links."""
        return self.cycle.deflection

    def at(self, plain: Deflection) -> Deflection:
        """Return the answer at the positions of a quasi-static deflection."""
        if self.theory == QUASI_STATIC or self.vibrating is None or self.vibrating.vibration is None:
            return plain
        return deflection_at(self.vibrating, plain.motion)

    @property
    def unknown(self) -> str:
        """The reason why the error is unknown, or an empty string if it is known."""
        return self.off.unknown

    @cached_property
    def errors(self) -> Mapping[str, Sequence[FigureError]]:
        """The errors of the figures by key, for all items."""
        return figure_errors(self.cycle, self.figures, self.off)

    @cached_property
    def by_motion(self) -> float:
        """The result of `history_error`; nan if it is unknown."""
        known = self.cycle.scene.labels and not self.unknown
        return history_error(self.cycle, self.off) if known else math.nan if self.unknown else 0.0

    @cached_property
    def courses(self) -> Mapping[str, float]:
        """The result of `course_errors`; empty if it is unknown."""
        return {} if self.unknown or not self.cycle.scene.labels else course_errors(self.cycle, self.off)

    @property
    def worst_course(self) -> tuple[str, float]:
        """The name and relative error of the least accurate time history; an empty name and nan if it is unknown."""
        return max(self.courses.items(), key=lambda item: item[1], default=("", math.nan))

    @property
    def error(self) -> float:
        """The largest relative error of the graded figures; nan if one is unknown, 0 if there are no graded figures."""
        if self.unknown:
            return math.nan
        worst = worst_of(self.graded)
        return worst.share if worst else 0.0

    @property
    def enough(self) -> bool:
        """Whether a better theory would not help, because the accuracy is reached or the error would hardly decrease.

        If an accuracy is requested, the time histories of all fields and joint forces must also reach it.
        """
        if self.unknown:
            return False
        for each in self.graded:
            by_motion = _share_by_motion(each)
            left = each.share - by_motion
            if not by_motion <= max(self.wanted - left, NEGLIGIBLE_GAIN * self.wanted):
                return False
        return self.accuracy is None or max(self.courses.values(), default=0.0) <= SAFE_SHARE * self.wanted

    @property
    def off_by_motion(self) -> float:
        """The largest relative error due to the theory of motion; infinite if it is unknown."""
        if self.unknown:
            return math.inf
        return max((*map(_share_by_motion, self.graded), *self.courses.values()), default=0.0)

    @property
    def accurate(self) -> bool | None:
        """Whether the requested accuracy is reached; None if no accuracy is requested."""
        return self.reaches(self.error)

    @property
    def wanted(self) -> float:
        """The accuracy to reach, which is `ACCURACY` by default."""
        return ACCURACY if self.accuracy is None else self.accuracy

    @property
    def missed_peaks(self) -> Reals:
        """The instants [s] around the peaks of graded figures for which the error `BETWEEN` exceeds the accuracy."""
        keys = {each.key for each in self.graded if each.error.parts.get(BETWEEN, 0.0) > self.wanted * each.base}
        figures = [figure for figure in self.figures if figure.key in keys and not figure.of_motion(self.cycle.scene)]
        instants = [np.zeros(0)]
        for cycle in filter(None, (self.off.closer, self.off.moving)):
            time = cycle.motion.time
            for figure in figures:
                near = np.add.outer(cycle.of(figure).position, (-1, 0, 1))
                instants.append(time[np.clip(near, 0, len(time) - 1)].ravel())
        return np.unique(np.concatenate(instants))

    def reaches(self, error: float) -> bool | None:
        """Return whether an error and the time histories are within the requested accuracy, or None without one."""
        if self.accuracy is None:
            return None
        return error <= self.accuracy and not self.worst_course[1] > self.accuracy


def _share_by_motion(graded: GradedFigure) -> float:
    return graded.error.without(NOT_OF_MOTION).size / graded.base
