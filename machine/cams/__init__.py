"""Cams: profile for a follower motion, pressure angle, curvature, contact force and pressure."""

from machine.cams.flanks import BOTH, INNER, OUTER, Cam, CamFlank, cam_flank, cut_depth
from machine.cams.push import HERTZ_RANGE, CamPush, contact_modulus, line_pressure
