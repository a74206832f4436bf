"""Array types for quantities on beams.

The name of a type describes the axes. In shapes, `...` stands for the axis of designs. This axis exists only if there
are several designs.
"""

from rigid.arrays import Complexes, Reals

VectorCoefficients = Complexes
"""Polynomials with vector coefficients (complex numbers), with the shape of `Coefficients`."""

Coefficients = Reals
"""Polynomials in ascending powers of xi, shape (n, beams, ..., positions) or (n, pieces, ..., positions)."""

PerBeam = Reals
"""One number per beam, shape (beams, ..., positions), or (beams, ..., 1) if it is the same at all positions."""

VectorPerBeam = Complexes
"""One vector (complex number) per beam, with the shape of `PerBeam`."""

AtStations = Reals
"""Values along the beams, shape (beams, ..., positions, stations)."""

Matrices = Reals
"""Matrices, shape (..., rows, columns)."""
