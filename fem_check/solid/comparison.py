"""Error of beam theory, measured by comparing its deflections with those of plane-stress bodies."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from elastic import Deflection, sample
from fem_check.solid.solution import ACROSS, POISSON, SolidSolution, solve_solid
from rigid import Reals

STATIONS = 33  # number of points along a beam without a body at which its largest deflection is searched for
# the reference deflection of a link is at least this, relative to the largest deflection of the mechanism
MIN_DEFLECTION = 1e-6


class SolidComparison(Struct, frozen=True, eq=False):
    """Differences of the chord deflection between beam theory and plane-stress bodies.

    Attributes
    ----------
    largest
        Largest chord deflection of each beam by beam theory [m], shape (beams,).
    difference
        Largest difference between the chord deflections of beam theory and of the plane-stress body, over all stations
        and positions [m], shape (beams,); nan for beams without a body.
    peak
        Largest chord deflection of the plane-stress bodies [m], shape (beams,); nan for beams without a body.
    by_link
        Largest difference on the beams of each link, relative to the largest chord deflection of these beams, by link
        name.
    left_out
        Reason why a link has no plane body, by link name.
    refinement
        Largest change of `peak` from a mesh of elements of twice the size, relative to the largest chord deflection of
        the mechanism by beam theory. This is at least three quarters of the error of the coarser mesh, if halving the
        elements divides the error by at least four.
    compared
        Number of positions for which both solutions exist.
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
        """Largest difference, relative to the largest chord deflection of the compared beams; nan if there are none."""
        known = np.isfinite(self.difference)
        if not known.any() or not self.largest[known].max() > 0:
            return float("nan")
        return float(self.difference[known].max() / self.largest[known].max())

    def __repr__(self) -> str:
        return f"SolidComparison({len(self.by_link)} links, {self.compared} positions: {self.relative:.2%} off)"


def compare_solid(
    deflection: Deflection, poisson: float | Sequence[float] = POISSON, across: int = ACROSS
) -> SolidComparison:
    """Compare the chord deflections of beam theory and plane-stress bodies.

    The chord deflection of a body is the distance of the deformed axis from the line through the mean positions of the
    pins at the ends of the beam.

    Parameters
    ----------
    poisson
        Poisson's ratio, one for all beams or one per beam.
    across
        Number of elements across the depth, a multiple of 4. `refinement` compares the results for this number and for
        half of it.

    Raises
    ------
    ValueError
        If `across` is not a multiple of 4; see also `solve_solid`.
    """
    if across % 4:
        raise ValueError(f"{across} elements across: expected a multiple of 4, to compare with half as many")
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
    """Return `largest`, `difference` and `peak` of `SolidComparison`."""
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
    """Return the largest magnitude of the finite values, or nan if there are none."""
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")
