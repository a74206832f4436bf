"""Nonlinear motions and equilibria on the equations of `fem_check.nonlinear`, by other methods than its own.

`fem_check.nonlinear` integrates by Radau collocation; these use Fourier collocation and the generalised-alpha method.
"""

from .marched import nonlinear_equilibrium, nonlinear_transient
from .periodic import PeriodicCollocation, nonlinear_steady_state
