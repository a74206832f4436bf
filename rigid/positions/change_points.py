"""Change points: where a dyad passes through its singular position and the smooth branch goes on folded the other way.

The closed forms know a dyad's branch as the sign of its sine s. Where |s| touches zero between positions that both
exist, the mechanism could fold either way; the branch on which it moves smoothly changes that sign. (A parallelogram
whose sign is kept would jump into an antiparallelogram.)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

POINTS = 65  # of a grid in which the least |s| is looked for
ZOOMS = 12  # into the least interval of that grid, at most
TOUCH = 1e-7  # |s| that counts as zero
ROUNDED = 16  # the least of POINTS values of a sharp corner is a smaller part than this of the greatest
SAME = 1e-5  # of a step between positions, within which two touches are one
SHALLOW = 0.5  # |s| above which no touch is near
CLEARLY = 1.01  # ratio of two values of |s| that are told apart

Sine = Callable[[Any], Any]


def suspects(sine: Any) -> Any:
    """Whether |s| falls or rises so steeply that it may touch zero nearby, bool, shape (..., positions - 2)."""
    size = np.abs(sine)
    before, here, after = size[..., :-2], size[..., 1:-1], size[..., 2:]
    with np.errstate(invalid="ignore"):
        # On uneven positions a zero between two of them shows only as a least value.
        least = (here * CLEARLY < before) & (here <= after * CLEARLY)
        least |= (here * CLEARLY < after) & (here <= before * CLEARLY)
        found = (2 * here < before) | (2 * here < after) | (least & (here < SHALLOW))
        for end, beside in ((0, 1), (-1, -2)) if found.size else ():
            found[..., end] |= (size[..., end] * CLEARLY < size[..., beside]) & (size[..., end] < SHALLOW)
        return found


def touches(sine_at: Sine, places: Any, row: int) -> list[float]:
    """Where |s| touches zero near some positions.

    Parameters
    ----------
    sine_at
        s at any places between the positions, counted in positions: shape (n,) to (..., n).
    places
        Suspect positions.
    row
        Which of the designs.
    """
    found: list[float] = []
    for place in places:
        found_at = touch(lambda at: sine_at(at).reshape(-1, len(at))[row], place - 1.0, place + 1.0)
        if found_at is not None and all(abs(found_at - other) > SAME for other in found):
            found.append(found_at)
    return sorted(found)


def touch(sine_at: Sine, low: float, high: float) -> float | None:
    """The place of least |s| in an interval, if it is zero there: zoomed in on until it is, or falls no further."""
    for _ in range(ZOOMS):
        grid = np.linspace(low, high, POINTS)
        size = np.abs(sine_at(grid))
        if not np.isfinite(size).all():
            return None
        best = int(size.argmin())
        if size[best] <= TOUCH:
            return float(grid[best])
        if size[best] * ROUNDED > size.max():
            return None
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, POINTS - 1)]
    return None


def flips(found: list[list[float]], places: Any, shape: tuple[int, ...]) -> Any:
    """+1 or -1 at some places: the sign after all touches before them.

    Parameters
    ----------
    found
        Touches of every design.
    places
        Counted in positions, shape (n,).
    shape
        Shape of the columns of the designs: () or (designs,).
    """
    signs = [np.where(np.searchsorted(touched, places) % 2, -1.0, 1.0) for touched in found]
    return np.array(signs).reshape(*shape, -1) if shape else signs[0]
