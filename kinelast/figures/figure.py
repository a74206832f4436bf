"""Figures as plain data that JSON can hold: each with its unit, and where in the cycle it is."""

from __future__ import annotations

import math
from typing import Any

from kinelast.figures.peaks import Peak
from kinelast.figures.results import Results


def figure(value: Any, unit: str, **more: Any) -> dict[str, Any]:
    """A value and its unit; null where there is no number."""
    size = float(value)
    return {"value": size if math.isfinite(size) else None, "unit": unit, **more}


def coordinates(results: Results, values: Any) -> dict[str, Any]:
    """Coordinates of the drives by name."""
    return {name: figure(value, unit) for (name, _, unit, _), value in zip(results.drive_words, values, strict=True)}


def at_position(results: Results, position: int) -> dict[str, Any]:
    """Time and coordinates of the drives at a position."""
    motion = results.motion
    return {"time": figure(motion.time[position], "s"), "drive": coordinates(results, motion.drive[:, position])}


def at_peak(results: Results, peak: Peak) -> dict[str, Any]:
    """Time and coordinates of the drives at a peak."""
    return {"time": figure(peak.time, "s"), "drive": coordinates(results, peak.drive)}


def largest(results: Results, peak: Peak, unit: str, **more: Any) -> dict[str, Any]:
    """A peak with time and drive."""
    if math.isnan(peak.value):
        return figure(math.nan, unit, **more)
    place = at_peak(results, peak) if not math.isnan(peak.time) else {}
    return figure(results.figures.rounded(peak.value, unit), unit, **more, **place)
