"""One beam: its section, its elastic line, its fields as polynomials of pieces."""

from elastic.beams.cross_sections import SHAPES, Shape, circle, rectangle, section_of, tapered, tube
from elastic.beams.section import RIGID, JointCompliance, Section, Taper

__all__ = [
    "RIGID",
    "SHAPES",
    "JointCompliance",
    "Section",
    "Shape",
    "Taper",
    "circle",
    "rectangle",
    "section_of",
    "tapered",
    "tube",
]


def __dir__() -> list[str]:
    return __all__
