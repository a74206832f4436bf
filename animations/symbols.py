"""Standard symbols: pins, welds, ground, sliding blocks and rails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from animations.shapes import INK, PAPER, QUIET, Complexes, FlatShape
from elastic import Deflection, displacement_of
from rigid import Slider, position_of
from rigid.arrays import Integers

PEDESTAL = np.array([0.0, -0.95 - 1.6j, 0.95 - 1.6j])  # triangle under a pin, in pin diameters
BLOCK = np.array([-1.25 - 0.8j, 1.25 - 0.8j, 1.25 + 0.8j, -1.25 + 0.8j])  # a slider's block


def symbol_shapes(deflection: Deflection, size: float, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw the symbols of all joints.

    Parameters
    ----------
    size
        Diameter of a pin [m], which scales all symbols.
    exaggeration
        Scale factor of the displacements of the symbols.
    """
    shapes: list[FlatShape] = []
    seen: dict[str, bool] = {}
    for joint in deflection.motion.structure.joints:
        if not joint.turns:
            shapes += _slider(deflection, deflection.motion.mechanism.slider(joint.name), size, exaggeration)
            continue
        grounded = 0 in (joint.parent, joint.child)
        if joint.name not in seen:
            symbol = _weld if joint.name in deflection.motion.mechanism.welded_points else _pin
            shapes.append(symbol(moved_place(deflection, joint.child, joint.name, exaggeration), size))
        if grounded and not seen.get(joint.name):
            shapes += _ground(complex(deflection.motion.mechanism.links[0].points[joint.name]), size)
        seen[joint.name] = grounded or seen.get(joint.name, False)
    return shapes


def moved_place(deflection: Deflection, link: str | int, point: str, exaggeration: float) -> Complexes:
    """Positions of a link's point, with exaggerated displacement."""
    place: Complexes = position_of(deflection.motion, link, point)
    if exaggeration:
        place = place + exaggeration * displacement_of(deflection, link, point)
    return place


def _pin(place: Complexes, size: float) -> FlatShape:
    circle = size / 2 * np.exp(2j * np.pi * np.arange(28) / 28)
    ring = np.arange(len(circle))
    return FlatShape(
        "pin", lambda position: place[position] + circle, (ring,), (np.append(ring, 0),), fill=PAPER, width=1.8
    )


def _weld(place: Complexes, size: float) -> FlatShape:
    """A filled square."""
    corners = 0.45 * size * np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
    ring = np.arange(4)
    return FlatShape(
        "pin", lambda position: place[position] + corners, (ring,), (np.append(ring, 0),), fill=INK, width=1.8
    )


def _ground(place: complex, size: float) -> list[FlatShape]:
    """Triangle under a pin on a hatched base."""
    corners = place + size * PEDESTAL
    triangle = FlatShape("ground", _still(corners), (np.arange(3),), (np.array([0, 1, 2, 0]),), fill=PAPER)
    base = _hatched(place + size * (-1.5 - 1.6j), place + size * (1.5 - 1.6j), size, -1j)
    points, lines = base
    return [triangle, FlatShape("ground", _still(points), lines=lines)]


def _hatched(start: complex, end: complex, size: float, side: complex) -> tuple[Complexes, tuple[Integers, ...]]:
    """Line hatched on one side, with strokes about half a pin apart."""
    along = (end - start) / abs(end - start)
    count = max(2, round(abs(end - start) / (0.55 * size)))
    tops = start + (end - start) * (np.arange(count) + 0.7) / count
    feet = tops + 0.55 * size * (side - along)
    points = np.concatenate([[start, end], tops, feet])
    strokes = np.stack([np.arange(count) + 2, np.arange(count) + 2 + count], -1)
    return points, (np.array([0, 1]), *strokes)


def slide(deflection: Deflection, slider: Slider, size: float) -> tuple[complex, complex]:
    """Ends of a slider's path, slightly extended, in the axes of its owner [m]."""
    motion = deflection.motion
    on = motion.mechanism.index[slider.on]
    place = position_of(motion, slider.link, slider.point)
    local = np.conj(motion.direction[on]) * (place - motion.origin[on])
    slides = (np.conj(slider.direction) * (local - slider.origin)).real
    slides = slides[np.isfinite(slides)]
    low, high = (slides.min(), slides.max()) if slides.size else (0.0, 0.0)
    start, end = (slider.origin + slider.direction * way for way in (low - 2.6 * size, high + 2.6 * size))
    return complex(start), complex(end)


def under(way: complex) -> complex:
    """Unit normal of a line on the ground: downwards, or left of a vertical line."""
    side = 1j * way / abs(way)
    return -side if (round(side.imag, 9), side.real) > (0.0, 0.0) else side


def _slider(deflection: Deflection, slider: Slider, size: float, exaggeration: float) -> list[FlatShape]:
    """Block at the slider's point, and the line of its path over the cycle."""
    motion = deflection.motion
    on = motion.mechanism.index[slider.on]
    start, end = slide(deflection, slider, size)
    moved = moved_place(deflection, slider.link, slider.point, exaggeration)
    block = size * BLOCK
    along = motion.direction[on] * slider.direction
    ring = np.arange(4)
    box = FlatShape(
        "block", lambda p: moved[p] + along[p] * block, (ring,), (np.append(ring, 0),), fill=PAPER, width=1.8
    )
    return [_guide(deflection, on, start, end, size), box]


def _guide(deflection: Deflection, on: int, start: complex, end: complex, size: float) -> FlatShape:
    motion = deflection.motion
    if on == 0:
        side = under(end - start)
        points, lines = _hatched(start + 0.8 * size * side, end + 0.8 * size * side, size, side)
        return FlatShape("ground", _still(points), lines=lines)
    ends = np.array([start, end])
    place: Callable[[int], Complexes] = lambda p: motion.origin[on, p] + motion.direction[on, p] * ends  # noqa: E731
    return FlatShape("guide", place, lines=(np.arange(2),), ink=QUIET, width=1.2)


def _still(points: Complexes) -> Callable[[int], Complexes]:
    return lambda position: points
