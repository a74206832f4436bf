"""Bound on the effect of vibration on a quasi-static solution, from its harmonics and the lowest natural frequency.

A harmonic of frequency w excites a mode with natural frequency omega and damping ratio zeta to at most
1/|1 - (w/omega)^2| times its quasi-static amplitude, and to at most 1 + 1/(2 zeta) times. Damping beta causes a phase
lag of beta w. In the worst case, all modes are as soft as the lowest one. Axial forces change the stiffness by a
fraction equal to force / critical load, and rotation of the links changes it by (rate/omega)^2. The sum bounds the
change of the square root of the strain energy; individual figures may change by `SAFETY` times as much. Comparisons are
in docs/validity.md.
"""

import math

import numpy as np

from elastic.assessment.columns import euler_loads, euler_ratio
from elastic.assessment.spectrum import harmonics
from elastic.elastodynamics.point_effects import chosen_points, point_effects
from elastic.elastodynamics.strains import Damping
from elastic.sampling import sample
from elastic.solution import Deflection

SAFETY = 1.25  # largest change of a figure / change of the root of the strain energy, for random mechanisms
MAX_BOUND = 0.1  # the bound has not been tested above this, where softening by axial forces is not small
MAX_SPACING_ERROR = 1e-6  # largest deviation of evenly spaced positions, relative to the spacing
PINNED_PER_CANTILEVER = 4.0  # critical load of a pinned beam / of a cantilever; used if no beam is compressed
STATIONS = 9


def vibration_bound(deflection: Deflection, period: float, lowest: float, damping: Damping, pressed: float) -> float:
    """Return a bound on the change of figures by vibration, relative to the largest figure of the same kind.

    It is infinite if no bound is known, i.e. with unevenly spaced positions, friction, or forces that follow displaced
    points.

    Parameters
    ----------
    deflection
        Quasi-static deflection at evenly spaced positions of one cycle.
    period
        Duration of the cycle [s].
    lowest
        Lowest natural frequency over the cycle [rad/s].
    damping
        Damping of the beams.
    pressed
        Largest load / critical load of the mechanism.
    """
    motion = deflection.motion
    steps = np.diff(motion.time)
    even = len(steps) > 0 and np.abs(steps * len(motion.time) / period - 1.0).max() <= MAX_SPACING_ERROR
    if not even or motion.mechanism.friction or not np.isfinite(lowest):
        return math.inf
    if any(np.any(each.stiffness) for each in point_effects(deflection, chosen_points(motion.mechanism))):
        return math.inf
    spectrum = harmonics(deflection, period)
    settled = damping.settled(lowest)
    square = np.square(spectrum.omega / lowest)
    with np.errstate(divide="ignore"):
        most = 1.0 + 1.0 / (lowest * settled.beams.min(initial=settled.joints))
        lag = spectrum.omega * settled.beams.max(initial=settled.joints)  # phase lag due to damping
        gain = np.where(square < 1.0, np.minimum((square + np.square(lag)) / np.abs(1.0 - square), most), most)
    change = math.sqrt(2.0) * float(gain[1:] @ spectrum.share[1:]) / spectrum.crest
    turned = float(np.square(motion.angular_velocity).max(initial=0.0)) / lowest**2
    bound = SAFETY * (change + turned + _stiffened(deflection, pressed))
    return bound if bound <= MAX_BOUND else math.inf


def _stiffened(deflection: Deflection, pressed: float) -> float:
    """Return the relative change of the stiffness by axial forces: load / critical load, in tension or compression."""
    force = np.abs(sample(deflection, "N", np.linspace(0.0, 1.0, STATIONS))).max(axis=-1)
    loads, compressed = force / euler_loads(deflection), float(euler_ratio(deflection).max(initial=0.0))
    factor = max(pressed / compressed, 1.0) if compressed > 0.0 else PINNED_PER_CANTILEVER
    return factor * float(loads.max(initial=0.0))
