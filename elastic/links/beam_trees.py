"""Tree of the beams of each link, along which loads and displacements are summed. Rings of beams are cut open."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from msgspec import Struct

from rigid import Beam, LineLoad, Link, Mechanism, MechanismError, structure
from rigid.arrays import Columns
from rigid.plane import cross

MAX_OFFSET = 1e-9
"""Largest offset of a beam from a slider's line, or of a point from a beam, relative to the beam's length."""


class TreeBeam(Struct, frozen=True):
    """Beam in the tree of its link.

    `number` is the index of the beam among all beams of the mechanism. `near` is its end that is closer to the root
    along the tree, and `far` the other end. `forward` is True if the beam starts at `near`.
    """

    number: int
    near: str
    far: str
    forward: bool


class Cut(Struct, frozen=True):
    """Cut that opens a ring of beams at `node`. `free` is the name of the loose end of the cut beam."""

    link: int
    node: str
    free: str


class BeamTrees(Struct, frozen=True, eq=False):
    """Trees of the beams of all moving links.

    Attributes
    ----------
    trees
        By link index, the beams of the link in the order from the root outwards.
    cuts
        One cut per ring.
    tips
        All nodes except the roots. A load at a root is carried by the clamped support, and does not bend the beams.
    points
        Position of each node in link axes [m].
    rails
        By index of the slider in `Structure.joints`, the beams along the line of the slider.
    """

    trees: Mapping[int, tuple[TreeBeam, ...]]
    cuts: tuple[Cut, ...]
    tips: frozenset[tuple[int, str]]
    points: Mapping[tuple[int, str], Columns]
    rails: Mapping[int, tuple[int, ...]]


def root_of(tree: tuple[TreeBeam, ...]) -> str:
    """Return the name of the node at which a tree starts."""
    return tree[0].near


@lru_cache(maxsize=64)
def trees_of(mechanism: Mechanism) -> BeamTrees:
    """Build the trees of beams of a mechanism.

    Raises
    ------
    MechanismError
        If the beams of a link are not connected, or if they do not reach each point of the link that has a joint or
        load.
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
    """Return the beams of a link from the start of its first beam outwards, and the loose ends of cut rings.

    For each loose end, the result contains the node at which the ring was cut and the name of the loose end.
    """
    waiting = list(enumerate(link.beams, first))
    reached = {waiting[0][1].start}
    order: list[TreeBeam] = []
    loose: list[tuple[str, str]] = []
    while waiting:
        joined = next((item for item in waiting if {item[1].start, item[1].end} & reached), None)
        if joined is None:
            raise MechanismError(f'link "{link.name}": its beams are not connected', links=(link.name,))
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
    """Raise MechanismError if the beams of a link do not reach each point of the link that has a joint or load."""
    used = acting_points(mechanism)
    for at, tree in trees.items():
        nodes = {node for branch in tree for node in (branch.near, branch.far)}
        for point in sorted(point for owner, point in used if owner == at and point and point not in nodes):
            name = mechanism.links[at].name
            bare = f'link "{name}": no beam reaches the point "{point}", which carries a joint or a load'
            raise MechanismError(bare, links=(name,), joints=(point,))


def acting_points(mechanism: Mechanism) -> set[tuple[int, str | None]]:
    """Return the link index and name of each point at which a joint, load, spring or mass acts."""
    used = {(link, joint.point(link)) for joint in structure(mechanism).joints for link in (joint.parent, joint.child)}
    at_points = (load for load in mechanism.loads if not isinstance(load, LineLoad))
    used |= {(mechanism.index[link], point) for load in at_points for link, point in load.points}
    used |= {(at, lump.point) for at, link in enumerate(mechanism.links) for lump in link.lumps}
    return used


def in_line(one: Columns, other: Columns, off: float = MAX_OFFSET) -> bool:
    """Return whether, in all designs, two vectors have the same direction to within an angle `off` [rad]."""
    along = (np.conj(one) * other).real
    return bool(np.all((along > 0.0) & (np.abs(cross(one, other)) <= off * along)))


def lined_up(link: Link, beam: Beam, origin: Columns, direction: Columns) -> Columns:
    """Return for each design whether a beam lies on a line, to within `MAX_OFFSET`."""
    way, off = link.points[beam.end] - link.points[beam.start], origin - link.points[beam.start]
    return np.abs(cross(way, direction)) + np.abs(cross(direction, off)) <= MAX_OFFSET * np.abs(way)


def _rails(mechanism: Mechanism, trees: Mapping[int, tuple[TreeBeam, ...]]) -> dict[int, tuple[int, ...]]:
    """Return the beams along the line of each slider. The block can move from one of these beams to the next."""
    rails = {}
    for place, joint in enumerate(structure(mechanism).joints):
        owner = joint.owner
        if joint.turns or owner not in trees:
            continue
        link = mechanism.links[owner]
        along = []
        for branch in trees[owner]:
            beam = mechanism.beams[branch.number][1]
            if np.all(lined_up(link, beam, joint.at(owner), joint.line)):
                along.append(branch.number)
        rails[place] = tuple(along)
        if not along:
            raise MechanismError(
                f'slider "{joint.name}": no beam of "{link.name}" lies along its line to carry it: add one, or give '
                "the link its mass without beams"
            )
    return rails
