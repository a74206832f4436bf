"""Table of knots. A knot is a point on the path of the drives at which the posture is computed.

Knots are sorted by design, and the knots of a design by the path parameter.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid.arrays import Flags, Integers, Reals

# at a change point (two branches meet), the sine must be smaller than at this number of knots on each side
SIDE_KNOTS = 3

Table = dict[str, Any]
"""Arrays by name. The first axis of each array runs over the knots.

place
    Path parameter s.
row
    Index of the design.
coarse
    True if the knot belongs to the regular grid, which is the same for all designs.
origin, direction
    Origin [m] and unit vector of each link (complex), each of shape (knots, links).
driver_angles
    Coordinate of each undriven joint that drives a gear, shape (knots, gears).
sine
    Sine of each group, shape (knots, groups): 0 at a singular position, nan if the group does not close.
sign
    -1 for a dyad in the assembly opposite to the drawing, otherwise +1, shape (knots, groups).
free0, free1, ...
    Coordinates of the free joints of each group, shape (knots, free).
columns0, duals0, ...
    `columns` and `Closure.duals` of each group, each of shape (knots, free, cuts).
box0, box1, ...
    For each group, bounds on the deviation of the free coordinates from linear motion in the step to the next knot,
    shape (knots, free); nan if the step is uncertain.
certain0, certain1, ...
    For each group, whether it is proved that exactly one branch runs through the step to the next knot, shape (knots,).
"""


def knots(places: Any, rows: int, links: int, groups: int, gears: int) -> Table:
    """Create a table with knots at `places` for each of `rows` designs. No positions of links are computed yet."""
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
    """Merge tables, and sort the knots by design and path parameter."""
    joined = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    return select(joined, np.lexsort((joined["place"], joined["row"])))


def steps(table: Mapping[str, Any]) -> Integers:
    """Return the index of the knot at which each step begins.

    A step leads from a knot to the next knot of the same design.
    """
    return np.flatnonzero(table["row"][1:] == table["row"][:-1])


def knots_before(table: Mapping[str, Any], places: Any, rows: int) -> Integers:
    """Return for each point the index of the knot at which the step that contains it begins, shape (rows, places).

    For points outside the tracked range, use the first or last step.
    """
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
    """Return the indices of the knots closest to points at which the sine of a dyad touches zero.

    At such a point the magnitude of the sine has a sharp minimum. If the sine only comes close to zero, its magnitude
    hardly changes over a few finest steps, and the point is not included.

    Parameters
    ----------
    place, row
        Path parameter and design index of the knots.
    sine
        Sine of a dyad at the knots.
    uncertain
        Whether the step from each knot to the next is uncertain (not certified) and has the finest length.
    width
        Smallest distance between two such points of a design. If two points are closer, only the first is included.
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
