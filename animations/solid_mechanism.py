"""Mechanism as solid bodies: links in layers on axles, in front of the ground."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np
from msgspec import Struct

from animations.diagrams import Diagram, values_of
from animations.layers import Stack
from animations.layout import Scales
from animations.shapes import Complexes, carried, moved_beams
from animations.solid import CIRCLE_CORNERS, CrossSections, SolidShape, beam_bodies, cross_sections, prism
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection
from rigid import Slider
from symbols import BLOCK_CORNERS, PEDESTAL, hull, travel

Place = Callable[[int], Complexes]

CIRCLE = np.exp(2j * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS)
SQUARE = np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
DEFAULT_THICKNESS = 0.55  # thickness of links with unknown dimensions, relative to the diameter of a pin
SLAB_SHARE = 0.52  # half thickness of a body / thickness of its link; slightly over 0.5, to cover the faces of beams
# distances of the ends of axles and blocks, of axle heads and of rails from the mid-plane of the outermost link,
# relative to the thickness of the layer of that link
AXLE_REACH, HEAD_REACH, RAIL_REACH = 0.55, 0.58, 0.65
EYE_RADIUS, AXLE_RADIUS = 0.62, 0.34  # radii of link ends and of axles, relative to the diameter of a pin
OUTLINE_OPACITY = 0.4  # opacity of outlines
GREYS = "metal", "iron"  # alternating colours of rigid bodies in neighbouring layers


def mechanism_bodies(
    deflection: Deflection, diagram: Diagram, scales: Scales, style: Style, stack: Stack
) -> list[SolidShape]:
    """Build links, joints and ground; the field of the diagram, or the displacement, colours the beams."""
    bodies = _Bodies(deflection, scales, stack)
    return [
        *bodies.beams(diagram),
        *bodies.outlines(style.outlines),
        *bodies.rigid_parts(),
        *bodies.blocks(),
        *bodies.axles(),
    ]


def sections_of(deflection: Deflection, scales: Scales) -> list[CrossSections]:
    """Return the cross-sections of every beam as drawn."""
    return [cross_sections(section, DEFAULT_THICKNESS * scales.pin) for section in deflection.sections]


def thicknesses(deflection: Deflection, scales: Scales) -> list[float]:
    """Return the thickness of each link [m]: the width of its widest beam, or the default if that is larger."""
    thick = [DEFAULT_THICKNESS * scales.pin] * len(deflection.motion.mechanism.links)
    for (at, _), section in zip(deflection.motion.mechanism.beams, sections_of(deflection, scales), strict=True):
        thick[at] = max(thick[at], float(section.width.max()))
    return thick


class _Bodies(Struct, frozen=True, eq=False):
    """Builder of the solid bodies of a mechanism."""

    deflection: Deflection
    scales: Scales
    stack: Stack

    def beams(self, diagram: Diagram) -> Iterator[SolidShape]:
        """Yield a single body of all beams, if there are any."""
        sections = sections_of(self.deflection, self.scales)
        if sections:
            axes = moved_beams(self.deflection, self.scales.exaggeration)
            heights = [self.stack.middle[at] for at, _ in self.deflection.motion.mechanism.beams]
            values = values_of(self.deflection, diagram)
            yield beam_bodies(axes, sections, heights, lambda position: values[:, position])

    def outlines(self, corners: Mapping[str, Sequence[complex]]) -> Iterator[SolidShape]:
        """Yield the outlines of links as transparent bodies."""
        half = SLAB_SHARE * DEFAULT_THICKNESS * self.scales.pin
        for at, link in enumerate(self.deflection.motion.mechanism.links):
            if link.name in corners:
                place = self._on_link(at, np.array(corners[link.name], complex))
                yield self._slab(at, half, place, len(corners[link.name]), "quiet", OUTLINE_OPACITY)

    def rigid_parts(self) -> Iterator[SolidShape]:
        """Yield the eyes of the moving links, and the hulls of links without beams."""
        links, pin = self.deflection.motion.mechanism.links, self.scales.pin
        for at, (link, thick) in enumerate(zip(links, thicknesses(self.deflection, self.scales), strict=True)):
            if at == 0:
                continue
            half, direction = SLAB_SHARE * thick, self.deflection.motion.direction[at]
            for point in link.points:
                eye = self._about(at, point, EYE_RADIUS * pin * CIRCLE, direction)
                yield self._slab(at, half, eye, CIRCLE_CORNERS, smooth=True)
            if not link.beams and len(link.points) > 1:
                points = np.array(list(link.points.values()), complex)
                corners = hull((points[:, None] + 0.5 * pin * CIRCLE).ravel())
                fill = GREYS[self.stack.layer[at] % 2]
                yield self._slab(at, half, self._on_link(at, corners), len(corners), fill)

    def blocks(self) -> Iterator[SolidShape]:
        """Yield the blocks, each with a bar on the link that guides it, or with a rail on the ground."""
        motion, pin = self.deflection.motion, self.scales.pin
        for joint in motion.structure.joints:
            if joint.turns:
                continue
            slider = motion.mechanism.slider(joint.name)
            on, at = motion.mechanism.index[slider.on], motion.mechanism.index[slider.link]
            corners = block(self.deflection, slider, self.scales)
            yield prism(corners.__getitem__, 4, *self._between({on, at} - {0}, AXLE_REACH, AXLE_REACH))
            if on:  # a thin bar, hidden inside the beam if there is one
                start, end = slide(self.deflection, slider, pin)
                bar = np.array([start, end, end, start]) + 0.1j * pin * slider.direction * np.array([-1, -1, 1, 1])
                yield self._slab(on, 0.05 * self.stack.thick[on], self._on_link(on, bar), 4)
            else:
                yield _fixed(rail(self.deflection, slider, pin), *self._between({at}, RAIL_REACH, RAIL_REACH), "quiet")

    def axles(self) -> Iterator[SolidShape]:
        """Yield the axles, which are square at welds, and their pedestals on the ground."""
        mechanism, pin = self.deflection.motion.mechanism, self.scales.pin
        joined: dict[str, set[int]] = {}
        for joint in self.deflection.motion.structure.joints:
            if joint.turns:
                joined.setdefault(joint.name, set()).update((joint.parent, joint.child))
        for name, links in joined.items():
            welded = name in mechanism.welded_points
            outline: Complexes = SQUARE if welded else CIRCLE
            corners = AXLE_RADIUS * pin * outline
            low, high = self._between(links, AXLE_REACH, HEAD_REACH)
            axle = self._about(max(links), name, corners)
            yield prism(axle, len(corners), low, high, "soft", smooth=not welded)
            if 0 in links:
                foot = complex(mechanism.links[0].points[name]) + self.scales.symbol * PEDESTAL
                yield _fixed(foot, *self._between({0}, 0.5, 0.5))

    def _on_link(self, at: int, corners: Complexes) -> Place:
        """Return a function from a position to the corners [m], which are fixed to a link and given in link axes."""
        return carried(self.deflection, at, corners, self.scales.exaggeration)

    def _about(self, at: int, point: str, corners: Complexes, direction: Complexes | None = None) -> Place:
        """Return a function from a position to corners around a point of a link [m].

        `corners` are relative to the point. Their x axis has the `direction` at each position; if `direction` is None,
        the axes are those of the ground.
        """
        middle = moved_place(self.deflection, at, point, self.scales.exaggeration)
        if direction is None:
            return lambda position: middle[position] + corners
        return lambda position: middle[position] + direction[position] * corners

    def _slab(
        self,
        at: int,
        half: float,
        place: Place,
        corners: int,
        fill: str = "metal",
        opacity: float = 1.0,
        smooth: bool = False,
    ) -> SolidShape:
        """Return a flat body in the mid-plane of a link."""
        z = self.stack.middle[at]
        return prism(place, corners, z - half, z + half, fill, opacity, smooth)

    def _between(self, links: Collection[int], below: float, above: float) -> tuple[float, float]:
        """Return the range of z that spans some links [m].

        The range begins `below`, and ends `above`, layer thicknesses from the mid-planes of the outermost links.
        """
        middle, thick = self.stack.middle, self.stack.thick
        low = min(middle[at] - below * thick[at] for at in links)
        return low, max(middle[at] + above * thick[at] for at in links)


def _fixed(corners: Complexes, low: float, high: float, fill: str = "metal") -> SolidShape:
    """Return a body that does not move."""
    return prism(lambda _: corners, len(corners), low, high, fill)


def block(deflection: Deflection, slider: Slider, scales: Scales) -> Complexes:
    """Return the corners of a sliding block at all positions [m], shape (positions, 4)."""
    motion = deflection.motion
    along = motion.direction[motion.mechanism.index[slider.on]] * slider.direction
    middle = moved_place(deflection, slider.link, slider.point, scales.exaggeration)
    return middle[:, None] + scales.symbol * along[:, None] * BLOCK_CORNERS


def slide(deflection: Deflection, slider: Slider, pin: float) -> tuple[complex, complex]:
    """Return the ends of the path of a slider in the axes of the guiding link [m]; the path is slightly extended."""
    low, high = travel(deflection.motion, slider) or (0.0, 0.0)
    start, end = (complex(slider.origin + slider.direction * way) for way in (low - 2.6 * pin, high + 2.6 * pin))
    return start, end


def under(way: complex) -> complex:
    """Return the unit normal of a line on the ground. It points downwards, or to the left if the line is vertical."""
    side = 1j * way / abs(way)
    return -side if (round(side.imag, 9), side.real) > (0.0, 0.0) else side


def rail(deflection: Deflection, slider: Slider, pin: float) -> Complexes:
    """Return the corners of the rail of the ground under a block [m]."""
    start, end = slide(deflection, slider, pin)
    way = under(end - start)
    return np.array([start, end, end + 0.5 * pin * way, start + 0.5 * pin * way]) + 0.8 * pin * way
