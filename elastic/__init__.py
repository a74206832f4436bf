"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form.

Needs numpy and `rigid` only. What the fields mean for a design is in `elastic.assessment`, natural frequencies in
`elastic.vibration`, and vibrating links in `elastic.elastodynamics`.
"""

from elastic.beams.cross_sections import SHAPES, Shape, box, circle, i_section, rectangle, section_of, tapered, tube
from elastic.beams.section import RIGID, JointCompliance, Section, Taper, with_rotary_inertia
from elastic.chunks import deflection_in_chunks
from elastic.cycle_maxima import cycle_maxima
from elastic.derived import coefficients
from elastic.extreme_values import Extreme, extremes
from elastic.fields import FIELDS, PRIMARY, Field, Kind
from elastic.largest import Largest, largest, largest_row, peak_gain
from elastic.sampling import displacement_of, reference_deflection, rotation_of, sample
from elastic.solution import Deflection, deflection, marked

__all__ = [
    "FIELDS",
    "PRIMARY",
    "RIGID",
    "SHAPES",
    "Deflection",
    "Extreme",
    "Field",
    "JointCompliance",
    "Kind",
    "Largest",
    "Section",
    "Shape",
    "Taper",
    "box",
    "circle",
    "coefficients",
    "cycle_maxima",
    "deflection",
    "deflection_in_chunks",
    "displacement_of",
    "extremes",
    "i_section",
    "largest",
    "largest_row",
    "marked",
    "peak_gain",
    "rectangle",
    "reference_deflection",
    "rotation_of",
    "sample",
    "section_of",
    "tapered",
    "tube",
    "with_rotary_inertia",
]


def __dir__() -> list[str]:
    return __all__
