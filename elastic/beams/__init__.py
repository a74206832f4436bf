"""A single beam: cross-section, elastic line, and fields as piecewise polynomials."""

from elastic.beams.compliance import designs_of
from elastic.beams.cross_sections import (
    POISSON,
    SHAPES,
    Shape,
    angle,
    box,
    channel,
    circle,
    i_section,
    rectangle,
    t_section,
    tube,
)
from elastic.beams.outline import CrossSectionError, outline
from elastic.beams.section import RIGID, JointCompliance, Section, Taper, with_rotary_inertia
from elastic.beams.shaped_sections import section_of, tapered
