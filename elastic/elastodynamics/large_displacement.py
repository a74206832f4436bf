"""Error of a solution due to large displacement."""

import math

import numpy as np

from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.second_order import second_order
from elastic.elastodynamics.solution import Elastodynamic
from elastic.links import members_of
from elastic.sampling import reference_deflection, sample
from elastic.solution import Deflection
from rigid import Reals

STATIONS = 21


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
