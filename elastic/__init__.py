"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form.

Needs numpy and `rigid` only. What the fields mean for a design is in `elastic.assessment`, natural frequencies in
`elastic.vibration`, and vibrating links in `elastic.elastodynamics`.
"""

from elastic.beams.cross_sections import SHAPES, Shape, circle, rectangle, section_of, tapered, tube
from elastic.beams.section import RIGID, JointCompliance, Section, Taper
from elastic.chunks import deflection_in_chunks
from elastic.derived import coefficients
from elastic.extreme_values import Extreme, extremes
from elastic.fields import FIELDS, PRIMARY, Field, Kind
from elastic.sampling import displacement_of, reference_deflection, sample
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
    "Section",
    "Shape",
    "Taper",
    "circle",
    "coefficients",
    "deflection",
    "deflection_in_chunks",
    "displacement_of",
    "extremes",
    "marked",
    "rectangle",
    "reference_deflection",
    "sample",
    "section_of",
    "tapered",
    "tube",
]


def __dir__() -> list[str]:
    return __all__
