"""End load of each beam, from the equilibrium of the part of the link beyond it, and the effects of gears."""

from collections.abc import Iterable, Iterator

import numpy as np

from elastic.arrays import PerBeam, VectorPerBeam
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees
from elastic.links.configuration import Configuration, LinkLoads, NodeDisplacements, NodeLoads
from rigid import JointForces, Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.closures import gear_input, gear_loads
from rigid.joints import JointPlace
from rigid.kinetostatics import point_loads
from rigid.plane import ZERO, cross

NO_DISPLACEMENT = (ZERO, ZERO)


def gear_node_loads(motion: Motion, forces: JointForces) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Yield the loads of gears on links at the points of driving joints and followers, in addition to joint forces.

    Yields
    ------
    Link index, point name, force in ground axes [N], complex, and moment [N m].
    """
    for number, place in enumerate(motion.places):
        if place.joint.gear is not None:
            for load in gear_loads(place, *forces.without_friction(number), forces.flank.get(number, 0.0)):
                yield load.link, load.joint.point(load.link) or "", load.force, load.moment


def follower_displacement(
    place: JointPlace, nodes: NodeDisplacements, flank: Columns | None
) -> tuple[Columns, Columns]:
    """Return the displacement [m], complex, and rotation [rad] of a gear's follower due to bending of the links.

    `flank` is the loaded tooth flank (see `JointForces`), or None for a gear without teeth.
    """
    return place.driven(
        gear_input(place, lambda joint, link: nodes.get((link, joint.point(link) or ""), NO_DISPLACEMENT), flank)
    )


def node_loads(motion: Motion, trees: BeamTrees) -> NodeLoads:
    """Sum the concentrated loads at each node."""
    nodes: NodeLoads = {}
    for at, point, force, moment in point_loads(motion):
        if (at, point) in trees.tips:
            add_load(nodes, (at, point), force, moment)
    return nodes


def with_joint_forces(nodes: NodeLoads, motion: Motion, trees: BeamTrees, forces: JointForces) -> NodeLoads:
    """Add joint forces, and the loads of gears that are not joint forces, to node loads."""
    nodes = dict(nodes)
    for joint, force, moment in zip(motion.structure.joints, forces.force, forces.moment, strict=True):
        child, parent = (joint.child, joint.child_point or ""), (joint.parent, joint.parent_point or "")
        if child in trees.tips:
            add_load(nodes, child, force, moment)
        if parent in trees.tips:
            add_load(nodes, parent, -force, -moment)
    for at, point, force, moment in gear_node_loads(motion, forces):
        if (at, point) in trees.tips:
            add_load(nodes, (at, point), force, moment)
    return nodes


def with_points(nodes: NodeLoads, trees: BeamTrees, points: Iterable[tuple[int, str, Complexes, Reals]]) -> NodeLoads:
    """Add loads at points (link index, point name, force, moment) to node loads."""
    nodes = dict(nodes)
    for at, point, force, moment in points:
        if (at, point) in trees.tips:
            add_load(nodes, (at, point), force, moment)
    return nodes


def resultants(
    added: AddedLoads, motion: Motion, configuration: Configuration
) -> Iterator[tuple[int, Columns, Columns]]:
    """Yield the resultants of additional loads at the origins of the links.

    Yields
    ------
    Link index, force in ground axes [N], complex, and moment [N m].
    """
    mechanism, loads = motion.mechanism, LinkLoads({}, added.q)
    for k, (at, beam) in enumerate(mechanism.beams):
        force, moment = _own_load(configuration, k, loads)
        arm = configuration.link[at] * mechanism.links[at].points[beam.start]
        yield at, force, cross(arm, force) + moment
    for at, point, force, moment in added.points:
        arm = configuration.link[at] * mechanism.links[at].points[point]
        yield at, force, cross(arm, force) + moment
    for number, force, moment in added.blocks:
        place = motion.places[number]
        owner = place.joint.owner
        yield owner, force, cross(place.arm(owner), force) + moment
    for number, _, moment in added.slides:
        yield motion.places[number].joint.owner, 0j, moment


def add_load(nodes: NodeLoads, where: tuple[int, str], force: Columns, moment: Columns) -> None:
    """Add a force and a moment to the load of a node."""
    before = nodes.get(where)
    nodes[where] = (force, moment) if before is None else (before[0] + force, before[1] + moment)


def end_loads(configuration: Configuration, loads: LinkLoads) -> tuple[VectorPerBeam, PerBeam]:
    """Return the force in beam axes [N], complex, and the moment [N m] that act on the end of each beam.

    The shape of each is (beams, ..., positions).
    """
    carried = dict(loads.nodes)
    pull = np.empty((len(configuration.length), *configuration.columns), complex)
    twist = np.empty((len(configuration.length), *configuration.columns))
    for at, tree in configuration.trees.trees.items():
        for branch in reversed(tree):
            k = branch.number
            force, moment = carried.get((at, branch.far), (0.0, 0.0))
            if branch.forward:
                pull[k], twist[k] = force, moment
            if branch is tree[0] and branch.forward:
                continue
            load, about_start = _own_load(configuration, k, loads)
            arm = configuration.arm(at, branch.near, branch.far)
            moment = moment + cross(arm, force) + about_start
            if not branch.forward:
                moment = moment + cross(arm, load)
                pull[k], twist[k] = -(force + load), -moment
            add_load(carried, (at, branch.near), force + load, moment)
    pull *= configuration.back
    return pull, twist


def _own_load(configuration: Configuration, k: int, loads: LinkLoads) -> tuple[Complexes, Reals]:
    """Return the resultant of the loads along a beam: force in ground axes [N], and moment about its start [N m]."""
    length, q = configuration.length[k], loads.q
    force = length * np.tensordot(1.0 / np.arange(1, len(q) + 1), q[:, k], 1)
    moment = length**2 * np.tensordot(1.0 / np.arange(2, len(q) + 2), q[:, k].imag, 1)
    if loads.couple is not None:
        moment = moment + length * np.tensordot(1.0 / np.arange(1, len(loads.couple) + 1), loads.couple[:, k], 1)
    for block in loads.blocks:
        if block.beam == k:
            force = force + block.force
            moment = moment + block.moment + block.xi * length * block.force.imag
    return configuration.beam[k] * force, moment
