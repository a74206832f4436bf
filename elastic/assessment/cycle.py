"""Largest and rms values over a cycle, period of the cycle, and harmonics of the loads."""

from collections.abc import Collection

import numpy as np
from msgspec import Struct

from elastic.beams.polynomials import gauss_points
from elastic.extreme_values import Extreme
from elastic.largest import Largest, largest
from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Motion, Reals
from rigid.arrays import ArrayLike, Integers

STEP_TOLERANCE = 1e-9  # two steps or speeds count as equal if their relative difference is at most this
POINTS = 6  # number of Gauss points along a beam; exact for M^2 under a linearly varying load
# attribute of `BeamCompliance` for each section force
COMPLIANCES = {"M": "bend", "N": "stretch", "V": "shear"}
MIN_HARMONIC = 0.05  # a harmonic is called strong if its `Harmonics.share` exceeds this


def over_cycle(values: Extreme | ArrayLike) -> Largest:
    """Return the value with the largest magnitude over the last axis (positions). Singular positions are ignored.

    Parameters
    ----------
    values
        Array of shape (..., positions), or an `Extreme` of this shape.

    Examples
    --------
    >>> float(over_cycle([1.0, -3.0, 2.0]).value)
    -3.0
    """
    return largest(values.value, xi=values.xi) if isinstance(values, Extreme) else largest(values)


def rms(values: ArrayLike) -> Reals:
    """Return the root mean square over the last axis (positions). Singular positions are ignored."""
    square = np.square(np.abs(np.asarray(values)))
    known = ~np.isnan(square)
    count = known.sum(axis=-1)
    mean = np.where(known, square, 0.0).sum(axis=-1) / np.maximum(count, 1)
    return np.where(count > 0, np.sqrt(mean), np.nan)


def period_of(motion: Motion) -> float:
    """Return the period of a motion [s]: the duration of one revolution at constant speed in equal steps.

    The last position must be one step before the end of the revolution. If there are several drives, each must make a
    whole number of revolutions, and the slowest one exactly one. The result is nan if the motion does not meet these
    conditions.
    """
    rate = motion.drive_rate
    if not len(rate) or rate.shape[-1] < 3 or not all(drive.turns for drive in motion.mechanism.drives):
        return float("nan")
    step = np.diff(motion.drive, axis=-1)
    travel = step[:, :1] * motion.drive.shape[-1]
    turns = np.round(travel / (2 * np.pi))
    even = np.ptp(step, axis=-1) <= STEP_TOLERANCE * np.abs(travel[:, 0])
    steady = np.ptp(rate, axis=-1) <= STEP_TOLERANCE * np.abs(rate[:, 0])
    once = np.abs(turns).min() == 1 and (np.abs(travel - 2 * np.pi * turns) <= STEP_TOLERANCE * np.abs(travel)).all()
    if not (even.all() and steady.all() and once and rate.any()):
        return float("nan")
    periods = travel[:, 0] / rate[:, 0]
    if np.ptp(periods) > STEP_TOLERANCE * abs(periods[0]):
        return float("nan")
    return float(abs(periods[0]))


class Harmonics(Struct, frozen=True, eq=False):
    """Harmonics of the section forces of all beams.

    Attributes
    ----------
    omega
        Angular frequencies of the harmonics 0, 1, 2, ... of the cycle [rad/s], shape (harmonics,).
    share
        Square root of a ratio: the mean strain energy of each harmonic, relative to the sum of the mean strain energies
        of all harmonics. Shape (harmonics,). The squares of the shares add up to 1.
    crest
        Square root of the ratio of the largest to the mean strain energy in the cycle.
    """

    omega: Reals
    share: Reals
    crest: float

    def strong(self, share: float = MIN_HARMONIC) -> Integers:
        """Return the numbers (from 1) of the harmonics with a `share` above the given value."""
        return 1 + np.flatnonzero(self.share[1:] > share)


def harmonics(deflection: Deflection, period: float, forces: Collection[str] = ("M",)) -> Harmonics:
    """Compute the harmonics of the loads, measured by the strain energy that they cause.

    The strain energy is computed from section forces, which include the effects of all loads.

    Parameters
    ----------
    deflection
        Deflection of one design at equal time steps over one cycle. The last position is one step before the end.
    period
        Duration of the cycle [s].
    forces
        Section forces that are included: "M", "N", "V".

    Returns
    -------
    Harmonics with numbers up to half of the number of positions. `share` and `crest` are nan if a position is singular,
    or if no beam is strained.

    Raises
    ------
    ValueError
        If there are several designs.
    """
    columns = deflection.motion.columns
    if len(columns) != 1:
        raise ValueError(f"the deflection has several designs (shape {columns}): expected one")
    count = columns[0]
    xi, weights = gauss_points(POINTS)
    twice = np.full(count // 2 + 1, 2.0)
    twice[0] = 1.0
    if count % 2 == 0:
        twice[-1] = 1.0
    energy, course = np.zeros(len(twice)), np.zeros(count)  # strain energy by harmonic, and by position
    for name in forces:
        force = sample(deflection, name, xi)
        per_length = (deflection.length * getattr(deflection.compliance, COMPLIANCES[name]))[:, 0]
        spectrum = np.square(np.abs(np.fft.rfft(force, axis=1)) / count)
        energy += np.einsum("bks,s,b->k", spectrum, weights, per_length) * twice
        course += np.einsum("bks,s,b->k", np.square(force), weights, per_length)
    with np.errstate(invalid="ignore", divide="ignore"):
        share, crest = np.sqrt(energy / energy.sum()), np.sqrt(course.max() / energy.sum())
    return Harmonics(np.arange(float(len(share))) * (2 * np.pi / period), share, float(crest))
