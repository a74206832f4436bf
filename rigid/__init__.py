"""Rigid-body motion of planar mechanisms: mechanism in, motion, inertia loads and joint forces out.

Needs numpy; scipy only to integrate a motion and for cubic tables.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

import rigid.memory  # noqa: F401  before any array is made
from rigid.analysis.reach import ReachError, reachable, require_reach, stops
from rigid.closure import JointPlace
from rigid.conditioning import SINGULAR, amplified, hopeless
from rigid.constants import beam_table, mass_moments, per_row
from rigid.displacements import displacements
from rigid.forces import JointForces, self_stresses
from rigid.loads import (
    balancing_forces,
    beam_directions,
    beam_loads,
    drive_efforts,
    force_condition,
    point_loads,
    reactions,
)
from rigid.mechanism import (
    GROUND,
    Beam,
    Gear,
    Law,
    LineLoad,
    Link,
    Load,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointForce,
    PointLoad,
    Reals,
    Slider,
    SliderDrive,
)
from rigid.motion import Motion, acceleration_of, motion, position_of, repeated, stacked, velocity_of, with_rates
from rigid.plane import cross, dot, minus, plus
from rigid.topology.structure import Joint, Structure, structure

if TYPE_CHECKING:
    from rigid.analysis.coordinates import Coordinate, Distance, LinkAngle, Offset, Path, PointCoordinate, Rated, Slide
    from rigid.analysis.inverse import drive_values
    from rigid.analysis.limits import (
        DeadPoint,
        Limit,
        Transmission,
        dead_points,
        limits,
        swing,
        time_ratio,
        transmission_angles,
        velocity_ratio,
    )
    from rigid.chunks import columns_of, design_chunks, motion_in_chunks, of_designs
    from rigid.dynamics.effort import (
        EquationOfMotion,
        equation_of_motion,
        multiplier_forces,
        reduced_inertia,
        virtual_work_efforts,
    )
    from rigid.dynamics.energy import dissipated_power, kinetic_energy, load_power, potential_energy
    from rigid.dynamics.force_laws import (
        TableError,
        constant_law,
        law_of,
        law_of_rate,
        law_of_time,
        sum_of_laws,
        table_curve,
    )
    from rigid.dynamics.forward_dynamics import Course, Effort, ForwardError, MotionLaw, forward, motion_during
    from rigid.dynamics.springs import Spring, TorsionSpring
    from rigid.laws import CURVES, ConstantSpeed, LawError, Segment, SegmentedLaw
    from rigid.postures import Posture, assembled, flat_triangles, posture
    from rigid.topology.assur import AssurGroup, assur_groups
    from rigid.topology.graph import (
        Branch,
        Graph,
        components,
        cyclomatic_number,
        fundamental_loops,
        graph_from_incidence,
        incidence,
        loop_walk,
        spanning_tree,
    )
    from rigid.topology.input_output import Action, force_law, joint_rates, velocity_law
    from rigid.topology.mechanism_graphs import bar_graph, link_graph
    from rigid.topology.pairs import Contact, Pair, gear_contacts, kutzbach, mobility_count, pairs
    from rigid.topology.planar_chain import mechanism_mobility, planar_chain, redundant_joints, self_stress_forces
    from rigid.topology.ranks import (
        RANK_TOLERANCE,
        Chain,
        Mobility,
        kinematic_matrix,
        link_motions,
        mobility,
        self_stress,
        static_matrix,
        stressed_joints,
    )
    from rigid.topology.spatial import (
        JOINT_TYPES,
        SYNONYMS,
        JointType,
        SpatialJoint,
        kinematic_torsor,
        spatial_chain,
        static_torsor,
    )

__all__ = [
    "CURVES",
    "GROUND",
    "JOINT_TYPES",
    "RANK_TOLERANCE",
    "SINGULAR",
    "SYNONYMS",
    "Action",
    "AssurGroup",
    "Beam",
    "Branch",
    "Chain",
    "ConstantSpeed",
    "Contact",
    "Coordinate",
    "Course",
    "DeadPoint",
    "Distance",
    "Effort",
    "EquationOfMotion",
    "ForwardError",
    "Gear",
    "Graph",
    "Joint",
    "JointForces",
    "JointPlace",
    "JointType",
    "Law",
    "LawError",
    "Limit",
    "LineLoad",
    "Link",
    "LinkAngle",
    "Load",
    "Lump",
    "Mechanism",
    "MechanismError",
    "Mobility",
    "Motion",
    "MotionLaw",
    "Offset",
    "Pair",
    "Path",
    "PinDrive",
    "PointCoordinate",
    "PointForce",
    "PointLoad",
    "Posture",
    "Rated",
    "ReachError",
    "Reals",
    "Segment",
    "SegmentedLaw",
    "Slide",
    "Slider",
    "SliderDrive",
    "SpatialJoint",
    "Spring",
    "Structure",
    "TableError",
    "TorsionSpring",
    "Transmission",
    "acceleration_of",
    "amplified",
    "assembled",
    "assur_groups",
    "balancing_forces",
    "bar_graph",
    "beam_directions",
    "beam_loads",
    "beam_table",
    "columns_of",
    "components",
    "constant_law",
    "cross",
    "cyclomatic_number",
    "dead_points",
    "design_chunks",
    "displacements",
    "dissipated_power",
    "dot",
    "drive_efforts",
    "drive_values",
    "equation_of_motion",
    "flat_triangles",
    "force_condition",
    "force_law",
    "forward",
    "fundamental_loops",
    "gear_contacts",
    "graph_from_incidence",
    "hopeless",
    "incidence",
    "joint_rates",
    "kinematic_matrix",
    "kinematic_torsor",
    "kinetic_energy",
    "kutzbach",
    "law_of",
    "law_of_rate",
    "law_of_time",
    "limits",
    "link_graph",
    "link_motions",
    "load_power",
    "loop_walk",
    "mass_moments",
    "mechanism_mobility",
    "minus",
    "mobility",
    "mobility_count",
    "motion",
    "motion_during",
    "motion_in_chunks",
    "multiplier_forces",
    "of_designs",
    "pairs",
    "per_row",
    "planar_chain",
    "plus",
    "point_loads",
    "position_of",
    "posture",
    "potential_energy",
    "reachable",
    "reactions",
    "reduced_inertia",
    "redundant_joints",
    "repeated",
    "require_reach",
    "self_stress",
    "self_stress_forces",
    "self_stresses",
    "spanning_tree",
    "spatial_chain",
    "stacked",
    "static_matrix",
    "static_torsor",
    "stops",
    "stressed_joints",
    "structure",
    "sum_of_laws",
    "swing",
    "table_curve",
    "time_ratio",
    "transmission_angles",
    "velocity_law",
    "velocity_of",
    "velocity_ratio",
    "virtual_work_efforts",
    "with_rates",
]

_LATER = {
    "rigid.analysis.limits": (
        "DeadPoint",
        "Limit",
        "Transmission",
        "dead_points",
        "limits",
        "swing",
        "time_ratio",
        "transmission_angles",
        "velocity_ratio",
    ),
    "rigid.topology.assur": ("AssurGroup", "assur_groups"),
    "rigid.chunks": ("columns_of", "design_chunks", "motion_in_chunks", "of_designs"),
    "rigid.analysis.coordinates": (
        "Coordinate",
        "Distance",
        "LinkAngle",
        "Offset",
        "Path",
        "PointCoordinate",
        "Rated",
        "Slide",
    ),
    "rigid.dynamics.effort": (
        "EquationOfMotion",
        "equation_of_motion",
        "multiplier_forces",
        "reduced_inertia",
        "virtual_work_efforts",
    ),
    "rigid.dynamics.energy": ("dissipated_power", "kinetic_energy", "load_power", "potential_energy"),
    "rigid.dynamics.force_laws": (
        "TableError",
        "constant_law",
        "law_of",
        "law_of_rate",
        "law_of_time",
        "sum_of_laws",
        "table_curve",
    ),
    "rigid.dynamics.forward_dynamics": ("Course", "Effort", "ForwardError", "MotionLaw", "forward", "motion_during"),
    "rigid.topology.graph": (
        "Branch",
        "Graph",
        "components",
        "cyclomatic_number",
        "fundamental_loops",
        "graph_from_incidence",
        "incidence",
        "loop_walk",
        "spanning_tree",
    ),
    "rigid.topology.input_output": ("Action", "force_law", "joint_rates", "velocity_law"),
    "rigid.analysis.inverse": ("drive_values",),
    "rigid.laws": ("CURVES", "ConstantSpeed", "LawError", "Segment", "SegmentedLaw"),
    "rigid.topology.mechanism_graphs": ("bar_graph", "link_graph"),
    "rigid.topology.ranks": (
        "Chain",
        "Mobility",
        "RANK_TOLERANCE",
        "kinematic_matrix",
        "link_motions",
        "mobility",
        "self_stress",
        "static_matrix",
        "stressed_joints",
    ),
    "rigid.topology.pairs": ("gear_contacts", "Contact", "Pair", "kutzbach", "mobility_count", "pairs"),
    "rigid.topology.planar_chain": ("mechanism_mobility", "planar_chain", "redundant_joints", "self_stress_forces"),
    "rigid.postures": ("Posture", "assembled", "flat_triangles", "posture"),
    "rigid.topology.spatial": (
        "JOINT_TYPES",
        "JointType",
        "SYNONYMS",
        "SpatialJoint",
        "kinematic_torsor",
        "spatial_chain",
        "static_torsor",
    ),
    "rigid.dynamics.springs": ("Spring", "TorsionSpring"),
}
_MODULES = {name: module for module, names in _LATER.items() for name in names}


def __getattr__(name: str) -> Any:
    """What not every user takes is imported when it is asked for."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found = getattr(import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
