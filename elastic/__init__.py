"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form.

Needs numpy and `rigid` only.
"""

from elastic.accuracy import PathDeviation, angle_error, path_deviation, point_displacements
from elastic.buckling import euler_loads, euler_ratio, least_axial_force, slenderness
from elastic.cautions import LIMITS, Caution, Limit, cautions
from elastic.chunks import deflection_in_chunks
from elastic.cycle import Peak, over_cycle, period_of, rms
from elastic.deflection import FIELDS, Deflection, deflection
from elastic.extremes import Extreme, extremes
from elastic.forcing import Harmonics, harmonics, quasi_static_error
from elastic.sampling import chord_deflection, coefficients, displacement_of, sample
from elastic.section import RIGID, JointCompliance, Section, Taper
from elastic.shapes import Shape, circle, rectangle, section_of, tapered, tube
from elastic.strength import safety_factor, stress, stress_extremes, stress_range
from elastic.vibration import Frequencies, natural_frequencies

__all__ = [
    "FIELDS",
    "LIMITS",
    "RIGID",
    "Caution",
    "Deflection",
    "Extreme",
    "Frequencies",
    "Harmonics",
    "JointCompliance",
    "Limit",
    "PathDeviation",
    "Peak",
    "Section",
    "Shape",
    "Taper",
    "angle_error",
    "cautions",
    "chord_deflection",
    "circle",
    "coefficients",
    "deflection",
    "deflection_in_chunks",
    "displacement_of",
    "euler_loads",
    "euler_ratio",
    "extremes",
    "harmonics",
    "least_axial_force",
    "natural_frequencies",
    "over_cycle",
    "path_deviation",
    "period_of",
    "point_displacements",
    "quasi_static_error",
    "rectangle",
    "rms",
    "safety_factor",
    "sample",
    "section_of",
    "slenderness",
    "stress",
    "stress_extremes",
    "stress_range",
    "tapered",
    "tube",
]
