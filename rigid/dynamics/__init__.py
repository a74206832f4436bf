"""Forward dynamics: drive efforts, laws of loads, and motions integrated from given efforts."""

from rigid.dynamics.force_laws import CurveLaw, corners, law_of, law_of_time, table_curve
from rigid.dynamics.forward_dynamics import INTERRUPTED, forward, remaining_steps
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
