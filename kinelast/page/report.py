"""report.html: the figures of a scene as one page that needs nothing but itself."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import FIELDS, PRIMARY, Kind
from kinelast.figures.results import EXTREME_FIELDS, Peak, Results, drive_words, peak_positions
from kinelast.figures.summary import greatest_beam
from kinelast.figures.trust import CAUTION, GOOD, POOR, verdict
from kinelast.page.charts import Axis, line_charts
from kinelast.page.cycle_charts import MOST_MAPPED, axis, cycle_charts, cycle_maps, legend
from kinelast.page.drawing import mechanism_drawing
from kinelast.page.numbers import coordinate, number, quantity

if TYPE_CHECKING:
    from jinja2 import Template

VERDICTS = {
    GOOD: "These figures can be relied on.",
    CAUTION: "These figures are to be taken with care",
    POOR: "Some of these figures are not to be relied on",
}
TABLED = [field for field in FIELDS.values() if field.key in EXTREME_FIELDS and field.kind is not Kind.STRESS]
STRESSES = [field for field in FIELDS.values() if field.key in EXTREME_FIELDS and field.kind is Kind.STRESS]
AT_END = 1e-6


@cache
def _template() -> Template:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.globals.update(
        quantity=_quantity,
        hertz=_hertz,
        rpm=_rpm,
        direction=_direction,
        percent=_percent,
        share=_share,
        checked=PRIMARY,
    )
    return environment.get_template("report.html")


def _quantity(figure: dict[str, Any], digits: int = 4) -> str:
    """A figure of the summary in words."""
    if figure["value"] is None:
        return number(math.nan)
    return quantity(figure["value"], figure["unit"], digits)


def _hertz(figure: dict[str, Any], digits: int = 4) -> str:
    """A frequency of the summary in hertz."""
    return number(math.nan if figure["value"] is None else figure["value"] / (2 * math.pi), digits) + " Hz"


def _rpm(figure: dict[str, Any]) -> str:
    """A speed of the summary in turns per minute."""
    return number(math.nan if figure["value"] is None else figure["value"] * 30 / math.pi) + " rpm"


def _direction(figure: dict[str, Any]) -> str:
    """An angle of the summary in degrees."""
    return coordinate(figure["value"], figure["unit"])


def _percent(figure: dict[str, Any], digits: int = 2) -> str:
    """A share of the summary."""
    return number(math.nan if figure["value"] is None else 100 * figure["value"], digits) + " %"


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
    over = axis(results)
    charts = cycle_charts(results)
    svgs = line_charts(over, charts)
    labels = results.scene.labels
    level, reasons = verdict(figures["trust"])
    return _template().render(
        figures=figures,
        fields=TABLED,
        stresses=STRESSES,
        drawing=Markup(drawing),
        caption=caption,
        charts=[(chart.heading, legend(chart), Markup(svg)) for chart, svg in zip(charts, svgs, strict=True)],
        maps=[Markup(row) for row in cycle_maps(results, over)] if labels else [],
        unmapped=max(0, len(labels) - MOST_MAPPED),
        stressed=any(peaks["normal"]["value"] is not None for peaks in figures["peaks"].values()),
        verdict=level,
        verdict_words=VERDICTS[level],
        reasons=reasons,
        moved=any(point["displacement"]["value"] for point in figures["points"].values()),
        safety=_safety(figures),
        times_drive=_inverse(figures),
        refined=figures["made_from"]["options"]["refine"],
        at=lambda figure: at_drive(figure, over),
        place=lambda label, figure: _place(figures, label, figure),
    )


def _safety(figures: dict[str, Any]) -> dict[str, Any] | None:
    """The least safety factor, its link, and how it is graded; None where none is known."""
    known = {label: row for label, row in figures["strength"].items() if row["safety_factor"]["value"] is not None}
    if not known:
        return None
    label = min(known, key=lambda each: known[each]["safety_factor"]["value"])
    found, limits = known[label]["safety_factor"], figures["limits"]["yield"]
    share = 1.0 / found["value"]
    level = POOR if share > limits["beyond"] else CAUTION if share > limits["watch"] else GOOD
    return {"label": label, "figure": found, "limit": known[label]["yield_stress"], "level": level}


def _place(figures: dict[str, Any], label: str, figure: dict[str, Any]) -> str:
    """Where along its link a figure is: one of its ends, or the distance from the first."""
    link = next(link for link in figures["links"] if link["label"] == label)
    way = figure["along"]["value"] / link["length"]["value"]
    return link["from"] if way < AT_END else link["to"] if way > 1 - AT_END else _quantity(figure["along"], 3)


def _inverse(figures: dict[str, Any]) -> dict[str, Any]:
    """The lowest natural frequency over the drive's speed."""
    ratio = (figures["vibration"] or {}).get("drive_to_lowest", {}).get("value")
    return {"value": 1.0 / ratio if ratio else None, "unit": "1"}


def _drawing(results: Results, found: dict[str, list[Peak]]) -> tuple[str, str]:
    """The mechanism where it deflects most, and what the picture shows."""
    beam = greatest_beam(found, "w")
    position = 0
    if beam is not None:
        position = int(peak_positions(results, results.extremes["w"])[beam])
    drawing, factor = mechanism_drawing(results, position)
    place = ", ".join(
        f"{name} at {coordinate(float(value), unit)}"
        for (name, _, unit, _), value in zip(
            drive_words(results.mechanism), results.motion.drive[:, position], strict=True
        )
    )
    if not any(np.any(moved) for moved in results.displacements.values()):
        return drawing, f"{place}, over its course."
    size = f"enlarged {number(factor)}" if factor >= 1 else f"reduced {number(1 / factor)}"
    words = f"rigid position (thin) and deformed shape (thick), displacements {size} times."
    return drawing, f"{place}: {words}"


def at_drive(figure: dict[str, Any], over: Axis) -> str:
    """Where in the cycle a figure of the summary is found, in words: at an angle of the drive that turns, or when."""
    if not figure["value"]:
        return ""
    if over.label.endswith("[deg]"):
        first = next(iter(figure["drive"].values()))
        return coordinate(first["value"], first["unit"])
    return _quantity(figure["time"])
