"""Placement of names on matplotlib axes, so that names cover no links or other names and few thin lines."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

LINK_ZORDER = 3  # zorder of the lines that represent links; all other lines and patches count as thin lines
SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 7, 5, 0, 4, 6, 2]))  # tried directions from a point, the best first
AROUND, ALONGSIDE = (0.9, 1.8, 2.7, 4.0), (0.4, 1.3, 2.4)  # tried distances from a point or line / symbol size
SHARES = (0.5, 0.35, 0.65, 0.2, 0.8)  # tried positions of a name along its line / length of the line
# costs of each crossed thin line, of a leader line, and of each covered link or name
# each hidden pixel of a thin line costs 1
CROSSING, ASTRAY, COVER = 10.0, 100.0, 1e4
LEADER = 1.0  # the name of a line gets a leader line if (length of the leader line / symbol size) is larger
MIN_NEARER = 4.0  # [pixels] see `_astray`
LEADER_GAP = 1.5  # [pixels] gap between a name and its leader line
SAME_PLACE = 1.0  # [pixels] points that are closer together count as one place
LINK_HALF, THIN_HALF = 3.0, 1.0  # [pixels] a name covers a link, or crosses a thin line, if it is nearer


class PlacedName(Struct, frozen=True, eq=False):
    """A text that names a line or a point.

    Attributes
    ----------
    line
        Points of the line as complex numbers [m]; a single point if the text names a point.
    always
        Whether the text is drawn even if it covers a link or another name.
    """

    text: Text
    line: Any
    always: bool

    def middles(self, to_pixels: Any, unit: float, half: complex) -> Any:
        """Return candidate positions for the centre of the text, as complex numbers [pixels], the best first."""
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
    """Move names to their best positions, and draw leader lines.

    Names of points are placed first. Names of lines that would cover a link or another name are removed.

    Parameters
    ----------
    unit
        Size of the symbols [m].
    behind
        Ends of additional thin lines as complex numbers [m], shape (lines, 2).
    """

    def to_pixels(places: Any) -> Any:
        x, y = axes.transData.transform(np.stack([places.real, places.imag], -1).reshape(-1, 2)).T
        return (x + 1j * y).reshape(places.shape)

    pixels = abs(np.diff(to_pixels(np.array([0j, unit + 0j]))))[0]
    named = sorted(names, key=lambda name: not name.always)
    own = {id(name.text) for name in named}
    taken = [_box(text) for text in axes.texts if id(text) not in own]
    links, thin = (to_pixels(lines) for lines in _lines(axes, behind))
    lines: list[tuple[Any, int, float]] = []  # leader lines: named line, index in `taken`, minimum length [pixels]
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
    """Return, for each candidate position of the name of a point, whether the name seems to belong to another point.

    This is true if (distance to another point) < (distance to the named point) + `MIN_NEARER`.

    `middles` are the candidate centres of the name, and `half` is half its size. `point` is the named point, and
    `points` are all points with names. Other points at the place of `point` are ignored. All lengths are in pixels.
    """
    others = points[abs(points - point) > SAME_PLACE]
    own, *away = (_away(middles, half, each) for each in (point, *others))
    return np.any([each < own + MIN_NEARER for each in away] or [np.zeros(len(middles), bool)], axis=0)


def _away(middles: Any, half: complex, point: complex) -> Any:
    """Return the distance of a point from each box. `middles` are the centres, and `half` is half the size of a box."""
    way = middles - point
    return np.hypot(np.maximum(abs(way.real) - half.real, 0.0), np.maximum(abs(way.imag) - half.imag, 0.0))


def _draw_leader(axes: Axes, line: Any, box: tuple[complex, complex], others: Any, least: float) -> None:
    """Draw a leader line from a name to the named line or point if the leader line is longer than `least`.

    `box` contains the centre and half the size of the name. `others` are the boxes of other names. A leader line that
    would cross another name is not drawn. All lengths are in pixels.
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
    """Return the centre and half the size of a text [pixels]."""
    box = text.get_window_extent()
    return complex(box.x0 + box.x1, box.y0 + box.y1) / 2, complex(box.width, box.height) / 2


def _lines(axes: Axes, behind: Any) -> tuple[Any, Any]:
    """Return two arrays with the ends of line segments, as complex numbers [m], shape (segments, 2).

    The first array contains the lines of links. The second array contains all other lines, including `behind`.
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
    """Return the length of each line inside each box [pixels], shape (lines, boxes).

    `middles` are the centres of the boxes, and `half` is half the size of a box.
    """
    start, course = lines[:, 0, None] - middles, (lines[:, 1] - lines[:, 0])[:, None]
    first, last = np.zeros(start.shape), np.ones(start.shape)
    for at, step, room in ((start.real, course.real, half.real), (start.imag, course.imag, half.imag)):
        along = np.where(step == 0, 1e-9, step)
        one, other = (-room - at) / along, (room - at) / along
        first, last = np.maximum(first, np.minimum(one, other)), np.minimum(last, np.maximum(one, other))
    return np.maximum(last - first, 0.0) * abs(course)
