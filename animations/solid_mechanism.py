"""A mechanism drawn as solid bodies: links in layers on axles, the ground behind them."""

from collections.abc import Callable, Collection
from functools import partial

import numpy as np

from animations.diagrams import STATIONS, Diagram
from animations.layers import Stack
from animations.layout import Scales
from animations.shapes import Complexes, carried, moved_beams
from animations.solid import CIRCLE_CORNERS, CrossSections, SolidShape, beam_bodies, cross_sections, prism
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection, sample
from rigid import Reals, Slider
from symbols import BLOCK_CORNERS, PEDESTAL, hull, travel

CIRCLE = np.exp(2j * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS)
DEFAULT_THICKNESS = 0.55  # thickness of links with unknown dimensions, relative to a pin's diameter
AXLE_REACH, HEAD_REACH, RAIL_REACH = (
    0.55,
    0.58,
    0.65,
)  # [layer thicknesses] reach of axles, heads and rails from the mid-plane
EYE_RADIUS, AXLE_RADIUS = 0.62, 0.34  # radii of link ends and of axles, relative to a pin's diameter
OUTLINE_OPACITY = 0.4  # opacity of outlines
GREYS = "metal", "iron"  # alternating colours of rigid bodies in neighbouring layers


def mechanism_bodies(
    deflection: Deflection, diagram: Diagram, scales: Scales, style: Style, stack: Stack
) -> list[SolidShape]:
    """Build links, joints and ground; beams are coloured by the diagram's field or the displacement."""
    links = deflection.motion.mechanism.links
    sections = sections_of(deflection, scales)
    owners = [at for at, _ in deflection.motion.mechanism.beams]
    bodies = []
    if sections:
        axes = moved_beams(deflection, scales.exaggeration)
        heights = [stack.middle[at] for at in owners]
        bodies.append(beam_bodies(axes, sections, heights, _values(deflection, diagram)))
    for at, (link, z) in enumerate(zip(links, stack.middle, strict=True)):
        if link.name in style.outlines:
            outline = np.array(style.outlines[link.name], complex)
            half = 0.52 * DEFAULT_THICKNESS * scales.pin
            bodies.append(_slab(deflection, at, scales.exaggeration, z, half, outline, "", "quiet", OUTLINE_OPACITY))
    for at, (link, thick) in enumerate(zip(links, thicknesses(deflection, scales), strict=True)):
        if at == 0:
            continue
        place = partial(_slab, deflection, at, scales.exaggeration, stack.middle[at], 0.52 * thick)
        bodies += [place(EYE_RADIUS * scales.pin * CIRCLE, point, smooth=True) for point in link.points]
        if not link.beams and len(link.points) > 1:
            corners = np.array(list(link.points.values()), complex)
            fill = GREYS[stack.layer[at] % 2]
            bodies.append(place(hull((corners[:, None] + 0.5 * scales.pin * CIRCLE).ravel()), fill=fill))
    return bodies + _joints(deflection, scales, stack)


def sections_of(deflection: Deflection, scales: Scales) -> list[CrossSections]:
    """Cross-sections of every beam, as drawn."""
    return [cross_sections(section, DEFAULT_THICKNESS * scales.pin) for section in deflection.sections]


def thicknesses(deflection: Deflection, scales: Scales) -> list[float]:
    """Thickness of each link [m]: that of its widest beam, or of a rigid body."""
    thick = [DEFAULT_THICKNESS * scales.pin] * len(deflection.motion.mechanism.links)
    for (at, _), section in zip(deflection.motion.mechanism.beams, sections_of(deflection, scales), strict=True):
        thick[at] = max(thick[at], float(section.width.max()))
    return thick


def _values(deflection: Deflection, diagram: Diagram) -> Callable[[int], Reals]:
    """Values of the field by position, shape (beams, stations)."""
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
) -> SolidShape:
    """Flat body of a link, centred at z; corners in the link's axes or relative to a point."""
    if about:
        middle, direction = moved_place(deflection, at, about, exaggeration), deflection.motion.direction[at]
        return prism(lambda p: middle[p] + direction[p] * local, len(local), z - half, z + half, fill, opacity, smooth)
    return prism(carried(deflection, at, local, exaggeration), len(local), z - half, z + half, fill, opacity, smooth)


def _joints(deflection: Deflection, scales: Scales, stack: Stack) -> list[SolidShape]:
    """Build axles (square at welds), pedestals on the ground, blocks and rails."""
    motion, pin = deflection.motion, scales.pin
    joined: dict[str, set[int]] = {}
    bodies: list[SolidShape] = []
    for joint in motion.structure.joints:
        if not joint.turns:
            bodies += _slider(deflection, motion.mechanism.slider(joint.name), scales, stack)
            continue
        joined.setdefault(joint.name, set()).update((joint.parent, joint.child))
    for name, links in joined.items():
        middle = moved_place(deflection, max(links), name, scales.exaggeration)
        low, high = _between(stack, links, AXLE_REACH, HEAD_REACH)
        if name in motion.mechanism.welded_points:
            bodies.append(prism(partial(_square, middle, AXLE_RADIUS * pin), 4, low, high, "soft"))
        else:
            bodies.append(
                prism(partial(_round, middle, AXLE_RADIUS * pin), CIRCLE_CORNERS, low, high, "soft", smooth=True)
            )
        if 0 in links:
            corners = complex(motion.mechanism.links[0].points[name]) + scales.symbol * PEDESTAL
            foot = _between(stack, {0}, 0.5, 0.5)
            bodies.append(prism(lambda _, still=corners: still, len(corners), *foot))  # type: ignore[misc]
    return bodies


def _between(stack: Stack, links: Collection[int], below: float, above: float) -> tuple[float, float]:
    """Range of z that some links occupy, extended by a number of their thicknesses [m]."""
    low = min(stack.middle[at] - below * stack.thick[at] for at in links)
    return low, max(stack.middle[at] + above * stack.thick[at] for at in links)


def _round(middle: Complexes, radius: float, position: int) -> Complexes:
    return middle[position] + radius * CIRCLE


def _square(middle: Complexes, half: float, position: int) -> Complexes:
    return middle[position] + half * np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])


def block(deflection: Deflection, slider: Slider, scales: Scales) -> Complexes:
    """Corners of a sliding block at all positions [m], shape (positions, 4)."""
    motion = deflection.motion
    along = motion.direction[motion.mechanism.index[slider.on]] * slider.direction
    middle = moved_place(deflection, slider.link, slider.point, scales.exaggeration)
    return middle[:, None] + scales.symbol * along[:, None] * BLOCK_CORNERS


def slide(deflection: Deflection, slider: Slider, pin: float) -> tuple[complex, complex]:
    """Ends of a slider's path, slightly extended, in the axes of its owner [m]."""
    low, high = travel(deflection.motion, slider) or (0.0, 0.0)
    start, end = (complex(slider.origin + slider.direction * way) for way in (low - 2.6 * pin, high + 2.6 * pin))
    return start, end


def under(way: complex) -> complex:
    """Unit normal of a line on the ground: downwards, or left of a vertical line."""
    side = 1j * way / abs(way)
    return -side if (round(side.imag, 9), side.real) > (0.0, 0.0) else side


def rail(deflection: Deflection, slider: Slider, pin: float) -> Complexes:
    """Corners of the ground's rail under a block [m]."""
    start, end = slide(deflection, slider, pin)
    way = under(end - start)
    return np.array([start, end, end + 0.5 * pin * way, start + 0.5 * pin * way]) + 0.8 * pin * way


def _slider(deflection: Deflection, slider: Slider, scales: Scales, stack: Stack) -> list[SolidShape]:
    """Block on the link that guides it, or on a rail on the ground."""
    pin, motion = scales.pin, deflection.motion
    on, at = motion.mechanism.index[slider.on], motion.mechanism.index[slider.link]
    corners = block(deflection, slider, scales)
    box = prism(lambda p: corners[p], 4, *_between(stack, {on, at} - {0}, AXLE_REACH, AXLE_REACH))
    if on:  # a thin bar, hidden inside the beam if there is one
        start, end = slide(deflection, slider, pin)
        bar = np.array([start, end])[[0, 1, 1, 0]] + 0.1j * pin * slider.direction * np.array([-1, -1, 1, 1])
        return [box, _slab(deflection, on, scales.exaggeration, stack.middle[on], 0.05 * stack.thick[on], bar)]
    under_it = rail(deflection, slider, pin)
    return [box, prism(lambda _: under_it, 4, *_between(stack, {at}, RAIL_REACH, RAIL_REACH), "quiet")]
