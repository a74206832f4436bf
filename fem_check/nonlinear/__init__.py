"""The whole elastic mechanism in absolute coordinates: displacements of any size, inertia of the bent links.

It shares no computation with `rigid` and `elastic`: of them it takes the mechanism, the sections and nothing else.
"""

from fem_check.nonlinear.equilibrium import nonlinear_equilibrium
from fem_check.nonlinear.errors import ErrorEstimate, estimated_errors
from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.refinement import RefinedDeflection, refined_deflection
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.solution import JointForce, NonlinearSolution
from fem_check.nonlinear.steady import nonlinear_steady_state
from fem_check.nonlinear.transient import nonlinear_transient

__all__ = [
    "DoesNotCloseError",
    "ErrorEstimate",
    "JointForce",
    "NonlinearSolution",
    "NotCheckedError",
    "RefinedDeflection",
    "estimated_errors",
    "nonlinear_equilibrium",
    "nonlinear_steady_state",
    "nonlinear_transient",
    "refined_deflection",
]
