"""Solution for links with large displacement, and its residual in the exact equations."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.second_order import chord_of
from elastic.links import members_of
from elastic.sampling import reference_deflection
from rigid.arrays import Columns, Complexes

Sliding = tuple[tuple[int, Columns, Columns], ...]  # see `AddedLoads.sliding`

BEAMS = 10.0  # tolerance of the deflection of a single beam, relative to the overall tolerance
FORCES = 10.0  # same for the section forces
FURTHER = 0.4  # tolerance of a finer solution, relative to that of the solution it is compared with
STATIONS = 21
BENT = 1e-6  # smallest reference for the deflection of a beam, relative to the largest displacement; less is round-off
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Settled:
    """Links with large displacement after several steps of an iteration.

    Attributes
    ----------
    displaced
        Displaced links.
    change, residual
        Change by one more step and residual of the exact equations, for the displacements of the beams [m], complex,
        shape (points, beams, Gauss points). Without beams, these are rotations of the links [rad], shape (points,
        links, 1), and displacements of points.
    steps
        Number of steps, including the one for `change`.
    sliding
        Rates of joints with hard friction.
    forces
        See `Unbalanced.force_share`; 0 if not required.
    """

    displaced: Displaced
    change: Complexes
    residual: Complexes
    steps: int
    sliding: Sliding = ()
    forces: float = 0.0

    @property
    def share(self) -> float:
        """Larger of change and residual, relative to the largest displacement."""
        return max(self.change_share, self.residual_share)

    @cached_property
    def change_share(self) -> float:
        """Change by one more step, relative to the largest displacement."""
        return self._share_of(self.change)

    @cached_property
    def residual_share(self) -> float:
        """Residual of the exact equations, relative to the largest displacement."""
        return self._share_of(self.residual)

    def _share_of(self, off: Complexes) -> float:
        greatest = np.abs(places_of(self.displaced.moved)).max(initial=TINY)
        return float(np.abs(off).max(initial=0.0) / greatest)

    @cached_property
    def worst(self) -> float:
        """Larger of change and residual of the chord deflection for the worst beam, relative to its member."""
        linear, stations = self.displaced.vibration, np.linspace(0.0, 1.0, STATIONS)
        if not self.displaced.moved.beams.size:
            return 0.0
        parts = (self.displaced.moved.beams[1:, ..., 0], self.change, self.residual)
        chord, *off = (np.abs(chord_of(linear, part, stations)).max(axis=(1, 2), initial=0.0) for part in parts)
        least = BENT * np.abs(places_of(self.displaced.moved)).max(initial=TINY)
        base = np.maximum(reference_deflection(members_of(linear.motion.mechanism).greatest(chord)), least)
        return float((np.maximum(*off) / base).max(initial=0.0))

    @property
    def open(self) -> float:
        """Measure of convergence, in which errors of single beams and of forces have less weight."""
        return max(self.share, self.worst / BEAMS, self.forces / FORCES)

    def finer_tolerance(self, tolerance: float) -> float:
        """Return the tolerance of a finer solution that measures the error of this one, computed to `tolerance`.

        `worst` of the finer solution is then at most `FURTHER` times the larger of `tolerance` and this `worst`.
        """
        return FURTHER * min(tolerance, max(tolerance, self.worst) / BEAMS)


def places_of(moved: Displacements) -> Complexes:
    """Return the displacements at the points as compared in `Settled.change`."""
    places: Complexes = moved.beams
    if not places.size:
        places = np.concatenate((moved.angle, moved.moves), axis=1)[:, :, None].astype(complex)
    return places[1:, ..., 0]
