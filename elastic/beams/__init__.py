"""Mechanics of a single beam: cross-section, elastic line, and fields as piecewise polynomials."""

from elastic.beams.compliance import designs_of
from elastic.beams.cross_sections import POISSON
from elastic.beams.outline import CrossSectionError, outline
