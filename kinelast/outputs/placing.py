"""Placement of names on matplotlib axes.

Names do not cover links or other names if possible, and cover few thin lines. For each name, candidate positions are
tried, and the position with the lowest cost is chosen.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

LINK_ZORDER = 3  # lines with this zorder represent links; all other lines and patches count as thin lines
SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 7, 5, 0, 4, 6, 2]))  # candidate directions from a point to its name
# AROUND for the names of points, ALONGSIDE for the names of lines
AROUND, ALONGSIDE = (0.9, 1.8, 2.7, 4.0), (0.4, 1.3, 2.4)  # candidate distances of names / symbol size
SHARES = (0.5, 0.35, 0.65, 0.2, 0.8)  # candidate (position of a name along its line) / length of the line
# Costs: CROSSING for each thin line that the name covers in part, plus 1 for each covered pixel of the thin line;
# ASTRAY if the name seems to belong to another point; COVER for each link or name that the name covers.
CROSSING, ASTRAY, COVER = 10.0, 100.0, 1e4
LEADER = 1.0  # the name of a line gets a leader line if length of the leader line / symbol size > LEADER
MIN_NEARER = 4.0  # [pixels] the name of a point must be nearer to this point than to any other point, by this distance
LEADER_GAP = 1.5  # [pixels] gap between a leader line and its name
SAME_PLACE = 1.0  # [pixels] two points count as one place if their distance is at most this
LINK_HALF, THIN_HALF = 3.0, 1.0  # [pixels] smallest allowed distance of a name from a link, and from a thin line


class PlacedName(Struct, frozen=True, eq=False):
    """Name of a line or a point in a picture.

    Attributes
    ----------
    line
        Points of the named line, or only the named point, as complex numbers [m].
    always
        Whether the name is drawn even if it covers a link or another name. True for points.
    """

    text: Text
    line: Any
    always: bool

    def middles(self, to_pixels: Any, unit: float, half: complex) -> Any:
        """Return candidate positions of the centre of the name as complex numbers [pixels], the best position first.

        `half` is half the size of the name [pixels], and `unit` is the size of the symbols [pixels].
        """
        line = to_pixels(np.asarray(self.line))
        if len(line) == 1:
            corners = SIDES / np.maximum(abs(SIDES.real), abs(SIDES.imag))
            reach = corners.real * half.real + 1j * corners.imag * half.imag
            return line[0] + np.concatenate([reach + SIDES * away * unit for away in AROUND])
        across = 1j * (line[-1] - line[0]) / abs(line[-1] - line[0]) * (1 if line[-1].real >= line[0].real else -1)
        clear = abs(across.real) * half.real + abs(across.imag) * half.imag
        at = np.interp(SHARES, np.linspace(0.0, 1.0, len(line)), line)
        ways = [[side * across * (clear + away * unit) for side in (1, -1)] for away in ALONGSIDE]
        return np.concatenate([(at[:, None] + np.array(sides)).ravel() for sides in ways])


def place_names(axes: Axes, names: Iterable[PlacedName], unit: float, behind: Any) -> None:
    """Move each name to the candidate position with the lowest cost, and draw leader lines.

    Names of points are placed before names of lines. If the name of a line would cover a link or another name at all
    candidate positions, the name is removed.

    Parameters
    ----------
    unit
        Size of the symbols [m].
    behind
        Both ends of thin lines that the axes do not contain, as complex numbers [m], shape (lines, 2).
    """

    def to_pixels(places: Any) -> Any:
        x, y = axes.transData.transform(np.stack([places.real, places.imag], -1).reshape(-1, 2)).T
        return (x + 1j * y).reshape(places.shape)

    pixels = abs(np.diff(to_pixels(np.array([0j, unit + 0j]))))[0]
    named = sorted(names, key=lambda name: not name.always)
    own = {id(name.text) for name in named}
    taken = [_box(text) for text in axes.texts if id(text) not in own]
    links, thin = (to_pixels(lines) for lines in _lines(axes, behind))
    # leader lines: named line, index of the name in `taken`, minimum length of the leader line [pixels]
    lines: list[tuple[Any, int, float]] = []
    points = np.array([to_pixels(np.asarray(name.line))[0] for name in named if name.always], complex)
    for name in named:
        half = _box(name.text)[1]
        middles = name.middles(to_pixels, pixels, half)
        cost = COVER * (_hidden(links, middles, half + LINK_HALF * (1 + 1j)) > 0).sum(axis=0)
        length = _hidden(thin, middles, half + THIN_HALF * (1 + 1j))
        cost = cost + (CROSSING * (length > 0) + length).sum(axis=0)
        for middle, other in taken:
            way, room = middles - middle, half + other
            cost = cost + COVER * ((abs(way.real) < room.real) & (abs(way.imag) < room.imag))
        astray = _astray(middles, half, to_pixels(np.asarray(name.line))[0], points) & name.always
        cost = cost + ASTRAY * astray
        best = int(cost.argmin())
        if cost[best] >= COVER and not name.always:
            name.text.remove()
            continue
        taken.append((middles[best], half))
        x, y = axes.transData.inverted().transform((middles[best].real, middles[best].imag))
        name.text.set_position((x, y))
        if astray[best] or not name.always:
            least = 0.0 if name.always else LEADER * pixels
            lines.append((to_pixels(np.asarray(name.line)), len(taken) - 1, least))
    for line, number, least in lines:
        _draw_leader(axes, line, taken[number], [*taken[:number], *taken[number + 1 :]] if least else [], least)


def _astray(middles: Any, half: complex, point: complex, points: Any) -> Any:
    """Return for each candidate position whether the name of a point seems to belong to another point.

    A name seems to belong to another point if (distance of the name from the other point) < (distance of the name from
    the named point) + `MIN_NEARER`.

    `middles` are the candidate positions of the centre of the name, and `half` is half the size of the name. `point` is
    the named point, and `points` are all points with names. Points that coincide with `point` are ignored. All lengths
    are in pixels.
    """
    others = points[abs(points - point) > SAME_PLACE]
    own, *away = (_away(middles, half, each) for each in (point, *others))
    return np.any([each < own + MIN_NEARER for each in away] or [np.zeros(len(middles), bool)], axis=0)


def _away(middles: Any, half: complex, point: complex) -> Any:
    """Return the distance of a point from each box. All boxes have the same size.

    `middles` are the centres of the boxes, and `half` is half the size of a box.
    """
    way = middles - point
    return np.hypot(np.maximum(abs(way.real) - half.real, 0.0), np.maximum(abs(way.imag) - half.imag, 0.0))


def _draw_leader(axes: Axes, line: Any, box: tuple[complex, complex], others: Any, least: float) -> None:
    """Draw a leader line from a name to the named line or point.

    The leader line is not drawn if it would be shorter than `least` or would cross another name. `line` contains the
    points of the named line, or only the named point. `box` contains the centre of the name and half the size of the
    name. `others` are the boxes of other names. All lengths are in pixels.
    """
    middle, half = box
    feet = np.interp(np.linspace(0.1, 0.9, 9), np.linspace(0.0, 1.0, len(line)), line) if len(line) > 1 else line
    way, room = feet - middle, half + LEADER_GAP * (1 + 1j)
    edges = np.clip(way.real, -room.real, room.real) + 1j * np.clip(way.imag, -room.imag, room.imag)
    length, ends = np.abs(way - edges), middle + np.stack([way, edges], axis=-1)
    crossed = sum(
        (_hidden(ends, np.array([other]), size)[:, 0] > 0 for other, size in others), np.zeros(len(feet), bool)
    )
    best = int(np.where(crossed, np.inf, length).argmin())
    if length.min() > least and not crossed[best]:
        places = axes.transData.inverted().transform(np.stack([ends[best].real, ends[best].imag], axis=-1))
        axes.plot(*places.T, color="#7c8894", linewidth=0.6, zorder=LINK_ZORDER - 1)


def _box(text: Text) -> tuple[complex, complex]:
    """Return the centre of a text, and half the size of the text, as complex numbers [pixels]."""
    box = text.get_window_extent()
    return complex(box.x0 + box.x1, box.y0 + box.y1) / 2, complex(box.width, box.height) / 2


def _lines(axes: Axes, behind: Any) -> tuple[Any, Any]:
    """Return the ends of all line segments on the axes as two arrays of complex numbers [m], shape (segments, 2).

    The first array contains the lines of links. The second array contains all other lines, and the lines `behind`.
    """
    links: list[Any] = []
    thin: list[Any] = [*behind]
    for line in axes.lines:
        places = np.asarray(line.get_xydata()) @ (1, 1j)
        (links if line.get_zorder() == LINK_ZORDER else thin).extend(pairwise(places))
    for patch in axes.patches:
        thin += pairwise(np.asarray(patch.get_path().vertices) @ (1, 1j))
    both = (np.array(parts, complex).reshape(-1, 2) for parts in (links, thin))
    first, second = (parts[np.isfinite(parts).all(axis=1)] for parts in both)
    return first, second


def _hidden(lines: Any, middles: Any, half: complex) -> Any:
    """Return the length of the part of each line that is inside each box [pixels], shape (lines, boxes).

    `middles` are the centres of the boxes, and `half` is half the size of a box.
    """
    start, course = lines[:, 0, None] - middles, (lines[:, 1] - lines[:, 0])[:, None]
    first, last = np.zeros(start.shape), np.ones(start.shape)
    for at, step, room in ((start.real, course.real, half.real), (start.imag, course.imag, half.imag)):
        along = np.where(step == 0, 1e-9, step)
        one, other = (-room - at) / along, (room - at) / along
        first, last = np.maximum(first, np.minimum(one, other)), np.minimum(last, np.maximum(one, other))
    return np.maximum(last - first, 0.0) * abs(course)
