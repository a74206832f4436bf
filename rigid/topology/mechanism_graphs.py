"""Two graphs of a mechanism: links and joints, or joints and bars.

Topology only, without lengths. See docs/structure.md.
"""

from itertools import pairwise

import numpy as np

from rigid.arrays import Complex
from rigid.mechanism import Mechanism
from rigid.parts import GROUND, Link
from rigid.topology.graph import Branch, Graph
from rigid.topology.kinematic_pairs import Contact, pairs


def link_graph(mechanism: Mechanism, contacts: tuple[Contact, ...] = ()) -> Graph:
    """Graph of links, ground first, and joints; n links on one pin make n - 1 branches."""
    joints = pairs(mechanism, contacts)
    return Graph(
        tuple(Branch(pair.name, pair.start, pair.end) for pair in joints), tuple(link.name for link in mechanism.links)
    )


def bar_graph(mechanism: Mechanism) -> Graph:
    """Graph of joints and bars, after Vlase.

    A link with two joints is one bar; with n > 2 joints, it is a strip of triangles made of 2 n - 3 bars. The ground is
    a path of bars through its joints. A slider is a branch of variable length from its line's origin to its point; the
    origin is a node named like the slider, or a joint of the owner at the same place. Points of a single link are
    omitted unless the link has fewer than two joints. Welded links are one.
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
                own = f"{slider.name}'s line" if slider.name in named else slider.name
                free = [point for point in places if point != slider.point]  # the line may also begin at this point
                start = next((point for point in free if np.all(places[point] == slider.origin)), own)
                places.setdefault(start, slider.origin)
                slides.append(Branch(slider.name, start, slider.point))
        nodes.setdefault(bodies[link.name], {}).update(places)
    bars = [
        bar for name, joints in nodes.items() for bar in _bars(mechanism.links[mechanism.index[name]], list(joints))
    ]
    return Graph((*bars, *slides))


def _bodies(mechanism: Mechanism) -> dict[str, str]:
    """Map each link to the first of the links welded to it, including itself."""
    body = {link.name: link.name for link in mechanism.links}
    for weld in mechanism.welds:
        kept, gone = sorted((body[weld.on], body[weld.link]), key=mechanism.index.__getitem__)
        body = {name: kept if first == gone else first for name, first in body.items()}
    return body


def _bars(link: Link, joints: list[str]) -> list[Branch]:
    """Bars that make a link rigid."""
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
