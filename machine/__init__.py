"""Sizing of a machine's parts from its motion and its forces: drives, joints and life, as formulas on arrays."""

from machine.averages import mean, mean_positive, root_mean_square, time_weights
from machine.cylinders import Cylinder, buckling_safety, flow_rate, working_pressure
from machine.flywheels import energy_fluctuation, flywheel_inertia
from machine.motors import (
    Motor,
    available_torque,
    gear_effort,
    inertia_matched_ratio,
    least_torque_ratio,
    motor_torque,
)

__all__ = [
    "Cylinder",
    "Motor",
    "available_torque",
    "buckling_safety",
    "energy_fluctuation",
    "flow_rate",
    "flywheel_inertia",
    "gear_effort",
    "inertia_matched_ratio",
    "least_torque_ratio",
    "mean",
    "mean_positive",
    "motor_torque",
    "root_mean_square",
    "time_weights",
    "working_pressure",
]


def __dir__() -> list[str]:
    return __all__
