"""Error in the lowest natural frequency, which is computed without the effects of loads, springs and motion."""

import numpy as np

from elastic.assessment import BucklingModes
from kinelast.answers.results import Results
from kinelast.figures.beam_limits import too_many_beams
from kinelast.figures.cycle import Cycle
from kinelast.tasks.progress import one_thread
from rigid.arrays import distinct

MAX_BOUND_OF_MOTION = 5e-3  # largest bound on the effect of the motion that is used in place of this effect


def frequency_error(results: Results) -> float:
    """Return the relative error in the lowest natural frequency due to beam theory, loads, springs and motion."""
    return results.figures.frequency_error + abs(frequency_change(results.cycle))


def frequency_change(cycle: Cycle) -> float:
    """Return the relative change in the lowest natural frequency due to loads, springs and the motion of the links.

    `Cycle.frequencies` neglects these effects. A compressive force reduces the frequency, to 0 at the critical load. So
    does the rotation of a link, whose inertia pulls a displaced mass further out. The change is computed at the
    position with the lowest frequency, and where the load is largest relative to the critical load. It is nan if it is
    unknown, and 0 without beams.
    """
    return cycle.once(_frequency_change)


@one_thread()
def _frequency_change(cycle: Cycle) -> float:
    known, bent = cycle.frequencies, cycle.deflection.complete or cycle.deflection
    if known is None or len(cycle.columns) > 1:
        return 0.0
    omega, ratio = known.omega[0], cycle.buckling_ratio
    if too_many_beams(cycle.scene.mechanism) or not np.isfinite(omega).any():
        return np.nan
    lowest = known.position[int(np.nanargmin(omega))]
    some = distinct([lowest, *ratio.position[ratio.value > 0.0]])
    turned = cycle.motion.angular_velocity**2 + np.abs(cycle.motion.angular_acceleration)
    by_motion = float(np.nanmax(turned, initial=0.0) / np.nanmin(omega) ** 2)
    small = by_motion <= MAX_BOUND_OF_MOTION
    try:
        free, loaded = BucklingModes(bent).frequencies(some, None if small else cycle.scene.course.at)
    except np.linalg.LinAlgError:
        return np.nan
    change = float(loaded.min() / free.min() - 1.0)
    return change + np.copysign(by_motion, change) if small else change
