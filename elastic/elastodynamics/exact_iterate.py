"""Intermediate result (iterate) of the iteration for links with large displacement, with measures of its error."""

from functools import cached_property

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.second_order import chord_of
from elastic.links import members_of
from elastic.sampling import reference_deflection
from rigid.arrays import Columns, Complexes

Sliding = tuple[tuple[int, Columns, Columns], ...]  # see `AddedLoads.sliding`

# tolerance of the error in the deflection of a single beam, relative to the overall tolerance
BEAM_TOLERANCE_RATIO = 10.0
FORCE_TOLERANCE_RATIO = 10.0  # tolerance of the error in section forces, relative to the overall tolerance
# tolerance of a finer solution, relative to the tolerance of the solution whose error it measures
FINER_TOLERANCE_RATIO = 0.4
STATIONS = 21
# the reference for errors in a beam's deflection is at least this, relative to the largest displacement
MIN_BEAM_REFERENCE = 1e-6
TINY = float(np.finfo(float).tiny)


class ExactIterate(Struct, frozen=True, eq=False, dict=True):
    """Links with large displacement after some steps of an iteration.

    Attributes
    ----------
    displaced
        Displaced links.
    change
        Change in the beam displacements in the next step, in ground axes [m], complex, shape (points, beams, Gauss
        points). In results of `first_steps` and `next_step`, it is instead the change in the step that led to
        `displaced`. For a mechanism without beams, it contains rotations of the links [rad] and displacements of points
        [m], shape (points, links + chosen points, 1).
    residual
        Residual of the exact equations, converted to displacements, with the same shape as `change`.
    steps
        Number of steps, including the step in which `change` occurs.
    sliding
        Sliding rates of the joints with friction; empty unless friction is stiff (see `exact_steps`).
    force_residual
        See `ResidualState.force_residual`; 0 with Coulomb friction.
    """

    displaced: Displaced
    change: Complexes
    residual: Complexes
    steps: int
    sliding: Sliding = ()
    force_residual: float = 0.0

    @property
    def relative_error(self) -> float:
        """Larger of change and residual, relative to the largest displacement."""
        return max(self.relative_change, self.relative_residual)

    @cached_property
    def relative_change(self) -> float:
        """`change`, relative to the largest displacement."""
        return self._relative(self.change)

    @cached_property
    def relative_residual(self) -> float:
        """`residual`, relative to the largest displacement."""
        return self._relative(self.residual)

    def _relative(self, values: Complexes) -> float:
        greatest = np.abs(compared_displacements(self.displaced.moved)).max(initial=TINY)
        return float(np.abs(values).max(initial=0.0) / greatest)

    @cached_property
    def worst(self) -> float:
        """Error in the chord deflection of the worst beam, relative to the largest chord deflection of its member.

        A member is a row of collinear beams. The error is the larger of `change` and `residual`.
        """
        linear, stations = self.displaced.vibration, np.linspace(0.0, 1.0, STATIONS)
        if not self.displaced.moved.beams.size:
            return 0.0
        parts = (self.displaced.moved.beams[1:, ..., 0], self.change, self.residual)
        chord, *errors = (np.abs(chord_of(linear, part, stations)).max(axis=(1, 2), initial=0.0) for part in parts)
        least = MIN_BEAM_REFERENCE * np.abs(compared_displacements(self.displaced.moved)).max(initial=TINY)
        reference = np.maximum(reference_deflection(members_of(linear.motion.mechanism).greatest(chord)), least)
        return float((np.maximum(*errors) / reference).max(initial=0.0))

    @property
    def errors(self) -> tuple[float, float, float]:
        """Errors of all displacements, of single beams and of section forces, divided by the ratios of tolerances."""
        return self.relative_error, self.worst / BEAM_TOLERANCE_RATIO, self.force_residual / FORCE_TOLERANCE_RATIO

    @property
    def convergence_error(self) -> float:
        """Error that is compared with the tolerance: the largest of `errors`."""
        return max(self.errors)

    def finer_tolerance(self, tolerance: float) -> float:
        """Return the tolerance for a finer solution that is used to measure the error of this solution.

        `tolerance` is the tolerance of this solution. If the finer solution meets the returned tolerance, its `worst`
        is at most `FINER_TOLERANCE_RATIO` times the larger of `tolerance` and the `worst` of this solution.
        """
        return FINER_TOLERANCE_RATIO * min(tolerance, max(tolerance, self.worst) / BEAM_TOLERANCE_RATIO)


def compared_displacements(moved: Displacements) -> Complexes:
    """Return the displacements at the points, with the same shape as `ExactIterate.change`."""
    displacements: Complexes = moved.beams
    if not displacements.size:
        displacements = np.concatenate((moved.angle, moved.moves), axis=1)[:, :, None].astype(complex)
    return displacements[1:, ..., 0]
