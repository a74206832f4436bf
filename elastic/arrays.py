"""Types of arrays over beams, by their axes; `...` stands for the designs, where there are several."""

from rigid.arrays import Complexes, Reals

VectorCoefficients = Complexes
"""Polynomials with vectors for coefficients, of the same shape as `Coefficients`."""

Coefficients = Reals
"""Polynomials in powers of xi, shape (n, beams, ..., positions), or of pieces of beams in the place of these."""

PerBeam = Reals
"""A number of every beam, shape (beams, ..., positions), or (beams, ..., 1) where it is the same at all positions."""

VectorPerBeam = Complexes
"""A vector of every beam, of the same shape."""

AtStations = Reals
"""Values along the beams, shape (beams, ..., positions, stations)."""

Matrices = Reals
"""Matrices, shape (..., rows, columns)."""
