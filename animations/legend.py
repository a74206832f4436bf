"""Words and measures around a mechanism: title, scales, what the colours mean, where the drives stand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from animations.diagrams import TIMES, Diagram, quantity, round_below, steady
from animations.layout import FOOT, HEAD, MARGIN, Layout, Style
from animations.shapes import BENT, INK, NEGATIVE, POSITIVE, QUIET, SOFT, Complexes, Shape
from elastic import Deflection
from rigid import PinDrive

LETTER = 0.62  # width of a letter against its height, on average


@dataclass(frozen=True)
class Words:
    """A line of text at a place in pixels from the lower left; `side` -1 starts there, +1 ends there, 0 is centred."""

    text: str
    at: complex
    height: float
    side: int = -1
    ink: str = INK


def headings(diagram: Diagram, scales: Layout, style: Style) -> list[Words]:
    """Title and name of the diagram, top left."""
    width, height = style.size
    left = MARGIN * height
    kind = f"{diagram.title} {diagram.symbol}".strip()
    kind += f" {TIMES} {scales.exaggeration:g}, displacement" if diagram.field is None else ","
    kind += f" at most {quantity(scales.peak, diagram.unit)} over the positions"
    lines = []
    for text, y, size, ink in ((style.title, 0.42, 0.036, INK), (kind, 0.80, 0.028, SOFT)):
        fitting = (0.66 if y < 0.5 else 0.9) * width / (LETTER * max(len(text), 1))
        lines.append(Words(text, left + 1j * (1 - y * HEAD) * height, min(size * height, fitting), ink=ink))
    return [line for line in lines if line.text]


def drive_words(deflection: Deflection) -> Callable[[int], str]:
    """Text that tells where the drives stand and the time of a position."""
    motion = deflection.motion
    counted = np.array_equal(motion.time, np.arange(len(motion.time)))
    time = steady(np.abs(motion.time).max(), "s")
    slides = [steady(np.abs(values).max(), "m") for values in motion.drive]

    def text(position: int) -> str:
        parts = []
        for drive, value, slide in zip(motion.mechanism.drives, motion.drive[:, position], slides, strict=True):
            if isinstance(drive, PinDrive):
                parts.append(f"{drive.link} {np.degrees(value):.1f}°")
            else:
                parts.append(f"{drive.slider} {slide(value)}")
        if not counted:
            parts.append(f"t = {time(motion.time[position])}")
        return "   ".join(parts)

    return text


def legend(diagram: Diagram, scales: Layout, style: Style) -> tuple[list[Shape], list[Words]]:
    """Measures along the bottom, in pixels: the ordinates' scale, the colours' signs, a length."""
    width, height = style.size
    letter = 0.026 * height
    middle = 0.5 * FOOT * height
    shapes, words = _length(scales, width - MARGIN * height, middle, letter)
    left = MARGIN * height
    if scales.exaggeration:
        text = f"deformed {TIMES} {scales.exaggeration:g}"
        shapes.append(_stroke(np.array([left, left + 2.2 * letter]) + 1j * middle, 3.0, BENT))
        words.append(Words(text, left + 2.8 * letter + 1j * middle, letter))
        left += (5.0 + LETTER * len(text)) * letter
    if diagram.field is None:
        shapes.append(_stroke(np.array([left, left + 2.2 * letter]) + 1j * middle, 3.0, QUIET))
        words.append(Words("rigid", left + 2.8 * letter + 1j * middle, letter))
        return shapes, words
    if scales.scale and scales.peak:
        value = round_below(0.7 * FOOT * height / (scales.scale * scales.pixels))
        tall = value * scales.scale * scales.pixels
        tick = 0.35 * letter
        ends = left + tick + 1j * (middle + np.array([-tall, tall]) / 2)
        shapes.append(_bar(ends, tick))
        text = quantity(value, diagram.unit)
        words.append(Words(text, left + 3.2 * tick + 1j * middle, letter))
        left += 3.2 * tick + (2.0 + LETTER * len(text)) * letter
    for fill, sign in ((POSITIVE, ">"), (NEGATIVE, "<"))[: 2 if diagram.signed else 1]:
        square = left + 1j * middle + 0.6 * letter * np.array([-1j, 2 - 1j, 2 + 1j, 1j])
        shapes.append(_still("fill", square, faces=True, fill=fill))
        text = f"{diagram.symbol} {sign} 0"
        words.append(Words(text, left + 1.7 * letter + 1j * middle, letter))
        left += (3.2 + LETTER * len(text)) * letter
    return shapes, words


def _length(scales: Layout, right: float, middle: float, letter: float) -> tuple[list[Shape], list[Words]]:
    """A length of the mechanism, at the right, its measure over it."""
    value = round_below(9.0 * letter / scales.pixels)
    ends = np.array([right - value * scales.pixels, right]) + 1j * (middle - 0.5 * letter)
    words = Words(quantity(value, "m"), ends.mean() + 1.15j * letter, letter, 0)
    return [_bar(ends, 0.35 * letter)], [words]


def _bar(ends: Complexes, tick: float) -> Shape:
    """A measured line with a tick at either end."""
    across = 1j * (ends[1] - ends[0]) / abs(ends[1] - ends[0]) * tick
    points = np.concatenate([ends, ends + across, ends - across])
    lines = (np.array([0, 1]), np.array([2, 4]), np.array([3, 5]))
    return Shape("link", lambda position: points, lines=lines, width=1.5)


def _stroke(ends: Complexes, width: float, ink: str = INK) -> Shape:
    return Shape("link", lambda position: ends, lines=(np.array([0, 1]),), ink=ink, width=width)


def _still(level: str, points: Complexes, faces: bool, fill: str) -> Shape:
    ring = np.arange(len(points))
    return Shape(level, lambda position: points, (ring,) if faces else (), (np.append(ring, 0),), fill=fill, width=1.0)
