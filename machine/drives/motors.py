"""Motors with gearboxes (torque, speed, inertia, best gear ratio), and averages over time."""

from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Real, Reals, of_designs

UNKNOWN = float("nan")
MAX_DIFFERENCE = 1e-6  # two time steps count as equal if their difference is below MAX_DIFFERENCE * (time step)


class Motor(Struct, frozen=True, eq=False):
    """A motor with its gearbox; unknown data are nan.

    Attributes
    ----------
    rated_torque, peak_torque, stall_torque
        Continuous torque, short-term torque at any speed, and torque at rest, all at the motor shaft [N m]. The
        available torque falls linearly from the stall torque to zero at `top_speed`.
    rated_speed, top_speed
        Highest speed at rated torque, and highest speed without load [rad/s].
    rotor_inertia, gear_inertia
        Inertias at the motor shaft [kg m^2].
    gear_ratio
        Motor angle / drive coordinate [1 or rad/m].
    efficiency
        Efficiency of the gearbox, the same in both directions.
    inertia_ratio
        Largest allowed ratio (load inertia) / (motor + gearbox inertia).
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
        """Inertia of rotor and gearbox at the motor shaft [kg m^2]."""
        return self.rotor_inertia + self.gear_inertia

    @property
    def reduced_inertia(self) -> Real:
        """Inertia of rotor and gearbox, reduced to the drive's coordinate [kg m^2 or kg]."""
        return self.gear_ratio**2 * self.inertia


def gear_effort(motor: Motor, effort: Any, rate: Any) -> Reals:
    """Return the effort of the drive including gearbox losses [N m or N].

    The effort is divided by the efficiency if the motor drives the load. It is multiplied by the efficiency if the load
    drives the motor, or if the drive is at rest, where friction helps to hold the load. The result is the effort at the
    drive, not at the motor shaft. Assumption: the efficiency is the same in both directions, and at any load and speed.

    Parameters
    ----------
    effort, rate
        Effort of the drive without the inertia of rotor and gearbox [N m or N], and rate of the drive coordinate, shape
        (..., positions).
    """
    drives = np.asarray(effort) * rate > 0
    return np.where(drives, effort / motor.efficiency, effort * motor.efficiency)


def motor_torque(motor: Motor, effort: Any, rate: Any, acceleration: Any) -> Reals:
    """Return the motor torque that moves the load and accelerates rotor and gearbox [N m], shape (..., positions).

    The rotor and the gearbox are rigid and have no backlash. Range: see `gear_effort`.

    Parameters
    ----------
    effort, rate, acceleration
        Effort of the drive without the inertia of rotor and gearbox, and rate and acceleration of the drive coordinate.
    """
    ratio = motor.gear_ratio
    return gear_effort(motor, effort, rate) / ratio + motor.inertia * ratio * acceleration


def available_torque(motor: Motor, speed: Any) -> Reals:
    """Return the available motor torque at given speeds [rad/s], in the shape of `speed`; nan if unknown.

    The torque falls linearly from the stall torque to zero at the top speed, and is limited to the peak torque.
    """
    falling = motor.stall_torque * np.clip(1.0 - np.abs(speed) / motor.top_speed, 0.0, None)
    return np.fmin(motor.peak_torque + np.zeros_like(falling), falling)


def least_torque_ratio(motor: Motor, effort: Any, rate: Any, acceleration: Any, weight: Any = 1.0) -> Reals:
    """Return the gear ratio that minimizes the rms motor torque, shape (...).

    For the ratio n, the mean square of the torque is A / n^2 + 2 B + C n^2. A is the mean square of `gear_effort`. C is
    the mean square of (inertia of rotor and gearbox * acceleration of the drive). B does not depend on n. The minimum
    is at n^4 = A / C. The ratio is limited: the mean speed of the motor is within the rated speed, the largest speed
    within the top speed. If the drive has no acceleration, the result is the ratio at this limit. Assumption: the
    efficiency and the inertia of rotor and gearbox do not depend on the ratio.
    """
    transmitted = mean(gear_effort(motor, effort, rate) ** 2, weight)
    inertial = mean((motor.inertia * np.asarray(acceleration)) ** 2, weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        best = np.where(inertial > 0, (transmitted / np.where(inertial > 0, inertial, 1.0)) ** 0.25, np.inf)
        speed = np.abs(np.broadcast_to(rate, np.shape(acceleration)))
        rated, top = of_designs(motor.rated_speed), of_designs(motor.top_speed)
        bound = np.fmin(rated / mean(speed, weight), top / speed.max(axis=-1))
    ratio: Reals = np.fmin(best, np.where(np.isnan(bound), np.inf, bound))
    return np.where(np.isfinite(ratio), ratio, np.nan)


def inertia_matched_ratio(load: Any, motor: Any) -> Reals:
    """Return the gear ratio that accelerates a load with the least torque: sqrt(load inertia / motor inertia).

    Range: a constant inertia as the only load.

    >>> round(float(inertia_matched_ratio(0.09, 1e-4)), 9)
    30.0
    """
    return np.sqrt(np.asarray(load) / motor)


def mean(values: Any, weight: Any = 1.0) -> Reals:
    """Return the weighted mean over the last axis.

    Parameters
    ----------
    values
        Shape (..., positions).
    weight
        Time weight of each position in any unit, shape (positions,) or (..., positions).
    """
    weight = np.broadcast_to(weight, np.shape(values))
    return np.sum(weight * values, axis=-1) / np.sum(weight, axis=-1)


def root_mean_square(values: Any, weight: Any = 1.0) -> Reals:
    """Return the weighted root mean square over the last axis (see `mean`).

    >>> float(root_mean_square([3.0, 0.0, -3.0]))  # torque of a trapezoidal speed profile in thirds: peak * sqrt(2/3)
    2.449...
    """
    return np.sqrt(mean(np.abs(values) ** 2, weight))


def mean_positive(values: Any, weight: Any = 1.0) -> Reals:
    """Return the weighted mean of max(values, 0).

    If `values` is a power, the mean times the duration is the consumed energy.
    """
    return mean(np.where(np.isnan(values), np.nan, np.maximum(values, 0.0)), weight)


def time_weights(time: Any, period: Any = np.nan) -> Reals:
    """Return the weights of the trapezoidal rule [s], in the shape of `time`.

    Parameters
    ----------
    time
        Instants [s], shape (..., positions).
    period
        Period of the motion [s]. If the instants cover one period without the end, the interval from the last instant
        to the end of the period is included.
    """
    time = np.asarray(time, float)
    if time.shape[-1] < 2:
        return np.ones_like(time)
    steps = np.diff(time, axis=-1)
    left = period - (time[..., -1:] - time[..., :1])
    around = np.where(np.abs(left - steps[..., -1:]) < MAX_DIFFERENCE * steps[..., -1:], left, 0.0)
    steps = np.concatenate([around, steps, around], axis=-1)
    return (steps[..., 1:] + steps[..., :-1]) / 2
