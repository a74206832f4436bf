"""SVG charts and maps of results over the cycle of a mechanism, drawn with matplotlib."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import FIELDS, Field, FieldKind, sample
from kinelast.answers.results import Results
from kinelast.outputs.sheet import LINKS as COLOURS
from kinelast.values.figure import drive_words
from kinelast.values.numbers import number, quantity, scale_of, ticks, unit_words
from rigid import Reals
from rigid.arrays import Integers

if TYPE_CHECKING:
    from matplotlib.figure import Figure


INK, SOFT, RULE, GREY = "#1d2733", "#5d6b7a", "#e6eaee", 190
DASHES = ((), (6.0, 3.0), (1.5, 2.5), (11.0, 3.0, 2.0, 3.0), (16.0, 4.0), (9.0, 2.0, 2.0, 2.0, 2.0, 2.0))
WIDTH, HEIGHT = 6.1, 2.1  # [in] size of a chart
ACROSS, BETWEEN = 180, 14  # [pixels] width of a map, and gap between two maps in a row
ROW, GAP, COLUMN, SPACE, EDGE, LETTER = 0.62, 0.24, 1.95, 0.105, 0.7, 0.085  # [in] dimensions of the maps in a picture
STYLE: dict[Any, Any] = {"svg.fonttype": "none", "font.size": 8.0, "text.color": SOFT, "image.composite_image": False}
LEANER = (  # pattern that is replaced in an SVG, and its replacement
    (r"(?s)<defs>\s*<style.*?</style>\s*</defs>", ""),  # remove <style>: it would affect the whole page
    (r'(<g|<image [^>]*?) id="[^"]*"', r"\1"),  # remove id: two pictures may use the same id
    (r"(?<=base64,)\s+", ""),
    (r"(?<=font-family: )[^;]*(?=;)", "sans-serif"),
    (r"\s*\n\s*", " "),
)


class Axis(Struct, frozen=True, eq=False):
    """Horizontal axis of the charts over the cycle: values of shape (positions,), label, and ticks."""

    values: Reals
    label: str
    marks: list[float]


class Curve(Struct, frozen=True, eq=False):
    """A curve over the cycle: values of shape (positions,), index into `COLOURS`, and index into `DASHES`."""

    name: str
    values: Reals
    colour: int
    dash: int = 0


class Chart(Struct, frozen=True, eq=False):
    """A chart with one or more curves. All curves of a chart have the same unit."""

    heading: str
    unit: str
    curves: Sequence[Curve]


@contextmanager
def new_axes(width: float, height: float, place: tuple[float, float, float, float]) -> Iterator[Any]:
    """Yield axes in a new picture, in the style of the report.

    `width` and `height` are the size of the picture [in]. `place` is the left and lower edge, the width and the height
    of the axes, relative to the size of the picture.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        yield Figure(figsize=(width, height), facecolor="none").add_axes(place, frameon=False)


def svg_of(figure: Figure, name: str) -> str:
    """Return a matplotlib figure as an `<svg>` element.

    The identifiers in the SVG are derived from `name`. Two pictures on one page need different names, because
    identifiers on a page must be unique.
    """
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
    """Return each chart as SVG. The largest magnitude in a chart determines the SI prefix of the unit."""
    drawn = []
    with new_axes(WIDTH, HEIGHT, (0.105, 0.2, 0.885, 0.76)) as axes:
        axes.set_xlim(axis.values[0], axis.values[-1] if axis.values[-1] != axis.values[0] else axis.values[0] + 1.0)
        axes.set_xticks(axis.marks, [number(mark) for mark in axis.marks])
        axes.tick_params(length=0, labelcolor=SOFT)
        axes.grid(color=RULE, linewidth=0.8)
        zero = axes.axhline(0.0, color="#aab4be", linewidth=0.9)
        axes.figure.text(0.5475, 0.02, axis.label, ha="center", color=INK)
        unit = axes.figure.text(0.012, 0.58, "", rotation=90, ha="left", va="center", color=INK)
        for chart in charts:
            for line in set(axes.lines) - {zero}:
                line.remove()
            unit.set_text(_draw_curves(axes, axis, chart))
            drawn.append(svg_of(axes.figure, chart.heading))
    return drawn


def _draw_curves(axes: Any, axis: Axis, chart: Chart) -> str:
    """Draw the curves of a chart, and a dot at the largest magnitude of each curve. Return the label of the y axis."""
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
    return f"[{unit_words(prefixed)}]"


def field_maps(
    axis: Axis, labels: Sequence[str], fields: Mapping[str, tuple[Any, Sequence[str]]], columns: int = 0
) -> str:
    """Return one SVG with a map of each field (quantity along beams) on each beam.

    The picture has a row of maps for each beam and a column of maps for each field. The vertical axis of a map is the
    location along the beam. The horizontal axis is the position in the cycle.

    Parameters
    ----------
    labels
        Labels of the beams, one for each row.
    fields
        Values of each field, shape (beams, positions, stations), and for each beam a text with the range of the values.
        The keys are the headings of the columns. The colour scale of a map extends from minus to plus the largest
        magnitude in the map. Unknown values (nan) are grey.
    columns
        The picture is at least wide enough for this number of columns. Pictures with equal `columns` get equal widths.
    """
    rows, pitch = len(labels), ROW + GAP
    edge = max(EDGE, LETTER * max(map(len, labels)))
    inner = (COLUMN + SPACE) * len(fields)
    width, height = edge + (COLUMN + SPACE) * max(columns, len(fields)), 0.36 + rows * pitch + 0.3
    place = edge / width, 0.36 / height, inner / width, rows * pitch / height
    with new_axes(width, height, place) as axes:
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
        axes.figure.text((edge + inner / 2) / width, 0.0, axis.label, ha="center", va="bottom", color=INK)
        return svg_of(axes.figure, "maps")


def _marks(axis: Axis) -> list[tuple[float, str]]:
    """Return a few ticks of the horizontal axis of a map.

    A tick consists of the distance from the left edge of the map [in], and a label.
    """
    first, way = axis.values[0], axis.values[-1] - axis.values[0]
    few = axis.marks[:: math.ceil(len(axis.marks) / 3) or 1]
    return [(float(COLUMN * (mark - first) / way) if way else COLUMN / 2, number(mark)) for mark in few]


def mosaic(fields: Sequence[Any]) -> Any:
    """Return the pixels of a picture with a row of maps for each beam and a column of maps for each field.

    Each array in `fields` has the shape (beams, positions, stations).

    Returns
    -------
    RGBA bytes, shape (rows of pixels, columns of pixels, 4). Positive values are blue, negative values are red, and nan
    is grey. The gaps between the maps are transparent.
    """
    from matplotlib import colormaps

    beams, count, stations = fields[0].shape
    below = round(stations * GAP / ROW)
    some = np.linspace(0, count - 1, ACROSS).round().astype(int)
    picture = np.zeros((beams, stations + below, len(fields), ACROSS + BETWEEN, 4), np.uint8)
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


# kinds of fields in each picture with maps
MAPPED = ((FieldKind.LOAD, FieldKind.FORCE), (FieldKind.DISPLACEMENT,), (FieldKind.STRESS,))
MOST_MAPPED, MOST_CURVES = 16, 6  # maximum number of beams in a picture with maps, and of curves in a chart
ANGLE_STEPS = (1, 2, 5, 10, 15, 30, 60, 90, 180, 360)  # [deg] distances between ticks


def axis(results: Results) -> Axis:
    """Return the horizontal axis: the angle of the first drive if the drive turns in one sense, otherwise the time."""
    motion = results.motion
    drive, values = results.mechanism.drives[0], motion.drive[0]
    steps = np.diff(values)
    if drive.turns and len(steps) and (np.all(steps > 0) or np.all(steps < 0)):
        angles = _spread(results, np.degrees(values))
        low, high = sorted((float(angles[0]), float(angles[-1])))
        step = next((step for step in ANGLE_STEPS if high - low <= 8 * step), 360 * math.ceil((high - low) / 2880))
        marks = [float(step * k) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
        return Axis(angles, f"angle of {drive.name} [deg]", marks)
    factor, unit = scale_of(float(np.abs(motion.time).max()), "s")
    times = _spread(results, motion.time * factor)
    return Axis(times, f"time [{unit}]", ticks(float(times[0]), float(times[-1]), 6))


def _numbers(results: Results) -> Integers:
    """Return the index of each computed position among all positions of the run, shape (computed positions,).

    All positions of the run include the unreachable positions that were omitted from the computation.
    """
    time = results.motion.time
    if not results.left_out or len(time) < 2:
        return np.arange(len(time))
    return np.asarray(np.round((time - time[0]) / np.diff(time).min()), int)


def _spread(results: Results, values: Any) -> Reals:
    """Return the values of an axis at all positions of the run, interpolated between the computed positions."""
    numbers = _numbers(results)
    return np.asarray(np.interp(np.arange(numbers[-1] + 1), numbers, values))


def _with_gaps(results: Results, values: Any) -> Reals:
    """Return values at all positions of the run, shape (..., positions).

    The value is nan at unreachable and at ill-conditioned positions.
    """
    values = np.broadcast_to(values, (*np.shape(values)[:-1], *results.motion.columns))
    numbers = _numbers(results)
    spread = np.full((*values.shape[:-1], numbers[-1] + 1), np.nan)
    spread[..., numbers] = np.where(results.cycle.counted | results.cycle.lost, values, np.nan)
    return spread


def cycle_charts(results: Results) -> list[Chart]:
    """Return the charts over the cycle: deflection, stress, moments, drives, joint forces and displacements."""
    forces, names = results.deflection.forces, results.scene.beam_names
    charts = []
    for field in ("w", "mises", "M"):
        sizes = np.abs(results.cycle.extremes[field].value)
        if np.isfinite(sizes).any():
            entries = zip(_places(results), names, sizes, strict=True)
            curves = [Curve(name, size, *place) for place, name, size in entries]
            charts.append(Chart(f"Largest {FIELDS[field].name} along each link", FIELDS[field].unit, curves))
    efforts: dict[str, list[Curve]] = {}
    for (name, *_, unit), effort in zip(drive_words(results.mechanism), results.cycle.efforts, strict=True):
        efforts.setdefault(unit, []).append(Curve(name, effort, len(efforts.get(unit, []))))
    charts += [Chart("Drive moment" if unit == "N m" else "Drive force", unit, own) for unit, own in efforts.items()]
    joints = zip(results.joint_words, forces.in_joints, strict=True)
    in_joints = {f"{at} on {on}": np.abs(force) for (at, on), (force, _) in joints}
    charts.append(Chart("Joint forces", "N", _curves(in_joints)))
    shaking = forces.ground_force
    sides = {"size": np.abs(shaking), "x": np.real(shaking), "y": np.imag(shaking)}
    charts.append(Chart("Shaking force on the ground", "N", _curves(sides)))
    charts.append(Chart("Shaking moment on the ground", "N m", _curves({"about the origin": forces.ground_moment})))
    strays = {f"{point}": np.abs(moved) for point, moved in results.displacements.items() if np.any(moved)}
    if strays:
        charts.append(Chart("Displacement of the points", "m", _curves(strays)))
    return [_largest(_broken(results, chart)) for chart in charts]


def _broken(results: Results, chart: Chart) -> Chart:
    curves = [
        replace(curve, values=_with_gaps(results, results.figures.rounded(curve.values, chart.unit)))
        for curve in chart.curves
    ]
    return Chart(chart.heading, chart.unit, curves)


def _largest(chart: Chart) -> Chart:
    """Return a copy of a chart that contains only the `MOST_CURVES` curves with the largest magnitudes."""
    if len(chart.curves) <= MOST_CURVES:
        return chart
    sizes = [float(np.nanmax(np.abs(curve.values), initial=0.0)) for curve in chart.curves]
    kept = sorted(sorted(range(len(sizes)), key=lambda k: -sizes[k])[:MOST_CURVES])
    curves = [chart.curves[k] for k in kept]
    return Chart(f"{chart.heading} ({MOST_CURVES} of {len(sizes)})", chart.unit, curves)


def _curves(named: dict[str, Any]) -> list[Curve]:
    return [Curve(name, values, k % len(COLOURS), k // len(COLOURS)) for k, (name, values) in enumerate(named.items())]


def _places(results: Results) -> list[tuple[int, int]]:
    """Return, for each beam, an index into `COLOURS` and one into `DASHES`. Beams of one link have the same colour."""
    places, seen = [], dict.fromkeys(range(len(results.mechanism.links)), 0)
    for link, _ in results.mechanism.beams:
        places.append(((link - 1) % len(COLOURS), seen[link] + (link - 1) // len(COLOURS)))
        seen[link] += 1
    return places


def cycle_maps(results: Results, over: Axis) -> list[str]:
    """Return up to three pictures with maps: loads and forces, displacements, and stresses.

    A picture is left out if all its values are unknown.
    """
    shown = [[field for field in FIELDS.values() if field.main and field.kind in kinds] for kinds in MAPPED]
    found = [{words: values for field in row for words, values in [_map(results, field)]} for row in shown]
    known = [row for row in found if any(np.isfinite(values).any() for values, _ in row.values())]
    columns = max((len(row) for row in known), default=0)
    return [field_maps(over, results.scene.beam_names[:MOST_MAPPED], row, columns) for row in known]


def _map(results: Results, field: Field) -> tuple[str, tuple[Any, list[str]]]:
    """Return the heading and the values of a field, and the range of the values on each beam as text.

    The values have the shape (beams, positions, stations).
    """
    sampled = sample(results.deflection, field.key, np.linspace(0.0, 1.0, 31))[:MOST_MAPPED]
    values = _with_gaps(results, sampled.swapaxes(1, 2)).swapaxes(1, 2)
    sizes = np.nanmax(np.abs(values), axis=(1, 2), initial=0.0)
    if field.key in results.cycle.extremes:  # `extremes` also cover locations between the stations
        exact = results.cycle.extremes[field.key].value[: len(values), results.cycle.counted]
        sizes = np.maximum(sizes, np.nanmax(np.abs(exact), axis=1, initial=0.0))
    sign = "±" if field.signed else "≤ "
    ranges = [f"{sign}{quantity(size, field.unit, 3)}" if size else "0" for size in sizes]
    return f"{field.symbol}  {field.name}", (values, ranges)
