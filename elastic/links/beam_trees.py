"""The beams of every link as a tree that sums loads and passes displacements on, and the cuts of its rings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rigid import Beam, LineLoad, Link, Mechanism, MechanismError, structure
from rigid.arrays import Columns
from rigid.plane import cross

LINED_UP = 1e-9  # of its length that a beam may be off a slider's line and yet lie along it


@dataclass(frozen=True)
class TreeBeam:
    """A beam in the tree of its link: `number` among all beams, `near` and `far` its ends as seen from the root."""

    number: int
    near: str
    far: str
    forward: bool


@dataclass(frozen=True)
class Cut:
    """Where a ring of beams is cut open: `free` is the loose end of a beam that belongs to `node`."""

    link: int
    node: str
    free: str


@dataclass(frozen=True, eq=False)
class BeamTrees:
    """Beams of all moving links.

    Attributes
    ----------
    trees
        Per link with beams, its beams from the root outwards.
    cuts
        One per ring.
    tips
        The nodes at which a branch ends: all but the roots, whose loads no beam feels.
    points
        Place of every node in its link's axes [m].
    rails
        Per joint whose slider moves along beams, by the joint's place in `Structure.joints`: the beams in its line.
    """

    trees: Mapping[int, tuple[TreeBeam, ...]]
    cuts: tuple[Cut, ...]
    tips: frozenset[tuple[int, str]]
    points: Mapping[tuple[int, str], Columns]
    rails: Mapping[int, tuple[int, ...]]


def root_of(tree: tuple[TreeBeam, ...]) -> str:
    """The node from which a tree grows."""
    return tree[0].near


@lru_cache(maxsize=64)
def trees_of(mechanism: Mechanism) -> BeamTrees:
    """Trees of beams of a mechanism.

    Raises
    ------
    MechanismError
        The beams of a link do not hang together, or do not reach a point that carries a joint or a load.
    """
    trees, cuts, number = {}, [], 0
    points = {(at, name): place for at, link in enumerate(mechanism.links) for name, place in link.points.items()}
    for at, link in enumerate(mechanism.links[1:], 1):
        if not link.beams:
            continue
        trees[at], loose = _tree(link, number)
        cuts += [Cut(at, node, free) for node, free in loose]
        points.update({(at, free): link.points[node] for node, free in loose})
        number += len(link.beams)
    _require_held(mechanism, trees)
    tips = frozenset((at, branch.far) for at, tree in trees.items() for branch in tree)
    return BeamTrees(trees, tuple(cuts), tips, points, _rails(mechanism, trees))


def _tree(link: Link, first: int) -> tuple[tuple[TreeBeam, ...], list[tuple[str, str]]]:
    """Branches from the start of the first beam outwards, and the loose ends of those that close rings."""
    waiting = list(enumerate(link.beams, first))
    reached = {waiting[0][1].start}
    order: list[TreeBeam] = []
    loose: list[tuple[str, str]] = []
    while waiting:
        joined = next((item for item in waiting if {item[1].start, item[1].end} & reached), None)
        if joined is None:
            raise MechanismError(f'link "{link.name}": its beams do not hang together', links=(link.name,))
        waiting.remove(joined)
        number, beam = joined
        forward = beam.start in reached
        near, far = (beam.start, beam.end) if forward else (beam.end, beam.start)
        if far in reached:
            loose.append((far, f"{far} of beam {number}"))
            far = loose[-1][1]
        order.append(TreeBeam(number, near, far, forward))
        reached.add(far)
    return tuple(order), loose


def _require_held(mechanism: Mechanism, trees: Mapping[int, tuple[TreeBeam, ...]]) -> None:
    """Raise where a joint or a load is at a point that no beam of its link reaches."""
    used = acting_points(mechanism)
    for at, tree in trees.items():
        nodes = {node for branch in tree for node in (branch.near, branch.far)}
        for point in sorted(point for owner, point in used if owner == at and point and point not in nodes):
            name = mechanism.links[at].name
            bare = f'link "{name}": no beam reaches the point "{point}", which carries a joint or a load'
            raise MechanismError(bare, links=(name,), joints=(point,))


def acting_points(mechanism: Mechanism) -> set[tuple[int, str | None]]:
    """Numbers of links and names of their points at which a joint, a load, a spring or a mass acts."""
    used = {(link, joint.point(link)) for joint in structure(mechanism).joints for link in (joint.parent, joint.child)}
    at_points = (load for load in mechanism.loads if not isinstance(load, LineLoad))
    used |= {(mechanism.index[link], point) for load in at_points for link, point in load.points}
    used |= {(at, lump.point) for at, link in enumerate(mechanism.links) for lump in link.lumps}
    return used


def lies_along(link: Link, beam: Beam, origin: Columns, direction: Columns) -> bool:
    """Whether a line through a point, both in a link's axes, is that of one of its beams, in all designs."""
    return bool(np.all(lined_up(link, beam, origin, direction)))


def in_line(one: Columns, other: Columns, off: float = LINED_UP) -> bool:
    """Whether two vectors have one direction, in all designs, to an angle of `off` [rad]."""
    along = (np.conj(one) * other).real
    return bool(np.all((along > 0.0) & (np.abs(cross(one, other)) <= off * along)))


def lined_up(link: Link, beam: Beam, origin: Columns, direction: Columns) -> Columns:
    """The same, design by design."""
    way, off = link.points[beam.end] - link.points[beam.start], origin - link.points[beam.start]
    return np.abs(cross(way, direction)) + np.abs(cross(direction, off)) <= LINED_UP * np.abs(way)


def _rails(mechanism: Mechanism, trees: Mapping[int, tuple[TreeBeam, ...]]) -> dict[int, tuple[int, ...]]:
    """The beams along which each slider on a link with beams moves: it passes from one to the next."""
    rails = {}
    for place, joint in enumerate(structure(mechanism).joints):
        owner = joint.owner
        if joint.turns or owner not in trees:
            continue
        link = mechanism.links[owner]
        along = []
        for branch in trees[owner]:
            beam = mechanism.beams[branch.number][1]
            if lies_along(link, beam, joint.at(owner), joint.line):
                along.append(branch.number)
        rails[place] = tuple(along)
        if not along:
            raise MechanismError(
                f'slider "{joint.name}": no beam of "{link.name}" lies along its line to carry it: add one, or give '
                "the link its mass without beams"
            )
    return rails
