"""Compatibility: gaps between bent links, statically indeterminate joint forces, and links with closed rings.

This corresponds to equations (8) to (16) of Utenov et al. There, (8) to (11) propagate the displacement of a joint from
one link to the next, and (12) to (15) close the loop with the conditions (16) at its end. Here, each link is bent
separately, as if it were clamped at the root of its beams. Rigid-body displacements of the links then close the joints,
see `rigid.closures.displacements`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.arrays import Matrices, VectorCoefficients
from elastic.beams.blocks import Block, at
from elastic.beams.compliance import BeamCompliance, compliance_of
from elastic.beams.polynomials import added, evaluate
from elastic.beams.section import JointCompliance, Section
from elastic.links.added_loads import AddedLoads
from elastic.links.clamped_links import LinkResponse, clamped_response
from elastic.links.configuration import (
    Configuration,
    ElasticProblem,
    LinkLoads,
    NodeDisplacements,
    NodeLoads,
    configuration_of,
)
from elastic.links.free_body import (
    NO_DISPLACEMENT,
    add_load,
    follower_displacement,
    node_loads,
    with_joint_forces,
    with_points,
)
from elastic.links.sliding_blocks import block_loads
from rigid import JointForces, Motion
from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.closures import MAX_UNSTRESSED
from rigid.kinetostatics import beam_couples, beam_loads
from rigid.plane import dot

CLOSING_PASSES = 2  # the second pass removes round-off, which is large if the stiffnesses of beams differ very much


class JointGaps(Struct, frozen=True, eq=False):
    """Gaps at the joints between bent links, before rigid-body displacements close them.

    Attributes
    ----------
    displacement, rotation
        For each joint, the displacement of the child's point relative to the parent's point [m], complex, and the
        rotation [rad], by which the joint would be closed.
    """

    displacement: list[Columns]
    rotation: list[Columns]


def problem_of(
    motion: Motion, sections: tuple[Section, ...], joints: Mapping[str, JointCompliance], more: AddedLoads | None = None
) -> ElasticProblem:
    """Set up the elastic problem of a motion with inertia, weight, given loads and additional loads."""
    configuration = configuration_of(motion)
    nodes, q = node_loads(motion, configuration.trees), beam_loads(motion)
    if more is not None:
        nodes, q = with_points(nodes, configuration.trees, more.points), added(q, more.q)
    couple = beam_couples(motion)
    powers = len(q) + 2 if couple is None else max(len(q) + 2, len(couple) + 1)
    compliance = compliance_of(motion.mechanism, sections, len(motion.columns), powers)
    return ElasticProblem(
        motion,
        configuration,
        compliance,
        joints,
        LinkLoads(nodes, q, strain=None if more is None else more.strain, couple=couple),
        more,
    )


def bent_links(problem: ElasticProblem, forces: JointForces) -> tuple[LinkResponse, JointGaps]:
    """Return the response of clamped links to loads and joint forces, and the resulting gaps at the joints."""
    motion, trees = problem.motion, problem.configuration.trees
    blocks = block_loads(motion, problem.configuration, forces, problem.added)
    nodes = with_joint_forces(problem.loads.nodes, motion, trees, forces)
    loads = replace(problem.loads, nodes=nodes, blocks=tuple(block for each in blocks for block in each))
    response = link_response(problem.configuration, problem.compliance, loads)
    displacement: list[Any] = []
    rotation: list[Any] = []
    on_rails = dict(zip(trees.rails, blocks, strict=True))
    for number, (joint, place) in enumerate(zip(motion.structure.joints, motion.places, strict=True)):
        child = response.nodes.get((joint.child, joint.child_point or ""), NO_DISPLACEMENT)
        parent = response.nodes.get((joint.parent, joint.parent_point or ""), NO_DISPLACEMENT)
        if number in on_rails:
            under = under_blocks(problem, response, on_rails[number])
            child, parent = (child, under) if joint.owner == joint.parent else (under, parent)
        gap, turn = parent[0] - child[0], parent[1] - child[1]
        if joint.name in problem.joints:
            own = problem.joints[joint.name]
            force, moment = forces.without_friction(number)  # friction forces do not deform a compliant joint
            gap, turn = gap - force * own.translation + own.gap, turn - moment * own.rotation + own.turn
        if problem.added is not None:
            gap, turn = gap + problem.added.gaps[number], turn + problem.added.turns[number]
        if joint.gear is not None:
            along, turned = follower_displacement(place, response.nodes, forces.flank.get(number))
            gap, turn = gap + along, turn + turned
        displacement.append(gap)
        rotation.append(turn)
    return response, JointGaps(displacement, rotation)


def under_blocks(problem: ElasticProblem, response: LinkResponse, blocks: Sequence[Block]) -> tuple[Complexes, Reals]:
    """Return the displacement in ground axes, and the rotation, of the beam under a block.

    `blocks` describes the block on each of the beams along its line.
    """
    moved, turned = _under_block(problem, response, blocks[0])
    for block in blocks[1:]:
        there, turn = _under_block(problem, response, block)
        moved, turned = np.where(block.here, there, moved), np.where(block.here, turn, turned)
    return moved, turned


def _under_block(problem: ElasticProblem, response: LinkResponse, block: Block) -> tuple[Complexes, Reals]:
    """Return the displacement in ground axes, and the rotation, of a beam of a clamped link under a block."""
    k, configuration, amplitudes = block.beam, problem.configuration, response.amplitudes
    link, beam = problem.motion.mechanism.beams[k]
    u, w, phi = (evaluate(values[:, k], block.xi) for values in (amplitudes.u, amplitudes.w, amplitudes.phi))
    if amplitudes.free is not None:
        u, w, phi = (
            value + evaluate(free[:, k], block.xi) for value, free in zip((u, w, phi), amplitudes.free, strict=True)
        )
    for other in response.blocks:
        if other.beam == k:
            way = np.maximum(block.xi - other.xi, 0.0)
            more = other.beyond(problem.compliance)
            u, w, phi = u + at(more["u"], way), w + at(more["w"], way), phi + at(more["phi"], way)
    before, turned = response.nodes[link, beam.start]
    arm = configuration.beam[k] * (block.xi * configuration.length[k])
    return before + 1j * turned * arm + configuration.beam[k] * (u + 1j * w), turned + phi


def compatible_forces(
    problem: ElasticProblem, forces: JointForces, gaps: JointGaps, states: Sequence[JointForces]
) -> JointForces:
    """Add self-stresses to the joint forces so that the bent links fit together (force method).

    A self-stress does no work on rigid-body displacements of the links. If these can close the gaps, its work on the
    gaps must therefore be zero. This gives one equation for each self-stress.

    Parameters
    ----------
    forces, gaps
        Joint forces that are in equilibrium with the loads (any of the many solutions), and the gaps under these
        forces.
    states
        Self-stresses: joint forces that are in equilibrium without loads.
    """
    unloaded = problem.unloaded
    alone = [bent_links(unloaded, state)[1] for state in states]
    work = np.array([[_work(state, other) for other in alone] for state in states])
    missing = np.array([_work(state, gaps) for state in states])
    flexibility, right = np.moveaxis(work, (0, 1), (-2, -1)), np.moveaxis(missing, 0, -1)
    size = np.sqrt(np.abs(np.diagonal(flexibility, axis1=-2, axis2=-1)))
    redundants = np.full(right.shape, np.nan)
    good = np.isfinite(right).all(axis=-1) & np.isfinite(flexibility).all(axis=(-2, -1)) & (size > 0).all(axis=-1)
    scaled = flexibility[good] / (size[good][:, :, None] * size[good][:, None, :])
    redundants[good] = -np.linalg.solve(scaled, (right[good] / size[good])[..., None])[..., 0] / size[good]
    force, moment, (pull, twist) = list(forces.force), list(forces.moment), forces.ground_load
    for number, state in enumerate(states):
        amount = redundants[..., number]
        force = [value + _scaled_part(amount, part) for value, part in zip(force, state.force, strict=True)]
        moment = [value + _scaled_part(amount, part) for value, part in zip(moment, state.moment, strict=True)]
        # the load on the ground is needed separately, because gears load the ground directly and not only through
        # joints
        pull, twist = (
            value + _scaled_part(amount, part) for value, part in zip((pull, twist), state.ground_load, strict=True)
        )
    return replace(forces, force=force, moment=moment, ground_load=(pull, twist))


def _scaled_part(amount: Reals, part: Columns) -> Numbers:
    """Multiply a component of a self-stress by a factor.

    If the component is zero, the result is zero even if the factor is nan.
    """
    return np.where(np.abs(part) > MAX_UNSTRESSED, amount, 0.0) * part


def _work(state: JointForces, gaps: JointGaps) -> Columns:
    """Return the work of a self-stress on the joint gaps."""
    total: Columns = 0.0
    for force, moment, gap, turn in zip(state.force, state.moment, gaps.displacement, gaps.rotation, strict=True):
        total = total + dot(force, gap) + moment * turn
    return total


def link_response(configuration: Configuration, compliance: BeamCompliance, loads: LinkLoads) -> LinkResponse:
    """Compute the section forces and displacements of links that are clamped at their roots and have closed rings."""
    if configuration.trees.cuts:
        loads = _with_redundants(configuration, compliance, loads)
    return clamped_response(configuration, compliance, loads)


def _with_redundants(configuration: Configuration, compliance: BeamCompliance, loads: LinkLoads) -> LinkLoads:
    """Add the loads at cuts that close the rings, by the force method with three redundants per ring."""
    scaled, scale = _flexibility(configuration, compliance, loads.q)
    for _ in range(CLOSING_PASSES):
        nodes = clamped_response(configuration, compliance, loads).nodes
        openings = np.moveaxis(_openings(configuration, nodes), 0, -1)
        redundants = -np.linalg.solve(scaled, (openings * scale)[..., None])[..., 0] * scale
        closed = dict(loads.nodes)
        for number, cut in enumerate(configuration.trees.cuts):
            along, across, moment = (redundants[..., 3 * number + row] for row in range(3))
            force = configuration.link[cut.link] * (along + 1j * across)
            add_load(closed, (cut.link, cut.free), force, moment)
            add_load(closed, (cut.link, cut.node), -force, -moment)
        loads = replace(loads, nodes=closed)
    return loads


def _flexibility(
    configuration: Configuration, compliance: BeamCompliance, q: VectorCoefficients
) -> tuple[Matrices, Reals]:
    """Return the flexibility matrix of the cuts, scaled to a unit diagonal, and the scale factors.

    The shapes are (..., n, n) and (..., n). The flexibility refers to link axes, so that it is the same at all
    positions.
    """
    local = configuration.in_link_axes
    nothing = np.zeros((len(q), len(local.length), *local.columns), complex)
    openings = []
    for cut in local.trees.cuts:
        for pair in ((1.0, 0.0), (1j, 0.0), (0.0, 1.0)):
            nodes: NodeLoads = {}
            add_load(nodes, (cut.link, cut.free), *(np.broadcast_to(value, local.columns) for value in pair))
            add_load(nodes, (cut.link, cut.node), *(np.broadcast_to(-value, local.columns) for value in pair))
            response = clamped_response(local, compliance.unstrained, LinkLoads(nodes, nothing))
            openings.append(_openings(local, response.nodes))
    flexibility = np.moveaxis(np.array(openings), (0, 1), (-1, -2))
    scale = 1.0 / np.sqrt(np.abs(np.diagonal(flexibility, axis1=-2, axis2=-1)))
    return flexibility * scale[..., :, None] * scale[..., None, :], scale


def _openings(configuration: Configuration, nodes: NodeDisplacements) -> Reals:
    """Return the opening of each ring at its cut in link axes (x, y, rotation), shape (3 cuts, ..., positions)."""
    rows = []
    for cut in configuration.trees.cuts:
        (free, turned), (node, held) = nodes[cut.link, cut.free], nodes[cut.link, cut.node]
        opened = np.conj(configuration.link[cut.link]) * (free - node)
        rows += [opened.real, opened.imag, turned - held]
    return np.array(np.broadcast_arrays(*rows))
