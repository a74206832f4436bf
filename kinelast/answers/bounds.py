"""Error bounds that are known before vibration is solved, and the largest bounds accepted in place of errors."""

import math

import numpy as np

from elastic.assessment import vibration_bound
from elastic.elastodynamics import Damping
from kinelast.answers.theory_settings import THEORY
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import Scene


def accepted_bound(accuracy: float, judged: bool, share: float = THEORY.max_discretization_bound) -> float:
    """Return the largest error bound that is accepted without measuring the error.

    `judged` is true if results are compared with limits or used by a speed map. The accepted bound is then smaller.
    """
    return share * (THEORY.limits_factor if judged else 1.0) * accuracy


def damping_of(scene: Scene) -> Damping:
    """Return the damping of every beam: the coefficient beta of its material or, by default, the damping ratio."""
    theory = scene.theory
    return Damping(np.array(theory.damping or (math.nan,) * len(scene.labels)), ratio=theory.damping_ratio)


def bound_of_vibration(cycle: Cycle, period: float) -> float:
    """Return a bound on the relative change that vibration causes in quasi-static results, or inf if it is unknown."""
    scene, course = cycle.scene, cycle.scene.course
    if not math.isfinite(period) or course.stops or len(course.breaks.sides) or scene.mechanism.friction:
        return math.inf
    frequencies = cycle.frequencies
    if frequencies is None or cycle.lost.any():
        return math.inf
    ratio = float(np.max(cycle.buckling_ratio.value, initial=0.0))
    return vibration_bound(cycle.deflection, period, frequencies.lowest, damping_of(scene), ratio)


def largest_rotation(cycle: Cycle) -> float:
    """Return the largest rotation of any beam section over the cycle [rad]."""
    return float(np.nanmax(np.abs(cycle.along("phi").value), initial=0.0))
