"""Readings and findings for summary.json.

A reading is a value with its unit, error and location in space and time. A finding states how reliable results are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import UNSET, Struct, UnsetType

from elastic import FIELDS
from kinelast.values.figure import items_of
from rigid.arrays import Flags

if TYPE_CHECKING:
    from kinelast.answers.results import Results
    from kinelast.figures.cycle import Cycle
    from kinelast.figures.peaks import Peak
    from kinelast.scene.data import Scene

MAX_MARKS = 24  # maximum number of positions in a list, e.g. of positions at which a fault occurs


class Reading(Struct, frozen=True, kw_only=True):
    """A value with its SI unit, error and location.

    The value is null if it is not finite. JSON omits entries that are UNSET.

    Attributes
    ----------
    error
        Error in the same unit. An unknown error is null, and `error_unknown` is the reason why it is unknown.
    error_measured, unreliable, endless
        `error_measured` is True if a check measured the error, `unreliable` if the error is large, and `endless` if the
        value is infinite.
    name, on, label, point
        Description of the figure, and the item, the label of the beam and the point to which the value belongs.
    along, xi, fibre
        Location on the beam: distance from the start of the beam, the same relative to the length of the beam, and
        "left" or "right" fibre.
    time, drive
        Time at which the value occurs, and coordinates of the drives at this time, by name of the drive.
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
    """Return a reading of a value, with its unit and the entries `more`.

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


class Finding(Struct, frozen=True):
    """A finding on the reliability of results.

    `level` is one of `ORDER`. `advice` is the cause and the remedy in brief.
    """

    level: str
    heading: str
    text: str
    advice: str = ""


class Reader(Struct, frozen=True):
    """Converts the results of a scene to readings."""

    results: Results

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.results.scene

    @property
    def cycle(self) -> Cycle:
        """The `Cycle`, from which values at the computed positions are obtained."""
        return self.results.cycle

    def coordinates(self, values: Any) -> dict[str, Reading]:
        """Return readings of the coordinates of the drives, by name of the drive."""
        pairs = zip(self.results.drive_words, values, strict=True)
        return {name: reading(value, unit) for (name, _, unit, _), value in pairs}

    def at_position(self, position: int) -> dict[str, Any]:
        """Return the time and the drive coordinates at a position."""
        motion = self.results.motion
        return {"time": reading(motion.time[position], "s"), "drive": self.coordinates(motion.drive[:, position])}

    def at_peak(self, peak: Peak) -> dict[str, Any]:
        """Return the time and drive coordinates of a peak as entries of a reading.

        They are empty if the peak has no time.
        """
        if math.isnan(peak.time):
            return {}
        between = {"between_positions": True} if peak.refined else {}
        return {"time": reading(peak.time, "s"), "drive": self.coordinates(peak.drive), **between}

    def marks(self, there: Flags) -> list[dict[str, Any]]:
        """Return the time and the drive coordinates of each position at which `there` is True.

        Ill-conditioned positions are left out. If there are more than `MAX_MARKS` positions, return evenly selected
        ones.
        """
        at = np.flatnonzero(there & self.results.cycle.counted)
        some = at if len(at) <= MAX_MARKS else at[np.linspace(0, len(at) - 1, MAX_MARKS).astype(int)]
        return [self.at_position(int(position)) for position in some]

    def error_of(self, peak: Peak, unit: str, least: float = 0.0) -> dict[str, Any]:
        """Return the error of a peak value in `unit`, or the reason why it is unknown, as entries of a reading.

        `least` is the smallest possible error.
        """
        if peak.error is None or math.isnan(peak.value):
            return {"error": None}
        if peak.error.unknown:
            return {"error": None, "error_unknown": peak.error.unknown}
        size, figures = max(peak.error.size, least), self.results.figures
        value = figures.rounded(peak.value, unit)
        if not value:
            size = figures.rounded(size, unit)
        marks = {"error_measured": peak.error.measured, "unreliable": figures.unreliable(value, size, unit)}
        return {"error": known(size), **{name: True for name, holds in marks.items() if holds}}

    def largest(self, peak: Peak, unit: str, least_error: float = 0.0, **more: Any) -> Reading:
        """Return a reading of a peak value, with its error, time and drive coordinates."""
        if math.isnan(peak.value):
            return reading(math.nan, unit, **more)
        if peak.error and math.isfinite(peak.value) and math.isinf(peak.error_size):
            return reading(math.nan, unit, error_unknown="its error has no bound", **more)
        value = self.results.figures.rounded(peak.value, unit)
        return reading(value, unit, **self.error_of(peak, unit, least_error), **more, **self.at_peak(peak))

    def of_item(self, key: str, name: str) -> Reading | None:
        """Return the reading of the figure (result) `key` for an item, or None if the figure has no such item."""
        figure = self.results.figures.by_key[key]
        items = items_of(self.scene, figure.of)
        if name not in items:
            return None
        at = items.index(name)
        return self.largest(self.results.figures.peaks[key][at], figure.units(self.scene)[at])

    def of_items(self, keys: Any, name: str) -> dict[str, Reading]:
        """Return the readings of an item by figure key, for those figures that exist for this item."""
        found = {key: self.of_item(key, name) for key in keys}
        return {key: each for key, each in found.items() if each is not None}

    def on_beam(self, field: str, peak: Peak, beam: int, least_error: float = 0.0, **more: Any) -> dict[str, Any]:
        """Return the peak of a field, such as the stress, with its location on a beam, as entries of a reading."""
        unit, length = FIELDS[field].unit, self.results.deflection.length[beam].item()
        return {
            "value": known(self.results.figures.rounded(peak.value, unit)),
            "unit": unit,
            **self.error_of(peak, unit, least_error),
            "along": reading(peak.xi * length, "m"),
            "xi": known(peak.xi),
            "time": reading(peak.time, "s"),
            "drive": self.coordinates(peak.drive),
            "between_positions": peak.refined,
            **more,
        }
