"""Rigid-body mechanics of planar mechanisms: motion, inertia loads and joint forces.

The package requires numpy. Integrated motions and cubic tables also require scipy. Less common functions are in
`rigid.analysis`, `closures`, `decomposition`, `dynamics`, `joints`, `kinetostatics`, `positions` and `topology`.
"""

import rigid.allocation  # noqa: F401  must be imported before any array is allocated
from rigid.arrays import Reals
from rigid.chunks import motion_in_chunks
from rigid.closures.conditioning import SINGULAR
from rigid.closures.forces import JointForces
from rigid.decomposition import assur_groups, structure
from rigid.kinematics import Motion, acceleration_of, motion, position_of, velocity_of, with_rates
from rigid.kinetostatics.resistance import Resistance
from rigid.kinetostatics.springs import Spring, TorsionSpring
from rigid.kinetostatics.statics import drive_efforts, reactions
from rigid.laws import ConstantSpeed, LawError, Segment, SegmentedLaw, TableError
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import (
    GROUND,
    PRESSURE_ANGLE,
    Beam,
    Friction,
    Gear,
    Law,
    LineLoad,
    Link,
    Load,
    Lump,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    Weld,
)
from rigid.peaks import law_peaks
from rigid.postures import Posture, posture
from rigid.reach import ReachError, opening_joint, reach_message, reachable, require_reach
from rigid.table_laws import RepeatedLaw, TableLaw
from rigid.transmission import transmission_angles

__all__ = [
    "GROUND", "PRESSURE_ANGLE", "SINGULAR", "Beam", "ConstantSpeed", "Friction", "Gear", "JointForces", "Law",
    "LawError", "LineLoad", "Link", "Load", "Lump", "Mechanism", "MechanismError", "Motion", "PinDrive", "PointLoad",
    "Posture", "ReachError", "Reals", "RepeatedLaw", "Resistance", "Segment", "SegmentedLaw", "Slider", "SliderDrive",
    "Spring", "TableError", "TableLaw", "TorsionSpring", "Weld", "acceleration_of", "assur_groups", "counted",
    "drive_efforts", "law_peaks", "motion", "motion_in_chunks", "opening_joint", "position_of", "posture",
    "reach_message", "reachable", "reactions", "require_reach", "structure", "transmission_angles", "velocity_of",
    "with_rates",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
