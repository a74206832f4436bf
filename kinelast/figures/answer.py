"""Answer of a theory of motion to a scene, with the errors of its figures."""

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

SURELY = 0.8  # stated error / accuracy up to which a time history surely reaches it: errors are right to about 20 %
BESIDES = 0.1  # no better theory is needed for a gain below this share of the accuracy or of the remaining error


@dataclass(frozen=True, eq=False)
class Answer:
    """Deflection according to the chosen theory, with errors.

    Attributes
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact".
    cycle
        Cycle of the answer.
    quasi_static
        Deflection without vibration.
    vibrating
        Solution with vibration; None if not computed.
    stages
        Corrected answers by cause, as in `off`, with their vibration; empty in finished results.
    figures, off
        Figures with errors, and the data for these errors.
    graded
        Main figures; their errors grade the answer.
    accuracy
        Requested accuracy, if any.
    missed
        Relative change that vibration and large displacement cause in the most affected displacement, stress or force
        among the graded figures, or a bound on it if vibration was not solved; nan if unknown.
    finer
        True if a more accurate theory is available.
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
        """Reason for an unknown error; empty if the error is known."""
        return self.off.unknown

    @cached_property
    def errors(self) -> Mapping[str, Sequence[FigureError]]:
        """Errors of all items of the figures, by key."""
        return figure_errors(self.cycle, self.figures, self.off)

    @cached_property
    def by_motion(self) -> float:
        """See `history_error`; nan if unknown."""
        known = self.cycle.scene.labels and not self.unknown
        return history_error(self.cycle, self.off) if known else math.nan if self.unknown else 0.0

    @cached_property
    def courses(self) -> Mapping[str, float]:
        """See `course_errors`; empty if unknown."""
        return {} if self.unknown or not self.cycle.scene.labels else course_errors(self.cycle, self.off)

    @property
    def worst_course(self) -> tuple[str, float]:
        """Name and relative error of the worst time history; empty and nan if unknown."""
        return max(self.courses.items(), key=lambda item: item[1], default=("", math.nan))

    @property
    def error(self) -> float:
        """Relative error of the worst graded figure; nan if one is unknown, 0 without graded figures."""
        if self.unknown:
            return math.nan
        worst = worst_of(self.graded)
        return worst.share if worst else 0.0

    @property
    def enough(self) -> bool:
        """True if a better theory would not help, because the accuracy is reached or it could remove little error.

        The time histories of all fields and joint forces must also reach a requested accuracy.
        """
        if self.unknown:
            return False
        for each in self.graded:
            by_motion = _share_by_motion(each)
            left = each.share - by_motion
            if not by_motion <= max(self.wanted - left, BESIDES * self.wanted):
                return False
        return self.accuracy is None or max(self.courses.values(), default=0.0) <= SURELY * self.wanted

    @property
    def off_by_motion(self) -> float:
        """Largest relative error due to the theory of motion; infinite if unknown."""
        if self.unknown:
            return math.inf
        return max((*map(_share_by_motion, self.graded), *self.courses.values()), default=0.0)

    @property
    def accurate(self) -> bool | None:
        """True if the requested accuracy is reached; None without one."""
        return self.reaches(self.error)

    @property
    def wanted(self) -> float:
        """Accuracy to reach: the requested one, or `ACCURACY`."""
        return ACCURACY if self.accuracy is None else self.accuracy

    @property
    def missed_peaks(self) -> Reals:
        """Instants [s] around the peaks of graded figures if their error `BETWEEN` positions exceeds the accuracy."""
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
        """Return True if an error and the time histories are within the requested accuracy; None without one."""
        if self.accuracy is None:
            return None
        return error <= self.accuracy and not self.worst_course[1] > self.accuracy


def _share_by_motion(graded: GradedFigure) -> float:
    return graded.error.without(NOT_OF_MOTION).size / graded.base
