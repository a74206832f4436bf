"""Efforts of drives, laws of loads, and motions found from efforts."""

from rigid.dynamics.force_laws import CurveLaw, corners, law_of, law_of_time, table_curve
from rigid.dynamics.forward_dynamics import INTERRUPTED, forward, steps_ahead
from rigid.dynamics.integrated_motion import (
    Effort,
    EquationOfMotion,
    ForwardError,
    IntegratedMotion,
    MotionLaw,
    equation_of_motion,
    motion_during,
    reduced_inertia,
)
from rigid.laws import TableError
