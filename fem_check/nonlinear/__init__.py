"""Independent nonlinear finite element analysis of moving mechanisms, in absolute coordinates.

It includes large displacements and the inertia of the deformed links. From `rigid` and `elastic` it takes the
definitions of the mechanism, its sections and the chord deflection, but no computed positions, forces or displacements.
"""

from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.refinement import RefinedDeflection, refined_deflection
from fem_check.nonlinear.rigid_places import DoesNotCloseError
from fem_check.nonlinear.system import system_of
