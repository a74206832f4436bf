"""Fields of a deflection at Gauss points, which are smooth over the positions."""

from typing import Any

import numpy as np
from numpy.polynomial import legendre

from elastic.beams.polynomials import evaluate, gauss_points
from elastic.sampling import sample
from elastic.solution import Deflection
from rigid.arrays import Reals


def along_beams(bent: Deflection, field: str, xi: Reals) -> Reals:
    """Evaluate a field at Gauss points, shape (..., positions, beams, points).

    A field has a kink or a jump under a block, which would pass from one point to the next as the block moves. On such
    beams, the values are those of the polynomial of best approximation in the mean, which has the same integrals with
    all shapes of the beam.
    """
    values = np.moveaxis(sample(bent, field, xi), 0, -2)
    division = bent.division
    for beam in {block.beam for block in bent.blocks}:
        rows = division.of_beam(beam)
        parts = getattr(bent, field)[:, rows]
        values[..., beam, :] = _nearest(parts, division.start[rows], division.width[rows], xi)
    return values


def _nearest(parts: Reals, start: Reals, width: Any, xi: Any) -> Reals:
    """Evaluate at xi the polynomial of best approximation to a piecewise polynomial, shape (..., positions, points)."""
    order = len(xi) - 1
    points = gauss_points((len(parts) + order) // 2 + 1)
    nodes, weights = (part.reshape(-1, *(1,) * np.ndim(width)) for part in points)
    places = start + width * nodes
    heights = evaluate(parts, np.broadcast_to(nodes, places.shape)) if len(parts) > 1 else parts[0] + 0 * places
    basis = legendre.legvander(2 * places - 1, order)
    series = np.einsum("gr...,gr...k->...k", heights * weights * width, basis) * (2 * np.arange(order + 1) + 1)
    return series @ legendre.legvander(2 * np.asarray(xi) - 1, order).T
