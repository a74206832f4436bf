"""Error bounds that are known before vibration is solved, and the criterion by which a bound is accepted."""

import math

import numpy as np

from elastic.assessment import vibration_bound
from elastic.elastodynamics import Damping
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import Scene

RESOLVED = 0.5  # accepted bound on the discretization error / accuracy; a larger error is measured
BOUNDED = 0.05  # the same for vibration and large displacement, because their bounds are loose for small figures
JUDGED = 0.2  # factor on the two values above if the answer is compared with limits
ASKED = 1e-4  # accepted bound on an error if an accuracy is requested
BOUND_OVER_ERROR = 4.0  # bound on the discretization error / its usual value
PER_ROTATION = 2.0  # bound on the effect of large displacement / largest rotation [rad]
FORCES_PER_ROTATION = 20.0  # the same for the forces of each member, which may be a tenth of the largest force


def resolved(accuracy: float, judged: bool, share: float = RESOLVED) -> float:
    """Return the largest error bound that is accepted without measuring the error.

    It is smaller if the answer is compared with limits or used by a speed map (`judged`).
    """
    return share * (JUDGED if judged else 1.0) * accuracy


def damping_of(scene: Scene) -> Damping:
    """Return the damping of every beam: the beta of its material if given, otherwise the damping ratio."""
    theory = scene.theory
    return Damping(np.array(theory.damping or (math.nan,) * len(scene.labels)), ratio=theory.damping_ratio)


def bound_of_vibration(cycle: Cycle, period: float) -> float:
    """Return a bound on the relative change of the quasi-static results due to vibration; infinite if none is known."""
    scene, course = cycle.scene, cycle.scene.course
    if not math.isfinite(period) or course.stops or len(course.breaks.sides) or scene.mechanism.friction:
        return math.inf
    frequencies = cycle.frequencies
    if frequencies is None or cycle.singular.any():
        return math.inf
    pressed = float(np.max(cycle.pressed.value, initial=0.0))
    return vibration_bound(cycle.deflection, period, frequencies.lowest, damping_of(scene), pressed)


def largest_rotation(cycle: Cycle) -> float:
    """Return the largest rotation of any beam section over the cycle [rad]."""
    return float(np.nanmax(np.abs(cycle.along("phi").value), initial=0.0))
