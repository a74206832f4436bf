"""Links displaced by any amount, with how far from the exact equations they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastic.elastodynamics.displaced_links import Displaced
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.second_order import chord_of
from elastic.links import members_of
from elastic.sampling import reference_deflection
from rigid.arrays import Columns, Complexes

Sliding = tuple[tuple[int, Columns, Columns], ...]  # as of `AddedLoads.sliding`

BEAMS = 10.0  # times the tolerance that the deflection of a single beam may be off
STATIONS = 21
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Settled:
    """Links displaced by any amount after so many steps.

    Attributes
    ----------
    displaced
        The links.
    change, residual
        Of the beams' displacements [m], complex, shape (points, beams, Gauss points): by one more step, and that of the
        exact equations, the quasi-static answer under the loads of displaced links less their displacement. Without
        beams of the links' rotations [rad], shape (points, links, 1), and of shifts.
    steps
        How many were made, with the one more.
    sliding
        Rates of the joints with friction, where it is hard.
    """

    displaced: Displaced
    change: Complexes
    residual: Complexes
    steps: int
    sliding: Sliding = ()

    @property
    def share(self) -> float:
        """The change or the residual, the greater, of the largest displacement."""
        greatest = np.abs(places_of(self.displaced.moved)).max(initial=TINY)
        return float(max(np.abs(off).max(initial=0.0) for off in (self.change, self.residual)) / greatest)

    @property
    def change_share(self) -> float:
        """The change of one more step, of the largest displacement."""
        greatest = np.abs(places_of(self.displaced.moved)).max(initial=TINY)
        return float(np.abs(self.change).max(initial=0.0) / greatest)

    @cached_property
    def worst(self) -> float:
        """As `share`, of the deflection from the chord, of the largest of the member for which that is most."""
        linear, stations = self.displaced.vibration, np.linspace(0.0, 1.0, STATIONS)
        if not self.displaced.moved.beams.size:
            return 0.0
        parts = (self.displaced.moved.beams[1:, ..., 0], self.change, self.residual)
        chord, *off = (np.abs(chord_of(linear, part, stations)).max(axis=(1, 2), initial=0.0) for part in parts)
        base = reference_deflection(members_of(linear.motion.mechanism).greatest(chord))
        return float((np.maximum(*off) / np.maximum(base, TINY)).max(initial=0.0))

    @property
    def open(self) -> float:
        """How far from settled it may be: a beam that bends little may be less so."""
        return max(self.share, self.worst / BEAMS)


def places_of(moved: Displacements) -> Complexes:
    """Displacements of one kind at the points, as of `Settled.change`."""
    places: Complexes = moved.beams
    if not places.size:
        places = np.concatenate((moved.angle, moved.moves), axis=1)[:, :, None].astype(complex)
    return places[1:, ..., 0]
