"""From motion to deflection: section forces, elastic line and Hooke's law, compatibility at the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from elastic.frame import Branch, branches
from elastic.section import Section
from rigid import (
    JointForces,
    Motion,
    Reals,
    beam_directions,
    beam_loads,
    beam_table,
    cross,
    displacements,
    per_row,
    point_loads,
    reactions,
    stacked,
)

FIELDS = ("N", "V", "M", "u", "w", "phi")


@dataclass(frozen=True, eq=False)
class Deflection:
    """How much every beam bends, turns and stretches, exactly.

    All fields are polynomials in xi = x'/l in the beam's own axes: arrays of shape
    (coefficients, beams, ..., positions), beams in the order of `Mechanism.beams`, powers from 0 up.

    Attributes
    ----------
    motion, sections
        What was asked; one section per beam.
    forces
        Joint forces.
    length
        Of the beams [m], shape (beams, 1) or (beams, designs, 1).
    q
        Distributed load q_x + i q_y [N/m], complex.
    N, V, M
        Axial force (tension positive) [N], shear force [N], bending moment [N m]: N' = -q_x, V' = q_y, M' = V.
    u, w, phi
        Longitudinal and transverse displacement [m] and slope [rad] from the rigid position.
    shift, angle
        Displacement of the origin [m], complex, and rotation [rad] of every link's axes, shape (links, ..., positions):
        where the link would be were it only carried, not bent.
    """

    motion: Motion
    sections: tuple[Section, ...]
    forces: JointForces
    length: Reals
    q: Any
    N: Reals
    V: Reals
    M: Reals
    u: Reals
    w: Reals
    phi: Reals
    shift: Any
    angle: Reals


def deflection(motion: Motion, sections: Sequence[Section], forces: JointForces | None = None) -> Deflection:
    """Section forces and displacements of all beams at all positions.

    Parameters
    ----------
    motion
        Of a mechanism whose elastic links are trees of beams.
    sections
        One per beam, in the order of `Mechanism.beams`.
    forces
        Joint forces where they are known already.

    Returns
    -------
    Deflection, nan at singular positions.

    Examples
    --------
    A cantilever of 2 m that turns at 3 rad/s, 5 kg/m: at its root it pulls with m w^2 L^2/2.

    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A", 5.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2})
    >>> deflection(motion(turning, [0.0], 3.0), [Section(EA=1e6, EI=1e3)]).N[0, 0]
    array([90.])
    """
    mechanism = motion.mechanism
    if len(sections) != len(mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(mechanism.beams)} beams")
    sections = tuple(sections)
    forces = forces or reactions(motion)
    length, direction = beam_table(mechanism, len(motion.columns)).length, beam_directions(motion)
    trees = branches(mechanism)
    q = beam_loads(motion)
    with np.errstate(invalid="ignore"):
        pull, twist = _end_loads(motion, forces, trees, q, length, direction)
        pull *= np.conj(direction)
        N, V, M = _section_forces(q, pull, twist, length)
        u, w, phi = _elastic_line(N, M, length, *_compliances(sections, len(motion.columns)))
        bent = _bent(motion, trees, direction, u.sum(0), w.sum(0), phi.sum(0))
        shift, angle = _compatible(motion, bent)
        _carry(motion, trees, bent, shift, angle, direction, length, u, w, phi)
    links = [stacked(values, motion.columns, kind) for values, kind in ((shift, complex), (angle, float))]
    return Deflection(motion, sections, forces, length, q, N, V, M, u, w, phi, *links)


@lru_cache(maxsize=64)
def _compliances(sections: tuple[Section, ...], ndim: int) -> tuple[Any, Any]:
    """1/EA and 1/EI of the beams, shape (beams, ..., 1)."""
    stretch = per_row([1.0 / np.asarray(section.EA, float) for section in sections], ndim, float)
    return stretch, per_row([1.0 / np.asarray(section.EI, float) for section in sections], ndim, float)


def _end_loads(motion: Motion, forces: JointForces, trees: Any, q: Any, length: Any, direction: Any) -> tuple[Any, Any]:
    """Force [N], in the ground's axes, and moment [N m] that every beam feels at its end, from cutting the trees."""
    nodes = _node_loads(motion, forces)
    pull = np.zeros((len(length), *motion.columns), complex)
    twist = np.zeros((len(length), *motion.columns))
    for at, tree in trees.items():
        for branch in reversed(tree):
            force, moment = nodes.get((at, branch.far), (0.0, 0.0))
            k = branch.number
            if branch.forward:
                pull[k], twist[k] = force, moment
            if branch.forward and branch is tree[0] and len(tree) == 1:
                continue
            _cut(nodes, (at, branch), (force, moment), q[:, k], length[k], direction[k], pull, twist)
    return pull, twist


def _cut(
    nodes: Any, where: tuple[int, Branch], far: Any, q: Any, length: Any, direction: Any, pull: Any, twist: Any
) -> None:
    """Pass the loads beyond a beam, and its own, on to its near end."""
    at, branch = where
    force, moment = far
    weights = 1.0 / np.arange(1, len(q) + 1)
    own = direction * length * np.tensordot(weights, q, 1)
    about_start = length**2 * np.tensordot(1.0 / np.arange(2, len(q) + 2), q.imag, 1)
    toward = direction * length
    if branch.forward:
        near_moment = moment + cross(toward, force) + about_start
    else:
        about_end = about_start - cross(toward, own)
        near_moment = moment + cross(-toward, force) + about_end
        pull[branch.number], twist[branch.number] = -(force + own), -near_moment
    before = nodes.get((at, branch.near), (0.0, 0.0))
    nodes[at, branch.near] = before[0] + force + own, before[1] + near_moment


def _node_loads(motion: Motion, forces: JointForces) -> dict[tuple[int, str], tuple[Any, Any]]:
    """Sum of the concentrated loads and joint forces at every point of every moving link."""
    nodes: dict[tuple[int, str], tuple[Any, Any]] = {}

    def put(at: int, point: str, force: Any, moment: Any) -> None:
        before = nodes.get((at, point))
        nodes[at, point] = (force, moment) if before is None else (before[0] + force, before[1] + moment)

    for joint, force, moment in zip(motion.structure.joints, forces.force, forces.moment, strict=True):
        if joint.child and joint.child_point:
            put(joint.child, joint.child_point, force, moment)
        if joint.parent and joint.parent_point:
            put(joint.parent, joint.parent_point, -force, -moment)
    for at, point, force, moment in point_loads(motion):
        put(at, point, force, moment)
    return nodes


def _section_forces(q: Any, pull: Any, twist: Any, length: Any) -> tuple[Any, Any, Any]:
    """N, V, M by equilibrium of the piece beyond a section, exact for a load of any degree.

    Parameters
    ----------
    q
        q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    pull, twist
        Force in the beam's axes [N], complex, and moment [N m] on its end.

    Returns
    -------
    Coefficients of N and V, shape (n + 1, ...), and of M, shape (n + 2, ...).
    """
    power = np.arange(1.0, len(q) + 2).reshape(-1, *[1] * pull.ndim)
    beyond = np.empty((len(q) + 1, *pull.shape), complex)
    np.multiply(q, -length / power[:-1], out=beyond[1:])
    np.subtract(pull, beyond[1:].sum(0), out=beyond[0])
    N, V = np.ascontiguousarray(beyond.real), -beyond.imag
    M = np.empty((len(q) + 2, *pull.shape))
    np.multiply(V, length / power, out=M[1:])
    np.subtract(twist, M[1:].sum(0), out=M[0])
    return N, V, M


def _elastic_line(N: Any, M: Any, length: Any, stretch: Any, bend: Any) -> tuple[Any, Any, Any]:
    """u, w, phi of beams clamped at their start, by integrating M/EI twice and N/EA once.

    Utenov et al., equations (2), (3), (4) with EA, (5), all constants of integration zero.
    """
    power = np.arange(1.0, len(M) + 2).reshape(-1, *[1] * (N.ndim - 1))
    u = np.zeros((len(N) + 1, *N.shape[1:]))
    np.multiply(N, length * stretch / power[: len(N)], out=u[1:])
    phi = np.zeros((len(M) + 1, *M.shape[1:]))
    np.multiply(M, length * bend / power[: len(M)], out=phi[1:])
    w = np.zeros((len(M) + 2, *M.shape[1:]))
    np.multiply(phi[1:], length / power[1:], out=w[2:])
    return u, w, phi


def _bent(
    motion: Motion, trees: Any, direction: Any, u: Any, w: Any, phi: Any
) -> dict[tuple[int, str], tuple[Any, Any]]:
    """Displacement [m], in the ground's axes, and rotation [rad] of the points of every link clamped at its root."""
    bent: dict[tuple[int, str], tuple[Any, Any]] = {}
    for at, tree in trees.items():
        bent[at, tree[0].near] = (0.0, 0.0)
        for branch in tree:
            k = branch.number
            move, turn = direction[k] * (u[k] + 1j * w[k]), phi[k]
            if branch is tree[0] and branch.forward:
                bent[at, branch.far] = (move, turn)
                continue
            before = bent[at, branch.near]
            points = motion.mechanism.links[at].points
            arm = motion.direction[at] * (points[branch.far] - points[branch.near])
            if branch.forward:
                bent[at, branch.far] = (before[0] + 1j * before[1] * arm + move, before[1] + turn)
            else:
                turned = before[1] - turn
                bent[at, branch.far] = (before[0] + 1j * turned * arm - move, turned)
    return bent


def _compatible(motion: Motion, bent: Any) -> tuple[list[Any], list[Any]]:
    """Displacement and rotation of every link that close the joints that bending opens, the drives held."""
    gaps: list[Any] = []
    turns: list[Any] = []
    nothing = (0.0, 0.0)
    for joint in motion.structure.joints:
        child = bent.get((joint.child, joint.child_point), nothing)
        parent = bent.get((joint.parent, joint.parent_point), nothing)
        gaps.append(parent[0] - child[0])
        turns.append(parent[1] - child[1])
    shift, turning = displacements(motion.closures, gaps, turns, [0.0] * len(motion.mechanism.links))
    return shift, [np.imag(value) for value in turning]


def _carry(
    motion: Motion, trees: Any, bent: Any, shift: Any, angle: Any, direction: Any, length: Any, u: Any, w: Any, phi: Any
) -> None:
    """Add to every beam's fields what carries its start."""
    for at, tree in trees.items():
        points = motion.mechanism.links[at].points
        for branch in tree:
            k = branch.number
            start = branch.near if branch.forward else branch.far
            move, turn = bent[at, start]
            turn = angle[at] + turn
            local = points[start]
            if np.ndim(local) or local:
                move = move + 1j * angle[at] * (motion.direction[at] * local)
            own = np.conj(direction[k]) * (shift[at] + move)
            u[0, k], w[0, k], phi[0, k] = own.real, own.imag, turn
            w[1, k] = length[k] * turn
