"""Bound on the effect of vibration on a quasi-static solution, from harmonics and the lowest natural frequency.

A mode has the natural frequency omega and the damping ratio zeta = beta omega / 2. In this mode, the response to a
harmonic of frequency w differs from the quasi-static response by at most ((w/omega)^2 + (beta w)^2) / |1 -
(w/omega)^2|, and by at most 1 + 1/(2 zeta), both relative to the quasi-static response. In the worst case, all modes
have the lowest natural frequency. In addition, axial forces change the stiffness by a fraction of at most (force /
critical load), and the rotation of the links changes the stiffness by a fraction of at most (angular velocity /
omega)^2. The sum of these three relative changes is a bound on the relative change in the square root of the strain
energy. A particular figure may change by `SAFETY` times this bound. Comparisons with exact solutions are in
docs/validity.md.
"""

import math

import numpy as np

from elastic.assessment.columns import euler_loads, euler_ratio
from elastic.assessment.cycle import harmonics
from elastic.elastodynamics.point_effects import chosen_points, point_effects
from elastic.elastodynamics.strains import Damping
from elastic.sampling import sample
from elastic.solution import Deflection

# largest ratio of the relative change in a figure to the relative change in the square root of the strain energy,
# measured on random mechanisms
SAFETY = 1.25
MAX_BOUND = 0.1  # a larger bound is replaced by infinity, because no tests cover it
MAX_SPACING_ERROR = 1e-6  # time steps count as equal if they deviate by at most this, relative to a step
# critical load of a pinned beam, relative to the critical load of a cantilever of the same length
PINNED_PER_CANTILEVER = 4.0
STATIONS = 9


def vibration_bound(deflection: Deflection, period: float, lowest: float, damping: Damping, pressed: float) -> float:
    """Return a bound on the change in figures due to vibration, relative to the largest figure of the same kind.

    The result is infinite in each of these cases: the time steps are unequal; there is friction; the force of a spring
    or load changes when its point is displaced; the natural frequency is unknown; or the bound exceeds `MAX_BOUND`.

    Parameters
    ----------
    deflection
        Quasi-static deflection at evenly spaced positions of one cycle.
    period
        Duration of the cycle [s].
    lowest
        Lowest natural frequency over the cycle [rad/s].
    damping
        Damping of beams and compliant joints.
    pressed
        Largest ratio of load to critical load of the mechanism, see `buckling_ratio`.
    """
    motion = deflection.motion
    steps = np.diff(motion.time)
    even = len(steps) > 0 and np.abs(steps * len(motion.time) / period - 1.0).max() <= MAX_SPACING_ERROR
    if not even or motion.mechanism.friction or not np.isfinite(lowest):
        return math.inf
    if any(np.any(each.stiffness) for each in point_effects(deflection, chosen_points(motion.mechanism))):
        return math.inf
    spectrum = harmonics(deflection, period)
    damping = damping.with_default_beta(lowest)
    square = np.square(spectrum.omega / lowest)
    with np.errstate(divide="ignore"):
        most = 1.0 + 1.0 / (lowest * damping.beams.min(initial=damping.joints))
        lag = spectrum.omega * damping.beams.max(initial=damping.joints)  # phase lag due to damping
        gain = np.where(square < 1.0, np.minimum((square + np.square(lag)) / np.abs(1.0 - square), most), most)
    change = math.sqrt(2.0) * float(gain[1:] @ spectrum.share[1:]) / spectrum.crest
    turned = float(np.square(motion.angular_velocity).max(initial=0.0)) / lowest**2
    bound = SAFETY * (change + turned + _stiffness_change(deflection, pressed))
    return bound if bound <= MAX_BOUND else math.inf


def _stiffness_change(deflection: Deflection, pressed: float) -> float:
    """Return a bound on the relative change in the stiffness due to axial forces, in tension or compression.

    The bound is the largest axial force of a beam relative to its Euler load, multiplied by a factor of at least 1. The
    factor corrects the Euler load, which is that of a span with pinned ends. It is `pressed` divided by the largest
    `euler_ratio`. If no beam is compressed, the factor is the one for a cantilever.
    """
    force = np.abs(sample(deflection, "N", np.linspace(0.0, 1.0, STATIONS))).max(axis=-1)
    loads, compressed = force / euler_loads(deflection), float(euler_ratio(deflection).max(initial=0.0))
    factor = max(pressed / compressed, 1.0) if compressed > 0.0 else PINNED_PER_CANTILEVER
    return factor * float(loads.max(initial=0.0))
