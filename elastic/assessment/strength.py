"""Stress ranges of the beams, and safety factors against yield."""

import numpy as np

from elastic.arrays import AtStations
from elastic.extreme_values import Extreme, extremes
from elastic.fields import FIELDS
from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals
from rigid.arrays import ArrayLike
from rigid.constants import per_row


def stress_range(deflection: Deflection, stations: int | ArrayLike) -> Reals:
    """Return the range of the normal stress over the positions, largest minus smallest [Pa].

    Returns
    -------
    Array of shape (2, beams, ..., stations) for the left and right fibre. Singular positions are ignored.
    """
    least, most = stress_ends(deflection, stations)
    return np.where(least <= most, most - least, np.nan)


def stress_ends(deflection: Deflection, stations: ArrayLike) -> tuple[AtStations, AtStations]:
    """Return the smallest and largest normal stress over the positions [Pa], or (inf, -inf) if unknown.

    Returns
    -------
    Two arrays of shape (2, beams, ..., stations) for the left and right fibre. Singular positions are ignored.
    """
    known: dict[str, AtStations] = {}
    sides = [_ends(sample(deflection, side, stations, known)) for side in FIELDS["normal"].greatest_of]
    least, most = zip(*sides, strict=True)
    return np.array(least), np.array(most)


def _ends(values: AtStations) -> tuple[AtStations, AtStations]:
    least, most = values.min(axis=-2), values.max(axis=-2)
    if np.isfinite(most - least).all():
        return least, most
    known = np.isfinite(values)
    return np.where(known, values, np.inf).min(axis=-2), np.where(known, values, -np.inf).max(axis=-2)


def safety_factor(deflection: Deflection, mises: Extreme | None = None) -> Reals:
    """Return yield stress / largest von Mises stress along every beam, shape (beams, ..., positions).

    The factor is infinite without stress, and nan if the yield stress or the dimensions of the section are unknown.

    Parameters
    ----------
    mises
        Result of `extremes`, if already computed.
    """
    largest = (mises or extremes(deflection, ["mises"])["mises"]).value
    limit = per_row([section.yield_stress for section in deflection.sections], largest.ndim - 1, float)
    with np.errstate(divide="ignore"):
        factor: Reals = limit / largest
    return factor
