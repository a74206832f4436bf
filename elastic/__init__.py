"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form."""

from elastic.deflection import FIELDS, Deflection, deflection
from elastic.section import RIGID, Section

__all__ = ["FIELDS", "RIGID", "Deflection", "Section", "deflection"]
