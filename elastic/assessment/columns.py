"""Spans of beams as columns: compression, Euler load and slenderness."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from elastic.arrays import PerBeam
from elastic.beams.polynomials import gauss_points, least_on
from elastic.beams.section import Section, Taper
from elastic.links.members import BeamRun, members_of, spans_of
from elastic.solution import Deflection
from rigid import Reals
from rigid.constants import per_row

TERMS = 16  # number of polynomials for the bending moment of a tapered column; more would only add round-off
POINTS = 64  # number of Gauss points, and number of intervals on which tapers are evaluated


def least_axial_force(deflection: Deflection) -> PerBeam:
    """Return the smallest axial force along each beam [N], shape (beams, ..., positions); compression is negative."""
    rows = least_on(deflection.N)
    least = np.full((len(deflection.sections), *rows.shape[1:]), np.inf)
    for row, beam in zip(rows, deflection.division.beam, strict=True):
        least[beam] = np.minimum(least[beam], row)
    return least


def euler_loads(deflection: Deflection) -> PerBeam:
    """Return the Euler load of the span that contains each beam [N], shape (beams, ..., 1).

    A span is the part of a member (row of collinear beams) between two joints. It is assumed to be pinned at both ends.
    The Euler load of a prismatic span is pi^2 EI/l^2. For all other spans, Ritz's method is used. Its result is
    accurate to round-off if the span is a single tapered beam, and to about 0.1 % if the span has beams with different
    sections.

    References
    ----------
    Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., section 2.1.
    """
    ndim = len(deflection.motion.columns)
    EI = per_row([section.EI for section in deflection.sections], ndim, float)
    factors = [_critical_factor(section) for section in deflection.sections]
    loads: PerBeam = per_row(factors, ndim, float) * EI / deflection.length**2
    for span in spans_of(deflection.motion.mechanism).runs:
        if len(span.beams) > 1:
            rows = [*span.beams]
            loads[rows] = _load_of_span(span, deflection.sections, deflection.length[rows].sum(0))
    return loads


def _load_of_span(span: BeamRun, sections: Sequence[Section], length: Reals) -> Reals:
    """Return the critical load of a span of several collinear beams, pinned at its ends [N], shape (..., 1)."""
    parts = zip(span.start, span.width, (sections[beam] for beam in span.beams), strict=True)
    return _critical_load((start, width, section.EI, section.taper) for start, width, section in parts) / length**2


def _critical_load(parts: Iterable[tuple[float, float, Any, Taper | None]]) -> Reals:
    """Return the critical load of a pinned column, multiplied by the square of its length [N m^2], shape (..., 1).

    Each part of the column is given by four values: its start and its width, both relative to the length of the column;
    EI at the start of the part; and its taper. Ritz's method minimises the ratio (integral of M'^2) / (integral of M^2
    / EI).
    """
    xi, weights = gauss_points(POINTS)
    flexibility: Any = 0.0
    for start, width, EI, taper in parts:
        falling = 1.0 if taper is None else np.polynomial.polynomial.polyval(xi, taper.EI)
        moment = _moments(2 * (start + width * xi) - 1)
        softness = np.abs(width) * weights / (EI * falling)
        flexibility = flexibility + (moment * softness[..., None, :]) @ moment.swapaxes(-1, -2)
    with np.errstate(divide="ignore"):
        return 1.0 / np.linalg.eigvalsh(flexibility)[..., -1:]


def _moments(place: Reals) -> Reals:
    """Evaluate polynomials M_k for the moment of a pinned column at points from -1 to 1, shape (..., TERMS, points).

    The M_k are integrals of Legendre polynomials. They are scaled so that the integrals of M_j' M_k' over a column of
    unit length form the identity matrix.
    """
    legendre = np.moveaxis(np.polynomial.legendre.legvander(place, TERMS + 1), -1, -2)
    scale = 2 * np.sqrt(2 * np.arange(1, TERMS + 1) + 1)
    return (legendre[..., 2:, :] - legendre[..., :-2, :]) / scale[:, None]


@lru_cache(maxsize=256)
def _critical_factor(section: Section) -> float:
    """Return the critical load of a pinned beam, multiplied by length^2 and divided by EI at the start.

    Without a taper, the result is pi^2.
    """
    return np.pi**2 if section.taper is None else float(_critical_load([(0.0, 1.0, 1.0, section.taper)])[0])


def euler_ratio(deflection: Deflection) -> PerBeam:
    """Return the largest compression along the span that contains each beam, divided by the Euler load of the span.

    For spans see `euler_loads`. The largest compression is assumed to act over the whole span, which is conservative.
    Both ends of the span are assumed to be fixed laterally and free to rotate. This second assumption is not
    conservative for a cantilever: its critical load is only a quarter of the Euler load.

    Returns
    -------
    Array of shape (beams, ..., positions). The ratio is 0 in tension and for beams that cannot bend. A pinned span with
    a ratio of 1 or more buckles.
    """
    return compressions(deflection) / euler_loads(deflection)


def compressions(deflection: Deflection) -> PerBeam:
    """Return the largest compression along the span that contains each beam [N], shape (beams, ..., positions)."""
    spans = spans_of(deflection.motion.mechanism)
    return spans.greatest(np.maximum(-least_axial_force(deflection), 0.0))


def least_shear_rigidity(section: Section) -> float | Reals:
    """Return the smallest kGA along a beam [N]."""
    if section.taper is None:
        return section.kGA
    xi = np.linspace(0.0, 1.0, POINTS + 1)
    return section.kGA * np.polynomial.polynomial.polyval(xi, section.taper.kGA).min()


def slenderness(deflection: Deflection) -> PerBeam:
    """Return the slenderness ratio l sqrt(EA/EI) of each beam, shape (beams, ..., 1).

    l is the length of the member that contains the beam. For a tapered beam, the result is the smallest slenderness
    ratio along the beam. For a beam that cannot stretch, the result is nan.
    """
    ndim = len(deflection.motion.columns)
    EA, EI = (
        per_row([getattr(section, name) for section in deflection.sections], ndim, float) for name in ("EA", "EI")
    )
    least_factor = per_row([_least_taper_ratio(section) for section in deflection.sections], ndim, float)
    with np.errstate(invalid="ignore"):
        ratio = EA / EI
    return np.where(np.isfinite(EA), member_lengths(deflection) * np.sqrt(ratio * least_factor), np.nan)


def member_lengths(deflection: Deflection) -> PerBeam:
    """Return the length of the member (row of collinear beams) that contains each beam [m], shape (beams, ..., 1)."""
    length = np.array(deflection.length)
    for run in members_of(deflection.motion.mechanism).runs:
        length[[*run.beams]] = deflection.length[[*run.beams]].sum(0)
    return length


def _least_taper_ratio(section: Section) -> float:
    """Return the smallest EA/EI along a beam, relative to EA/EI at the start."""
    if section.taper is None:
        return 1.0
    xi = np.linspace(0.0, 1.0, POINTS + 1)
    EA, EI = (np.polynomial.polynomial.polyval(xi, values) for values in (section.taper.EA, section.taper.EI))
    return float((EA / EI).min())
