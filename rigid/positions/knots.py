"""Places on the way of the drives at which a mechanism is known, design by design in order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid.arrays import Integers

Table = dict[str, Any]
"""Arrays with the knots as their first axis.

place
    Place s on the way.
row
    Number of the design.
coarse
    Whether it belongs to the grid that all designs share.
origin, direction
    Of every link, complex, shape (knots, links).
led
    Coordinate of every joint that drives a gear and is not itself moved, shape (knots, gears).
sine, sign
    Of every group, and +1, or -1 where a dyad folds the other way than drawn, shape (knots, groups).
free0, columns0, duals0, ...
    Of every group: coordinates of its free joints, and columns and duals as in `Closure`.
box0, sure0, ...
    Of every group, from the knot to the next: how far the coordinates may be from the straight line, and whether the
    branch is certain there.
"""


def knots(places: Any, rows: int, links: int, groups: int, gears: int) -> Table:
    """Knots of nothing but the ground."""
    count = rows * len(places)
    table: Table = {
        "place": np.tile(np.asarray(places, float), rows),
        "row": np.repeat(np.arange(rows), len(places)),
        "coarse": np.ones(count, bool),
        "origin": np.zeros((count, links), complex),
        "direction": np.ones((count, links), complex),
        "led": np.full((count, gears), np.nan),
        "sine": np.ones((count, groups)),
        "sign": np.ones((count, groups)),
    }
    return table


def some(table: Mapping[str, Any], which: Any) -> Table:
    """Some of the knots."""
    return {name: value[which] for name, value in table.items()}


def merged(tables: list[Table]) -> Table:
    """Knots of several tables in order."""
    joined = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    return some(joined, np.lexsort((joined["place"], joined["row"])))


def steps(table: Mapping[str, Any]) -> Integers:
    """Numbers of the knots that are followed by one of the same design."""
    return np.flatnonzero(table["row"][1:] == table["row"][:-1])


def located(table: Mapping[str, Any], places: Any, rows: int) -> Integers:
    """Number of the knot before each of some places, shape (rows, places), never the last of a design."""
    place, row = table["place"], table["row"]
    if rows == 1:
        before = np.searchsorted(place, np.ravel(places), side="right") - 1
        return np.clip(before, 0, len(place) - 2)[None]
    low = min(place.min(), np.min(places)) - 1.0
    span = max(place.max(), np.max(places)) - low + 1.0
    keys = row * span + (place - low)
    asked = np.arange(rows)[:, None] * span + (places - low)
    before = np.searchsorted(keys, asked, side="right") - 1
    first = np.searchsorted(row, np.arange(rows))
    last = np.searchsorted(row, np.arange(rows), side="right") - 2
    knots: Integers = np.clip(before, first[:, None], last[:, None])
    return knots
