"""Flywheels: the energy that a cycle stores and gives back, and the inertia that keeps the speed even."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.arrays import Reals


def energy_fluctuation(effort: Any, coordinate: Any, travel: Any) -> Reals:
    """Greatest less least energy stored over a cycle, where its mean effort is supplied all the time [J], shape (...).

    Parameters
    ----------
    effort
        Of the drive over one cycle, whose end is not repeated [N m], shape (..., positions).
    coordinate
        Of the drive [rad], shape (..., positions).
    travel
        Change of the coordinate in a cycle [rad].

    References
    ----------
    R. L. Norton, Design of Machinery, chapter 11: the torque about its mean, integrated pulse by pulse.
    """
    effort, coordinate = np.broadcast_arrays(np.asarray(effort, float), np.asarray(coordinate, float))
    ends = np.concatenate([coordinate, coordinate[..., :1] + travel], axis=-1)
    steps = np.diff(ends, axis=-1)
    middle = (effort + np.roll(effort, -1, axis=-1)) / 2
    mean = (middle * steps).sum(axis=-1, keepdims=True) / np.abs(travel) * np.sign(travel)
    stored = np.cumsum((middle - mean) * steps, axis=-1)
    fluctuation: Reals = stored.max(axis=-1) - stored.min(axis=-1)
    return fluctuation


def flywheel_inertia(fluctuation: Any, unevenness: Any, speed: Any) -> Reals:
    """Inertia [kg m^2] with which the speed [rad/s] varies by a share of its mean, greatest less least.

    Of the whole that turns with it, as the textbooks have it: the machine's own counts against it.

    >>> round(float(flywheel_inertia(583.1, 0.0133, 26.18)), 1)  # Khurmi, Theory of Machines: 400 kg at 0.4 m
    64.0
    """
    inertia: Reals = np.asarray(fluctuation) / (unevenness * np.square(speed))
    return inertia
