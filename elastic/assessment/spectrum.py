"""Harmonics of the quasi-static section forces over the cycle, which measure the excitation."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache

import numpy as np

from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals
from rigid.arrays import Integers

POINTS = 6  # number of Gauss points along a beam; exact for the square of the bending moment under a linear load
COMPLIANCES = {"M": "bend", "N": "stretch", "V": "shear"}  # compliance in the strain energy of each section force
MIN_HARMONIC = 0.05  # harmonics with a larger `share` are strong


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics of the section forces of all beams.

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


def harmonics(deflection: Deflection, period: float, forces: Collection[str] = ("M",)) -> Harmonics:
    """Compute the harmonics of the loads, measured by the strain energy that they cause.

    Section forces, each weighted by its compliance, are used, because they include the effects of all loads.

    Parameters
    ----------
    deflection
        Deflection of one design at equal time steps over one cycle, without the end point.
    period
        Duration of the cycle [s].
    forces
        Section forces: "M", "N" and "V".

    Returns
    -------
    Harmonics up to half the number of positions; they are nan if a position is singular or no beam is strained.
    """
    columns = deflection.motion.columns
    if len(columns) != 1:
        raise ValueError(f"columns of shape {columns}: expected one design")
    count = columns[0]
    xi, weights = _quadrature()
    twice = np.full(count // 2 + 1, 2.0)
    twice[0] = 1.0
    if count % 2 == 0:
        twice[-1] = 1.0
    energy, course = np.zeros(len(twice)), np.zeros(count)  # of each harmonic, and at each position
    for name in forces:
        force = sample(deflection, name, xi)
        per_length = (deflection.length * getattr(deflection.compliance, COMPLIANCES[name]))[:, 0]
        spectrum = np.square(np.abs(np.fft.rfft(force, axis=1)) / count)
        energy += np.einsum("bks,s,b->k", spectrum, weights, per_length) * twice
        course += np.einsum("bks,s,b->k", np.square(force), weights, per_length)
    with np.errstate(invalid="ignore", divide="ignore"):
        share, crest = np.sqrt(energy / energy.sum()), np.sqrt(course.max() / energy.sum())
    return Harmonics(np.arange(float(len(share))) * (2 * np.pi / period), share, float(crest))


@cache
def _quadrature() -> tuple[Reals, Reals]:
    """Return Gauss points on [0, 1] and weights that sum to 2; the common factor cancels in all results."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    return (nodes + 1) / 2, weights
