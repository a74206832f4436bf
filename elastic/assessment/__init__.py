"""Assessment of a design: strength, buckling, output error, and validity of the theory."""

from elastic.assessment.beam_theory import beyond_beam_theory, introduction_share, sections_with_shear, shear_share
from elastic.assessment.buckling import Buckling, BucklingModes, buckling_ratio
from elastic.assessment.buckling_bound import buckling_bound
from elastic.assessment.columns import euler_loads, euler_ratio, least_axial_force, slenderness
from elastic.assessment.cycle import Harmonics, harmonics, over_cycle, period_of, rms
from elastic.assessment.output_error import (
    PathDeviation,
    angle_error,
    offset_at_rest,
    path_deviation,
    rest_from,
    settling_time,
)
from elastic.assessment.strength import safety_factor, stress_ends, stress_range, web_stress
from elastic.assessment.validity import VALIDITY_RANGES, Exceedance, ValidityRange, exceedances
from elastic.assessment.vibration_bound import vibration_bound
