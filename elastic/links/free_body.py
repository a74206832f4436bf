"""Loads through the trees of beams: what every beam feels at its end, from cutting beyond it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic.links.beam_trees import Branch, Frame
from elastic.links.gearing import driver_loads
from rigid import JointForces, Motion
from rigid.constants import beam_table
from rigid.loads import beam_directions, point_loads
from rigid.plane import cross, dot

ON_BEAM = 1e-12

Nodes = dict[tuple[int, str], tuple[Any, Any]]


@dataclass(frozen=True, eq=False)
class Contact:
    """A force and a moment that moves along a beam: a slider's block on it.

    Attributes
    ----------
    beam
        Number of the beam.
    xi
        Where the block is, shape (..., positions).
    force, moment
        On the beam, in its own axes [N], complex, and [N m].
    """

    beam: int
    xi: Any
    force: Any
    moment: Any


@dataclass(frozen=True, eq=False)
class Stance:
    """Where the links are, as far as statics needs it.

    The beams' rows in arrays over the links, directions of links and beams, those of the beams in the axes of their
    links, lengths [m], shape of the columns.
    """

    frame: Frame
    rows: Any
    link: Any
    beam: Any
    unit: Any
    length: Any
    columns: tuple[int, ...]

    @cached_property
    def back(self) -> Any:
        """From the ground's axes to the beams'."""
        return np.conj(self.beam)

    def arm(self, at: int, start: str, end: str) -> Any:
        """From one node of a link to another, in the ground's axes [m], complex."""
        return self.link[at] * (self.frame.points[at, end] - self.frame.points[at, start])


def node_loads(motion: Motion, frame: Frame) -> Nodes:
    """Sum of the concentrated loads at every node that a beam ends at."""
    nodes: Nodes = {}
    for at, point, force, moment in point_loads(motion):
        if (at, point) in frame.tips:
            put(nodes, (at, point), force, moment)
    return nodes


def with_joints(nodes: Nodes, motion: Motion, frame: Frame, forces: JointForces) -> Nodes:
    """The same with the joint forces, and with what gears ask of the links that drive them."""
    nodes = dict(nodes)
    for joint, force, moment in zip(motion.structure.joints, forces.force, forces.moment, strict=True):
        child, parent = (joint.child, joint.child_point or ""), (joint.parent, joint.parent_point or "")
        if child in frame.tips:
            put(nodes, child, force, moment)
        if parent in frame.tips:
            put(nodes, parent, -force, -moment)
    for at, point, force, moment in driver_loads(motion, forces):
        if (at, point) in frame.tips:
            put(nodes, (at, point), force, moment)
    return nodes


def block_places(motion: Motion, frame: Frame) -> list[Any]:
    """Where the block of every slider on a beam is, in xi, shape (..., positions); nan where it is beyond its beam."""
    table = beam_table(motion.mechanism, len(motion.columns))
    directions = beam_directions(motion)
    found = []
    for number, beam in frame.rails.items():
        place = motion.places[number]
        joint = place.joint
        at = joint.owner
        xi = dot(directions[beam], place.arm(at) - motion.direction[at] * table.start[beam]) / table.length[beam]
        found.append(np.where((xi >= -ON_BEAM) & (xi <= 1 + ON_BEAM), np.clip(xi, 0.0, 1.0), np.nan))
    return found


def contacts(motion: Motion, stance: Stance, forces: JointForces) -> tuple[Contact, ...]:
    """Loads of the sliders on the beams they move along; nan where a block is beyond its beam."""
    found = []
    rails = stance.frame.rails
    for (number, beam), xi in zip(rails.items(), block_places(motion, stance.frame) if rails else (), strict=True):
        sense = motion.structure.joints[number].sense
        pull = stance.back[beam] * forces.force[number]
        found.append(Contact(beam, xi, -sense * pull, -sense * forces.moment[number]))
    return tuple(found)


def put(nodes: Nodes, where: tuple[int, str], force: Any, moment: Any) -> None:
    """Add a force and a moment to what a node carries."""
    before = nodes.get(where)
    nodes[where] = (force, moment) if before is None else (before[0] + force, before[1] + moment)


def end_loads(
    stance: Stance, nodes: Mapping[tuple[int, str], tuple[Any, Any]], q: Any, moving: tuple[Contact, ...]
) -> tuple[Any, Any]:
    """Force in the beam's own axes [N], complex, and moment [N m] on the end of every beam, from cutting the trees."""
    carried = dict(nodes)
    pull = np.zeros((len(stance.length), *stance.columns), complex)
    twist = np.zeros((len(stance.length), *stance.columns))
    for at, tree in stance.frame.trees.items():
        for branch in reversed(tree):
            k = branch.number
            force, moment = carried.get((at, branch.far), (0.0, 0.0))
            if branch.forward:
                pull[k], twist[k] = force, moment
            if branch is tree[0] and branch.forward:
                continue
            own, about_start = _own_load(stance, k, q, moving)
            arm = stance.arm(at, branch.near, branch.far)
            moment = moment + cross(arm, force) + about_start
            if not branch.forward:
                moment = moment + cross(arm, own)
                pull[k], twist[k] = -(force + own), -moment
            put(carried, (at, branch.near), force + own, moment)
    pull *= stance.back
    return pull, twist


def _own_load(stance: Stance, k: int, q: Any, moving: tuple[Contact, ...]) -> tuple[Any, Any]:
    """Force of a beam's own load in the ground's axes [N], complex, and its moment about the beam's start [N m]."""
    length = stance.length[k]
    force = length * np.tensordot(1.0 / np.arange(1, len(q) + 1), q[:, k], 1)
    moment = length**2 * np.tensordot(1.0 / np.arange(2, len(q) + 2), q[:, k].imag, 1)
    for contact in moving:
        if contact.beam == k:
            force = force + contact.force
            moment = moment + contact.moment + contact.xi * length * contact.force.imag
    return stance.beam[k] * force, moment


def root_of(tree: tuple[Branch, ...]) -> str:
    """The node from which a tree grows."""
    return tree[0].near
