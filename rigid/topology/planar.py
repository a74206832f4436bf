"""Graphs, mobility and redundant constraints of planar mechanisms."""

from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np

from rigid.arrays import Complex, Complexes, Reals
from rigid.decomposition.groups import Group
from rigid.decomposition.order import structure
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import GROUND, Link, MechanismError
from rigid.postures import Posture
from rigid.topology.assembly import assembled
from rigid.topology.graph import Branch, Graph
from rigid.topology.kinematic_pairs import Contact, Pair, pairs
from rigid.topology.ranks import Chain, Mobility, mobility


def planar_chain(here: Posture, contacts: Iterable[Contact] = ()) -> Chain:
    """Return the chain of a planar mechanism at the one or many positions of a posture.

    If there are contacts (gears, cams), the posture must have one position, because a contact point has one position.

    Examples
    --------
    Two rolling gears have the mobility 1 and one redundant constraint, although the count by `kutzbach` is 0:

    >>> from rigid.topology import Contact, assembled, mobility, planar_chain
    >>> from rigid import Link, Mechanism
    >>> links = (Link("ground", {"O": 0, "D": 3}), Link("pinion", {"O": 0}), Link("wheel", {"D": 0}))
    >>> gears = assembled(Mechanism(links, (), {"O": 0, "D": 3}))
    >>> result = mobility(planar_chain(gears, [Contact("mesh", "pinion", "wheel", 1.0)]))
    >>> int(result.mobility), int(result.hyperstaticity), result.index
    (1, 1, 0)
    """
    contacts = tuple(contacts)
    joints = pairs(here.mechanism, contacts)
    places = [_place(here, pair) for pair in joints]
    everywhere = np.concatenate([np.ravel(place) for place in places]) if places else np.zeros(1, complex)
    center = complex(everywhere.mean())
    length = float(np.sqrt((np.abs(everywhere - center) ** 2).mean())) or 1.0
    twists = [_twists(here, pair, place - center) for pair, place in zip(joints, places, strict=True)]
    graph = link_graph(here.mechanism, contacts)
    return Chain(
        graph,
        tuple(twist for twist, _ in twists),
        tuple(names for _, names in twists),
        np.array([center.real, center.imag]),
        length,
    )


def mechanism_mobility(mechanism: Mechanism, contacts: Iterable[Contact] = ()) -> Mobility:
    """Return the mobility and hyperstaticity of a mechanism as drawn. Joints with drives count as free joints."""
    return mobility(planar_chain(assembled(mechanism), contacts))


def _place(here: Posture, pair: Pair) -> Complexes:
    """Return the position of a pair in ground axes [m]. For a slider, this is the point of the sliding link."""
    if pair.joint is not None:
        return here.place(pair.joint.block, pair.joint.at(pair.joint.block))
    assert pair.contact is not None
    return np.full(np.shape(here.origin)[1:], pair.contact.at, complex)


def _twists(here: Posture, pair: Pair, arm: Complexes) -> tuple[Reals, tuple[str, ...]]:
    """Return the twists and the names of the freedoms of a pair.

    A twist is the motion of the end link relative to the start link. It consists of the angular velocity, and of the
    velocity (x, y) of the point of the end link at the center of the chain. `arm` is the vector from the center to the
    pair.
    """
    turn = _column(np.ones(np.shape(arm)), -1j * arm)
    if not pair.freedoms:
        return turn[..., :0], ()
    if pair.joint is not None and not pair.joint.turns:
        return _column(np.zeros(np.shape(arm)), pair.joint.along(here)), ("slide",)
    if pair.contact is not None and pair.contact.normal is not None:
        slip = _column(np.zeros(np.shape(arm)), np.full(np.shape(arm), 1j * pair.contact.normal))
        return np.concatenate([turn, slip], axis=-1), ("angle", "slip")
    return turn, ("angle",)


def _column(angular: Reals, velocity: Complexes) -> Reals:
    """Return one twist, shape (..., 3, 1)."""
    angular, velocity = np.broadcast_arrays(angular, velocity)
    return np.stack([angular, velocity.real, velocity.imag], axis=-1)[..., None]


@lru_cache(maxsize=64)
def require_fit(mechanism: Mechanism) -> None:
    """Check that a mechanism with redundant constraints can be assembled, and that its drives can move it.

    Raises
    ------
    MechanismError
        If the joints do not close, the mechanism is locked, or it has more drives than freedoms.
    """
    for group in structure(mechanism).groups:
        if group.surplus:
            _require_fit(mechanism, group)


def _require_fit(mechanism: Mechanism, group: Group) -> None:
    drives = len(mechanism.drives)
    names = tuple(mechanism.links[link].name for link in sorted(group.links))
    try:
        freedoms = int(mechanism_mobility(mechanism).mobility)
    except MechanismError as unfit:
        raise MechanismError(
            f"links {_quoted(names)} are overconstrained by {counted(group.surplus, 'constraint')}, "
            f"and their dimensions do not fit ({unfit}): remove a joint",
            kind="overconstrained",
            links=names,
        ) from unfit
    if drives and freedoms == 0:
        names = tuple(link.name for link in mechanism.links[1:])
        message = f"links {_quoted(names)} are locked: no drive can move them, remove a link or a joint"
        raise MechanismError(message, kind="overconstrained", links=names)
    if drives > freedoms:
        message = f"too many drives: {drives} for a mechanism with {counted(freedoms, 'freedom')}: remove one"
        raise MechanismError(message, kind="drives")


def _quoted(names: tuple[str, ...]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def link_graph(mechanism: Mechanism, contacts: tuple[Contact, ...] = ()) -> Graph:
    """Return the graph with links as nodes (ground first) and pairs as branches."""
    joints = pairs(mechanism, contacts)
    return Graph(
        tuple(Branch(pair.name, pair.start, pair.end) for pair in joints), tuple(link.name for link in mechanism.links)
    )


def bar_graph(mechanism: Mechanism) -> Graph:
    """Return the graph with joints as nodes and bars as branches, after Vlase.

    A link with two joints is one bar. A link with n > 2 joints is a strip of triangles with 2 n - 3 bars. The ground is
    a path of bars through its joints. A slider is a branch of variable length, from the origin of its line to the point
    that slides. The origin is a node with the name of the slider, or a joint of the guiding link at the same position.
    Points that belong to one link only are omitted, unless the link has fewer than two joints. Welded links count as
    one link.
    """
    named = {point for link in mechanism.links for point in link.points}
    shared = {pair.name for pair in pairs(mechanism) if pair.kind == "pin"}
    shared |= {slider.point for slider in mechanism.sliders}
    bodies = _bodies(mechanism)
    nodes: dict[str, dict[str, Complex]] = {}
    slides: list[Branch] = []
    for link in mechanism.links:
        places = {point: place for point, place in link.points.items() if point in shared}
        for slider in mechanism.sliders:
            if slider.on == link.name:
                origin_name = f"{slider.name}'s line" if slider.name in named else slider.name
                free = [point for point in places if point != slider.point]  # a branch cannot start at its own end
                start = next((point for point in free if np.all(places[point] == slider.origin)), origin_name)
                places.setdefault(start, slider.origin)
                slides.append(Branch(slider.name, start, slider.point))
        nodes.setdefault(bodies[link.name], {}).update(places)
    bars = [
        bar for name, joints in nodes.items() for bar in _bars(mechanism.links[mechanism.index[name]], list(joints))
    ]
    return Graph((*bars, *slides))


def _bodies(mechanism: Mechanism) -> dict[str, str]:
    """Map the name of each link to the name of the first link in its body, i.e. its group of welded links."""
    body = {link.name: link.name for link in mechanism.links}
    for weld in mechanism.welds:
        kept, merged = sorted((body[weld.on], body[weld.link]), key=mechanism.index.__getitem__)
        body = {name: kept if first == merged else first for name, first in body.items()}
    return body


def _bars(link: Link, joints: list[str]) -> list[Branch]:
    """Return the bars of a link, see `bar_graph`."""
    nodes = joints
    if len(nodes) < 2 and link.name != GROUND:
        nodes = list(dict.fromkeys((*link.points, *joints)))
    path = list(pairwise(nodes))
    if link.name == GROUND:
        return [Branch(f"{link.name} {start}-{end}", start, end) for start, end in path]
    if len(path) == 1:
        return [Branch(link.name, *path[0])]
    strip = [pair for near, far in zip(path, zip(nodes, nodes[2:], strict=False), strict=False) for pair in (near, far)]
    strip += path[len(strip) // 2 :]
    return [Branch(f"{link.name} {start}-{end}", start, end) for start, end in strip]
