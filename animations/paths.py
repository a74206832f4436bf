"""Paths of the moving points."""

import numpy as np

from animations.shapes import Complexes, FlatShape
from animations.symbols import moved_place
from elastic import Deflection
from rigid.arrays import Integers

MAX_CLOSING_GAP = 1.5  # largest gap between the ends of a closed path, relative to the longest step


def path_shapes(deflection: Deflection, positions: Integers, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw the paths of all moving points, with exaggerated displacements."""
    motion = deflection.motion
    seen, shapes = set(motion.mechanism.links[0].points), []
    for link in motion.mechanism.links[1:]:
        for name in [name for name in link.points if name not in seen]:
            seen.add(name)
            shapes += _path(moved_place(deflection, link.name, name, exaggeration)[positions])
    return shapes


def _path(places: Complexes) -> list[FlatShape]:
    strides = np.abs(np.diff(places))
    if not strides.any():
        return []
    round_trip = abs(places[-1] - places[0]) <= MAX_CLOSING_GAP * strides.max()
    points = np.append(places, places[0]) if round_trip else places
    return [FlatShape("guide", lambda position: points, lines=(np.arange(len(points)),), ink="accent", width=1.0)]
