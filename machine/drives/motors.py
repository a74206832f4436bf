"""Motors with a gear: torque, speed and inertia at the motor's shaft, and the gear ratio that needs least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from machine.drives.averages import mean
from rigid.arrays import Real, Reals

UNKNOWN = float("nan")


@dataclass(frozen=True, eq=False)
class Motor:
    """A motor with its gear; nan for the data that its sheet leaves out.

    Attributes
    ----------
    rated_torque, peak_torque, stall_torque
        At the motor's shaft [N m]: borne for ever, borne for a while at any speed, and that at rest of a motor whose
        torque falls in proportion to the speed, to none at `top_speed`.
    rated_speed, top_speed
        Up to which the rated torque is there, and the greatest [rad/s].
    rotor_inertia, gear_inertia
        At the motor's shaft [kg m^2].
    gear_ratio
        Angle of the motor over the coordinate of the drive [1 or rad/m].
    efficiency
        Of the gear: share of the power that it passes on, whichever way.
    inertia_ratio
        Greatest allowed inertia of the load over that of motor and gear.
    """

    rated_torque: Real = UNKNOWN
    peak_torque: Real = UNKNOWN
    stall_torque: Real = UNKNOWN
    rated_speed: Real = UNKNOWN
    top_speed: Real = UNKNOWN
    rotor_inertia: Real = 0.0
    gear_inertia: Real = 0.0
    gear_ratio: Real = 1.0
    efficiency: Real = 1.0
    inertia_ratio: Real = UNKNOWN

    @property
    def inertia(self) -> Real:
        """Of rotor and gear at the motor's shaft [kg m^2]."""
        return self.rotor_inertia + self.gear_inertia

    @property
    def reduced_inertia(self) -> Real:
        """Of rotor and gear, reduced to the drive's coordinate [kg m^2 or kg]."""
        return self.gear_ratio**2 * self.inertia


def gear_effort(motor: Motor, effort: Any, rate: Any) -> Reals:
    """Return the effort at the gear's input, before its ratio [N m or N].

    The efficiency divides the effort if the gear drives, and multiplies it if the load drives. Range: an efficiency
    that is the same both ways, at any load and speed.

    Parameters
    ----------
    effort, rate
        Effort of the drive without the rotor's inertia [N m or N], and its rate, shape (..., positions).
    """
    drives = np.asarray(effort) * rate > 0
    through: Reals = np.where(drives, effort / motor.efficiency, effort * motor.efficiency)
    return through


def motor_torque(motor: Motor, effort: Any, rate: Any, acceleration: Any) -> Reals:
    """Return the torque of the motor [N m], shape (..., positions): of the load through the gear, and of the rotor.

    Equation of motion of a stiff rotor and gear without backlash. Range: that of `gear_effort`.

    Parameters
    ----------
    effort, rate, acceleration
        Effort without the rotor's inertia, and rates of the drive's coordinate.
    """
    ratio = motor.gear_ratio
    torque: Reals = gear_effort(motor, effort, rate) / ratio + motor.inertia * ratio * acceleration
    return torque


def available_torque(motor: Motor, speed: Any) -> Reals:
    """Return the greatest torque of the motor at a speed [rad/s], shape of the speed; nan if unknown.

    The lesser of the peak torque and the line from stall to zero at the top speed: a model of the data sheet, of any
    motor whose torque falls in proportion to its speed.
    """
    falling = motor.stall_torque * np.clip(1.0 - np.abs(speed) / motor.top_speed, 0.0, None)
    available: Reals = np.fmin(motor.peak_torque + np.zeros_like(falling), falling)
    return available


def least_torque_ratio(motor: Motor, effort: Any, rate: Any, acceleration: Any, weight: Any = 1.0) -> Reals:
    """Return the gear ratio with the least root mean square of the motor's torque, shape (...).

    The mean square is A / n^2 + 2 B + C n^2 with the mean squares A of the effort through the gear and C of the torque
    that accelerates rotor and gear: n^4 = A / C. At most the ratio at which the motor reaches its rated or top speed;
    that ratio if the drive does not accelerate. Range: an efficiency and a rotor that do not change with the ratio.
    """
    passed = mean(gear_effort(motor, effort, rate) ** 2, weight)
    own = mean((motor.inertia * np.asarray(acceleration)) ** 2, weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        best = np.where(own > 0, (passed / np.where(own > 0, own, 1.0)) ** 0.25, np.inf)
        bound = np.min(
            np.fmin(motor.rated_speed, motor.top_speed) / np.abs(np.broadcast_to(rate, np.shape(acceleration))), axis=-1
        )
    ratio: Reals = np.fmin(best, np.where(np.isnan(bound), np.inf, bound))
    return np.where(np.isfinite(ratio), ratio, np.nan)


def inertia_matched_ratio(load: Any, motor: Any) -> Reals:
    """Return the gear ratio that accelerates an inertia with the least torque: the root of load over motor inertia.

    Range: a load of constant inertia alone.

    >>> round(float(inertia_matched_ratio(0.09, 1e-4)), 9)
    30.0
    """
    ratio: Reals = np.sqrt(np.asarray(load) / motor)
    return ratio
