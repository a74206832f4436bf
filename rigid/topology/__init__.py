"""Graphs, mobility and redundancy of planar mechanisms and of spatial chains."""

from rigid.topology.assembly import assembled, flat_triangles
from rigid.topology.graph import (
    Branch,
    Graph,
    components,
    cyclomatic_number,
    fundamental_loops,
    incidence,
    loop_walk,
    spanning_tree,
)
from rigid.topology.input_output import Action, force_law, joint_rates, velocity_law
from rigid.topology.kinematic_pairs import Contact, Pair, gear_contacts, kutzbach, mobility_count, pairs
from rigid.topology.planar import bar_graph, link_graph, mechanism_mobility, planar_chain, require_fit
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
