"""Title, scales, colour legend and drive coordinates around the drawing."""

from collections.abc import Callable

import numpy as np
from msgspec import Struct

from animations.diagrams import MOTION, SHAPE, Diagram, quantity, round_below, steady, times
from animations.layout import FOOT, HEAD, MARGIN, Scales, View
from animations.shapes import BENT, FILL_OPACITY, INK, NEGATIVE, POSITIVE, QUIET, Complexes, FlatShape
from animations.style import Style
from elastic import Deflection

LETTER_WIDTH = 0.62  # average width of a letter, relative to its height
MIN_LETTER_HEIGHT = 7.0  # [pixels] smallest readable letter height


class Words(Struct, frozen=True):
    """Line of text at a position in pixels from the lower left corner.

    `side` is its alignment: -1 if the text starts at the position, 0 if it is centred, +1 if it ends there.
    """

    text: str
    at: complex
    height: float
    side: int = -1
    ink: str = INK


def headings(diagram: Diagram, scales: Scales, style: Style, longest: int) -> list[Words]:
    """Return the title and the diagram name (top left), and an empty line for the drive coordinates (top right)."""
    (width, height), unit = style.size, style.unit
    left = MARGIN * unit
    kind = f"{diagram.title} {diagram.symbol}".strip()
    if diagram is not MOTION:
        kind += f" {times(scales.exaggeration)}, displacement" if diagram is SHAPE else ","
        kind += f" at most {quantity(scales.peak, diagram.unit)} over the positions"
    kind += f"; {style.pace}" if style.pace else ""
    drives = min(0.03 * unit, 0.4 * width / (LETTER_WIDTH * max(longest, 1)))
    room = width - 4 * left - LETTER_WIDTH * drives * longest
    lines = [Words(" ", width - left + 1j * (height - 0.42 * HEAD * unit), drives, 1)]
    rows = (style.title, 0.42, 0.036, INK, room), (kind, 0.82, 0.028, "soft", width - 2 * left)
    for text, y, size, ink, space in rows:
        fitting = space / (LETTER_WIDTH * max(len(text), 1))
        lines.append(Words(text, left + 1j * (height - y * HEAD * unit), min(size * unit, fitting), ink=ink))
    return lines


def drive_words(deflection: Deflection) -> Callable[[int], str]:
    """Return a formatter for the drive coordinates and the time at a position."""
    motion = deflection.motion
    counted = np.array_equal(motion.time, np.arange(len(motion.time)))
    time = steady(np.abs(motion.time).max(), "s")
    slides = [steady(np.abs(values).max(), "m") for values in motion.drive]

    def text(position: int) -> str:
        parts = []
        for drive, value, slide in zip(motion.mechanism.drives, motion.drive[:, position], slides, strict=True):
            parts.append(f"{drive.name} {f'{_within_turn(value):.1f}°' if drive.turns else slide(value)}")
        if not counted:
            parts.append(f"t = {time(motion.time[position])}")
        return "   ".join(parts)

    return text


def _within_turn(angle: float) -> float:
    """Convert an angle to degrees between 0 and 360; return 0 if it would be printed as 360.0."""
    within = float(np.degrees(angle)) % 360.0
    return 0.0 if within >= 359.95 else within


class Legend(Struct, frozen=True):
    """Scale bars, lines of text, and the corners of the colour bar (None if there is no colour bar) [pixels]."""

    shapes: list[FlatShape]
    words: list[Words]
    bar: tuple[complex, complex] | None = None


def legend(diagram: Diagram, scales: Scales, view: View, style: Style) -> Legend:
    """Return the legend along the bottom: ordinate scale, meaning of the colours, and length scale."""
    unit = style.unit
    letter, middle = max(0.026 * unit, MIN_LETTER_HEIGHT), 0.5j * FOOT * unit
    shapes, words = _length(view, style.size[0] - MARGIN * unit, middle.imag, letter)
    left = MARGIN * unit

    def add(text: str, size: float, *drawn: FlatShape) -> None:
        nonlocal left
        shapes.extend(drawn)
        words.append(Words(text, left + size + 0.6 * letter + middle, letter))
        left += size + (2.0 + LETTER_WIDTH * len(text)) * letter

    ends = left + middle + np.array([0.0, 2.2 * letter])
    if style.look == "solid":
        bar = None
        if scales.peak:
            low = quantity(-scales.peak if diagram.signed and diagram.field else 0.0, diagram.unit)
            add(f"{diagram.symbol or 'displacement'}   {low}", -0.6 * letter)
            left -= 1.4 * letter
            bar = left + middle - 0.5j * letter, left + middle + (9.0 + 0.5j) * letter
            add(quantity(scales.peak, diagram.unit), 9.0 * letter)
        if scales.exaggeration:
            add(f"deformed {times(scales.exaggeration)}", -0.6 * letter)
        return Legend(shapes, words, bar)
    if scales.exaggeration:
        add(f"deformed {times(scales.exaggeration)}", 2.2 * letter, _stroke(ends, BENT))
    if diagram is SHAPE:
        add("rigid", 2.2 * letter, _stroke(left + middle + np.array([0.0, 2.2 * letter]), QUIET))
    if diagram.field is None or not scales.peak:
        return Legend(shapes, words)
    value = round_below(0.8 * FOOT * unit / (scales.scale * view.pixels))
    tall = value * scales.scale * view.pixels
    tick = 0.35 * letter
    add(quantity(value, diagram.unit), 2 * tick, _bar(left + tick + middle + np.array([-0.5j, 0.5j]) * tall, tick))
    signs: list[tuple[tuple[str, ...], str]] = [((POSITIVE,), f"{diagram.symbol} > 0")]
    if diagram.signed:
        signs += [((NEGATIVE,), f"{diagram.symbol} < 0"), ((POSITIVE, NEGATIVE), "both overlap")]
    for fills, text in signs:
        square = left + middle + 0.6 * letter * np.array([-1j, 2 - 1j, 2 + 1j, 1j])
        add(text, 1.2 * letter, *(_patch(square, fill) for fill in fills))
    return Legend(shapes, words)


def _length(view: View, right: float, middle: float, letter: float) -> tuple[list[FlatShape], list[Words]]:
    """Return the bar and the label of the length scale; `right` and `middle` are x and y [pixels]."""
    start, end = view.flat(np.array([0j, 1.0]))
    metre = float(abs(end - start))  # pixels per metre along x, which a rotated view foreshortens
    value = round_below(9.0 * letter / metre)
    ends = np.array([right - value * metre, right]) + 1j * (middle - 0.5 * letter)
    words = Words(quantity(value, "m"), ends.mean() + 1.15j * letter, letter, 0)
    return [_bar(ends, 0.35 * letter)], [words]


def _bar(ends: Complexes, tick: float) -> FlatShape:
    """Return a scale bar with a tick at each end."""
    across = 1j * (ends[1] - ends[0]) / abs(ends[1] - ends[0]) * tick
    points = np.concatenate([ends, ends + across, ends - across])
    lines = (np.array([0, 1]), np.array([2, 4]), np.array([3, 5]))
    return FlatShape("link", lambda position: points, lines=lines, width=1.5)


def _stroke(ends: Complexes, ink: str) -> FlatShape:
    return FlatShape("link", lambda position: ends, lines=(np.array([0, 1]),), ink=ink, width=3.0)


def _patch(corners: Complexes, fill: str) -> FlatShape:
    """Return a colour sample with the opacity of the diagrams."""
    ring = np.arange(4)
    return FlatShape(
        "fill", lambda position: corners, (ring,), (np.append(ring, 0),), fill=fill, width=1.0, opacity=FILL_OPACITY
    )
