"""Rates of the positions of masses by central differences in time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_check.balance.masses import Masses, places, velocities
from rigid import Motion, Posture, posture
from rigid.arrays import Complexes, Reals

GRANTED = 1e-6
"""Largest accepted residual, relative to the largest ground force or moment, velocity or size."""
STEP = 0.01
"""Step of the differences, relative to the time in which the fastest link turns by 1 rad."""
EIGHTH = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SIXTH = (3 / 4, -3 / 20, 1 / 60, 0.0)
"""Central differences of orders eight and six; their difference estimates the error."""

MotionNear = Callable[[Reals, Posture], Motion]


@dataclass(frozen=True, eq=False)
class Rates:
    """Velocities [m/s], accelerations [m/s^2], complex, and angular accelerations [1/s^2].

    Shape (masses, positions); `known` marks positions with resolved differences.
    """

    velocity: Any
    acceleration: Any
    rotation: Any
    known: Any


def rates_of(motion: Motion, masses: Masses, motion_near: MotionNear, span: tuple[float, float]) -> Rates:
    """Differentiate over a few short steps before and after each position."""
    step = STEP * _pace(motion)
    far = len(EIGHTH) * step
    inside = (motion.time - far >= span[0]) & (motion.time + far <= span[1])
    if not inside.any():  # the run is shorter than the steps
        unknown = np.full((len(masses.mass), *motion.columns), np.nan)
        return Rates(unknown + 0j, unknown + 0j, unknown, inside)
    time, here = motion.time[inside], posture(motion, inside)
    steps = np.array([
        _carried(motion_near(time + k * step, here), masses) - _carried(motion_near(time - k * step, here), masses)
        for k in range(1, len(EIGHTH) + 1)
    ])  # fmt: skip
    good, rough = (np.tensordot(weights, steps, 1) / step for weights in (EIGHTH, SIXTH))
    largest = np.abs(good).max(axis=(1, 2), initial=0.0, where=np.isfinite(good), keepdims=True)
    known = inside.copy()
    known[inside] = (np.abs(good - rough) <= GRANTED / 10 * largest).all(axis=(0, 1))
    rates = np.full((*good.shape[:2], *motion.columns), np.nan, complex)
    rates[..., inside] = good
    return Rates(rates[0], rates[1], rates[2].real, known)


def _carried(motion: Motion, masses: Masses) -> Complexes:
    """Positions and velocities of the masses and their angular velocities, (3, masses, positions)."""
    return np.array([places(motion, masses), velocities(motion, masses), motion.angular_velocity[masses.link]])


def _pace(motion: Motion) -> float:
    """Shortest time of a 1 rad rotation or a displacement by the mechanism's size [s]."""
    known = np.isfinite(motion.velocity)
    turns = np.abs(motion.angular_velocity).max(initial=0.0, where=known)
    goes = np.abs(motion.velocity).max(initial=0.0, where=known)
    size = size_of(motion, np.isfinite(motion.origin).all(axis=0))
    fastest = max(float(turns), float(goes) / size if size else 0.0)
    return 1.0 / fastest if fastest else 1.0


def size_of(motion: Motion, known: Any) -> float:
    """Larger of the width and height of the area that the points of the links sweep [m]."""
    points = [motion.origin[at] + motion.direction[at] * point
              for at, link in enumerate(motion.mechanism.links) for point in link.points.values()]  # fmt: skip
    reached = np.array(points)[:, known]
    return float(max(np.ptp(reached.real), np.ptp(reached.imag))) if reached.size else 0.0
