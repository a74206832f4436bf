"""Stress ranges of the beams, and safety factors against yield."""

from collections.abc import Sequence

import numpy as np

from elastic.arrays import AtStations
from elastic.beams.section import Section
from elastic.fields import FIELDS
from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals
from rigid.arrays import ArrayLike
from rigid.constants import per_row


def stress_range(deflection: Deflection, stations: int | ArrayLike) -> Reals:
    """Return the range (largest minus smallest) of the normal stress over the positions [Pa].

    Singular positions are ignored. The range is nan if all positions are singular.

    Returns
    -------
    Array of shape (2, beams, ..., stations). Index 0 of the first axis is the left fibre, and index 1 the right fibre.
    """
    least, most = stress_ends(deflection, stations)
    return np.where(least <= most, most - least, np.nan)


def stress_ends(deflection: Deflection, stations: ArrayLike) -> tuple[AtStations, AtStations]:
    """Return the smallest and largest normal stress over the positions [Pa].

    Singular positions are ignored. The result is (inf, -inf) if all positions are singular.

    Returns
    -------
    Two arrays of shape (2, beams, ..., stations). Index 0 of the first axis is the left fibre, and index 1 the right
    fibre.
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


def safety_factor(sections: Sequence[Section], stress: AtStations) -> Reals:
    """Return the safety factor against yield, shape (beams, ..., positions).

    The safety factor is the yield stress divided by the von Mises stress.

    The factor is infinite if the stress is zero, and nan if the stress or the yield stress is unknown.

    Parameters
    ----------
    sections
        Sections of the beams.
    stress
        Largest von Mises stress along each beam [Pa], shape (beams, ..., positions).
    """
    limit = per_row([section.yield_stress for section in sections], stress.ndim - 1, float)
    with np.errstate(divide="ignore"):
        factor: Reals = limit / np.abs(stress)
    return factor


def web_stress(deflection: Deflection, stations: int | ArrayLike) -> Reals:
    """Return the largest von Mises stress at the ends of the web of each beam over the positions [Pa], shape (beams,).

    It is 0 for a section without a web, and for a tapered beam. At the end of a web of constant thickness, at the
    distance y from the axis, the normal stress is |N|/A + |M| y/I, and the shear stress is the peak V f/A at the axis
    minus V y^2/(2 I).

    References
    ----------
    Timoshenko, Strength of Materials, Part I, 3rd ed., section 27: shearing stresses in I-beams.
    """
    sections, stresses = deflection.sections, np.zeros(len(deflection.sections))
    webbed = [number for number, section in enumerate(sections) if np.any(section.web_end)]
    if not webbed:
        return stresses
    N, V, M = (np.abs(sample(deflection, field, stations)[webbed]) for field in ("N", "V", "M"))
    area, inertia, peak_shear, place = (
        np.array([float(np.ravel(getattr(sections[number], name))[0]) for number in webbed])[:, None, None]
        for name in ("area", "inertia", "peak_shear", "web_end")
    )
    normal = N / area + M * place / inertia
    shear = V * np.maximum(peak_shear / area - place**2 / (2.0 * inertia), 0.0)
    stresses[webbed] = np.nan_to_num(np.sqrt(normal**2 + 3.0 * shear**2)).max(axis=(1, 2))
    return stresses
