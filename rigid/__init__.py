"""Rigid-body motion of planar mechanisms: mechanism in, motion, inertia loads and joint forces out.

Needs numpy only.
"""

import rigid.memory  # noqa: F401  before any array is made
from rigid.displacements import displacements
from rigid.forces import JointForces
from rigid.laws import CURVES, ConstantSpeed, LawError, Segment, SegmentedLaw
from rigid.loads import beam_direction, beam_directions, beam_loads, drive_efforts, point_loads, reactions
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
from rigid.tables import beam_table, per_row

__all__ = [
    "CURVES",
    "GROUND",
    "SINGULAR",
    "Beam",
    "ConstantSpeed",
    "JointForces",
    "LawError",
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
    "Segment",
    "SegmentedLaw",
    "Slider",
    "SliderDrive",
    "Structure",
    "acceleration_of",
    "beam_direction",
    "beam_directions",
    "beam_loads",
    "beam_table",
    "cross",
    "displacements",
    "dot",
    "drive_efforts",
    "motion",
    "per_row",
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
