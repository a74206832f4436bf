"""Rigid-body motion of planar mechanisms: mechanism in, motion, inertia loads and joint forces out.

Needs numpy only.
"""

from rigid.displacements import displacements
from rigid.forces import JointForces
from rigid.loads import beam_direction, beam_loads, drive_efforts, point_loads, reactions
from rigid.mechanism import (
    GROUND,
    Beam,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Reals,
    Slider,
    SliderDrive,
)
from rigid.motion import SINGULAR, Motion, acceleration_of, motion, position_of, stacked, velocity_of
from rigid.plane import cross, dot
from rigid.reach import ReachError, reachable, require_reach, stops
from rigid.structure import Structure, structure

__all__ = [
    "GROUND",
    "SINGULAR",
    "Beam",
    "JointForces",
    "LineLoad",
    "Link",
    "Lump",
    "Mechanism",
    "MechanismError",
    "Motion",
    "PinDrive",
    "PointLoad",
    "ReachError",
    "Reals",
    "Slider",
    "SliderDrive",
    "Structure",
    "acceleration_of",
    "beam_direction",
    "beam_loads",
    "cross",
    "displacements",
    "dot",
    "drive_efforts",
    "motion",
    "point_loads",
    "position_of",
    "reachable",
    "reactions",
    "require_reach",
    "stacked",
    "stops",
    "structure",
    "velocity_of",
]
