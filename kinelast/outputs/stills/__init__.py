"""Stills for papers: curves, maps and the mechanism as vector pictures, by matplotlib, on request."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from kinelast.figures.results import Results
from kinelast.outputs.stills.charts import line_charts
from kinelast.outputs.stills.cycle_charts import axis, cycle_charts, cycle_maps
from kinelast.outputs.stills.drawing import mechanism_drawing

HEAD = '<?xml version="1.0" encoding="utf-8"?>\n'


def write_stills(folder: Path, results: Results) -> None:
    """Write the mechanism where it deflects most, every chart over the cycle and the maps, an SVG each."""
    folder.mkdir()
    largest = results.cycle.along("w")
    known = len(results.scene.labels) and np.isfinite(largest.value).any()
    position = int(largest.position[np.nanargmax(np.abs(largest.value))]) if known else 0
    pictures = {"mechanism": mechanism_drawing(results, position)[0]}
    over, charts = axis(results), cycle_charts(results)
    for chart, svg in zip(charts, line_charts(over, charts), strict=True):
        pictures[re.sub(r"[^a-z0-9]+", "_", chart.heading.lower()).strip("_")] = svg
    if results.scene.labels:
        pictures |= {f"maps_{number}": svg for number, svg in enumerate(cycle_maps(results, over), 1)}
    for name, svg in pictures.items():
        (folder / f"{name}.svg").write_text(HEAD + svg + "\n", encoding="utf-8")
