"""Symbols and paths of points as flat shapes at displaced positions."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from animations.shapes import Complexes, FlatShape, carried
from elastic import Deflection, displacement_of
from rigid import position_of
from rigid.arrays import Integers
from symbols import NONE, SHADE, Anchor, Mark


def symbol_shapes(
    deflection: Deflection, marks: Iterable[Mark], size: float, exaggeration: float = 0.0
) -> list[FlatShape]:
    """Draw marks. The arrow of a drive at rest or of a load without force is reduced to a point.

    Parameters
    ----------
    size
        Size of the symbols [m].
    exaggeration
        Exaggeration factor of the displacements of the symbols.
    """
    return [_shape(deflection, mark, size, exaggeration) for mark in marks]


def moved_place(deflection: Deflection, link: str | int, point: str, exaggeration: float) -> Complexes:
    """Return the positions of a point of a link with exaggerated displacement."""
    place: Complexes = position_of(deflection.motion, link, point)
    if exaggeration:
        place = place + exaggeration * displacement_of(deflection, link, point)
    return place


def _moved_anchor(deflection: Deflection, anchor: Anchor, exaggeration: float) -> Any:
    """Return the positions of an anchor, shape (positions,)."""
    if anchor.point:
        return moved_place(deflection, anchor.link, anchor.point, exaggeration)
    at = deflection.motion.mechanism.index[anchor.link]
    place = carried(deflection, at, np.array([anchor.local]), exaggeration)
    return np.array([place(position)[0] for position in range(len(deflection.motion.time))])


def _shape(deflection: Deflection, mark: Mark, size: float, exaggeration: float) -> FlatShape:
    motion = deflection.motion
    place = _moved_anchor(deflection, mark.at, exaggeration)
    x_axis = np.broadcast_to(mark.direction(motion), motion.columns)
    end = None if mark.to is None else _moved_anchor(deflection, mark.to, exaggeration)
    sense = np.ones(motion.columns) if mark.drive is None else np.sign(np.nan_to_num(motion.drive_rate[mark.drive]))

    def points(position: int) -> Complexes:
        last = None if end is None else end[position]
        found = mark.placed(place[position], x_axis[position], size, last, sense[position] < 0.0)
        return found if sense[position] else np.full_like(found, place[position])

    cells = [(cell, line.closed) for cell, line in zip(mark.cells, mark.outlines, strict=True)]
    faces = [cell for cell, closed in cells if closed and mark.polygon_fill != NONE]
    lines = [np.append(cell, cell[0]) if closed else cell for cell, closed in cells]
    opacity = 0.4 if mark.fill == SHADE else 1.0
    return FlatShape(mark.level, points, tuple(faces), tuple(lines) if mark.stroke != NONE else (), mark.fill,
                     mark.stroke, mark.width, opacity)  # fmt: skip


MAX_CLOSING_GAP = 1.5  # a path is closed if the gap between its ends is at most this; relative to the longest step


def path_shapes(deflection: Deflection, positions: Integers, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw the paths of all moving points with exaggerated displacements."""
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
