"""Efforts of drives, laws of loads, and motions found from efforts."""

from rigid.dynamics.effort import EquationOfMotion, equation_of_motion, reduced_inertia
from rigid.dynamics.force_laws import CurveLaw, corners, law_of, law_of_time, table_curve
from rigid.dynamics.forward_dynamics import INTERRUPTED, forward, steps_ahead
from rigid.dynamics.integrated_motion import Effort, ForwardError, IntegratedMotion, MotionLaw, motion_during
from rigid.laws import TableError
