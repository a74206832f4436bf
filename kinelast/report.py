"""report.html: the figures of a scene as one page that needs nothing but itself."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import FIELDS, sample
from kinelast.output_results import EXTREME_FIELDS, UNITS, Peak, Results, drive_words, joint_words
from kinelast.output_summary import greatest_beam
from kinelast.report_charts import line_chart, map_image, strokes
from kinelast.report_drawing import mechanism_drawing
from kinelast.report_numbers import coordinate, number, quantity, scale_of, ticks
from rigid import PinDrive, Reals

if TYPE_CHECKING:
    from jinja2 import Template

NAMES = {
    "qx": "load along",
    "qy": "load across",
    "N": "axial force",
    "V": "shear force",
    "M": "bending moment",
    "u": "displacement along",
    "w": "deflection",
    "phi": "slope",
    "chord": "deflection from chord",
}
SYMBOLS = {"qx": "q<sub>x</sub>", "qy": "q<sub>y</sub>", "phi": "φ", "chord": "w<sub>chord</sub>"}
MAPPED = ("qx", "qy", "N", "M", "phi", "u", "w")
MOST_MAPPED = 16
ANGLE_STEPS = (1, 2, 5, 10, 15, 30, 60, 90, 180, 360)


@cache
def _template() -> Template:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.globals.update(quantity=_quantity, share=_share, checked=FIELDS)
    return environment.get_template("report.html")


def _quantity(figure: dict[str, Any], digits: int = 4) -> str:
    """A figure of the summary in words."""
    if figure["value"] is None:
        return number(math.nan)
    return quantity(figure["value"], figure["unit"], digits)


def _share(value: float | None) -> str:
    """A difference of the check in words."""
    return number(math.nan if value is None else value, 2)


def report_html(results: Results, found: dict[str, list[Peak]], figures: dict[str, Any]) -> str:
    """The report of a scene.

    Parameters
    ----------
    found
        The peaks per field, see `output_results.peaks`.
    figures
        The summary, see `output_summary.summary`: the report prints no other figures than these.

    Returns
    -------
    A whole HTML page without references to anything outside it.
    """
    from markupsafe import Markup

    drawing, caption = _drawing(results, found)
    return _template().render(
        figures=figures,
        fields=[(field, NAMES[field], Markup(SYMBOLS.get(field, field))) for field in EXTREME_FIELDS],
        drawing=Markup(drawing),
        caption=caption,
        charts=[(heading, legend, Markup(svg)) for heading, legend, svg in _charts(results)],
        maps=_maps(results),
        map_names=[(NAMES[field], Markup(SYMBOLS.get(field, field))) for field in MAPPED],
        unmapped=max(0, len(results.scene.labels) - MOST_MAPPED),
        axis=axis(results)[1],
        refined=figures["made_from"]["options"]["refine"],
        at=lambda figure: at_drive(figure, results),
    )


def _drawing(results: Results, found: dict[str, list[Peak]]) -> tuple[str, str]:
    """The mechanism where it deflects most, and what the picture shows."""
    beam = greatest_beam(found)
    position = 0
    if beam is not None:
        size = np.abs(results.extremes["w"].value[beam])
        position = int(np.nanargmax(size))
    drawing, factor = mechanism_drawing(results, position)
    place = ", ".join(
        f"{name} at {coordinate(float(value), unit)}"
        for (name, _, unit, _), value in zip(
            drive_words(results.mechanism), results.motion.drive[:, position], strict=True
        )
    )
    return (
        drawing,
        f"{place}: rigid position (thin) and deformed shape (thick), displacements enlarged {number(factor)} times.",
    )


def at_drive(figure: dict[str, Any], results: Results) -> str:
    """Where in the cycle a figure of the summary is found, in words."""
    drives = figure.get("drive")
    if not drives or figure["value"] is None:
        return ""
    if axis(results)[1].endswith("[deg]") or len(drives) == 1:
        first = next(iter(drives.values()))
        return coordinate(first["value"], first["unit"])
    return _quantity(figure["time"])


def axis(results: Results) -> tuple[Reals, str, list[float]]:
    """What the cycle is drawn over: the first drive's angle where it turns one way throughout, else the time."""
    motion = results.motion
    drive, values = results.mechanism.drives[0], motion.drive[0]
    steps = np.diff(values)
    if isinstance(drive, PinDrive) and len(steps) and (np.all(steps > 0) or np.all(steps < 0)):
        angles = np.degrees(values)
        low, high = sorted((float(angles[0]), float(angles[-1])))
        step = next((step for step in ANGLE_STEPS if high - low <= 8 * step), 360 * math.ceil((high - low) / 2880))
        marks = [float(step * k) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
        return angles, f"angle of {drive.link} [deg]", marks
    factor, unit = scale_of(float(np.abs(motion.time).max()), "s")
    times = motion.time * factor
    return times, f"time [{unit}]", ticks(float(times[0]), float(times[-1]), 6)


def _charts(results: Results) -> list[tuple[str, list[tuple[str, str, str]], str]]:
    """Headings, legends (name, colour, dashes) and curves over the cycle."""
    x, x_label, marks = axis(results)
    forces, labels = results.deflection.forces, results.scene.labels
    wanted: list[tuple[str, str, dict[str, Any]]] = []
    for field in ("w", "chord", "M") if labels else ():
        sizes = np.abs(results.extremes[field].value)
        heading = f"Largest {NAMES[field]} along each link"
        wanted.append((heading, UNITS[field], dict(zip(labels, sizes, strict=True))))
    efforts: dict[str, dict[str, Any]] = {}
    for (name, *_, unit), effort in zip(drive_words(results.mechanism), results.efforts, strict=True):
        efforts.setdefault(unit, {})[name] = effort
    wanted += [("Drive moment" if unit == "N m" else "Drive force", unit, curves) for unit, curves in efforts.items()]
    joints = {
        f"{joint} on {link}": np.abs(force)
        for (joint, link), force in zip(joint_words(results), forces.force, strict=True)
    }
    wanted.append(("Joint forces", "N", joints))
    shaking = {
        "size": np.abs(forces.ground_force),
        "x": np.real(forces.ground_force),
        "y": np.imag(forces.ground_force),
    }
    wanted.append(("Shaking force on the ground", "N", shaking))
    wanted.append(("Shaking moment about the origin", "N m", {"moment": forces.ground_moment}))
    charts = []
    for heading, unit, curves in wanted:
        full = {name: np.broadcast_to(values, results.motion.columns) for name, values in curves.items()}
        legend = [(name, *strokes(index)) for index, name in enumerate(full)] if len(full) > 1 else []
        charts.append((heading, legend, line_chart(x, full, unit, x_label, marks)))
    return charts


def _maps(results: Results) -> list[tuple[str, list[tuple[str, str]]]]:
    """Per link its name and, per field, the range and the picture of the field along it over the cycle."""
    stations = np.linspace(0.0, 1.0, 31)
    rows: list[tuple[str, list[tuple[str, str]]]] = [(label, []) for label in results.scene.labels[:MOST_MAPPED]]
    for field in MAPPED if rows else ():
        values = sample(results.deflection, field, stations)
        for (_, pictures), own in zip(rows, values, strict=False):
            largest = float(np.nanmax(np.abs(own), initial=0.0)) if np.isfinite(own).any() else 0.0
            pictures.append((f"±{quantity(largest, UNITS[field], 3)}" if largest else "0", map_image(own)))
    return rows
