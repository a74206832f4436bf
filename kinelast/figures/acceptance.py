"""Whether the machine is good enough: the scene's limits beside what was found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kinelast.figures.figure import figure
from kinelast.figures.limits import Verdict, judged
from kinelast.figures.results import Results

FIELDS = {
    "deflection": "w",
    "chord": "chord",
    "safety": "mises",
}  # figures of beams, and the fields that have their place


def acceptance(results: Results, figures: Mapping[str, Any]) -> dict[str, Any]:
    """Every limit of the scene with the figure that it bounds, and whether all are kept.

    Parameters
    ----------
    figures
        The rest of the summary, see `kinelast.figures.summary.summary`: places and units.

    Returns
    -------
    `passed`: None where no limit is set; a limit that there is no figure for is not kept. `limits`: a row each.
    """
    peaks = results.figures.peaks
    bounded = {limit.figure for limit in results.scene.limits} & peaks.keys()
    sizes = {key: np.abs([peak.value for peak in peaks[key]]) for key in bounded}
    rows = [
        {
            "kind": verdict.limit.kind,
            "on": verdict.limit.link,
            "limit": figure(verdict.limit.bound, row["unit"] if verdict.limit.kind == "output" else verdict.limit.unit),
            "found": row,
            "passed": bool(verdict.kept),
        }
        for verdict in judged(results.scene, sizes)
        for row in [_row(results, figures, verdict)]
    ]
    return {"passed": all(row["passed"] for row in rows) if rows else None, "limits": rows}


def _row(results: Results, figures: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    """The figure that a limit bounds, with its place; without a value where it is not known."""
    kind = verdict.limit.kind
    if np.isnan(verdict.value):
        return figure(np.nan, verdict.limit.unit or "m")
    if kind == "output":
        output = figures["output"]
        return {**output, "label": output["name"], "shares": None}
    label = results.scene.labels[int(verdict.item)]
    row = figures["peaks"][label][FIELDS[kind]]
    if kind == "safety":
        place = {key: value for key, value in row.items() if key not in ("value", "unit")}
        row = {**place, **figures["strength"][label]["safety_factor"]}
    return {**row, "label": label}
