"""Analysis of a motion: limit positions, reach, transmission angles, inverse kinematics."""

from rigid.analysis.coordinates import (
    Coordinate,
    Distance,
    LinkAngle,
    Offset,
    PathLength,
    PointCoordinate,
    Rated,
    Slide,
)
from rigid.analysis.repetition import Repetition, common_period, drives_repeat, mechanism_repeats
from rigid.analysis.turning_points import (
    DeadPoint,
    LimitPosition,
    dead_points,
    drive_values,
    limits,
    swing,
    time_ratio,
    velocity_ratio,
)
from rigid.reach import ReachError, reachable, require_reach, stops
from rigid.transmission import Transmission, transmission_angles
