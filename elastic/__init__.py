"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form.

Needs numpy and `rigid` only.
"""

from elastic.deflection import FIELDS, Deflection, deflection
from elastic.extremes import Extreme, extremes
from elastic.sampling import chord_deflection, coefficients, displacement_of, sample
from elastic.section import RIGID, JointCompliance, Section, Taper

__all__ = [
    "FIELDS",
    "RIGID",
    "Deflection",
    "Extreme",
    "JointCompliance",
    "Section",
    "Taper",
    "chord_deflection",
    "coefficients",
    "deflection",
    "displacement_of",
    "extremes",
    "sample",
]
