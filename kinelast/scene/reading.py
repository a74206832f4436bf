"""Readings of a run, as in summary.json: figures with unit, error and location. Findings on their reliability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import UNSET, Struct, UnsetType

from elastic import FIELDS
from kinelast.scene.figure import items_of
from kinelast.scene.numbers import UNRELIABLE
from rigid.arrays import Flags

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.figures.peaks import Peak
    from kinelast.figures.results import Results
    from kinelast.scene.data import Scene

MAX_MARKS = 24  # maximum number of positions that are listed for a fault


class Reading(Struct, frozen=True, kw_only=True):
    """A value in its SI unit, or null if it is not finite. JSON omits entries that are UNSET.

    Attributes
    ----------
    error
        Error in the same unit. If it is unknown, null, and `error_unknown` gives the reason.
    error_measured, unreliable, endless
        True if, respectively, a check measured the error, the error is large, or the value is infinite.
    name, on, label, point
        Description of the figure, and its item, beam and point.
    along, xi, fibre
        Location on the beam: distance from the start, the same relative to the length, and side.
    time, drive
        Time, and coordinates of the drives by name.
    between_positions
        Whether the time lies between the computed positions.
    """

    value: float | None
    unit: str
    error: float | UnsetType | None = UNSET
    error_unknown: str | UnsetType = UNSET
    error_measured: bool | UnsetType = UNSET
    unreliable: bool | UnsetType = UNSET
    endless: bool | UnsetType = UNSET
    name: str | UnsetType = UNSET
    on: str | UnsetType = UNSET
    label: str | UnsetType = UNSET
    point: str | UnsetType = UNSET
    along: Reading | UnsetType = UNSET
    xi: float | UnsetType | None = UNSET
    fibre: str | UnsetType = UNSET
    time: Reading | UnsetType = UNSET
    drive: Mapping[str, Reading] | UnsetType = UNSET
    between_positions: bool | UnsetType = UNSET


def reading(value: Any, unit: str, **more: Any) -> Reading:
    """Return a value with its unit and other entries of `Reading`.

    >>> reading(float("inf"), "m").value is None
    True
    """
    return Reading(value=known(value), unit=unit, **more)


def known(value: Any) -> float | None:
    """Return the number, or None if it is not finite."""
    size = float(value)
    return size if math.isfinite(size) else None


GOOD, OPEN, CAUTION, POOR = "good", "open", "caution", "poor"
ORDER = (POOR, CAUTION, OPEN, GOOD)


@dataclass(frozen=True)
class Finding:
    """A finding on reliability, with level, heading and text. `advice` is a short cause and remedy."""

    level: str
    heading: str
    text: str
    advice: str = ""


def error_entries(value: float, error: float) -> dict[str, Any]:
    """Return the error of a figure as entries of its reading."""
    return {"error": known(error), **({"unreliable": True} if error > UNRELIABLE * abs(value) else {})}


@dataclass(frozen=True)
class Reader:
    """Converts the results of a scene to readings."""

    results: Results

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.results.scene

    @property
    def cycle(self) -> Cycle:
        """Values at the computed positions."""
        return self.results.cycle

    def coordinates(self, values: Any) -> dict[str, Reading]:
        """Return the coordinates of the drives by name."""
        pairs = zip(self.results.drive_words, values, strict=True)
        return {name: reading(value, unit) for (name, _, unit, _), value in pairs}

    def at_position(self, position: int) -> dict[str, Any]:
        """Return the time and the drive coordinates at a position."""
        motion = self.results.motion
        return {"time": reading(motion.time[position], "s"), "drive": self.coordinates(motion.drive[:, position])}

    def at_peak(self, peak: Peak) -> dict[str, Any]:
        """Return the time and drive coordinates of a peak as entries of a reading; empty if it has no time."""
        if math.isnan(peak.time):
            return {}
        between = {"between_positions": True} if peak.refined else {}
        return {"time": reading(peak.time, "s"), "drive": self.coordinates(peak.drive), **between}

    def marks(self, there: Flags) -> list[dict[str, Any]]:
        """Return the included positions at which `there` is True, or an even selection if there are many."""
        at = np.flatnonzero(there & self.results.cycle.counted)
        some = at if len(at) <= MAX_MARKS else at[np.linspace(0, len(at) - 1, MAX_MARKS).astype(int)]
        return [self.at_position(int(position)) for position in some]

    def error_of(self, peak: Peak, unit: str) -> dict[str, Any]:
        """Return the error of a peak in its unit, or the reason why it is unknown, as entries of a reading."""
        if peak.error is None or math.isnan(peak.value):
            return {"error": None}
        if peak.error.unknown:
            return {"error": None, "error_unknown": peak.error.unknown}
        size, figures = peak.error.size, self.results.figures
        if not figures.rounded(peak.value, unit):
            size = figures.rounded(size, unit)
        marks = {"error_measured": peak.error.measured, "unreliable": figures.unreliable(peak.value, size, unit)}
        return {"error": known(size), **{name: True for name, holds in marks.items() if holds}}

    def largest(self, peak: Peak, unit: str, **more: Any) -> Reading:
        """Return a peak with its error, time and drive coordinates."""
        if math.isnan(peak.value):
            return reading(math.nan, unit, **more)
        value = self.results.figures.rounded(peak.value, unit)
        return reading(value, unit, **self.error_of(peak, unit), **more, **self.at_peak(peak))

    def of_item(self, key: str, name: str) -> Reading | None:
        """Return a figure of an item, or None if the figure has no such item."""
        figure = self.results.figures.by_key[key]
        items = items_of(self.scene, figure.of)
        if name not in items:
            return None
        at = items.index(name)
        return self.largest(self.results.figures.peaks[key][at], figure.units(self.scene)[at])

    def of_items(self, keys: Any, name: str) -> dict[str, Reading]:
        """Return the figures that an item has, by key."""
        found = {key: self.of_item(key, name) for key in keys}
        return {key: each for key, each in found.items() if each is not None}

    def on_beam(self, field: str, peak: Peak, beam: int, **more: Any) -> dict[str, Any]:
        """Return the peak of a field with its location on a beam, as entries of a reading."""
        unit, length = FIELDS[field].unit, self.results.deflection.length[beam].item()
        return {
            "value": known(self.results.figures.rounded(peak.value, unit)),
            "unit": unit,
            **self.error_of(peak, unit),
            "along": reading(peak.xi * length, "m"),
            "xi": known(peak.xi),
            "time": reading(peak.time, "s"),
            "drive": self.coordinates(peak.drive),
            "between_positions": peak.refined,
            **more,
        }
