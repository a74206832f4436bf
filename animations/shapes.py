"""Flat shapes as moving points and fixed cells, independent of the graphics library.

Each shape computes the coordinates of its points in the plane of motion at a position [m].
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from animations.diagrams import STATIONS, displacements
from elastic import Deflection, sample
from rigid import Link, Reals, position_of
from rigid.kinetostatics import beam_directions
from symbols import hull

Complexes = NDArray[np.complexfloating[Any, Any]]
Cells = tuple[Any, ...]  # arrays of point indices, one per polygon or polyline

INK, QUIET, BODY, FINE, BENT = "ink", "quiet", "body", "fine", "bent"  # keys of `paints`
POSITIVE, NEGATIVE, PAPER = "positive", "negative", "paper"
FILL_OPACITY = 0.55  # opacity of diagrams; overlapping diagrams mix their colours
HATCH = 4  # every HATCH-th ordinate of a diagram is drawn
# drawing order of flat shapes: shapes of later levels cover shapes of earlier levels
LEVELS = ("outline", "guide", "fill", "ordinate", "link", "curve", "ground", "block", "pin", "mark")


class FlatShape(Struct, frozen=True, eq=False):
    """Points with polygons and polylines between them.

    Attributes
    ----------
    level
        Place in the drawing order, one of `LEVELS`.
    place
        Function that returns the points at a position [m], complex, shape (points,).
    faces, lines
        Point indices of filled polygons and of polylines.
    fill, ink
        Colour names, see `paints`.
    width
        Line width [pixels] in a picture with a `Style.unit` of 720.
    opacity
        Opacity of the fill.
    """

    level: str
    place: Callable[[int], Complexes]
    faces: Cells = ()
    lines: Cells = ()
    fill: str = BODY
    ink: str = INK
    width: float = 1.5
    opacity: float = 1.0


class BeamPlaces(Struct, frozen=True, eq=False):
    """Starts [m] and unit vectors of the undeformed beams, complex, shape (beams, positions), and their lengths [m]."""

    start: Complexes
    along: Complexes
    length: Reals

    def points(self, position: int, stations: Reals = STATIONS) -> Complexes:
        """Return points on the axes at a position [m], shape (beams, stations)."""
        way = self.along[:, position] * self.length
        return self.start[:, position, None] + way[:, None] * stations


def beams(deflection: Deflection) -> BeamPlaces:
    """Return the undeformed positions of all beams."""
    motion = deflection.motion
    start = [position_of(motion, at, beam.start) for at, beam in motion.mechanism.beams]
    shape = (len(start), *motion.columns)
    return BeamPlaces(np.reshape(start, shape) + 0j, beam_directions(motion), deflection.length.reshape(len(start)))


def diagram_shapes(deflection: Deflection, field: str, scale: float) -> list[FlatShape]:
    """Draw a field across each beam, with an outline, ordinates, and a fill for each sign.

    Parameters
    ----------
    scale
        Length of an ordinate per unit of the field [m]. Positive ordinates point along y' of the beam.

    Returns
    -------
    Positive fill, negative fill, ordinates, and outline. The points of each shape are the points on the axes of all
    beams, followed by the ends of all ordinates.
    """
    place, values = beams(deflection), sample(deflection, field, STATIONS)
    values = np.where(np.isfinite(values).any(axis=(1, 2), keepdims=True), values, 0.0)  # zero if unknown
    count = len(place.length)

    def ends(position: int, part: Callable[[Reals], Reals]) -> Complexes:
        axis = place.points(position)
        heights = part(values[:, position])
        tips = axis + 1j * scale * place.along[:, position, None] * heights
        return np.concatenate([axis.ravel(), tips.ravel()])

    def filled(paint: str, place: Callable[[int], Complexes]) -> FlatShape:
        return FlatShape("fill", place, tuple(corners), fill=paint, opacity=FILL_OPACITY)

    numbers = np.arange(count * len(STATIONS)).reshape(count, len(STATIONS))
    tops = numbers + numbers.size
    corners = np.stack([numbers[:, :-1], numbers[:, 1:], tops[:, 1:], tops[:, :-1]], -1).reshape(-1, 4)
    outlines = [np.concatenate([numbers[k, :1], tops[k], numbers[k, -1:]]) for k in range(count)]
    strokes = [
        np.array(pair) for pair in zip(numbers[:, HATCH:-1:HATCH].flat, tops[:, HATCH:-1:HATCH].flat, strict=True)
    ]
    return [
        filled(POSITIVE, lambda position: ends(position, lambda v: np.maximum(v, 0.0))),
        filled(NEGATIVE, lambda position: ends(position, lambda v: np.minimum(v, 0.0))),
        FlatShape("ordinate", lambda position: ends(position, lambda v: v), lines=tuple(strokes), ink=FINE, width=0.8),
        FlatShape("ordinate", lambda position: ends(position, lambda v: v), lines=tuple(outlines), width=1.3),
    ]


def moved_beams(deflection: Deflection, exaggeration: float) -> Callable[[int], Complexes]:
    """Return a function from a position to the axes of the beams with exaggerated displacements.

    The axes are complex [m] and have the shape (beams, stations).
    """
    place = beams(deflection)
    moved = displacements(deflection)
    return lambda position: place.points(position) + exaggeration * place.along[:, position, None] * moved[:, position]


def deformed_shapes(deflection: Deflection, exaggeration: float) -> list[FlatShape]:
    """Draw the deformed mechanism with exaggerated displacements; links without beams move rigidly."""
    axes, count = moved_beams(deflection, exaggeration), len(deflection.sections)
    lines = tuple(np.arange(count * len(STATIONS)).reshape(count, len(STATIONS)))
    shapes = [FlatShape("curve", lambda position: axes(position).ravel(), lines=lines, ink=BENT, width=3.0)]
    for at, link in _moving_links(deflection):
        if not link.beams and len(link.points) > 1:
            corners = hull(np.array(list(link.points.values()), complex))
            shapes.append(
                _closed("curve", carried(deflection, at, corners, exaggeration), len(corners), BENT, 3.0, filled=False)
            )
    return shapes


def link_shapes(deflection: Deflection, radius: float, ink: str = INK) -> list[FlatShape]:
    """Draw the undeformed links.

    Elastic beams are lines. Rigid beams, and links without beams, are outlines with corners of radius `radius` [m].
    """
    place, mechanism = beams(deflection), deflection.motion.mechanism
    rigid = [bool(np.all(np.isinf(section.EA)) and np.all(np.isinf(section.EI))) for section in deflection.sections]
    slender = [k for k, stiff in enumerate(rigid) if not stiff]
    ends = np.array([0.0, 1.0])
    pairs = tuple(np.arange(2 * len(slender)).reshape(-1, 2))
    shapes = [FlatShape("link", lambda p: place.points(p, ends)[slender].ravel(), lines=pairs, ink=ink, width=3.0)]
    stiff_beams = [
        (at, (beam.start, beam.end)) for (at, beam), stiff in zip(mechanism.beams, rigid, strict=True) if stiff
    ]
    whole = [
        (at, tuple(link.points)) for at, link in _moving_links(deflection) if not link.beams and len(link.points) > 1
    ]
    for at, names in stiff_beams + whole:
        points = np.array([mechanism.links[at].points[name] for name in names], complex)
        corners = hull((points[:, None] + radius * _circle(24)).ravel())
        shapes.append(_closed("outline", carried(deflection, at, corners, 0.0), len(corners), ink, 1.5))
    return shapes


def outline_shapes(deflection: Deflection, outlines: Mapping[str, Sequence[complex]]) -> list[FlatShape]:
    """Draw the outlines of links, given by their corners in link axes [m].

    Raises
    ------
    ValueError
        If an outline belongs to an unknown link or has fewer than three corners.
    """
    shapes = []
    for name, corners in outlines.items():
        if name not in deflection.motion.mechanism.index:
            raise ValueError(f'there is no link "{name}" to outline')
        if len(corners) < 3:
            raise ValueError(f'the outline of link "{name}" has {len(corners)} corners: it needs at least three')
        at = deflection.motion.mechanism.index[name]
        place = carried(deflection, at, np.array(corners, complex), 0.0)
        shapes.append(_closed("outline", place, len(corners), QUIET, 1.0))
    return shapes


def _moving_links(deflection: Deflection) -> Iterable[tuple[int, Link]]:
    return list(enumerate(deflection.motion.mechanism.links))[1:]


def carried(deflection: Deflection, at: int, local: Complexes, exaggeration: float) -> Callable[[int], Complexes]:
    """Return a function that moves points with a link, including the exaggerated displacement of the link."""
    motion = deflection.motion

    def place(position: int) -> Complexes:
        arms = motion.direction[at, position] * local
        points: Complexes = motion.origin[at, position] + arms
        if exaggeration:
            points = points + exaggeration * (
                deflection.shift[at, position] + 1j * deflection.angle[at, position] * arms
            )
        return points

    return place


def _closed(
    level: str, place: Callable[[int], Complexes], count: int, ink: str, width: float, filled: bool = True
) -> FlatShape:
    ring = np.arange(count)
    return FlatShape(level, place, (ring,) if filled else (), (np.append(ring, 0),), ink=ink, width=width)


def _circle(corners: int) -> Complexes:
    return np.exp(2j * np.pi * np.arange(corners) / corners)
