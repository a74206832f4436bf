"""Error of the quasi-static solution due to vibration, and error of linear theory due to large displacement."""

import math
from dataclasses import dataclass

import numpy as np

from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.second_order import second_order
from elastic.elastodynamics.solution import Elastodynamic
from elastic.links import members_of
from elastic.sampling import reference_deflection, sample
from elastic.solution import Deflection
from rigid import Reals

STATIONS = 21
STRAIGHT = 1e-6  # deflections smaller than this are round-off; relative to the largest elongation
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class TheoryError:
    """Errors relative to the largest chord deflection of the member of each beam, shape (beams,); nan if unknown.

    Attributes
    ----------
    history
        Largest error of the quasi-static solution at any instant and station.
    peak
        Error of the largest value over the positions.
    large_displacement
        Effect of large displacement that the elastodynamic solution neglects, see `large_displacement_error`.
    """

    history: Reals
    peak: Reals
    large_displacement: float


def theory_error(answer: Elastodynamic) -> TheoryError:
    """Return the error of the quasi-static solution due to vibration, i.e. the difference between both solutions."""
    plain, vibrating = (_chord(bent) for bent in (answer.quasi_static, answer.deflection))
    members = members_of(answer.deflection.motion.mechanism)
    vibrating_peak = members.greatest(np.abs(vibrating).max(axis=(1, 2)))
    stretch = np.abs(sample(answer.deflection, "u", np.ones(1)))
    greatest = np.maximum(reference_deflection(vibrating_peak), max(STRAIGHT * stretch.max(initial=0.0), TINY))
    history = members.greatest(np.abs(vibrating - plain).max(axis=(1, 2))) / greatest
    peak = np.abs(members.greatest(np.abs(plain).max(axis=(1, 2))) - vibrating_peak) / greatest
    return TheoryError(history, peak, large_displacement_error(answer))


def large_displacement_error(answer: Elastodynamic) -> float:
    """Return the error of linear theory due to large displacement, relative to the deflection of the worst beam.

    For an exact solution, this is the change by its last step. Otherwise it is the second-order effect, plus the square
    of the largest rotation for the third order. If links bend without vibration, it is only the latter.
    """
    if answer.vibration is None or not answer.stable:
        return 0.0 if answer.vibration is None else math.nan
    if answer.exact is not None:
        return answer.exact.worst
    return second_order_error(answer.vibration, answer.deflection)


def second_order_error(vibration: Vibration, bent: Deflection) -> float:
    """Return the effects of second and third order that linear vibration neglects, relative to the worst beam."""
    linear, more = second_order(vibration, np.linspace(0.0, 1.0, STATIONS))
    rotation = np.abs(sample(bent, "phi", np.linspace(0.0, 1.0, STATIONS))).max(initial=0.0)
    if not linear.size or not linear.any():
        return float(rotation**2)
    members = members_of(bent.motion.mechanism)
    share = _greatest(more) / reference_deflection(members.greatest(_greatest(linear)))
    return float(share.max() + rotation**2)


def _greatest(chord: Reals) -> Reals:
    """Return the largest magnitude on every beam, shape (beams,)."""
    return np.abs(chord).max(axis=(1, 2), initial=0.0)


def _chord(bent: Deflection) -> Reals:
    return sample(bent, "chord", np.linspace(0.0, 1.0, STATIONS))
