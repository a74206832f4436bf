"""A mechanism as solid bodies: links that are joined stand one behind the other, on axles; the ground behind all."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from animations.diagrams import STATIONS, Diagram
from animations.layout import Scales
from animations.shapes import Complexes, carried, hull, moved_beams
from animations.solid import ROUND, Body, beam_bodies, cross_sections, prism
from animations.style import Style
from animations.symbols import BLOCK, PEDESTAL, moved_place, slide, under
from elastic import Deflection, sample
from rigid import Reals, Slider

CIRCLE = np.exp(2j * np.pi * np.arange(ROUND) / ROUND)
THIN = 0.55  # of a pin's diameter, where a section's dimensions are not known
APART = 1.2  # widths from one layer to the next
EYE, AXLE = 0.62, 0.34  # radii at the ends of links and of axles, of a pin's diameter
SHEER = 0.4  # opacity of outlines


def mechanism_bodies(deflection: Deflection, diagram: Diagram, scales: Scales, style: Style) -> list[Body]:
    """Links, joints and ground as bodies; beams in the colours of the diagram's field, or of the displacement."""
    links = deflection.motion.mechanism.links
    sections = [cross_sections(section, THIN * scales.pin) for section in deflection.sections]
    owners = [at for at, _ in deflection.motion.mechanism.beams]
    width = widest(deflection, scales)
    layer = layers(deflection, width)
    bodies = []
    if sections:
        axes = moved_beams(deflection, scales.exaggeration)
        bodies.append(beam_bodies(axes, sections, [layer[at] for at in owners], _values(deflection, diagram)))
    for at, link in enumerate(links):
        if link.name in style.outlines:
            outline = np.array(style.outlines[link.name], complex)
            half = 0.52 * THIN * scales.pin
            bodies.append(_slab(deflection, at, scales.exaggeration, layer[at], half, outline, "", "quiet", SHEER))
    for at, link in enumerate(links[1:], 1):
        widths = [float(each.width.max()) for each, owner in zip(sections, owners, strict=True) if owner == at]
        thick = max(*widths, THIN * scales.pin) if widths else THIN * scales.pin
        place = partial(_slab, deflection, at, scales.exaggeration, layer[at], 0.52 * thick)
        bodies += [place(EYE * scales.pin * CIRCLE, point, smooth=True) for point in link.points]
        if not link.beams and len(link.points) > 1:
            corners = np.array(list(link.points.values()), complex)
            bodies.append(place(hull((corners[:, None] + 0.5 * scales.pin * CIRCLE).ravel())))
    return bodies + _joints(deflection, scales, layer, width)


def widest(deflection: Deflection, scales: Scales) -> float:
    """Width of the widest beam, across the plane of motion [m]."""
    sections = (cross_sections(section, THIN * scales.pin) for section in deflection.sections)
    return max([float(each.width.max()) for each in sections] + [THIN * scales.pin])


def layers(deflection: Deflection, width: float) -> list[float]:
    """z of every link's middle [m], the ground behind all: links that a joint joins are in different layers."""
    links = deflection.motion.mechanism.links
    beside: list[set[int]] = [set() for _ in links]
    for joint in deflection.motion.structure.joints:
        beside[joint.parent].add(joint.child)
        beside[joint.child].add(joint.parent)
    found = [-1] * len(links)
    for at in range(1, len(links)):
        taken = {found[other] for other in beside[at] if 0 < other < at}
        found[at] = next(layer for layer in range(len(links)) if layer not in taken)
    return [APART * width * (number - max(found) / 2) for number in found]


def _values(deflection: Deflection, diagram: Diagram) -> Callable[[int], Reals]:
    """The field at the stations of the beams at a position, shape (beams, stations)."""
    if diagram.field is None:
        values = np.abs(sample(deflection, "u", STATIONS) + 1j * sample(deflection, "w", STATIONS))
    else:
        values = sample(deflection, diagram.field, STATIONS)
    return lambda position: values[:, position]


def _slab(
    deflection: Deflection,
    at: int,
    exaggeration: float,
    z: float,
    half: float,
    local: Complexes,
    about: str = "",
    fill: str = "metal",
    opacity: float = 1.0,
    smooth: bool = False,
) -> Body:
    """A flat body of a link about z: corners in its axes, or from one of its points."""
    if about:
        middle, direction = moved_place(deflection, at, about, exaggeration), deflection.motion.direction[at]
        return prism(lambda p: middle[p] + direction[p] * local, len(local), z - half, z + half, fill, opacity, smooth)
    return prism(carried(deflection, at, local, exaggeration), len(local), z - half, z + half, fill, opacity, smooth)


def _joints(deflection: Deflection, scales: Scales, layer: list[float], width: float) -> list[Body]:
    """Axles through the links that they join, pedestals on the ground, sliding blocks and their rails."""
    motion, pin = deflection.motion, scales.pin
    back = layer[0]
    reach: dict[str, list[float]] = {}
    child: dict[str, int] = {}
    bodies: list[Body] = []
    for joint in motion.structure.joints:
        if joint.slider is not None:
            bodies += _slider(deflection, joint.slider, scales, layer, width)
            continue
        child[joint.name] = joint.child
        for link in (joint.parent, joint.child):
            reach.setdefault(joint.name, []).append(layer[link])
        if 0 in (joint.parent, joint.child):
            corners = complex(motion.mechanism.links[0].points[joint.name]) + pin * PEDESTAL
            bodies.append(prism(lambda _, still=corners: still, len(corners), back - 0.5 * width, back + 0.5 * width))  # type: ignore[misc]
    for name, levels in reach.items():
        middle = moved_place(deflection, child[name], name, scales.exaggeration)
        low, high = min(levels) - 0.55 * width, max(levels) + 0.75 * width
        axle = partial(_round, middle, AXLE * pin)
        bodies.append(prism(axle, ROUND, low, high, "soft", smooth=True))
    return bodies


def _round(middle: Complexes, radius: float, position: int) -> Complexes:
    circle: Complexes = middle[position] + radius * CIRCLE
    return circle


def _slider(deflection: Deflection, slider: Slider, scales: Scales, layer: list[float], width: float) -> list[Body]:
    motion, pin = deflection.motion, scales.pin
    on, at = motion.mechanism.index[slider.on], motion.mechanism.index[slider.link]
    middle = moved_place(deflection, slider.link, slider.point, scales.exaggeration)
    along = motion.direction[on] * slider.direction
    z = layer[at] if on == 0 else (layer[at] + layer[on]) / 2
    half = 0.6 * width + abs(z - layer[at])
    box = prism(lambda p: middle[p] + pin * along[p] * BLOCK, 4, z - half, z + half)
    start, end = slide(deflection, slider, pin)
    if on:  # a thin bar, within the beam where there is one
        bar = np.array([start, end])[[0, 1, 1, 0]] + 0.1j * pin * slider.direction * np.array([-1, -1, 1, 1])
        return [box, _slab(deflection, on, scales.exaggeration, layer[on], 0.05 * width, bar)]
    way = under(end - start)
    rail = np.array([start, end, end + 0.5 * pin * way, start + 0.5 * pin * way]) + 0.8 * pin * way
    return [box, prism(lambda _: rail, 4, z - 1.2 * half, z + 1.2 * half, "quiet")]
