"""Cams: profile for a follower motion, pressure angle, curvature, contact force and pressure."""

from machine.cams.contact import HERTZ_RANGE, contact_modulus, line_pressure
from machine.cams.courses import BOTH, INNER, OUTER, Cam, CamCourse, cam_course, cut_depth
from machine.cams.push import CamPush

__all__ = [
    "BOTH",
    "HERTZ_RANGE",
    "INNER",
    "OUTER",
    "Cam",
    "CamCourse",
    "CamPush",
    "cam_course",
    "contact_modulus",
    "cut_depth",
    "line_pressure",
]


def __dir__() -> list[str]:
    return __all__
