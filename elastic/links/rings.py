"""Rings of beams, cut open and closed by redundants (force method)."""

from dataclasses import replace

import numpy as np

from elastic.arrays import Matrices, VectorCoefficients
from elastic.beams.compliance import BeamCompliance
from elastic.links.clamped_links import LinkResponse, clamped_response
from elastic.links.configuration import Configuration, LinkLoads, NodeDisplacements, NodeLoads
from elastic.links.free_body import add_load
from rigid.arrays import Reals

CLOSING_PASSES = 2  # the second pass removes round-off between beams of very different stiffness


def link_response(configuration: Configuration, compliance: BeamCompliance, loads: LinkLoads) -> LinkResponse:
    """Section forces and displacements of the links under load, clamped at their roots, with rings closed."""
    if configuration.trees.cuts:
        loads = _with_redundants(configuration, compliance, loads)
    return clamped_response(configuration, compliance, loads)


def _with_redundants(configuration: Configuration, compliance: BeamCompliance, loads: LinkLoads) -> LinkLoads:
    """Add the loads that close the rings: force method, three redundants per ring."""
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
    """Flexibility of the cuts, scaled to a unit diagonal, shape (..., n, n), and the scale (..., n).

    It is computed in link axes, so that it does not depend on the position.
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
    """Opening of each ring at its cut in link axes: x, y, rotation; shape (3 cuts, ..., positions)."""
    rows = []
    for cut in configuration.trees.cuts:
        (free, turned), (node, held) = nodes[cut.link, cut.free], nodes[cut.link, cut.node]
        opened = np.conj(configuration.link[cut.link]) * (free - node)
        rows += [opened.real, opened.imag, turned - held]
    return np.array(np.broadcast_arrays(*rows))
