"""Independent nonlinear analysis in absolute coordinates: large displacements, inertia of the deformed links.

It shares no computation with `rigid` and `elastic`, only the definitions of mechanism and sections.
"""

from fem_check.nonlinear.equilibrium import nonlinear_equilibrium
from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.refinement import RefinedDeflection, refined_deflection
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.solution import JointForce, NonlinearSolution
from fem_check.nonlinear.steady import nonlinear_steady_state
from fem_check.nonlinear.transient import nonlinear_transient

__all__ = [
    "DoesNotCloseError",
    "JointForce",
    "NonlinearSolution",
    "NotCheckedError",
    "RefinedDeflection",
    "nonlinear_equilibrium",
    "nonlinear_steady_state",
    "nonlinear_transient",
    "refined_deflection",
]
