"""Excitation by the cycle: the harmonics of the quasi-static bending."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals
from rigid.arrays import Integers

POINTS = 6  # Gauss points along a beam: the square of the bending moment of a linear load is of the sixth degree
HELD = 0.05  # share of the strain energy's root from which a harmonic is strong


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Parts of the bending of all beams by their frequency.

    Attributes
    ----------
    omega
        0, 1, 2, ... times the cycle's angular frequency [rad/s], shape (harmonics,).
    share
        Root of the strain energy that each holds, of that of the whole cycle: the squares add up to 1.
    """

    omega: Reals
    share: Reals

    def strong(self, share: float = HELD) -> Integers:
        """Numbers of the harmonics, but the mean, that hold more than a share."""
        return 1 + np.flatnonzero(self.share[1:] > share)


def harmonics(deflection: Deflection, period: float) -> Harmonics:
    """Harmonics of the loads, measured by the bending that they cause.

    Bending moments weighed with 1/EI, because they hold what every load does: inertia, lumps and joints.

    Parameters
    ----------
    deflection
        One design, at equal steps of time over one cycle, the end left out.
    period
        Duration of the cycle [s].

    Returns
    -------
    Up to half the number of positions; shares nan where a position is singular, or nothing bends.
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
    return Harmonics(np.arange(float(len(share))) * (2 * np.pi / period), share)


@cache
def _quadrature() -> tuple[Reals, Reals]:
    """Gauss' stations on [0, 1] and twice their weights."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    return (nodes + 1) / 2, weights
