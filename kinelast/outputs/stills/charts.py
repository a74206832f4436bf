"""Curves and maps over the cycle, drawn by matplotlib as SVG that stands in the page."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.outputs.sheet import LINKS as COLOURS
from kinelast.scene.numbers import number, scale_of, ticks
from rigid import Reals

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, SOFT, RULE, GREY = "#1d2733", "#5d6b7a", "#e6eaee", 190
DASHES = ((), (7.0, 3.0), (2.0, 2.5), (9.0, 3.0, 2.0, 3.0))
WIDTH, HEIGHT = 6.1, 2.1  # inches
ACROSS, BESIDE = 180, 14  # pixels, of a map and between two
ROW, GAP, COLUMN, SPACE, EDGE, LETTER = 0.62, 0.24, 1.95, 0.105, 0.7, 0.085  # inches, of maps
STYLE: dict[Any, Any] = {"svg.fonttype": "none", "font.size": 8.0, "text.color": SOFT, "image.composite_image": False}
LEANER = (
    (r"(?s)<defs>\s*<style.*?</style>\s*</defs>", ""),  # which is for all of the page
    (r'(<g|<image [^>]*?) id="[^"]*"', r"\1"),  # which may be there again in another picture
    (r"(?<=base64,)\s+", ""),
    (r"(?<=font-family: )[^;]*(?=;)", "sans-serif"),
    (r"\s*\n\s*", " "),
)


@dataclass(frozen=True, eq=False)
class Axis:
    """Abscissa of the charts over the cycle: values of shape (positions,), their label, and the axis' marks."""

    values: Reals
    label: str
    marks: list[float]


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve over the cycle: shape (positions,), nan where there is none; places in `COLOURS` and `DASHES`."""

    name: str
    values: Reals
    colour: int
    dash: int = 0


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves of one unit."""

    heading: str
    unit: str
    curves: Sequence[Curve]


def svg_of(figure: Figure, name: str) -> str:
    """A figure as an `<svg>` that may stand in a page beside others of other names."""
    from matplotlib import rc_context

    text = StringIO()
    with rc_context({**STYLE, "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    for wanted, instead in LEANER:
        svg = re.sub(wanted, instead, svg)
    return svg


def line_charts(axis: Axis, charts: Sequence[Chart]) -> list[str]:
    """Every chart as SVG; its ordinates carry an SI prefix that suits the greatest of them."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    drawn = []
    with rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, HEIGHT), facecolor="none")
        axes = figure.add_axes((0.105, 0.2, 0.885, 0.76), frameon=False)
        axes.set_xlim(axis.values[0], axis.values[-1] if axis.values[-1] != axis.values[0] else axis.values[0] + 1.0)
        axes.set_xticks(axis.marks, [number(mark) for mark in axis.marks])
        axes.tick_params(length=0, labelcolor=SOFT)
        axes.grid(color=RULE, linewidth=0.8)
        zero = axes.axhline(0.0, color="#aab4be", linewidth=0.9)
        figure.text(0.5475, 0.02, axis.label, ha="center", color=INK)
        unit = figure.text(0.012, 0.58, "", rotation=90, ha="left", va="center", color=INK)
        for chart in charts:
            for line in set(axes.lines) - {zero}:
                line.remove()
            unit.set_text(_draw_curves(axes, axis, chart))
            drawn.append(svg_of(figure, chart.heading))
    return drawn


def _draw_curves(axes: Any, axis: Axis, chart: Chart) -> str:
    """Draw the curves of a chart, a dot on the greatest of each; returns the unit of the ordinates."""
    heights = np.array([np.broadcast_to(curve.values, axis.values.shape) for curve in chart.curves], float)
    finite = heights[np.isfinite(heights)]
    low, high = float(finite.min(initial=0.0)), float(finite.max(initial=0.0))
    factor, prefixed = scale_of(max(abs(low), abs(high)), chart.unit)
    margin = 0.05 * (high - low) * factor
    low, high = (low * factor - margin, high * factor + margin) if high > low else (0.0, 1.0)
    axes.set_ylim(low, high)
    marks = ticks(low, high, 4)
    axes.set_yticks(marks, [number(mark) for mark in marks])
    for curve, values in zip(chart.curves, heights * factor, strict=True):
        style = {"color": COLOURS[curve.colour % len(COLOURS)], "scalex": False, "scaley": False}
        dashes = DASHES[curve.dash % len(DASHES)]
        axes.plot(axis.values, values, linewidth=1.3, linestyle=(0, dashes) if dashes else "-", **style)
        if np.isfinite(values).any():
            at = int(np.nanargmax(np.abs(values)))
            axes.plot(axis.values[at], values[at], "o", markersize=4, clip_on=False, **style)
    return f"[{prefixed.replace(' ', '·')}]"


def field_maps(
    axis: Axis, labels: Sequence[str], fields: Mapping[str, tuple[Any, Sequence[str]]], columns: int = 0
) -> str:
    """Fields along beams (up) over the cycle (across) as one SVG, a column for each field.

    Parameters
    ----------
    labels
        Of the beams, one to a row.
    fields
        By what stands above the column: values of shape (beams, positions, stations), and the range of each beam in
        words. The colours of every map span plus and minus its own greatest magnitude; nan is grey.
    columns
        For how many fields there is room at least, so that several of these are of one width.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    rows, pitch = len(labels), ROW + GAP
    edge = max(EDGE, LETTER * max(map(len, labels)))
    inner = (COLUMN + SPACE) * len(fields)
    width, height = edge + (COLUMN + SPACE) * max(columns, len(fields)), 0.36 + rows * pitch + 0.3
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height), facecolor="none")
        axes = figure.add_axes((edge / width, 0.36 / height, inner / width, rows * pitch / height), frameon=False)
        for row, label in enumerate(labels):
            axes.text(-edge, (rows - row) * pitch - ROW / 2, label, va="center", color=INK, fontweight="bold")
        marks: dict[float, str] = {}
        for column, (heading, (_, ranges)) in enumerate(fields.items()):
            left = (COLUMN + SPACE) * column
            axes.text(left, rows * pitch + 0.1, heading, color=INK)
            marks |= {left + place: words for place, words in _marks(axis)}
            for row, words in enumerate(ranges):
                axes.text(left, (rows - row) * pitch - ROW - GAP / 2, words, va="center")
        picture = mosaic([values for values, _ in fields.values()])
        axes.imshow(picture, extent=(0.0, inner, 0.0, rows * pitch), aspect="auto", interpolation="none")
        axes.set(xlim=(0.0, inner), ylim=(0.0, rows * pitch), yticks=[])
        axes.set_xticks([*marks], [*marks.values()])
        axes.tick_params(length=0, pad=2, labelcolor=SOFT)
        figure.text((edge + inner / 2) / width, 0.0, axis.label, ha="center", va="bottom", color=INK)
        return svg_of(figure, "maps")


def _marks(axis: Axis) -> list[tuple[float, str]]:
    """A few marks of the axis: where they are along the width of a map, and their numbers."""
    first, way = axis.values[0], axis.values[-1] - axis.values[0]
    few = axis.marks[:: math.ceil(len(axis.marks) / 3) or 1]
    return [(float(COLUMN * (mark - first) / way) if way else COLUMN / 2, number(mark)) for mark in few]


def mosaic(fields: Sequence[Any]) -> Any:
    """One picture of fields of shape (beams, positions, stations), beside one another, a row for each beam.

    Returns
    -------
    Shape (rows, columns, 4), bytes: positive blue, negative red as in the diagrams, nan grey, clear between the maps.
    """
    from matplotlib import colormaps

    beams, count, stations = fields[0].shape
    below = round(stations * GAP / ROW)
    some = np.linspace(0, count - 1, ACROSS).round().astype(int)
    picture = np.zeros((beams, stations + below, len(fields), ACROSS + BESIDE, 4), np.uint8)
    for column, values in enumerate(fields):
        shown = values[:, some, ::-1].swapaxes(1, 2)
        good = np.isfinite(shown)
        plain = np.where(good, shown, 0.0)
        largest = np.abs(plain).max(axis=(1, 2), keepdims=True)
        shares = plain / np.where(largest > 0, largest, 1.0)
        colours = colormaps["RdBu"](0.5 + 0.47 * shares, bytes=True)
        colours[~good] = (GREY, GREY, GREY, 255)
        picture[:, :stations, column, :ACROSS] = colours
    return picture.reshape(beams * (stations + below), -1, 4)
