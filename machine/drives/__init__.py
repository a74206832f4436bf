"""Drives: averages over time, motors and gears, cylinders, flywheels, counterweights and springs."""

from machine.drives.balance import (
    Balance,
    balanced,
    inertia_force,
    inertia_moment,
    pivoted_links,
    shaking_influences,
    spring_influences,
    weight_effort,
    weight_influences,
)
from machine.drives.cylinders import ROD_RANGE, Cylinder, buckling_safety, flow_rate, working_pressure
from machine.drives.flywheels import UNEVENNESS_RANGE, added_inertia, energy_fluctuation, flywheel_inertia
from machine.drives.motors import (
    Motor,
    available_torque,
    gear_effort,
    inertia_matched_ratio,
    least_torque_ratio,
    mean,
    mean_positive,
    motor_torque,
    root_mean_square,
    time_weights,
)
