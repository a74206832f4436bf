"""What the joints must close because the links bend, and the joint forces where statics alone does not tell them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.beams.line import Compliance
from elastic.beams.section import JointCompliance
from elastic.links.clamped_links import Response, beyond_contact, respond
from elastic.links.free_body import Contact, Nodes, Stance, contacts, with_joints
from elastic.links.gearing import gear_gap
from rigid import JointForces, Motion
from rigid.plane import ZERO, dot

UNSTRESSED = 1e-12  # share of a self-stress below which a joint has no part in it


@dataclass(frozen=True, eq=False)
class Opening:
    """What the links do under given joint forces, each clamped at the root of its beams.

    Attributes
    ----------
    response
        Section forces and displacements of the links.
    contacts
        Sliders' blocks on beams.
    gaps, turns
        Per joint, what bringing it together takes: displacement of the child's point from the parent's [m], complex,
        and rotation [rad].
    """

    response: Response
    contacts: tuple[Contact, ...]
    gaps: list[Any]
    turns: list[Any]


def opening(
    motion: Motion,
    stance: Stance,
    soft: Compliance,
    joints: Mapping[str, JointCompliance],
    forces: JointForces,
    nodes: Nodes,
    q: Any,
) -> Opening:
    """Response of the links to loads and given joint forces, and what it opens at the joints."""
    moving = contacts(motion, stance, forces)
    found = respond(stance, soft, with_joints(nodes, motion, stance.frame, forces), q, moving)
    gaps: list[Any] = []
    turns: list[Any] = []
    nothing = (ZERO, ZERO)
    places = motion.places
    on_rails = dict(zip(stance.frame.rails, moving, strict=True))
    for number, joint in enumerate(motion.structure.joints):
        child = found.bent.get((joint.child, joint.child_point or ""), nothing)
        parent = found.bent.get((joint.parent, joint.parent_point or ""), nothing)
        if number in on_rails:
            at_block = _at_contact(motion, stance, found, soft, joint.owner, on_rails[number], moving)
            child, parent = (child, at_block) if joint.owner == joint.parent else (at_block, parent)
        gap, turn = parent[0] - child[0], parent[1] - child[1]
        if joint.name in joints:
            own = joints[joint.name]
            gap = gap - forces.force[number] * own.translation + own.gap
            turn = turn - forces.moment[number] * own.rotation + own.turn
        along, turned = gear_gap(places[number], found.bent)
        gaps.append(gap + along)
        turns.append(turn + turned)
    return Opening(found, moving, gaps, turns)


def require_joints(motion: Motion, joints: Mapping[str, JointCompliance]) -> None:
    """Raise where a soft joint is none of the mechanism's."""
    names = [joint.name for joint in motion.structure.joints]
    for name in joints:
        if names.count(name) == 0:
            raise ValueError(f'there is no joint "{name}" to be soft')
        if names.count(name) > 1:
            raise ValueError(f'"{name}" is {names.count(name)} joints, which does not tell which of them is soft')


def brought_together(
    motion: Motion,
    stance: Stance,
    soft: Compliance,
    joints: Mapping[str, JointCompliance],
    forces: JointForces,
    opened: Opening,
    states: Sequence[JointForces],
) -> JointForces:
    """Joint forces that bring the bent links together: the force method over the self-stresses of the mechanism.

    A self-stress does no work when rigid links move, so that its work on the openings of the joints must vanish: as
    many conditions as self-stresses.

    Parameters
    ----------
    forces, opened
        Any joint forces in balance with the loads, and what they open.
    states
        The self-stresses.
    """
    fitting = {name: JointCompliance(own.translation, own.rotation) for name, own in joints.items()}
    nothing = np.zeros((1, len(stance.length), *motion.columns), complex)
    alone = [opening(motion, stance, soft.unstrained, fitting, state, {}, nothing) for state in states]
    work = np.array([[_work(state, other) for other in alone] for state in states])
    missing = np.array([_work(state, opened) for state in states])
    flexibility, right = np.moveaxis(work, (0, 1), (-2, -1)), np.moveaxis(missing, 0, -1)
    size = np.sqrt(np.abs(np.diagonal(flexibility, axis1=-2, axis2=-1)))
    amounts = np.full(right.shape, np.nan)
    good = np.isfinite(right).all(axis=-1) & np.isfinite(flexibility).all(axis=(-2, -1)) & (size > 0).all(axis=-1)
    scaled = flexibility[good] / (size[good][:, :, None] * size[good][:, None, :])
    amounts[good] = -np.linalg.solve(scaled, (right[good] / size[good])[..., None])[..., 0] / size[good]
    force, moment = list(forces.force), list(forces.moment)
    for number, state in enumerate(states):
        amount = amounts[..., number]
        force = [value + _share(amount, part) for value, part in zip(force, state.force, strict=True)]
        moment = [value + _share(amount, part) for value, part in zip(moment, state.moment, strict=True)]
    return replace(forces, force=force, moment=moment)


def _share(amount: Any, part: Any) -> Any:
    """A part of a self-stress; nothing where it has none, known or not."""
    return np.where(np.abs(part) > UNSTRESSED, amount, 0.0) * part


def _work(state: JointForces, opened: Opening) -> Any:
    """Work of a self-stress on the openings of the joints."""
    total: Any = 0.0
    for force, moment, gap, turn in zip(state.force, state.moment, opened.gaps, opened.turns, strict=True):
        total = total + dot(force, gap) + moment * turn
    return total


def _at_contact(
    motion: Motion,
    stance: Stance,
    found: Response,
    soft: Compliance,
    owner: int,
    contact: Contact,
    moving: tuple[Contact, ...],
) -> tuple[Any, Any]:
    """Displacement, in the ground's axes, and rotation of the beam under a block, its link clamped at its root."""
    k = contact.beam
    start = motion.mechanism.beams[k][1].start
    before, turned = found.bent[owner, start]
    powers = contact.xi ** np.arange(len(found.line.w)).reshape(-1, *[1] * np.ndim(contact.xi))
    line = found.line
    u, w, phi = ((values[:, k] * powers[: len(values)]).sum(0) for values in (line.u, line.w, line.phi))
    for other in moving:
        if other.beam == k:
            way = np.maximum(contact.xi - other.xi, 0.0)
            more = beyond_contact(other, stance.length[k], soft)
            u, w, phi = (
                value + sum(part * way**power for power, part in enumerate(more[field]))
                for value, field in ((u, "u"), (w, "w"), (phi, "phi"))
            )
    arm = stance.beam[k] * (contact.xi * stance.length[k])
    return before + 1j * turned * arm + stance.beam[k] * (u + 1j * w), turned + phi
