"""Harmonics of the quasi-static bending over the cycle, which measure the excitation."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals
from rigid.arrays import Integers

POINTS = 6  # number of Gauss points along a beam; exact for the square of the bending moment under a linear load
MIN_HARMONIC = 0.05  # harmonics with a larger `share` are strong


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics of the bending of all beams.

    Attributes
    ----------
    omega
        Multiples 0, 1, 2, ... of the angular frequency of the cycle [rad/s], shape (harmonics,).
    share
        Square root of the share of each harmonic in the strain energy of the cycle. The squares add up to 1.
    crest
        Square root of (largest / mean strain energy over the cycle).
    """

    omega: Reals
    share: Reals
    crest: float

    def strong(self, share: float = MIN_HARMONIC) -> Integers:
        """Return the indices of the harmonics above a share, excluding the mean."""
        return 1 + np.flatnonzero(self.share[1:] > share)


def harmonics(deflection: Deflection, period: float) -> Harmonics:
    """Compute the harmonics of the loads, measured by the bending that they cause.

    Bending moments weighted by 1/EI are used, because they include the effects of all loads.

    Parameters
    ----------
    deflection
        Deflection of one design at equal time steps over one cycle, without the end point.
    period
        Duration of the cycle [s].

    Returns
    -------
    Harmonics up to half the number of positions; they are nan if a position is singular or no beam bends.
    """
    columns = deflection.motion.columns
    if len(columns) != 1:
        raise ValueError(f"columns of shape {columns}: expected one design")
    count = columns[0]
    xi, weights = _quadrature()
    moment = sample(deflection, "M", xi)
    spectrum = np.abs(np.fft.rfft(moment, axis=1)) / count
    twice = np.full(spectrum.shape[1], 2.0)
    twice[0] = 1.0
    if count % 2 == 0:
        twice[-1] = 1.0
    per_length = deflection.length * deflection.compliance.bend
    energy = np.einsum("bks,s,b->k", np.square(spectrum), weights, per_length[:, 0]) * twice
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.sqrt(energy / energy.sum())
        crest = np.sqrt(np.einsum("bks,s,b->k", np.square(moment), weights, per_length[:, 0]).max() / energy.sum())
    return Harmonics(np.arange(float(len(share))) * (2 * np.pi / period), share, float(crest))


@cache
def _quadrature() -> tuple[Reals, Reals]:
    """Return Gauss points on [0, 1] and weights that sum to 2; the common factor cancels in all results."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    return (nodes + 1) / 2, weights
