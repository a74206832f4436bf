"""Figures of an answer by name, which are printed with their unit and error."""

import math
from collections.abc import Mapping
from typing import Any

from msgspec import convert

from kinelast.outputs.words import error_words
from kinelast.scene.error import likely
from kinelast.scene.numbers import DisplayUnits, quantity
from kinelast.scene.reading import Reading


class Value(dict[str, Any]):
    """A number with its unit and error in SI units, as in summary.json. It is printed in the units of the scene.

    >>> Value({"value": 0.0016, "unit": "m", "error": 2e-6, "on": "crank"}, {})
    1.6 mm ± 0.12 %
    """

    def __init__(self, entries: Mapping[str, Any], shown_in: DisplayUnits) -> None:
        super().__init__(entries)
        self._display_units = shown_in

    def __repr__(self) -> str:
        return quantity(float(self), self["unit"], shown_in=self._display_units) + error_words(
            convert(self, Reading), self._display_units
        )

    def __float__(self) -> float:
        """Return the number in its SI unit, or nan if it is unknown."""
        return math.nan if self["value"] is None else float(self["value"])


class Figures(dict[str, Any]):
    """Entries of summary.json. `figures["mass"]` also finds a figure in `figures["figures"]`."""

    def __missing__(self, name: str) -> Any:
        figures = super().get("figures", {})
        if name in figures:
            return figures[name]
        raise KeyError(f'there is no figure "{name}"{likely(name, [*figures, *self])}')


def figures_of(summary: Mapping[str, Any], shown_in: DisplayUnits) -> Figures:
    """Return a summary in which every number with a unit is a `Value`."""
    return Figures({key: _valued(entry, shown_in) for key, entry in summary.items()})


def _valued(entry: Any, shown_in: DisplayUnits) -> Any:
    if isinstance(entry, list):
        return [_valued(each, shown_in) for each in entry]
    if not isinstance(entry, Mapping):
        return entry
    whole = {key: _valued(each, shown_in) for key, each in entry.items()}
    return Value(whole, shown_in) if {"value", "unit"} <= whole.keys() else whole
