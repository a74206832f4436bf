"""Numbers out of the polynomials: fields at stations, deflection from the chord, displacement of a point."""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic.deflection import Deflection
from rigid import Reals


def sample(deflection: Deflection, field: str, stations: Any) -> Reals:
    """A field at stations along every beam.

    Parameters
    ----------
    field
        "N", "V", "M", "u", "w", "phi", "chord", "qx" or "qy".
    stations
        xi = x'/l from 0 to 1, shape (stations,).

    Returns
    -------
    Shape (beams, ..., positions, stations), units of the field.
    """
    values = coefficients(deflection, field)
    powers = np.power.outer(np.asarray(stations, float), np.arange(len(values)))
    flat = powers @ values.reshape(len(values), -1)
    return np.moveaxis(flat.reshape(-1, *values.shape[1:]), 0, -1)


def coefficients(deflection: Deflection, field: str) -> Reals:
    """Coefficients of a field in powers of xi, shape (coefficients, beams, ..., positions)."""
    if field in ("qx", "qy"):
        return np.ascontiguousarray(deflection.q.real if field == "qx" else deflection.q.imag)
    if field == "chord":
        return chord_deflection(deflection)
    values: Reals = getattr(deflection, field)
    return values


def chord_deflection(deflection: Deflection) -> Reals:
    """Deflection of every beam from the line through its displaced ends, as `Deflection.w` [m]."""
    w = deflection.w.copy()
    w[1] = -w[2:].sum(0)
    w[0] = 0.0
    return w


def displacement_of(deflection: Deflection, link: str | int, point: str) -> Any:
    """Displacement of a link's point from its rigid place [m], complex, shape (..., positions).

    A point on no beam moves with the axes of its link.
    """
    motion = deflection.motion
    at = motion.mechanism.index[link] if isinstance(link, str) else link
    body = motion.mechanism.links[at]
    for number, (owner, beam) in enumerate(motion.mechanism.beams):
        if owner == at and point in (beam.start, beam.end):
            way = body.points[beam.end] - body.points[beam.start]
            along, across = deflection.u[:, number], deflection.w[:, number]
            at_start = point == beam.start
            own = along[0] + 1j * across[0] if at_start else along.sum(0) + 1j * across.sum(0)
            return motion.direction[at] * (way / np.abs(way)) * own
    return deflection.shift[at] + 1j * deflection.angle[at] * motion.direction[at] * body.points[point]
