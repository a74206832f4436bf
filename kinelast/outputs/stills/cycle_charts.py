"""Charts over the cycle: curves of the largest values and forces, maps of the fields along the links."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from elastic import FIELDS, Field, Kind, sample
from kinelast.figures.cycle import drive_words
from kinelast.figures.results import Results
from kinelast.outputs.sheet import LINKS as COLOURS
from kinelast.outputs.stills.charts import DASHES, Axis, Chart, Curve, field_maps
from kinelast.scene.numbers import quantity, scale_of, ticks
from rigid.arrays import Reals

MAPPED = ((Kind.LOAD, Kind.FORCE), (Kind.DISPLACEMENT,), (Kind.STRESS,))  # a row of maps each
MOST_MAPPED, MOST_CURVES = 16, 10
ANGLE_STEPS = (1, 2, 5, 10, 15, 30, 60, 90, 180, 360)


def axis(results: Results) -> Axis:
    """Abscissa of the cycle: the first drive's angle where it turns one way throughout, else the time."""
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


def _numbers(results: Results) -> Any:
    """Of every position, its number in the run; those that were left out have none here, shape (positions,)."""
    time = results.motion.time
    if not results.left_out or len(time) < 2:
        return np.arange(len(time))
    return np.round((time - time[0]) / np.diff(time).min()).astype(int)


def _spread(results: Results, values: Any) -> Any:
    """Values of an axis at all positions from the first to the last, those that were left out among them."""
    numbers = _numbers(results)
    return np.interp(np.arange(numbers[-1] + 1), numbers, values)


def _with_gaps(results: Results, values: Any) -> Reals:
    """Values, positions last, with nan at the positions between that were left out or that do not count."""
    values = np.broadcast_to(values, (*np.shape(values)[:-1], *results.motion.columns))
    numbers = _numbers(results)
    spread = np.full((*values.shape[:-1], numbers[-1] + 1), np.nan)
    spread[..., numbers] = np.where(results.counted | results.singular, values, np.nan)
    return spread


def cycle_charts(results: Results) -> list[Chart]:
    """Curves over the cycle."""
    forces, labels = results.deflection.forces, results.scene.labels
    charts = []
    for field in ("w", "mises", "M"):
        sizes = np.abs(results.extremes[field].value)
        if np.isfinite(sizes).any():
            entries = zip(_places(results), labels, sizes, strict=True)
            curves = [Curve(label, size, *place) for place, label, size in entries]
            charts.append(Chart(f"Largest {FIELDS[field].name} along each link", FIELDS[field].unit, curves))
    efforts: dict[str, list[Curve]] = {}
    for (name, *_, unit), effort in zip(drive_words(results.mechanism), results.efforts, strict=True):
        efforts.setdefault(unit, []).append(Curve(name, effort, len(efforts.get(unit, []))))
    charts += [Chart("Drive moment" if unit == "N m" else "Drive force", unit, own) for unit, own in efforts.items()]
    joints = zip(results.joint_words, forces.force, strict=True)
    charts.append(Chart("Joint forces", "N", _curves({f"{at} on {on}": np.abs(force) for (at, on), force in joints})))
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
    """A chart of no more curves than can be told apart: the largest."""
    if len(chart.curves) <= MOST_CURVES:
        return chart
    sizes = [float(np.nanmax(np.abs(curve.values), initial=0.0)) for curve in chart.curves]
    kept = sorted(sorted(range(len(sizes)), key=lambda k: -sizes[k])[:MOST_CURVES])
    curves = [chart.curves[k] for k in kept]
    return Chart(f"{chart.heading} ({MOST_CURVES} of {len(sizes)})", chart.unit, curves)


def _curves(named: dict[str, Any]) -> list[Curve]:
    return [Curve(name, values, k % len(COLOURS), k // len(COLOURS)) for k, (name, values) in enumerate(named.items())]


def _places(results: Results) -> list[tuple[int, int]]:
    """Colour and dashes of every beam: its link's colour in the drawing, other dashes for every beam of the link."""
    places, seen = [], dict.fromkeys(range(len(results.mechanism.links)), 0)
    for link, _ in results.mechanism.beams:
        places.append(((link - 1) % len(COLOURS), seen[link] + (link - 1) // len(COLOURS)))
        seen[link] += 1
    return places


def legend(chart: Chart) -> list[tuple[str, str, str]]:
    """Names, colours and dashes of the curves."""
    return [
        (curve.name, COLOURS[curve.colour % len(COLOURS)], " ".join(map(str, DASHES[curve.dash % len(DASHES)])))
        for curve in chart.curves
    ]


def cycle_maps(results: Results, over: Axis) -> list[str]:
    """Main fields along the links over the cycle: maps of loads and forces, of displacements, of stresses if known."""
    shown = [[field for field in FIELDS.values() if field.main and field.kind in kinds] for kinds in MAPPED]
    found = [{words: values for field in row for words, values in [_map(results, field)]} for row in shown]
    known = [row for row in found if any(np.isfinite(values).any() for values, _ in row.values())]
    columns = max((len(row) for row in known), default=0)
    return [field_maps(over, results.scene.labels[:MOST_MAPPED], row, columns) for row in known]


def _map(results: Results, field: Field) -> tuple[str, tuple[Any, list[str]]]:
    """Heading of the maps of a field; its values, shape (beams, positions, stations), and ranges in words."""
    sampled = sample(results.deflection, field.key, np.linspace(0.0, 1.0, 31))[:MOST_MAPPED]
    values = _with_gaps(results, sampled.swapaxes(1, 2)).swapaxes(1, 2)
    sizes = np.nanmax(np.abs(values), axis=(1, 2), initial=0.0)
    if field.key in results.extremes:  # between the stations
        exact = results.extremes[field.key].value[: len(values), results.counted]
        sizes = np.maximum(sizes, np.nanmax(np.abs(exact), axis=1, initial=0.0))
    sign = "±" if field.signed else "≤ "
    ranges = [f"{sign}{quantity(size, field.unit, 3)}" if size else "0" for size in sizes]
    return f"{field.symbol}  {field.name}", (values, ranges)
