"""Placement of names on matplotlib axes. Names do not cover links or other names, and rarely cross thin lines."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

LINK_ZORDER = 3  # zorder of the lines of links; all other lines and patches count as thin
SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 7, 5, 0, 4, 6, 2]))
AROUND, ALONGSIDE = (0.9, 1.8, 2.7, 4.0), (0.4, 1.3, 2.4)  # distances from a point or a line / unit of the symbols
SHARES = (0.5, 0.35, 0.65, 0.2, 0.8)  # positions of a name along its line / length of the line
CROSSING, COVER = 10.0, 1e4  # costs of crossing a thin line and of covering a link or name [pixels of a hidden line]
LINK_HALF, THIN_HALF = 3.0, 1.0  # [pixels] smallest distances between a name and the line of a link, or a thin line


@dataclass(frozen=True, eq=False)
class PlacedName:
    """A text with the line or the point that it names.

    Attributes
    ----------
    line
        Positions along the line [m], complex; a single one for a point.
    always
        Whether the text is drawn even if it covers a link or another name.
    """

    text: Text
    line: Any
    always: bool

    def middles(self, to_pixels: Any, unit: float, half: complex) -> Any:
        """Return candidates for the centre of the text [pixels], complex, the best first."""
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
    """Move names to their best positions, points before lines, and remove names that would cover others.

    Parameters
    ----------
    unit
        Size of the symbols [m].
    behind
        Ends of additional thin lines [m], complex, shape (lines, 2).
    """

    def to_pixels(places: Any) -> Any:
        x, y = axes.transData.transform(np.stack([places.real, places.imag], -1).reshape(-1, 2)).T
        return (x + 1j * y).reshape(places.shape)

    pixels = abs(np.diff(to_pixels(np.array([0j, unit + 0j]))))[0]
    named = sorted(names, key=lambda name: not name.always)
    own = {id(name.text) for name in named}
    taken = [_box(text) for text in axes.texts if id(text) not in own]
    links, thin = (to_pixels(lines) for lines in _lines(axes, behind))
    for name in named:
        half = _box(name.text)[1]
        middles = name.middles(to_pixels, pixels, half)
        cost = COVER * (_hidden(links, middles, half + LINK_HALF * (1 + 1j)) > 0).sum(axis=0)
        length = _hidden(thin, middles, half + THIN_HALF * (1 + 1j))
        cost = cost + (CROSSING * (length > 0) + length).sum(axis=0)
        for middle, other in taken:
            way, room = middles - middle, half + other
            cost = cost + COVER * ((abs(way.real) < room.real) & (abs(way.imag) < room.imag))
        best = int(cost.argmin())
        if cost[best] >= COVER and not name.always:
            name.text.remove()
            continue
        taken.append((middles[best], half))
        x, y = axes.transData.inverted().transform((middles[best].real, middles[best].imag))
        name.text.set_position((x, y))


def _box(text: Text) -> tuple[complex, complex]:
    """Return the centre and half the size of a text [pixels]."""
    box = text.get_window_extent()
    return complex(box.x0 + box.x1, box.y0 + box.y1) / 2, complex(box.width, box.height) / 2


def _lines(axes: Axes, behind: Any) -> tuple[Any, Any]:
    """Return the ends of the segments of links and of all other lines [m], complex, shape (segments, 2)."""
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
    """Return the lengths of lines inside boxes, given by centres and half a size [pixels], shape (lines, boxes)."""
    start, course = lines[:, 0, None] - middles, (lines[:, 1] - lines[:, 0])[:, None]
    first, last = np.zeros(start.shape), np.ones(start.shape)
    for at, step, room in ((start.real, course.real, half.real), (start.imag, course.imag, half.imag)):
        along = np.where(step == 0, 1e-9, step)
        one, other = (-room - at) / along, (room - at) / along
        first, last = np.maximum(first, np.minimum(one, other)), np.minimum(last, np.maximum(one, other))
    return np.maximum(last - first, 0.0) * abs(course)
