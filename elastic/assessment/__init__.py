"""What the fields mean for a design: strength, buckling, output error, validity of the theory."""

from elastic.assessment.buckling import euler_loads, euler_ratio, least_axial_force, slenderness
from elastic.assessment.harmonics import Harmonics, harmonics, quasi_static_error
from elastic.assessment.output_error import PathDeviation, angle_error, path_deviation, point_displacements
from elastic.assessment.over_cycle import Peak, over_cycle, period_of, rms
from elastic.assessment.strength import safety_factor, stress_range
from elastic.assessment.validity import LIMITS, Caution, Limit, cautions

__all__ = [
    "LIMITS",
    "Caution",
    "Harmonics",
    "Limit",
    "PathDeviation",
    "Peak",
    "angle_error",
    "cautions",
    "euler_loads",
    "euler_ratio",
    "harmonics",
    "least_axial_force",
    "over_cycle",
    "path_deviation",
    "period_of",
    "point_displacements",
    "quasi_static_error",
    "rms",
    "safety_factor",
    "slenderness",
    "stress_range",
]


def __dir__() -> list[str]:
    return __all__
