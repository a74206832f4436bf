"""Error of beam theory: deflections of the closed forms beside those of the plane-stress bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elastic import Deflection, sample
from fem_check.solid.solution import ACROSS, POISSON, SolidSolution, solve_solid
from rigid import Reals

STATIONS = 33  # at which a beam is asked for its largest deflection where no body is
UNBENT = 1e-6  # of the mechanism's largest deflection, below which a link's counts as none


@dataclass(frozen=True, eq=False, repr=False)
class SolidComparison:
    """Differences of the deflections from the chord.

    Attributes
    ----------
    largest
        Largest deflection of every beam from its chord by beam theory [m], shape (beams,).
    difference
        Greatest difference of the plane-stress bodies from it, at any place and position [m], shape (beams,); nan of
        beams that are no bodies.
    peak
        Largest deflection of the plane-stress bodies [m], shape (beams,).
    by_link
        By name of the link, the greatest difference on its beams over the largest deflection of any of them.
    left_out
        By name of the link, why it is no plane body.
    refinement
        Greatest change from elements twice as large over the largest deflection; three quarters of it at least are
        theirs.
    compared
        Number of positions at which both sides have an answer.
    """

    largest: Reals
    difference: Reals
    peak: Reals
    by_link: dict[str, float]
    left_out: Mapping[str, str]
    refinement: float
    compared: int

    @property
    def relative(self) -> float:
        """Greatest difference over the largest deflection of all; nan where there is nothing to compare."""
        known = np.isfinite(self.difference)
        if not known.any() or not self.largest[known].max() > 0:
            return float("nan")
        return float(self.difference[known].max() / self.largest[known].max())

    def __repr__(self) -> str:
        return f"SolidComparison({len(self.by_link)} links, {self.compared} positions: {self.relative:.2%} off)"


def compare_solid(
    deflection: Deflection, poisson: float | Sequence[float] = POISSON, across: int = ACROSS
) -> SolidComparison:
    """Difference of beam theory from plane-stress bodies, in its largest deflection.

    Deflections are from the chord through the ends of each beam: through the mean places of its pins. What is compared
    is the axis between them.

    Parameters
    ----------
    poisson
        Poisson's ratio, of all beams or one per beam.
    across
        Elements over the depth, an even number; the change from half as many is told.

    Raises
    ------
    ValueError
        As `solve_solid`.
    """
    if across % 4:
        raise ValueError(f"{across} elements across: expected a multiple of 4, to be compared with half as many")
    asked = deflection.motion, deflection.sections, poisson
    fine = solve_solid(*asked, across, deflection.joints)
    coarse = solve_solid(*asked, across // 2, deflection.joints)
    largest, difference, peak = _differences(deflection, fine)
    change = np.abs(_differences(deflection, coarse)[2] - peak)
    mechanism = deflection.motion.mechanism
    owner = np.array([at for at, _ in mechanism.beams], int)
    whole = max(float(largest.max(initial=0.0)), np.finfo(float).tiny)
    by_link = {
        mechanism.links[at].name: float(
            difference[owner == at].max() / max(float(largest[owner == at].max()), UNBENT * whole)
        )
        for at in fine.bodies
    }
    bodies = np.isin(owner, list(fine.bodies))
    refinement = float(change[bodies].max(initial=0.0)) / whole
    answered = ~deflection.lost & np.isfinite([loads.sum(0) for loads in fine.loads.values()]).all(axis=0)
    compared = int(answered.sum()) if fine.bodies else 0
    return SolidComparison(largest, difference, peak, by_link, fine.left_out, refinement, compared)


def _differences(deflection: Deflection, solid: SolidSolution) -> tuple[Reals, Reals, Reals]:
    """Per beam the largest deflection by beam theory, the greatest difference from it, and the bodies' largest [m]."""
    differences = np.zeros((3, len(solid.xi)))
    for k, (xi, chord) in enumerate(zip(solid.xi, solid.chord, strict=True)):
        stations = xi if len(xi) else np.linspace(0.0, 1.0, STATIONS)
        start, end = np.moveaxis(sample(deflection, "chord", [0.0, 1.0])[k], -1, 0)[..., None]
        beam = sample(deflection, "chord", stations)[k] - start * (1.0 - stations) - end * stations
        rows = (
            (beam, chord - beam, chord) if len(xi) else (beam, np.full(beam.shape, np.nan), np.full(beam.shape, np.nan))
        )
        differences[:, k] = [_greatest(row) for row in rows]
    return differences[0], differences[1], differences[2]


def _greatest(values: Reals) -> float:
    """Largest magnitude of the known values; nan where none is."""
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")
