"""Strength of a material in fatigue, the factors of a part that lower it, and the mean stress's share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Real, Reals

GOODMAN, GERBER, SODERBERG = CRITERIA = ("goodman", "gerber", "soderberg")
SURFACES = {  # of steel: a and b of k_a = a (S_ut / MPa)^b
    "polished": (1.0, 0.0),
    "ground": (1.58, -0.085),
    "machined": (4.51, -0.265),
    "hot-rolled": (57.7, -0.718),
    "as-forged": (272.0, -0.995),
}
"""Marin's factor of a steel's surface, k_a = a (S_ut / MPa)^b: a and b."""
LEAST_SIZE, MIDDLE_SIZE, LARGEST_SIZE = 2.79e-3, 51e-3, 254e-3  # [m] between which the size factor is known
SPREAD = 0.08  # standard deviation of endurance limits over their mean


@dataclass(frozen=True, eq=False)
class FatigueStrength:
    """Strength of a beam in fatigue; shapes () or (designs, 1).

    Attributes
    ----------
    ultimate, yield_stress
        Tensile and yield strength [Pa]; nan where not known.
    endurance
        Amplitude of fully reversed stress that the part bears for ever, its factors in it [Pa].
    slope, knee
        k and N_D of the S-N line N = N_D (endurance / amplitude)^k, which ends in the endurance limit at N_D cycles.
    """

    ultimate: Real
    yield_stress: Real
    endurance: Real
    slope: Real
    knee: Real

    def cycles(self, amplitude: Any, below: bool = False) -> Reals:
        """Cycles that a fully reversed stress amplitude [Pa] is borne for, infinite up to the endurance limit.

        Parameters
        ----------
        below
            Whether amplitudes up to the limit damage too, by the slope 2 k - 1: in a spectrum of which others are
            above it.

        References
        ----------
        Haibach, Betriebsfestigkeit, 3rd ed. 2006, section 3.2 (2 k - 1).
        """
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            ratio = self.endurance / np.asarray(amplitude, float)
            above: Reals = self.knee * ratio**self.slope
            beyond = self.knee * ratio ** (2.0 * self.slope - 1.0) if below else np.inf
            return np.where(ratio < 1.0, above, np.where(np.isnan(ratio), np.nan, beyond))

    def of_mean(self, criterion: str) -> Real:
        """Strength that a steady stress is held against [Pa]: yield of Soderberg's line, else the ultimate."""
        return self.yield_stress if criterion == SODERBERG else self.ultimate


def equivalent_amplitude(amplitude: Any, mean: Any, strength: FatigueStrength, criterion: str = GOODMAN) -> Reals:
    """Amplitude of fully reversed stress that does the same damage as an amplitude about a mean stress [Pa].

    A mean that presses counts as none. Infinite from the strength on.

    References
    ----------
    Budynas and Nisbett, Shigley's Mechanical Engineering Design, 9th ed. 2011, section 6-12.
    """
    share = np.maximum(mean, 0.0) / strength.of_mean(criterion)
    left = 1.0 - (share**2 if criterion == GERBER else share)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(left > 0.0, amplitude / left, np.where(np.isnan(left), np.nan, np.inf))


def endurance_safety(amplitude: Any, mean: Any, strength: FatigueStrength, criterion: str = GOODMAN) -> Reals:
    """Factor by which amplitude and mean may both grow until the endurance limit is reached.

    Infinite without stress. A mean that presses counts as none.

    Parameters
    ----------
    amplitude, mean
        Of the stress [Pa], shapes that broadcast with the strength's.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, table 6-7 (Gerber) and equations (6-41), (6-46) for the
    straight lines.

    Examples
    --------
    An amplitude of 100 MPa about 100 MPa, of a steel of 200 and 400 MPa: 1/(100/200 + 100/400).

    >>> strength = FatigueStrength(400e6, 250e6, 200e6, 5.0, 1e6)
    >>> float(endurance_safety(100e6, 100e6, strength))
    1.3333333333333333
    """
    reversed_, steady = amplitude / strength.endurance, np.maximum(mean, 0.0) / strength.of_mean(criterion)
    with np.errstate(divide="ignore", invalid="ignore"):
        if criterion != GERBER:
            return np.asarray(1.0 / (reversed_ + steady))
        root = np.sqrt(reversed_**2 + 4.0 * steady**2)
        return np.asarray(2.0 / (reversed_ + root))


def surface_factor(finish: str, ultimate: Any) -> Reals:
    """Factor of the endurance limit by the surface of a steel part, at most 1.

    Parameters
    ----------
    finish
        A key of `SURFACES`.
    ultimate
        Tensile strength [Pa].

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-19) and table 6-2.

    Examples
    --------
    Its example 6-3:

    >>> round(float(surface_factor("machined", 520e6)), 3)
    0.86
    """
    a, b = SURFACES[finish]
    return np.minimum(a * (np.asarray(ultimate) / 1e6) ** b, 1.0)


def size_factor(diameter: Any) -> Reals:
    """Factor of the endurance limit by size, of a rotating round bar in bending of that diameter [m], at most 1.

    Beyond 254 mm, to where it was measured, that of 254 mm.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-20).
    """
    size = 1e3 * np.clip(diameter, LEAST_SIZE, LARGEST_SIZE)
    factor = np.where(size <= 1e3 * MIDDLE_SIZE, (size / 7.62) ** -0.107, 1.51 * size**-0.157)
    return np.asarray(np.minimum(factor, 1.0))


def effective_diameter(depth: Any, width: Any, rounded: bool) -> Reals:
    """Diameter of a rotating round bar that has as much area at 95 % of the greatest stress, of one that does not turn.

    Parameters
    ----------
    depth, width
        In and across the plane of bending [m]; a round section's width does not matter.
    rounded
        Whether the section is round, and not a rectangle, box or I in bending by its flanges.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, table 6-3 and equations (6-24), (6-25).
    """
    return np.asarray(0.370 * np.asarray(depth) if rounded else 0.808 * np.sqrt(np.asarray(depth) * width))


def reliability_factor(reliability: float) -> float:
    """Factor of the mean endurance limit to that which a share of all parts has, 1 of half of them.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-29) and table 6-5.

    Examples
    --------
    >>> round(reliability_factor(0.99), 3)
    0.814
    """
    from statistics import NormalDist  # slow to load, and asked by few

    return 1.0 - SPREAD * NormalDist().inv_cdf(reliability)
