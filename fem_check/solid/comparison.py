"""Error of beam theory: closed forms compared with plane-stress bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elastic import Deflection, sample
from fem_check.solid.solution import ACROSS, POISSON, SolidSolution, solve_solid
from rigid import Reals

STATIONS = 33  # points along a beam without a body, to find its largest deflection
MIN_DEFLECTION = 1e-6  # deflection below which a link counts as undeflected, relative to the mechanism's largest


@dataclass(frozen=True, eq=False, repr=False)
class SolidComparison:
    """Differences of chord deflections.

    Attributes
    ----------
    largest
        Largest deflection of each beam from its chord by beam theory [m], shape (beams,).
    difference
        Largest difference from the plane-stress bodies over places and positions [m], shape (beams,); nan for beams
        without a body.
    peak
        Largest deflection of the plane-stress bodies [m], shape (beams,).
    by_link
        By link name, the largest difference on its beams, relative to their largest deflection.
    left_out
        By link name, the reason why a link has no plane body.
    refinement
        Largest change compared with elements of twice the size, relative to the largest deflection; at least three
        quarters of it are the error of the coarser elements.
    compared
        Number of positions with an answer on both sides.
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
        """Largest difference relative to the largest deflection; nan if nothing was compared."""
        known = np.isfinite(self.difference)
        if not known.any() or not self.largest[known].max() > 0:
            return float("nan")
        return float(self.difference[known].max() / self.largest[known].max())

    def __repr__(self) -> str:
        return f"SolidComparison({len(self.by_link)} links, {self.compared} positions: {self.relative:.2%} off)"


def compare_solid(
    deflection: Deflection, poisson: float | Sequence[float] = POISSON, across: int = ACROSS
) -> SolidComparison:
    """Compare the deflections of beam theory and plane-stress bodies.

    The deflection is that of the axis from the chord through the mean positions of the pins at the beam's ends.

    Parameters
    ----------
    poisson
        Poisson's ratio, common or per beam.
    across
        Number of elements across the depth, a multiple of 4; the change compared with half as many is reported.

    Raises
    ------
    ValueError
        See `solve_solid`.
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
            difference[owner == at].max() / max(float(largest[owner == at].max()), MIN_DEFLECTION * whole)
        )
        for at in fine.bodies
    }
    bodies = np.isin(owner, list(fine.bodies))
    refinement = float(change[bodies].max(initial=0.0)) / whole
    answered = ~deflection.lost & np.isfinite([loads.sum(0) for loads in fine.loads.values()]).all(axis=0)
    compared = int(answered.sum()) if fine.bodies else 0
    return SolidComparison(largest, difference, peak, by_link, fine.left_out, refinement, compared)


def _differences(deflection: Deflection, solid: SolidSolution) -> tuple[Reals, Reals, Reals]:
    """Per beam: largest beam deflection, largest difference, largest body deflection [m]."""
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
    """Largest magnitude of the known values, or nan."""
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")
