"""Flywheels: energy fluctuation over a cycle, and inertia for an allowed speed fluctuation."""

from typing import Any

import numpy as np

from machine.ranges import Range
from rigid.arrays import Reals

UNEVENNESS_RANGE = Range(
    "inertia of a flywheel", "unevenness", "Norton, Design of Machinery, chapter 11: constant speed", most=0.1,
    outside="the effort depends on the speed: integrate the motion under the mean effort",
)  # fmt: skip
"""Speed fluctuation for which the flywheel formula applies."""


def energy_fluctuation(effort: Any, coordinate: Any, travel: Any) -> Reals:
    """Return the energy fluctuation over a cycle [J], shape (...): largest minus smallest stored kinetic energy.

    The drive is assumed to supply the mean effort at all times.

    Parameters
    ----------
    effort
        Torque of the drive over one cycle [N m], shape (..., positions). The position at the end of the cycle is left
        out, because it equals the position at the start.
    coordinate
        Coordinate of the drive [rad], shape (..., positions).
    travel
        Change in the coordinate over a cycle [rad].

    References
    ----------
    R. L. Norton, Design of Machinery, chapter 11: integrate the torque about its mean, pulse by pulse.
    """
    effort, coordinate = np.broadcast_arrays(np.asarray(effort, float), np.asarray(coordinate, float))
    ends = np.concatenate([coordinate, coordinate[..., :1] + travel], axis=-1)
    steps = np.diff(ends, axis=-1)
    middle = (effort + np.roll(effort, -1, axis=-1)) / 2
    mean = (middle * steps).sum(axis=-1, keepdims=True) / np.abs(travel) * np.sign(travel)
    stored = np.cumsum((middle - mean) * steps, axis=-1)
    return stored.max(axis=-1) - stored.min(axis=-1)


def flywheel_inertia(fluctuation: Any, unevenness: Any, speed: Any) -> Reals:
    """Return the total inertia [kg m^2] that limits the speed fluctuation to a given unevenness.

    The unevenness is (largest speed - smallest speed) / mean speed. The total includes flywheel, machine, motor and
    gear; `added_inertia` returns the inertia of the flywheel alone.

    References
    ----------
    R. L. Norton, Design of Machinery, chapter 11. Range: `UNEVENNESS_RANGE`.

    >>> round(float(flywheel_inertia(583.1, 0.0133, 26.18)), 1)  # Khurmi, Theory of Machines: 400 kg at 0.4 m
    64.0
    """
    return np.asarray(fluctuation) / (unevenness * np.square(speed))


def added_inertia(total: Any, machine: Any) -> Reals:
    """Return the inertia that must be added to a machine to reach a total inertia [kg m^2], at least 0, shape (...).

    If the inertia of the machine varies over the cycle, the smallest inertia counts, so that the speed fluctuation
    stays within the limit.

    Parameters
    ----------
    total
        Total inertia from `flywheel_inertia` [kg m^2], shape (...).
    machine
        Inertia of links, motor and gear, reduced to the drive [kg m^2], shape (..., positions).
    """
    return np.asarray(np.maximum(np.asarray(total) - np.min(machine, axis=-1), 0.0))
