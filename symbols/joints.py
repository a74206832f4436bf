"""Symbols of joints and supports."""

from collections.abc import Iterator

import numpy as np

from rigid import GROUND, Slider
from rigid.arrays import Complexes
from rigid.joints import Placed
from symbols.marks import BLOCK_LEVEL, GROUND_LEVEL, INK, LINK, PAPER, UNDER, Anchor, Line, Mark, anchor_position

BLOCK = "block"
"""Mark kind of the blocks of sliders."""
POINTS = ("pin", "weld", "dot")
"""Mark kinds at points."""
JOINTS = (*POINTS, "support", "ground", BLOCK, "rail")
"""All mark kinds that this file defines."""
# radii of a pin and of a dot; all lengths from here to SHORT_RAIL are in symbol sizes
PIN_RADIUS, DOT_RADIUS = 0.55, 0.3
PEDESTAL = np.array([0.0, -1.3 - 2.0j, 1.3 - 2.0j])
"""Corners of the triangle under a fixed pin (complex, in symbol sizes)."""
SQUARE = np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
BLOCK_CORNERS = 1.6 * np.array([-1 - 0.62j, 1 - 0.62j, 1 + 0.62j, -1 + 0.62j])
"""Corners of a slider's block (complex, in symbol sizes)."""
BASE = 2.1  # half the length of the ground line under a fixed pin
STROKE, STROKE_GAP = -0.6 - 0.75j, 0.85  # hatching: vector along a stroke, and approximate distance between two strokes
# of rails: distance from the centre line, length beyond each end of the travel, and half of the length of a short rail
RAIL_OFFSET, RAIL_OVERHANG, SHORT_RAIL = 1.15, 3.0, 5.0

# argument `offset` for a line of constant size in the picture: both ends are given in symbol sizes only
NO_LENGTH = np.zeros(2, complex)


def pin(at: Anchor) -> Mark:
    """Return the symbol of a pin: a circle."""
    return Mark("pin", at, radius=(PIN_RADIUS, 0.0), fill=PAPER, width=1.5)


def weld(at: Anchor) -> Mark:
    """Return the symbol of a weld: a filled square."""
    return Mark("weld", at, (Line(0.45 * SQUARE, closed=True),), fill=INK)


def dot(at: Anchor) -> Mark:
    """Return the dot that marks a point without a joint."""
    return Mark("dot", at, radius=(DOT_RADIUS, 0.0), fill=INK, width=0.5)


def support(at: Anchor) -> list[Mark]:
    """Return the symbol of a fixed pin: a triangle on hatched ground."""
    triangle = Mark("support", at, (Line(PEDESTAL, closed=True),), fill=PAPER, width=1.2, level=GROUND_LEVEL)
    base = hatched(np.array([-BASE, BASE]) - 2.0j, 2 * BASE, NO_LENGTH)
    return [triangle, Mark("ground", at, (base,), width=1.2, level=GROUND_LEVEL)]


def hatched(ends: Complexes, sizes: float, offset: Complexes) -> Line:
    """Return a line along the x axis with hatching strokes, as one polyline.

    The strokes are on the right-hand side in the direction from the first to the second end.

    Parameters
    ----------
    ends, offset
        Positions of both ends, as the sum of `ends` [symbol sizes] and `offset` [m].
    sizes
        Approximate length of the line in symbol sizes. This length determines the number of strokes.
    """
    count = max(3, round(sizes / STROKE_GAP))
    share = np.concatenate([[0.0], np.repeat((np.arange(count) + 0.7) / count, 3), [1.0]])
    is_tip = np.arange(len(share)) % 3 == 2
    strokes = np.sign((ends[1] - ends[0]).real) * STROKE * is_tip
    return Line(ends[0] + share * (ends[1] - ends[0]) + strokes, offset[0] + share * (offset[1] - offset[0]))


def slider_marks(placed: Placed, slider: Slider, reach: tuple[float, float] | None, size: float) -> Iterator[Mark]:
    """Yield the marks of a slider: a block, and its guide (rails on the ground, or a line on a moving link).

    Parameters
    ----------
    reach
        Smallest and largest slide coordinate [m], or None if fewer than two positions are known.
    size
        Approximate symbol size [m].
    """
    at = Anchor(slider.link, slider.point)
    direction = complex(slider.direction)
    if reach is None:
        yield rails(at, slider.on, direction)
    else:
        ends = complex(slider.origin) + direction * np.array(reach)
        yield rails(Anchor(slider.on), slider.on, direction, ends / direction, (reach[1] - reach[0]) / size)
    yield Mark(BLOCK, at, (Line(BLOCK_CORNERS, closed=True),), axis=(slider.on, direction), stroke=LINK, fill=PAPER,
               width=2.0, level=BLOCK_LEVEL)  # fmt: skip


def rails(at: Anchor, on: str, direction: complex, offset: Complexes = NO_LENGTH, sizes: float = 0.0) -> Mark:
    """Return two hatched rails on the ground, or a line on a moving link.

    Parameters
    ----------
    at, on, direction
        Position, guiding link, and sliding direction in the axes of the guiding link.
    offset
        Both ends of the travel relative to `at` [m]. The two values are complex numbers, with the real axis in the
        sliding direction.
    sizes
        Approximate travel in symbol sizes. If `sizes` is 0, the rail is short, and its centre is at `at`.
    """
    half = RAIL_OVERHANG if sizes else SHORT_RAIL
    ends = np.array([-half, half], complex)
    if on != GROUND:
        return Mark("rail", at, (Line(ends, offset),), axis=(on, direction), width=1.2, level=UNDER)
    lower = hatched(ends - RAIL_OFFSET * 1j, sizes + 2 * half, offset)
    upper = hatched(ends[::-1] + RAIL_OFFSET * 1j, sizes + 2 * half, offset[::-1])
    return Mark("rail", at, (lower, upper), axis=(on, direction), width=1.2, level=GROUND_LEVEL)


def travel(placed: Placed, slider: Slider) -> tuple[float, float] | None:
    """Return the smallest and largest slide coordinate [m], or None if fewer than two positions are known."""
    number = placed.mechanism.index[slider.on]
    place = anchor_position(placed, Anchor(slider.link, slider.point))
    local = np.conj(placed.direction[number]) * (place - placed.origin[number])
    slides = np.ravel((np.conj(slider.direction) * (local - slider.origin)).real)
    slides = slides[np.isfinite(slides)]
    return (float(slides.min()), float(slides.max())) if slides.size > 1 else None
