"""Efforts, energy, laws and springs, and motions found from efforts."""

from rigid.dynamics.effort import (
    EquationOfMotion,
    equation_of_motion,
    multiplier_forces,
    reduced_inertia,
    virtual_work_efforts,
)
from rigid.dynamics.energy import dissipated_power, kinetic_energy, load_power, potential_energy
from rigid.dynamics.force_laws import (
    TableError,
    constant_law,
    law_of,
    law_of_rate,
    law_of_time,
    sum_of_laws,
    table_curve,
)
from rigid.dynamics.forward_dynamics import Effort, ForwardError, IntegratedMotion, MotionLaw, forward, motion_during
from rigid.dynamics.springs import Spring, TorsionSpring

__all__ = [
    "Effort",
    "EquationOfMotion",
    "ForwardError",
    "IntegratedMotion",
    "MotionLaw",
    "Spring",
    "TableError",
    "TorsionSpring",
    "constant_law",
    "dissipated_power",
    "equation_of_motion",
    "forward",
    "kinetic_energy",
    "law_of",
    "law_of_rate",
    "law_of_time",
    "load_power",
    "motion_during",
    "multiplier_forces",
    "potential_energy",
    "reduced_inertia",
    "sum_of_laws",
    "table_curve",
    "virtual_work_efforts",
]


def __dir__() -> list[str]:
    return __all__
