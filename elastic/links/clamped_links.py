"""Section forces and displacements of loaded links that are clamped at the roots of their beam trees."""

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.arrays import Coefficients, PerBeam
from elastic.beams.blocks import Block, at
from elastic.beams.compliance import BeamCompliance
from elastic.beams.elastic_line import Amplitudes, elastic_line, free_line, section_forces
from elastic.links.beam_trees import root_of
from elastic.links.configuration import Configuration, LinkLoads, NodeDisplacements
from elastic.links.free_body import end_loads
from rigid.arrays import Complexes, Reals
from rigid.plane import ZERO


class LinkResponse(Struct, frozen=True, eq=False):
    """Response of the links to loads.

    Attributes
    ----------
    amplitudes
        Coefficients of the fields of each beam, as if the beam were clamped at its start.
    nodes
        Displacements of the nodes of each link, which is clamped at its root.
    blocks
        Loads of sliding blocks.
    """

    amplitudes: Amplitudes
    nodes: NodeDisplacements
    blocks: tuple[Block, ...]


def clamped_response(configuration: Configuration, compliance: BeamCompliance, loads: LinkLoads) -> LinkResponse:
    """Compute the section forces and displacements of links that are clamped at their roots and have open rings."""
    N, V, M = section_forces(loads.q, loads.couple, *end_loads(configuration, loads), compliance)
    for block in loads.blocks:
        _before_block(N, V, M, compliance.length, block)
    amplitudes, ends = elastic_line(N, V, M, compliance)
    if loads.strain is not None:
        free = free_line(loads.strain, compliance.length)
        amplitudes = replace(amplitudes, free=free)
        ends = tuple(end + more.sum(0) for end, more in zip(ends, free, strict=True))
    for block in loads.blocks:
        more = block.beyond(compliance)
        for end, field in zip(ends, ("u", "w", "phi"), strict=True):
            end[block.beam] += at(more[field], 1.0 - block.xi)
    return LinkResponse(amplitudes, _node_displacements(configuration, *ends), loads.blocks)


def _before_block(N: Coefficients, V: Coefficients, M: Coefficients, length: PerBeam, block: Block) -> None:
    """Add the load of a block to the section forces in the part of the beam before the block."""
    k = block.beam
    N[0, k] += block.force.real
    V[0, k] -= block.force.imag
    M[0, k] += block.moment + block.xi * length[k] * block.force.imag
    M[1, k] -= length[k] * block.force.imag


def _node_displacements(configuration: Configuration, u: PerBeam, w: PerBeam, phi: PerBeam) -> NodeDisplacements:
    """Compute the displacements of nodes by summing the end displacements of clamped beams from the root outwards."""
    nodes: NodeDisplacements = {}
    ends = np.empty(u.shape, complex)
    ends.real, ends.imag = u, w
    ends *= configuration.beam
    for link, tree in configuration.trees.trees.items():
        nodes[link, root_of(tree)] = (ZERO, ZERO)
        for branch in tree:
            move, turn = ends[branch.number], phi[branch.number]
            if branch is tree[0] and branch.forward:
                nodes[link, branch.far] = (move, turn)
                continue
            before, turned = nodes[link, branch.near]
            arm = 1j * configuration.arm(link, branch.near, branch.far)
            if branch.forward:
                nodes[link, branch.far] = (before + turned * arm + move, turned + turn)
            else:
                turned = turned - turn
                nodes[link, branch.far] = (before + turned * arm - move, turned)
    return nodes


def add_rigid_motion(configuration: Configuration, response: LinkResponse, shift: Complexes, angle: Reals) -> None:
    """Add the displacement of the start of each beam to the fields of the beam, in place.

    This displacement is the sum of the rigid motion of the link and the bending of the preceding beams.

    Parameters
    ----------
    shift, angle
        Displacement [m], complex, and rotation [rad] of the axes of the links, shape (links, ..., positions).
    """
    amplitudes = response.amplitudes
    start_shift = configuration.back * shift[configuration.rows]
    amplitudes.phi[0] = angle[configuration.rows]
    for link, tree in configuration.trees.trees.items():
        for branch in tree:
            k = branch.number
            start = branch.near if branch.forward else branch.far
            local = configuration.trees.points[link, start]
            if start == root_of(tree) and not np.ndim(local) and local == 0:
                continue
            move, more = response.nodes[link, start]
            start_shift[k] += configuration.back[k] * (move + 1j * angle[link] * (configuration.link[link] * local))
            amplitudes.phi[0, k] = amplitudes.phi[0, k] + more
    amplitudes.u[0], amplitudes.w[0] = start_shift.real, start_shift.imag
    amplitudes.w[1] += configuration.length * amplitudes.phi[0]
