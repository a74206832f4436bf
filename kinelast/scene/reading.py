"""Reading: value of a figure with its unit, error and place, as summary.json has it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from msgspec import UNSET, Struct, UnsetType

MAX_MARKS = 24  # listed positions with a fault


class Reading(Struct, frozen=True, kw_only=True):
    """Value in its SI unit, null if it is not finite. JSON leaves out entries that are UNSET.

    Attributes
    ----------
    error
        Error in the same unit, null if it is unknown for the reason `error_unknown`.
    error_measured, unreliable, endless
        True for an error measured by a check, for a large error, and for an infinite value.
    name, on, label, point
        Figure in words; its item, beam and point.
    along, xi, fibre
        Place on the beam: distance from its start, relative to its length, and side.
    time, drive
        Instant, and coordinates of the drives by name.
    between_positions
        Whether the instant lies between the computed positions.
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
    """Return a value with its unit and further entries of `Reading`.

    >>> reading(float("inf"), "m").value is None
    True
    """
    return Reading(value=known(value), unit=unit, **more)


def known(value: Any) -> float | None:
    """Return a number, None if it is not finite."""
    size = float(value)
    return size if math.isfinite(size) else None
