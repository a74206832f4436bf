"""Section forces and displacements of all links under given loads, every link clamped at the root of its beams."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.beams.line import Compliance, Line, elastic_line, section_forces
from elastic.links.free_body import Contact, Nodes, Stance, end_loads, put, root_of
from rigid.plane import ZERO

CLOSINGS = 2  # of rings: what round-off leaves open between beams of very different stiffness is closed again

Bent = dict[tuple[int, str], tuple[Any, Any]]


@dataclass(frozen=True, eq=False)
class Response:
    """What loads do to the links.

    Attributes
    ----------
    N, V, M
        Coefficients in powers of xi, shape (n, beams, ..., positions); of a beam with contacts up to the first of them.
    line
        Displacements of every beam clamped at its start.
    bent
        Displacement [m], in the ground's axes, and rotation [rad] of every node of a link clamped at its root.
    """

    N: Any
    V: Any
    M: Any
    line: Line
    bent: Bent


def respond(stance: Stance, soft: Compliance, nodes: Nodes, q: Any, moving: tuple[Contact, ...] = ()) -> Response:
    """Section forces and displacements of the links under loads at nodes, along beams, and moving ones.

    Rings are closed: the loads that their cut ends exert on one another bring these together.
    """
    if stance.frame.cuts:
        nodes = _closed(stance, soft, nodes, q, moving)
    return _open_response(stance, soft, nodes, q, moving)


def _open_response(stance: Stance, soft: Compliance, nodes: Nodes, q: Any, moving: tuple[Contact, ...]) -> Response:
    pull, twist = end_loads(stance, nodes, q, moving)
    N, V, M = section_forces(q, pull, twist, stance.length)
    for contact in moving:
        _before_contact(N, V, M, stance.length, contact)
    line = elastic_line(N, V, M, stance.length, soft)
    for contact in moving:
        reached = _after_contact(contact, stance.length[contact.beam], soft, 1.0 - contact.xi)
        for end, more in zip(line.end, reached, strict=True):
            end[contact.beam] += more
    return Response(N, V, M, line, _bent(stance, *line.end))


def _before_contact(N: Any, V: Any, M: Any, length: Any, contact: Contact) -> None:
    """Add a moving load to the section forces of the piece before it."""
    k = contact.beam
    N[0, k] += contact.force.real
    V[0, k] -= contact.force.imag
    M[0, k] += contact.moment + contact.xi * length[k] * contact.force.imag
    M[1, k] -= length[k] * contact.force.imag


def beyond_contact(contact: Contact, length: Any, soft: Compliance) -> dict[str, tuple[Any, ...]]:
    """What the fields beyond a contact are more than those before it, in powers of xi minus the contact's."""
    k, along, across, moment = contact.beam, contact.force.real, contact.force.imag, contact.moment
    bend, shear, stretch = soft.bend[k] * length, soft.shear[k] * length, soft.stretch[k] * length
    slope = (0.0, -bend * moment, bend * length * across / 2)
    return {
        "N": (-along,),
        "V": (across,),
        "M": (-moment, length * across),
        "u": (0.0, -stretch * along),
        "phi": slope,
        "w": (0.0, -shear * across, length * slope[1] / 2, length * slope[2] / 3),
    }


def _after_contact(contact: Contact, length: Any, soft: Compliance, way: Any) -> tuple[Any, Any, Any]:
    """What a contact adds to u, w, phi at a distance beyond it, in units of the length."""
    more = beyond_contact(contact, length, soft)
    u, w, phi = (sum(value * way**power for power, value in enumerate(more[field])) for field in ("u", "w", "phi"))
    return u, w, phi


def _bent(stance: Stance, u: Any, w: Any, phi: Any) -> Bent:
    """Displacements of all nodes from the root outwards."""
    bent: Bent = {}
    ends = np.empty(u.shape, complex)
    ends.real, ends.imag = u, w
    ends *= stance.beam
    for at, tree in stance.frame.trees.items():
        bent[at, root_of(tree)] = (ZERO, ZERO)
        for branch in tree:
            move, turn = ends[branch.number], phi[branch.number]
            if branch is tree[0] and branch.forward:
                bent[at, branch.far] = (move, turn)
                continue
            before, turned = bent[at, branch.near]
            arm = 1j * stance.arm(at, branch.near, branch.far)
            if branch.forward:
                bent[at, branch.far] = (before + turned * arm + move, turned + turn)
            else:
                turned = turned - turn
                bent[at, branch.far] = (before + turned * arm - move, turned)
    return bent


def _closed(stance: Stance, soft: Compliance, nodes: Nodes, q: Any, moving: tuple[Contact, ...]) -> Nodes:
    """The loads with those that close the rings: the force method, three redundants a ring.

    The flexibilities are found in the links' own axes, where they do not change with the position.
    """
    cuts = stance.frame.cuts
    still = (1,) * len(stance.columns)
    own = replace(stance, link=np.ones((len(stance.link), *still)), beam=stance.unit, columns=still)
    none = np.zeros((len(q), len(stance.length), *still), complex)
    columns = []
    for cut in cuts:
        for pair in ((1.0, 0.0), (1j, 0.0), (0.0, 1.0)):
            loads: Nodes = {}
            put(loads, (cut.link, cut.free), *(np.broadcast_to(value, still) for value in pair))
            put(loads, (cut.link, cut.node), *(np.broadcast_to(-value, still) for value in pair))
            columns.append(_openings(own, _open_response(own, soft.unstrained, loads, none, ()).bent))
    flexibility = np.moveaxis(np.array(columns), (0, 1), (-1, -2))
    scale = 1.0 / np.sqrt(np.abs(np.diagonal(flexibility, axis1=-2, axis2=-1)))
    scaled = flexibility * scale[..., :, None] * scale[..., None, :]
    closed = dict(nodes)
    for _ in range(CLOSINGS):
        openings = np.moveaxis(_openings(stance, _open_response(stance, soft, closed, q, moving).bent), 0, -1)
        redundants = -np.linalg.solve(scaled, (openings * scale)[..., None])[..., 0] * scale
        for number, cut in enumerate(cuts):
            along, across, moment = (redundants[..., 3 * number + row] for row in range(3))
            force = stance.link[cut.link] * (along + 1j * across)
            put(closed, (cut.link, cut.free), force, moment)
            put(closed, (cut.link, cut.node), -force, -moment)
    return closed


def _openings(stance: Stance, bent: Bent) -> Any:
    """How far every ring is open at its cut, in its link's axes: x, y, turned; shape (3 cuts, ..., positions)."""
    rows = []
    for cut in stance.frame.cuts:
        (free, turned), (node, held) = bent[cut.link, cut.free], bent[cut.link, cut.node]
        opened = np.conj(stance.link[cut.link]) * (free - node)
        rows += [opened.real, opened.imag, turned - held]
    return np.array(np.broadcast_arrays(*rows))
