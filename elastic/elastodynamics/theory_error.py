"""Error of the quasi-static solution due to vibration, and error of linear theory due to large displacement."""

import math

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.second_order import second_order
from elastic.elastodynamics.solution import Elastodynamic
from elastic.links import members_of
from elastic.sampling import reference_deflection, sample
from elastic.solution import Deflection
from rigid import Reals

STATIONS = 21
MIN_DEFLECTION = 1e-6  # deflections below this are round-off, relative to the largest axial displacement of a beam end
TINY = float(np.finfo(float).tiny)


class TheoryError(Struct, frozen=True, eq=False):
    """Errors in the chord deflection of beams.

    They are relative to the largest chord deflection of the member, i.e. of the row of collinear beams to which a beam
    belongs.

    Attributes
    ----------
    history
        Largest error of the quasi-static solution at any instant and station, shape (beams,).
    peak
        Error of the quasi-static solution in the largest value over all instants and stations, shape (beams,).
    large_displacement
        Error due to large displacement for the worst beam, see `large_displacement_error`.
    """

    history: Reals
    peak: Reals
    large_displacement: float


def theory_error(answer: Elastodynamic) -> TheoryError:
    """Return the error of the quasi-static solution, i.e. its difference from the elastodynamic solution."""
    xi = np.linspace(0.0, 1.0, STATIONS)
    plain, vibrating = (sample(bent, "chord", xi) for bent in (answer.quasi_static, answer.deflection))
    members = members_of(answer.deflection.motion.mechanism)
    vibrating_peak = members.greatest(np.abs(vibrating).max(axis=(1, 2)))
    stretch = np.abs(sample(answer.deflection, "u", np.ones(1)))
    greatest = np.maximum(reference_deflection(vibrating_peak), max(MIN_DEFLECTION * stretch.max(initial=0.0), TINY))
    history = members.greatest(np.abs(vibrating - plain).max(axis=(1, 2))) / greatest
    peak = np.abs(members.greatest(np.abs(plain).max(axis=(1, 2))) - vibrating_peak) / greatest
    return TheoryError(history, peak, large_displacement_error(answer))


def large_displacement_error(answer: Elastodynamic) -> float:
    """Return the error of a solution due to large displacement, relative to the chord deflection of the worst beam.

    For a solution with large displacement, this is the larger of its residual and its change in the next step. For a
    linear solution, it is the second-order effect plus the square of the largest rotation, which is an estimate of the
    third-order effect. It is 0 if no link vibrates, and nan without a steady state.
    """
    if answer.vibration is None or not answer.stable:
        return 0.0 if answer.vibration is None else math.nan
    if answer.exact is not None:
        return answer.exact.worst
    return second_order_error(answer.vibration, answer.deflection)


def second_order_error(vibration: Vibration, bent: Deflection) -> float:
    """Return the second-order and third-order effects that a linear vibration neglects, for the worst beam.

    They are relative to the chord deflection of this beam.
    """
    linear, increment = second_order(vibration, np.linspace(0.0, 1.0, STATIONS))
    rotation = np.abs(sample(bent, "phi", np.linspace(0.0, 1.0, STATIONS))).max(initial=0.0)
    if not linear.size or not linear.any():
        return float(rotation**2)
    members = members_of(bent.motion.mechanism)
    ratio = _greatest(increment) / reference_deflection(members.greatest(_greatest(linear)))
    return float(ratio.max() + rotation**2)


def _greatest(chord: Reals) -> Reals:
    """Return the largest magnitude of the chord deflection of each beam, shape (beams,)."""
    return np.abs(chord).max(axis=(1, 2), initial=0.0)
