"""Lines of the links in a picture, and leader lines from the names of links to these lines."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec.structs import replace

from animations.layers import Stack
from animations.layout import Scales, View
from animations.placing import Label
from animations.shapes import Complexes, carried, moved_beams
from animations.style import Style
from animations.symbols import symbol_shapes
from elastic import Deflection
from rigid import Reals
from rigid.arrays import Flags
from symbols import hull, marks_of

EDGES_OF_BEAM = 4  # number of straight lines that approximate a bent beam
FEET = np.array([0.1, 0.3, 0.5, 0.7, 0.9])  # stations of a straight line, from 0 to 1, at which a leader line may end
# A name needs no leader line if its distance from its link is at most `MAX_DISTANCE`, and its distance from each other
# link is larger by at least `MIN_DIFFERENCE`.
MAX_DISTANCE, MIN_DIFFERENCE = 1.2, 0.3  # [letter heights]


def link_edges(
    deflection: Deflection, scales: Scales, view: View, style: Style, moved: float, stack: Stack | None
) -> dict[int, Complexes]:
    """Return the straight lines that draw the beams, plates and symbols of each moving link [pixels], by link index.

    The arrays are complex and have the shape (positions, lines, 2). The parameters are those of `labels.name_labels`.
    """
    motion, mechanism = deflection.motion, deflection.motion.mechanism
    positions, axes = range(motion.columns[-1]), moved_beams(deflection, moved)
    bent = np.array([axes(position) for position in positions])
    shown = [mark for mark in marks_of(motion, style.marks) if mark.shows]
    edges = {}
    for at, link in enumerate(mechanism.links[1:], 1):
        lines = [
            bent[:, k, :: (bent.shape[-1] - 1) // EDGES_OF_BEAM]
            for k, (of, _) in enumerate(mechanism.beams)
            if of == at
        ]
        if not lines and len(link.points) > 1:
            corners = hull(np.array(list(link.points.values()), complex))
            place = carried(deflection, at, np.append(corners, corners[0]), moved)
            lines = [np.array([place(position) for position in positions])]
        for shape in symbol_shapes(
            deflection, [mark for mark in shown if mark.shows == link.name], scales.symbol, moved
        ):
            spots = np.array([shape.place(position) for position in positions])
            lines += [spots[:, line] for line in shape.lines]
        aside = view.aside(stack.middle[at]) if stack else 0.0
        pairs = [np.stack([line[:, :-1], line[:, 1:]], axis=-1) for line in lines]
        if pairs:
            edges[at] = view.flat(np.concatenate(pairs, axis=1) + aside)
    return edges


def longest(edges: Complexes, stations: Reals) -> Complexes:
    """Return points on the longest line of a link, shape (positions, stations)."""
    ends = edges[:, np.abs(np.diff(edges[0])).argmax()]
    points: Complexes = ends[:, :1] + np.diff(ends) * stations
    return points


def is_clear(there: Complexes, half: complex, height: float, edges: Mapping[int, Complexes], at: int) -> Flags:
    """Return whether each text needs no leader line to its link, shape (texts, positions).

    Parameters
    ----------
    there
        Centres of the texts [pixels], complex, shape (texts, positions).
    half, height
        Half size of the texts and letter height [pixels].
    edges, at
        Lines of all links (see `link_edges`), and the index of the link that the texts name.
    """
    if at not in edges:
        return np.ones(there.shape, bool)
    points = _points(edges[at])
    others = [_points(lines) for other, lines in edges.items() if other != at]
    away = _nearest(there, half, points)
    farther = _nearest(there, half, np.concatenate(others, axis=1)) if others else np.inf
    clear: Flags = (away <= MAX_DISTANCE * height) & (farther >= away + MIN_DIFFERENCE * height)
    return clear


def with_leader(label: Label, edges: Mapping[int, Complexes], at: int) -> Label:
    """Return the label with a leader line to its link at positions at which `is_clear` is False."""
    clear = is_clear(label.middle[None], label.half, label.height, edges, at)[0]
    if clear.all():
        return label
    points = _points(edges[at])
    others = [_points(lines) for other, lines in edges.items() if other != at]
    free = _apart(points, others, MIN_DIFFERENCE * label.height)
    away = np.where(free, 0.0, np.inf) + _distance(points - label.middle[:, None], label.half)
    foot = points[np.arange(len(points)), away.argmin(axis=1)]
    return replace(label, foot=np.where(clear, np.nan, foot))


def _points(edges: Complexes) -> Complexes:
    """Return the possible feet of leader lines on lines, shape (positions, points)."""
    points: Complexes = edges[..., :1] + np.diff(edges) * FEET
    return points.reshape(len(edges), -1)


def _apart(points: Complexes, others: Sequence[Complexes], least: float) -> Flags:
    """Return which points of a link are farther than `least` from all points of the other links.

    At a position at which no point is, all points count.
    """
    free = np.ones(points.shape, bool)
    for each in others:
        free &= (np.abs(points[..., None] - each[:, None, :]) > least).all(axis=-1)
    return free | ~free.any(axis=1, keepdims=True)


def _nearest(there: Complexes, half: complex, points: Complexes) -> Reals:
    """Return the distance of each text from the nearest of the points [pixels], shape (texts, positions)."""
    return np.array([_distance(points - middle[:, None], half).min(axis=1) for middle in there])


def _distance(way: Complexes, half: complex) -> Reals:
    """Return the distance of points from a box. `way` is their offset from its centre, `half` half its size."""
    return np.hypot(np.maximum(np.abs(way.real) - half.real, 0.0), np.maximum(np.abs(way.imag) - half.imag, 0.0))
