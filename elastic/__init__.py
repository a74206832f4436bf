"""Deflection of the links of moving mechanisms: motion in, section forces and displacements out, in closed form.

Needs numpy and `rigid` only.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from elastic.beams.section import RIGID, JointCompliance, Section, Taper
from elastic.deflection import FIELDS, Deflection, deflection
from elastic.extremes import Extreme, extremes
from elastic.sampling import coefficients, displacement_of, sample

if TYPE_CHECKING:
    from elastic.assessment.buckling import euler_loads, euler_ratio, least_axial_force, slenderness
    from elastic.assessment.harmonics import Harmonics, harmonics, quasi_static_error
    from elastic.assessment.output_error import PathDeviation, angle_error, path_deviation, point_displacements
    from elastic.assessment.over_cycle import Peak, over_cycle, period_of, rms
    from elastic.assessment.strength import safety_factor, stress, stress_extremes, stress_range
    from elastic.assessment.validity import LIMITS, Caution, Limit, cautions
    from elastic.beams.cross_sections import Shape, circle, rectangle, section_of, tapered, tube
    from elastic.chunks import deflection_in_chunks
    from elastic.elastodynamics.solution import Elastodynamic
    from elastic.elastodynamics.speed_map import SpeedMap, speed_map
    from elastic.elastodynamics.steady_state import elastodynamic
    from elastic.elastodynamics.strains import Damping
    from elastic.elastodynamics.structural_buckling import buckling_factor
    from elastic.elastodynamics.theory_error import TheoryError, theory_error
    from elastic.elastodynamics.transient import transient
    from elastic.vibration.frequencies import Frequencies, natural_frequencies

__all__ = [
    "FIELDS",
    "LIMITS",
    "RIGID",
    "Caution",
    "Damping",
    "Deflection",
    "Elastodynamic",
    "Extreme",
    "Frequencies",
    "Harmonics",
    "JointCompliance",
    "Limit",
    "PathDeviation",
    "Peak",
    "Section",
    "Shape",
    "SpeedMap",
    "Taper",
    "TheoryError",
    "angle_error",
    "buckling_factor",
    "cautions",
    "circle",
    "coefficients",
    "deflection",
    "deflection_in_chunks",
    "displacement_of",
    "elastodynamic",
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
    "speed_map",
    "stress",
    "stress_extremes",
    "stress_range",
    "tapered",
    "theory_error",
    "transient",
    "tube",
]

_LATER = {
    "elastic.assessment.output_error": ("PathDeviation", "angle_error", "path_deviation", "point_displacements"),
    "elastic.assessment.buckling": ("euler_loads", "euler_ratio", "least_axial_force", "slenderness"),
    "elastic.assessment.validity": ("Caution", "LIMITS", "Limit", "cautions"),
    "elastic.chunks": ("deflection_in_chunks",),
    "elastic.assessment.over_cycle": ("Peak", "over_cycle", "period_of", "rms"),
    "elastic.assessment.harmonics": ("Harmonics", "harmonics", "quasi_static_error"),
    "elastic.beams.cross_sections": ("Shape", "circle", "rectangle", "section_of", "tapered", "tube"),
    "elastic.assessment.strength": ("safety_factor", "stress", "stress_extremes", "stress_range"),
    "elastic.elastodynamics.solution": ("Elastodynamic",),
    "elastic.elastodynamics.speed_map": ("SpeedMap", "speed_map"),
    "elastic.elastodynamics.steady_state": ("elastodynamic",),
    "elastic.elastodynamics.strains": ("Damping",),
    "elastic.elastodynamics.structural_buckling": ("buckling_factor",),
    "elastic.elastodynamics.theory_error": ("TheoryError", "theory_error"),
    "elastic.elastodynamics.transient": ("transient",),
    "elastic.vibration.frequencies": ("Frequencies", "natural_frequencies"),
}
_MODULES = {name: module for module, names in _LATER.items() for name in names}


def __getattr__(name: str) -> Any:
    """What not every user takes is imported when it is asked for."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = _MODULES[name]
    module = import_module(home)
    # all of its names at once: one is the module's own, which the import has put in its place
    globals().update({own: getattr(module, own) for own in _LATER[home]})
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
