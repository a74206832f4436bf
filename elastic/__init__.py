"""Closed-form section forces and displacements of the elastic links of a moving mechanism.

This package depends only on numpy and `rigid`. Its subpackages include `elastic.assessment` (stress, stability,
validity of beam theory), `elastic.vibration` (natural frequencies) and `elastic.elastodynamics` (vibrating links).
"""

from elastic.beams.cross_sections import SHAPES, Shape, box, circle, i_section, rectangle, tube
from elastic.beams.section import RIGID, JointCompliance, Section, Taper, with_rotary_inertia
from elastic.beams.shaped_sections import section_of, tapered
from elastic.cycle_maxima import cycle_maxima
from elastic.derived import coefficients
from elastic.extreme_values import Extreme, extremes
from elastic.fields import FIELDS, PRIMARY, Field, FieldKind
from elastic.largest import Largest, largest, largest_row, peak_gain
from elastic.sampling import displacement_of, larger_magnitude, reference_deflection, rotation_of, sample
from elastic.solution import Deflection, deflection, without_positions

__all__ = [
    "FIELDS", "PRIMARY", "RIGID", "SHAPES", "Deflection", "Extreme", "Field", "FieldKind", "JointCompliance", "Largest",
    "Section", "Shape", "Taper", "box", "circle", "coefficients", "cycle_maxima", "deflection", "displacement_of",
    "extremes", "i_section", "larger_magnitude", "largest", "largest_row", "peak_gain", "rectangle",
    "reference_deflection", "rotation_of", "sample", "section_of", "tapered", "tube", "with_rotary_inertia",
    "without_positions",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
