"""Array types for values on beams, named by their axes; `...` is the axis of designs, if there are several."""

from rigid.arrays import Complexes, Reals

VectorCoefficients = Complexes
"""Polynomials with vector coefficients, same shape as `Coefficients`."""

Coefficients = Reals
"""Polynomials in powers of xi, shape (n, beams, ..., positions), or (n, pieces, ..., positions)."""

PerBeam = Reals
"""One number per beam, shape (beams, ..., positions), or (beams, ..., 1) if equal at all positions."""

VectorPerBeam = Complexes
"""One vector per beam, same shape as `PerBeam`."""

AtStations = Reals
"""Values along the beams, shape (beams, ..., positions, stations)."""

Matrices = Reals
"""Matrices, shape (..., rows, columns)."""
