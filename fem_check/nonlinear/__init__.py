"""Independent nonlinear analysis in absolute coordinates: large displacements, inertia of the deformed links.

It shares no computation with `rigid` and `elastic`, only the definitions of the mechanism and its sections.
"""

from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.refinement import RefinedDeflection, refined_deflection
from fem_check.nonlinear.rigid_places import DoesNotCloseError
