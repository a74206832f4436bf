"""Fatigue strength: material data, factors for a part's surface, size and reliability, and effect of mean stress."""

from typing import Any

import numpy as np
from msgspec import Struct

from machine.ranges import Range
from rigid.arrays import Real, Reals

GOODMAN, GERBER, SODERBERG = "goodman", "gerber", "soderberg"
SURFACES = {
    "polished": (1.0, 0.0),
    "ground": (1.58, -0.085),
    "machined": (4.51, -0.265),
    "hot-rolled": (57.7, -0.718),
    "as-forged": (272.0, -0.995),
}
"""Coefficients (a, b) of Marin's surface factor of steel, k_a = a (S_ut / MPa)^b."""
# [mm] smallest diameter for the size factor, and largest diameter for the first of its two formulas
MIN_SIZE, MIDDLE_SIZE = 2.79, 51.0
RELATIVE_SPREAD = 0.08  # (standard deviation) / (mean) of endurance limits
SHIGLEY = "Shigley's Mechanical Engineering Design, 9th ed. 2011"
SURFACE_RANGE = Range(
    "surface factor", "modulus in GPa", f"{SHIGLEY}, table 6-2: steel", 190.0, 220.0, "give the factor as a number"
)
"""Young's modulus for which the surface factors (of steel) apply."""
SIZE_RANGE = Range(
    "size factor", "diameter in mm", f"{SHIGLEY}, equation (6-20)", most=254.0, outside="give the factor"
)
"""Diameter for which the size factor applies."""
CYCLES_RANGE = Range(
    "S-N line", "number of runs", "FKM guideline, 6th ed. 2012, section 2.4: 10^4 cycles or more", least=1e4,
    outside="low-cycle fatigue: the life must be computed from strains",
)  # fmt: skip
"""Number of cycles for which the S-N line applies."""
YIELD_RANGE = Range(
    "S-N line", "yield stress over stress", "FKM guideline, 6th ed. 2012, section 0.0: elastic stresses", least=1.0,
    outside="the link yields in the first cycle, and the formula no longer holds",
)  # fmt: skip
"""Yield stress / stress for which the S-N line applies."""


class FatigueStrength(Struct, frozen=True, eq=False):
    """Fatigue strength of a beam. All values have shape () or (designs, 1).

    Attributes
    ----------
    ultimate, yield_stress
        Tensile and yield strength [Pa]; nan if unknown.
    endurance
        Amplitude of fully reversed stress at the knee of the S-N line, including the factors of the part [Pa].
    slope, knee
        Exponent k and number of cycles N_D of the S-N line N = N_D (endurance / amplitude)^k.
    second_knee, second_slope
        A second S-N line can follow after the knee. `second_knee` is the number of cycles at the end of the second
        line, or nan without a second line. `second_slope` is the exponent of the second line. Values for aluminium and
        austenitic steel: 10^8 and 15.

    References
    ----------
    FKM guideline, Analytical Strength Assessment, 6th ed. 2012, section 2.4.3: type I (steel, cast iron) ends at the
    knee, type II (aluminium, austenitic steel) at the second knee. Range: `CYCLES_RANGE`, `YIELD_RANGE`.
    """

    ultimate: Real
    yield_stress: Real
    endurance: Real
    slope: Real
    knee: Real
    second_knee: Real = np.nan
    second_slope: Real = 15.0

    @property
    def limit(self) -> Reals:
        """Amplitude of fully reversed stress that the part withstands indefinitely [Pa]."""
        left = (self.knee / np.asarray(self.second_knee)) ** (1.0 / np.asarray(self.second_slope))
        return np.asarray(self.endurance * np.where(np.isnan(left), 1.0, left))

    def cycles(self, amplitude: Any, below: bool = False) -> Reals:
        """Return the life in cycles for an amplitude of fully reversed stress [Pa]; infinite up to the endurance limit.

        Parameters
        ----------
        below
            True if amplitudes below the endurance limit also do damage, because the stress has other amplitudes above
            this limit. The second line is then extended to any number of cycles. Without a second line, the first line
            continues after the knee with the exponent 2 k - 1.

        References
        ----------
        Haibach, Betriebsfestigkeit, 3rd ed. 2006, section 3.2 (2 k - 1); FKM guideline, see `FatigueStrength`.
        """
        size = np.asarray(amplitude, float)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            ratio = self.endurance / size
            flat = np.where(np.isnan(self.second_knee), 2.0 * np.asarray(self.slope) - 1.0, self.second_slope)
            lines = self.knee * ratio ** np.where(ratio < 1.0, self.slope, flat)
            endless = (size <= self.limit) & (not below)
            return np.where(endless, np.inf, lines)

    def of_mean(self, criterion: str) -> Real:
        """Return the strength that limits the mean stress [Pa]: yield stress for Soderberg, else ultimate strength."""
        return self.yield_stress if criterion == SODERBERG else self.ultimate


def equivalent_amplitude(amplitude: Any, mean: Any, strength: FatigueStrength, criterion: str = GOODMAN) -> Reals:
    """Return the amplitude of fully reversed stress [Pa] that is as damaging as a given amplitude and mean stress.

    A compressive mean stress counts as zero. The result is infinite if the mean stress reaches the strength that
    `of_mean` returns.

    References
    ----------
    Budynas and Nisbett, Shigley's Mechanical Engineering Design, 9th ed. 2011, section 6-12. Range: stresses below the
    strength.
    """
    share = np.maximum(mean, 0.0) / strength.of_mean(criterion)
    left = 1.0 - (share**2 if criterion == GERBER else share)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(left > 0.0, amplitude / left, np.where(np.isnan(left), np.nan, np.inf))


def endurance_safety(amplitude: Any, mean: Any, strength: FatigueStrength, criterion: str = GOODMAN) -> Reals:
    """Return the factor by which amplitude and mean stress can be scaled together up to the endurance limit.

    The result is infinite if there is no stress. A compressive mean stress counts as zero.

    Parameters
    ----------
    amplitude, mean
        Amplitude and mean of the stress [Pa]. Their shapes must broadcast with the shape of the strength.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, table 6-7 (Gerber) and equations (6-41), (6-46) for the
    straight lines (Goodman, Soderberg). Range: peak stress below the yield stress.

    Examples
    --------
    An amplitude of 100 MPa with a mean of 100 MPa, for a steel with an endurance limit of 200 MPa and an ultimate
    strength of 400 MPa, gives 1/(100/200 + 100/400):

    >>> strength = FatigueStrength(400e6, 250e6, 200e6, 5.0, 1e6)
    >>> float(endurance_safety(100e6, 100e6, strength))
    1.3333333333333333
    """
    reversed_, steady = amplitude / strength.limit, np.maximum(mean, 0.0) / strength.of_mean(criterion)
    with np.errstate(divide="ignore", invalid="ignore"):
        if criterion != GERBER:
            return np.asarray(1.0 / (reversed_ + steady))
        root = np.sqrt(reversed_**2 + 4.0 * steady**2)
        return np.asarray(2.0 / (reversed_ + root))


def surface_factor(finish: str, ultimate: Any) -> Reals:
    """Return the surface factor on the endurance limit of a steel part, at most 1.

    Parameters
    ----------
    finish
        A key of `SURFACES`.
    ultimate
        Tensile strength [Pa].

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-19) and table 6-2. Range: `SURFACE_RANGE`.

    Examples
    --------
    Example 6-3 of Shigley:

    >>> round(float(surface_factor("machined", 520e6)), 3)
    0.86
    """
    a, b = SURFACES[finish]
    return np.minimum(a * (np.asarray(ultimate) / 1e6) ** b, 1.0)


def size_factor(diameter: Any) -> Reals:
    """Return the factor on the endurance limit due to the diameter [m] of a rotating bar in bending, at most 1.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-20). Range: `SIZE_RANGE`; nan outside.
    """
    size = np.maximum(1e3 * np.asarray(diameter), MIN_SIZE)
    factor = np.where(size <= MIDDLE_SIZE, (size / 7.62) ** -0.107, 1.51 * size**-0.157)
    return np.where(SIZE_RANGE.holds(size), np.minimum(factor, 1.0), np.nan)


def effective_diameter(depth: Any, width: Any, rounded: bool) -> Reals:
    """Return the diameter [m] of the rotating round bar that is equivalent to a section in bending.

    Bar and section are equivalent if the areas with more than 95 % of the largest stress are equal.

    Parameters
    ----------
    depth, width
        Dimensions of the section in and across the plane of bending [m]. The width of a round section is ignored.
    rounded
        True for a round section; False for a rectangle, box or I section.

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, table 6-3 and equations (6-24), (6-25).
    """
    return np.asarray(0.370 * np.asarray(depth) if rounded else 0.808 * np.sqrt(np.asarray(depth) * width))


def reliability_factor(reliability: float) -> float:
    """Return (endurance limit that a fraction `reliability` of all parts reaches) / (mean endurance limit).

    References
    ----------
    Shigley's Mechanical Engineering Design, 9th ed. 2011, equation (6-29) and table 6-5: normal distribution, 0.5 to
    0.999999.

    Examples
    --------
    >>> round(reliability_factor(0.99), 3)
    0.814
    """
    from statistics import NormalDist  # imported here, because this module is slow to load and rarely needed

    return 1.0 - RELATIVE_SPREAD * NormalDist().inv_cdf(reliability)
