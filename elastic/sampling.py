"""Numbers out of the polynomials: fields at stations, deflection from the chord, displacement of a point."""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic.beams.line import tapered_powers
from elastic.deflection import FIELDS, Deflection
from rigid import Reals


def sample(deflection: Deflection, field: str, stations: Any) -> Any:
    """A field at stations along every beam.

    Parameters
    ----------
    field
        "N", "V", "M", "u", "w", "phi", "chord", "qx" or "qy".
    stations
        xi = x'/l from 0 to 1, shape (stations,).

    Raises
    ------
    ValueError
        There is no such field; a station is not on the beam.

    Returns
    -------
    Shape (beams, ..., positions, stations), units of the field.
    """
    xi = np.asarray(stations, float)
    if xi.size and not (xi.min() >= 0.0 and xi.max() <= 1.0):
        raise ValueError(f"stations from {xi.min():g} to {xi.max():g}, expected from 0 to 1, shares of the length")
    if field == "chord":
        ends = sample(deflection, "w", [0.0, 1.0])
        return sample(deflection, "w", xi) - ends[..., :1] * (1 - xi) - ends[..., 1:] * xi
    values = coefficients(deflection, field)
    powers = np.power.outer(xi, np.arange(len(values)))
    flat = (powers @ values.reshape(len(values), -1)).reshape(len(xi), *values.shape[1:])
    for number, section in enumerate(deflection.sections):
        if section.taper and field in ("u", "w", "phi"):
            flat[:, number] = _tapered(deflection, field, number, xi)
    result = np.moveaxis(flat, 0, -1)
    for contact in deflection.contacts if field in ("N", "V", "M", "u", "w", "phi") else ():
        way = xi - contact.xi[..., None]
        more = sum(np.asarray(part)[..., None] * way**k for k, part in enumerate(deflection.beyond(contact, field)))
        result[contact.beam] += np.where(way > 0, more, 0.0 * way)
    return result


def _tapered(deflection: Deflection, field: str, number: int, xi: Any) -> Any:
    """u, w or phi of a tapered beam, shape (stations, ..., positions)."""
    section = deflection.sections[number]
    stretch, turn, sag, slide = tapered_powers(section, xi)
    values = coefficients(deflection, field)[:, number]

    def times(powers: Any, parts: Any) -> Any:
        return np.tensordot(powers[: len(parts)].T, parts, 1)

    if field == "u":
        free = np.multiply.outer(xi, np.broadcast_to(section.strain * deflection.length[number], values.shape[1:]))
        return values[0] + times(stretch, values[1:]) + free
    if field == "phi":
        return values[0] + times(turn, values[1:])
    sheared = 0.0 if deflection.shear is None else times(slide, deflection.shear[:, number])
    return values[0] + np.multiply.outer(xi, values[1]) + times(sag, values[2:]) + sheared


def coefficients(deflection: Deflection, field: str) -> Reals:
    """Coefficients of a field in powers of xi, shape (coefficients, beams, ..., positions).

    Before the first contact of a slider with the beam; u, w, phi of tapered beams have other functions in place of the
    powers (`sample` knows them).
    """
    if field in ("qx", "qy"):
        return np.ascontiguousarray(deflection.q.real if field == "qx" else deflection.q.imag)
    if field not in FIELDS:
        raise ValueError(f'there is no field "{field}": choose from {", ".join((*FIELDS, "chord", "qx", "qy"))}')
    values: Reals = getattr(deflection, field)
    return values


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
            along = motion.direction[at] * (way / np.abs(way))
            if point == beam.start:
                return along * (deflection.u[0, number] + 1j * deflection.w[0, number])
            u, w = (sample(deflection, field, [1.0])[number, ..., 0] for field in ("u", "w"))
            return along * (u + 1j * w)
    return deflection.shift[at] + 1j * deflection.angle[at] * motion.direction[at] * body.points[point]
