"""Table of knots: points on the drive path with known postures, ordered by design and path parameter."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid.arrays import Flags, Integers, Reals

SIDE_KNOTS = 3  # number of knots on each side of a change point whose sine must be larger

Table = dict[str, Any]
"""Arrays by name. Their first axis is the knots.

place
    Path parameter s.
row
    Index of the design.
coarse
    True if the knot belongs to the grid that all designs share.
origin, direction
    Origin and unit vector of each link (complex), shape (knots, links).
driver_angles
    Coordinate of each undriven joint that drives a gear, shape (knots, gears).
sine, sign
    Sine of each group; -1 for a dyad assembled opposite to the drawing, otherwise +1; shape (knots, groups).
free0, columns0, duals0, ...
    For each group: coordinates of its free joints, and columns and duals (see `Closure`).
box0, certain0, ...
    For each group in the step to the next knot: bound on the deviation of the coordinates from linear motion, and True
    if the branch is certain.
"""


def knots(places: Any, rows: int, links: int, groups: int, gears: int) -> Table:
    """Create a table of knots in which no links are placed except the ground."""
    count = rows * len(places)
    return {
        "place": np.tile(np.asarray(places, float), rows),
        "row": np.repeat(np.arange(rows), len(places)),
        "coarse": np.ones(count, bool),
        "origin": np.zeros((count, links), complex),
        "direction": np.ones((count, links), complex),
        "driver_angles": np.full((count, gears), np.nan),
        "sine": np.ones((count, groups)),
        "sign": np.ones((count, groups)),
    }


def select(table: Mapping[str, Any], which: Any) -> Table:
    """Return the selected knots of a table."""
    return {name: value[which] for name, value in table.items()}


def merged(tables: list[Table]) -> Table:
    """Merge tables, and order the knots by design and path parameter."""
    joined = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    return select(joined, np.lexsort((joined["place"], joined["row"])))


def steps(table: Mapping[str, Any]) -> Integers:
    """Return the indices of the knots that are followed by a knot of the same design."""
    return np.flatnonzero(table["row"][1:] == table["row"][:-1])


def knots_before(table: Mapping[str, Any], places: Any, rows: int) -> Integers:
    """Return the index of the last knot before each point, shape (rows, places), but never that of a final knot."""
    place, row = table["place"], table["row"]
    if rows == 1:
        before = np.searchsorted(place, np.ravel(places), side="right") - 1
        return np.clip(before, 0, len(place) - 2)[None]
    low = min(place.min(), np.min(places)) - 1.0
    span = max(place.max(), np.max(places)) - low + 1.0
    keys = row * span + (place - low)
    keys_of_places = np.arange(rows)[:, None] * span + (places - low)
    before = np.searchsorted(keys, keys_of_places, side="right") - 1
    first = np.searchsorted(row, np.arange(rows))
    last = np.searchsorted(row, np.arange(rows), side="right") - 2
    return np.clip(before, first[:, None], last[:, None])


def touches(place: Reals, row: Integers, sine: Reals, uncertain: Flags, width: float) -> list[int]:
    """Return the knots closest to points at which a sine touches zero, at most one in `width`.

    At such a point the sine drops sharply within a few finest steps. If it only comes close to zero, it has a smooth
    minimum.

    Parameters
    ----------
    uncertain
        Whether each knot is followed by a finest step without a certificate.
    """
    sine, least, count = np.abs(sine), np.zeros(len(place), bool), len(place) - 2 * SIDE_KNOTS
    if count > 0:
        here = sine[SIDE_KNOTS:-SIDE_KNOTS]
        before, after = (
            np.array([sine[SIDE_KNOTS + k * sense :][:count] for k in range(1, SIDE_KNOTS + 1)]) for sense in (-1, 1)
        )
        inside = (
            uncertain[SIDE_KNOTS:-SIDE_KNOTS]
            & uncertain[SIDE_KNOTS - 1 :][:count]
            & (row[: -2 * SIDE_KNOTS] == row[2 * SIDE_KNOTS :])
        )
        with np.errstate(invalid="ignore"):
            lowest = (here < before.min(axis=0)) & (here <= after.min(axis=0))
            least[SIDE_KNOTS:-SIDE_KNOTS] = inside & lowest & (2 * here <= np.minimum(before[-1], after[-1]))
    chosen: list[int] = []
    for at in np.flatnonzero(least):
        if chosen and row[chosen[-1]] == row[at] and place[at] - place[chosen[-1]] <= width:
            continue
        chosen.append(int(at))
    return chosen
