"""Cams: profile for a follower motion, pressure angle, curvature, contact force and pressure."""

from machine.cams.courses import BOTH, INNER, OUTER, Cam, CamCourse, cam_course, cut_depth
from machine.cams.push import HERTZ_RANGE, CamPush, contact_modulus, line_pressure
