"""Extents of solid links at every position, for the choice of layers."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from animations.diagrams import STATIONS
from animations.layers import Stack, layers, reach, stacked
from animations.layout import Scales
from animations.shapes import Complexes, carried, moved_beams
from animations.solid_mechanism import AXLE_RADIUS, EYE_RADIUS, block, rail, sections_of, thicknesses
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection
from rigid import Reals
from symbols import hull

PARTS = 6  # number of convex pieces that approximate a bent beam


def stack_of(deflection: Deflection, scales: Scales, style: Style, positions: Any) -> Stack:
    """Assign layers so that no solid link passes through another."""
    found = layers(_links(deflection, scales, style, positions), _pins(deflection, scales, positions))
    return stacked(found, thicknesses(deflection, scales))


def _links(deflection: Deflection, scales: Scales, style: Style, positions: Any) -> list[list[Reals]]:
    """Extents of the parts of each link, see `reach`."""
    motion, pin, moved = deflection.motion, scales.pin, scales.exaggeration
    links = motion.mechanism.links
    bodies: list[list[Reals]] = [[] for _ in links]

    def add(at: int, corners: Sequence[complex] | Complexes, margin: float) -> None:
        place = carried(deflection, at, np.array(corners, complex), moved)
        bodies[at].append(reach(np.array([place(position) for position in positions]), margin))

    sections = sections_of(deflection, scales)
    axes = moved_beams(deflection, moved) if sections else None
    bent = np.array([axes(position) for position in positions]) if axes else np.zeros((0, 0, 0), complex)
    for beam, ((at, _), section) in enumerate(zip(motion.mechanism.beams, sections, strict=True)):
        for one, other in pairwise(np.linspace(0, len(STATIONS) - 1, PARTS + 1).astype(int)):
            bodies[at].append(reach(bent[:, beam, one : other + 1], float(section.depth.max()) / 2))
    for at, link in enumerate(links[1:], 1):
        for point in link.points:
            bodies[at].append(reach(moved_place(deflection, at, point, moved)[positions, None], EYE_RADIUS * pin))
        if not link.beams and len(link.points) > 1:
            add(at, hull(np.array(list(link.points.values()), complex)), 0.5 * pin)
        if link.name in style.outlines:
            add(at, style.outlines[link.name], 0.0)
    for joint in motion.structure.joints:
        if joint.turns:
            continue
        slider, at, on = motion.mechanism.slider(joint.name), joint.block, joint.owner
        box = block(deflection, slider, scales)[positions]
        bodies[at].append(reach(box, 0.0))
        if on:
            bodies[on].append(reach(box, 0.0))
        else:
            bodies[at].append(reach(np.tile(rail(deflection, slider, pin), (len(positions), 1)), 0.0))
    return bodies


def _pins(deflection: Deflection, scales: Scales, positions: Any) -> list[tuple[set[int], Reals]]:
    """Sets of links joined by an axle or block, with its extent, see `reach`."""
    motion = deflection.motion
    joined: dict[str, set[int]] = {}
    axles: dict[str, Reals] = {}
    for joint in motion.structure.joints:
        if joint.turns:
            place = moved_place(deflection, joint.child, joint.name, scales.exaggeration)[positions, None]
            axles[joint.name] = reach(place, AXLE_RADIUS * scales.pin)
        elif joint.parent:
            axles[joint.name] = reach(block(deflection, motion.mechanism.slider(joint.name), scales)[positions], 0.0)
        else:
            continue  # the block slides on the ground's rail
        joined.setdefault(joint.name, set()).update((joint.parent, joint.child))
    return [(joined[name], axles[name]) for name in axles]
