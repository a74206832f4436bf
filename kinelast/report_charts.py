"""Curves and maps of the report, as SVG text and PNG bytes.

Written here and not by a plotting library because that would be half of the command's run time: docs/report.md.
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from kinelast.report_numbers import number, quantity, scale_of, ticks
from rigid import Reals

WIDTH, HEIGHT = 640, 236
LEFT, RIGHT, TOP, BOTTOM = 58, 10, 12, 40
COLOURS = ("#0b5fa5", "#c8501e", "#2a8a5c", "#8a4f9e", "#b58900", "#4a6572", "#c2417c", "#5a9bd4")
PIXELS = 560  # that a curve is wide
DASHES = ("", "7 3", "2 3", "9 3 2 3")


def strokes(index: int) -> tuple[str, str]:
    """Colour and dash pattern of the curve with this number."""
    return COLOURS[index % len(COLOURS)], DASHES[index // len(COLOURS) % len(DASHES)]


def line_chart(x: Reals, curves: Mapping[str, Reals], unit: str, x_label: str, x_ticks: list[float]) -> str:
    """Curves over the cycle as an SVG element.

    Parameters
    ----------
    x
        Abscissae, shape (positions,).
    curves
        Ordinates by name, in `unit`, shape (positions,); nan where there is none.
    x_label, x_ticks
        Title of the axis, and where it has marks.

    Returns
    -------
    One `<svg>`; its ordinates carry an SI prefix that suits the greatest of them.
    """
    plot = _plot(x, np.array(list(curves.values())))
    factor, prefixed = scale_of(max(abs(plot.low), abs(plot.high)), unit)
    parts = [f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">', *_grid(plot, factor, x_ticks)]
    middle, height = (LEFT + WIDTH - RIGHT) / 2, (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text class="label" x="{middle}" y="{HEIGHT - 6}" text-anchor="middle">{escape(x_label)}</text>')
    label = f"[{prefixed.replace(' ', '·')}]"
    parts.append(
        f'<text class="label" transform="translate(11 {height}) rotate(-90)" text-anchor="middle">{label}</text>'
    )
    for index, (name, values) in enumerate(curves.items()):
        parts += _curve(plot, index, f"{name}: ", plot.x(x), np.asarray(values, float), unit)
    return "".join([*parts, "</svg>"])


@dataclass(frozen=True)
class _Plot:
    """Where abscissae from `start` on and ordinates between `low` and `high` are drawn."""

    start: float
    span: float
    low: float
    high: float

    def x(self, value: Any) -> Any:
        return LEFT + (WIDTH - LEFT - RIGHT) * (value - self.start) / self.span

    def y(self, value: Any) -> Any:
        return TOP + (HEIGHT - TOP - BOTTOM) * (self.high - value) / (self.high - self.low)


def _plot(x: Reals, heights: Reals) -> _Plot:
    """Room for all heights and the zero line."""
    finite = heights[np.isfinite(heights)]
    low, high = float(finite.min(initial=0.0)), float(finite.max(initial=0.0))
    margin = 0.04 * (high - low)
    low, high = (low - margin * (low < 0), high + margin * (high > 0)) if high > low else (0.0, 1.0)
    return _Plot(float(x[0]), float(x[-1] - x[0]) or 1.0, low, high)


def _grid(plot: _Plot, factor: float, x_ticks: list[float]) -> list[str]:
    """Lines and numbers of both axes; ordinates are multiplied by `factor`."""
    parts = []
    for tick in ticks(plot.low * factor, plot.high * factor, 4):
        at = plot.y(tick / factor)
        kind = "grid" if tick else "zero"
        parts.append(f'<line class="{kind}" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/>')
        parts.append(f'<text class="tick" x="{LEFT - 6}" y="{at + 3.5:.1f}" text-anchor="end">{number(tick)}</text>')
    foot = HEIGHT - BOTTOM
    for tick in x_ticks:
        at = plot.x(tick)
        parts.append(f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{TOP}" y2="{foot}"/>')
        parts.append(f'<text class="tick" x="{at:.1f}" y="{foot + 15}" text-anchor="middle">{number(tick)}</text>')
    return parts


def _curve(plot: _Plot, index: int, name: str, across: Reals, values: Reals, unit: str) -> list[str]:
    """One curve in as many pieces as gaps leave, with a dot on its greatest magnitude."""
    colour, dash = strokes(index)
    good = np.isfinite(values)
    if not good.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(int), [0]])))
    heights = plot.y(np.where(good, values, 0.0))
    parts = []
    for start, stop in edges.reshape(-1, 2):
        at = start + _telling(heights[start:stop])
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across[at].tolist(), heights[at].tolist(), strict=True))
        parts.append(f'<polyline fill="none" stroke="{colour}" stroke-dasharray="{dash}" points="{points}"/>')
    peak = int(np.argmax(np.where(good, np.abs(values), -1.0)))
    title = f"{name}{quantity(float(values[peak]), unit)}"
    dot = f'<circle cx="{across[peak]:.1f}" cy="{heights[peak]:.1f}" r="3" fill="{colour}">'
    return [*parts, f"{dot}<title>{escape(title)}</title></circle>"]


def _telling(heights: Reals) -> Any:
    """Numbers of the points that a curve needs to look the same: of many, the lowest and highest of every pixel."""
    if len(heights) <= 4 * PIXELS:
        return np.arange(len(heights))
    length = len(heights) // PIXELS
    rows = heights[: PIXELS * length].reshape(PIXELS, length)
    starts = np.arange(PIXELS) * length
    kept = [starts, starts + rows.argmin(axis=1), starts + rows.argmax(axis=1)]
    return np.unique(np.concatenate([*kept, np.arange(PIXELS * length, len(heights)), [len(heights) - 1]]))


def map_image(values: Reals) -> str:
    """A field along a link (up) over the cycle (across) as the address of an inline PNG.

    Parameters
    ----------
    values
        Shape (positions, stations); the colours span plus and minus their greatest magnitude, nan is grey.
    """
    every = max(1, len(values) // 180)
    shown = values[::every].T[::-1]
    good = np.isfinite(shown)
    largest = float(np.abs(shown[good]).max()) if good.any() else 0.0
    shares = np.where(good, shown, 0.0) / (largest or 1.0)
    pixels = np.where(good, 1 + np.rint((shares + 1.0) * 127), 0).astype(np.uint8)
    return "data:image/png;base64," + base64.b64encode(_png(pixels, palette())).decode()


def palette() -> Reals:
    """256 colours, shape (256, 3): grey for nan, then blue through white to red."""
    share = np.linspace(-1.0, 1.0, 255)[:, None]
    white, ends = np.array([250.0, 250.0, 250.0]), np.array([[178.0, 45.0, 38.0], [24.0, 80.0, 150.0]])
    strength = np.abs(share) ** 0.8
    tints = white + strength * (np.where(share > 0, ends[0], ends[1]) - white)
    return np.concatenate([[[190.0, 190.0, 190.0]], tints])


def _png(pixels: Any, colours: Reals) -> bytes:
    """A palette image; the format is ISO/IEC 15948."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels], axis=1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    shades = np.rint(colours).astype(np.uint8).tobytes()
    parts = (
        chunk(b"IHDR", header),
        chunk(b"PLTE", shades),
        chunk(b"IDAT", zlib.compress(rows, 6)),
        chunk(b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)
