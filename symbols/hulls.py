"""Convex outlines of links without beams."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from rigid.arrays import Complexes


def hull(points: Iterable[Any], flat: float = 0.0) -> Complexes:
    """Return the corners of the convex hull in counter-clockwise order, or both ends if the points are collinear.

    Uses the monotone chain algorithm.

    Parameters
    ----------
    flat
        Drop corners whose area is below this fraction of the squared extent.
    """
    ordered = sorted({complex(point) for point in points}, key=lambda place: (place.real, place.imag))
    if len(ordered) < 3:
        return np.array(ordered)
    corners: list[complex] = []
    least = flat * abs(ordered[-1] - ordered[0]) ** 2
    for places in (ordered, ordered[::-1]):
        chain: list[complex] = []
        for place in places:
            while len(chain) > 1 and ((chain[-1] - chain[-2]).conjugate() * (place - chain[-1])).imag <= least:
                chain.pop()
            chain.append(place)
        corners += chain[:-1]
    return np.array(corners)
