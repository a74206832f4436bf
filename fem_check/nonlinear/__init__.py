"""Independent nonlinear analysis in absolute coordinates, with large displacements and inertia of the deformed links.

It uses no computation of `rigid` and `elastic`, only the definitions of the mechanism and its sections.
"""

from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.refinement import RefinedDeflection, refined_deflection
from fem_check.nonlinear.rigid_places import DoesNotCloseError
