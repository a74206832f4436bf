"""Rigid-body motion of planar mechanisms: mechanism in, motion, inertia loads and joint forces out.

Needs numpy only.
"""

import rigid.memory  # noqa: F401  before any array is made
from rigid.assur import AssurGroup, assur_groups
from rigid.displacements import displacements
from rigid.forces import JointForces, self_stresses
from rigid.graph import (
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
from rigid.input_output import Action, force_law, joint_rates, velocity_law
from rigid.laws import CURVES, ConstantSpeed, LawError, Segment, SegmentedLaw
from rigid.loads import (
    balancing_forces,
    beam_direction,
    beam_directions,
    beam_loads,
    drive_efforts,
    point_loads,
    reactions,
)
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
from rigid.mechanism_graphs import bar_graph, link_graph
from rigid.mobility import (
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
from rigid.motion import SINGULAR, Motion, acceleration_of, motion, position_of, stacked, velocity_of
from rigid.pairs import Contact, Pair, kutzbach, mobility_count, pairs
from rigid.planar import mechanism_mobility, planar_chain, redundant_joints, self_stress_forces
from rigid.plane import cross, dot
from rigid.posture import Posture, assembled, flat_triangles, posture
from rigid.reach import ReachError, reachable, require_reach, stops
from rigid.spatial import JOINT_TYPES, SYNONYMS, JointType, SpatialJoint, kinematic_torsor, spatial_chain, static_torsor
from rigid.structure import Structure, structure
from rigid.tables import beam_table, per_row

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
    "Graph",
    "JointForces",
    "JointType",
    "LawError",
    "LineLoad",
    "Link",
    "Lump",
    "Mechanism",
    "MechanismError",
    "Mobility",
    "Motion",
    "Pair",
    "PinDrive",
    "PointLoad",
    "Posture",
    "ReachError",
    "Reals",
    "Segment",
    "SegmentedLaw",
    "Slider",
    "SliderDrive",
    "SpatialJoint",
    "Structure",
    "acceleration_of",
    "assembled",
    "assur_groups",
    "balancing_forces",
    "bar_graph",
    "beam_direction",
    "beam_directions",
    "beam_loads",
    "beam_table",
    "components",
    "cross",
    "cyclomatic_number",
    "displacements",
    "dot",
    "drive_efforts",
    "flat_triangles",
    "force_law",
    "fundamental_loops",
    "graph_from_incidence",
    "incidence",
    "joint_rates",
    "kinematic_matrix",
    "kinematic_torsor",
    "kutzbach",
    "link_graph",
    "link_motions",
    "loop_walk",
    "mechanism_mobility",
    "mobility",
    "mobility_count",
    "motion",
    "pairs",
    "per_row",
    "planar_chain",
    "point_loads",
    "position_of",
    "posture",
    "reachable",
    "reactions",
    "redundant_joints",
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
    "velocity_law",
    "velocity_of",
]
