"""Figures as plain data that JSON can hold: each with its unit, and where in the cycle it is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

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


def largest(results: Results, values: Any, unit: str, **more: Any) -> dict[str, Any]:
    """The value of largest magnitude over the positions that count, with time and drive."""
    if np.shape(values) != results.motion.columns:
        values = np.broadcast_to(values, results.motion.columns)
    size = np.where(np.isfinite(values) & results.counted, np.abs(values), -1.0)
    at = int(size.argmax())
    if size[at] < 0:
        return figure(math.nan, unit)
    return figure(results.rounded(values[at], unit), unit, **more, **at_position(results, at))
