"""Picture of a mechanism on matplotlib axes: links, symbols and names.

The display list contains the symbols of a mechanism. A symbol in the display list is called a mark.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.outputs.placing import PlacedName, place_names
from rigid import GROUND, Posture
from symbols import LEVELS, LINK, Anchor, Mark, anchor_position, extent_of, hull, marks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK = "#1b1b1b"
PAPER = "#ffffff"
LINKS = ("#0b5fa5", "#b3541e", "#2e7d4f", "#7a3b8f", "#8a6d00", "#a02c4a", "#31717f", "#5d5d5d")
COLORS = {"ink": INK, "paper": PAPER, "soft": "#5d6b7a", "accent": INK, "load": "#a8201a", "shade": "#5d6b7a2b",
          "none": "none"}  # fmt: skip
"""Colours of symbols, by name of the colour."""
ZORDER = dict(zip(LEVELS, (1, 4, 5, 6, 7), strict=True))  # zorder of each level of symbols; links have the zorder 3
DASHES = (6.0, 2.0, 1.3, 2.0)
# a corner is omitted from an outline if 2 * (area of the triangle of the corner and the two neighbouring corners) <=
# FLAT * (extent of all points)^2
FLAT = 1e-6


class MechanismAxes:
    """Picture of a mechanism in one posture.

    Parameters
    ----------
    places
        Positions of points [m], by link and point. By default, the points have their positions in the posture `here`.
    extent
        Two opposite corners of a box around the mechanism [m]. The size of the symbols depends on the size of the box.
    marks
        Display list. By default, it contains the symbols of the mechanism in the posture `here`.
    x_axis
        Function that returns the direction of the x axis of a mark. The function is called only for marks with
        `x_axis_of`. By default, the direction follows from the posture `here`.
    thin
        Thin lines [m] that are drawn behind the links. Names do not cover these lines if possible.
    """

    axes: Axes

    def __init__(
        self,
        here: Posture,
        places: Mapping[tuple[str, str], complex] | None = None,
        extent: tuple[complex, complex] | None = None,
        marks: Iterable[Mark] | None = None,
        x_axis: Callable[[Mark], Any] | None = None,
        thin: Iterable[Any] = (),
    ) -> None:
        self.here = here
        self.x_axis = x_axis
        self.thin = _bars(thin)
        self.names: list[PlacedName] = []
        self.mechanism = here.mechanism
        self.places = {
            (link.name, point): complex(np.ravel(here.point(link.name, point))[0])
            for link in self.mechanism.links
            for point in link.points
        } | dict(places or {})
        self.pins = self._pins()
        self.marks = list(marks_of(here) if marks is None else marks)
        everywhere = np.array(extent or extent_of(here, self.marks) or [0j, 1 + 1j])
        x, y = np.ptp(everywhere.real), np.ptp(everywhere.imag)
        large = float(max(x, y, 1e-9)) / 45
        self.unit = float(np.clip(0.4 * self._shortest(), 0.4 * large, large))
        self.letters = float(np.sqrt(self.unit / large))
        self.extent = float(x) + 12 * self.unit, float(y) + 12 * self.unit
        self.colors = {
            link.name: LINKS[number % len(LINKS)] for number, link in enumerate(self.mechanism.links[1:])
        } | {GROUND: INK}

    def _shortest(self) -> float:
        """Return the smallest distance between two points of one link, which limits the size of the symbols."""
        ways = [
            abs(self.places[link.name, one] - self.places[link.name, other])
            for link in self.mechanism.links
            for one, other in combinations(link.points, 2)
        ]
        return min((way for way in ways if way > 0), default=np.inf)

    def _pins(self) -> dict[str, list[str]]:
        carried: dict[str, list[str]] = {}
        for link, point in self.places:
            carried.setdefault(point, []).append(link)
        return {point: links for point, links in carried.items() if len(links) > 1}

    def draw(self) -> None:
        """Draw links, symbols and names, from back to front."""
        # draw long links before short links, so that no long link hides a short link
        for name in sorted(self.colors, key=self._span, reverse=True):
            if name != GROUND:
                self._link(name)
        self.draw_symbols()

    def draw_symbols(self) -> None:
        """Draw the symbols of the display list, and add the names of points."""
        for mark in self.marks:
            self._mark(mark)
        for owner, point in self.places:
            self._point_name(owner, point)

    def _span(self, name: str) -> float:
        """Return the largest distance between the first point of a link and any other point of the link."""
        spots = [place for (link, _), place in self.places.items() if link == name]
        return max(abs(spot - spots[0]) for spot in spots)

    def _link(self, name: str) -> None:
        """Draw a link and add its name. Two points give a line, and more points give their convex hull."""
        color = self.colors[name]
        spots = [place for (link, _), place in self.places.items() if link == name]
        corners = hull(spots, FLAT).tolist()
        if len(corners) > 2:
            self._patch(corners, facecolor=color, alpha=0.16, zorder=2)
            self._line([*corners, corners[0]], color=color, linewidth=1.8, zorder=3)
            self.name(name, [np.mean(corners)], color=color, fontsize=10)
        elif len(corners) == 2:
            self._line(corners, color=color, linewidth=3.2, zorder=3, solid_capstyle="round")
            self.name(name, corners, color=color, fontsize=10)
        else:
            self.name(name, spots, color=color, fontsize=10)

    def name(self, words: str, line: Any, always: bool = False, **style: Any) -> None:
        """Add the name of a line or a point at a preliminary position. `place_names` moves all names later."""
        box = {"boxstyle": "round,pad=0.12", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.75}
        style = {"ha": "center", "va": "center", "zorder": 8, "bbox": box, **style}
        text = self.axes.text(*_xy(line[0]), words, **{**style, "fontsize": self.letters * style["fontsize"]})
        self.names.append(PlacedName(text, line, always))

    def place_names(self) -> None:
        """Move all names to their final positions. Set the size and the limits of the axes before this call."""
        place_names(self.axes, self.names, self.unit, self.thin)

    def _mark(self, mark: Mark) -> None:
        """Draw a symbol of the display list."""
        place, end = self._place(mark.at), None if mark.to is None else self._place(mark.to)
        way = self.x_axis(mark) if self.x_axis and mark.x_axis_of else mark.direction(self.here)
        x_axis = complex(np.ravel(way)[0])
        if not x_axis:
            return
        points = mark.placed(place, x_axis, self.unit, end)
        colors = {**COLORS, LINK: self.colors[mark.at.link]}
        dashes: Any = (0, DASHES) if mark.dashed else "-"
        style = {"zorder": ZORDER[mark.level], "linewidth": mark.width, "linestyle": dashes}
        for cell, line in zip(mark.cells, mark.outlines, strict=True):
            if line.closed:
                self._patch(
                    points[cell].tolist(), facecolor=colors[mark.polygon_fill], edgecolor=colors[mark.stroke], **style
                )
            else:
                self._line(points[cell].tolist(), color=colors[mark.stroke], **style)

    def _place(self, anchor: Anchor) -> complex:
        if anchor.point:
            return self.places[anchor.link, anchor.point]
        return complex(np.ravel(anchor_position(self.here, anchor))[0])

    def _point_name(self, link: str, point: str) -> None:
        """Add the name of a point if `link` is the first of the links that share the point."""
        shared = self.pins.get(point, [link])
        if shared[0] != link:
            return
        self.name(point, [self.places[link, point]], always=True, color=INK, fontsize=11, fontweight="bold")

    def _line(self, spots: list[complex], **style: Any) -> None:
        self.axes.plot([spot.real for spot in spots], [spot.imag for spot in spots], **style)

    def _patch(self, corners: list[complex], **style: Any) -> None:
        from matplotlib.patches import Polygon

        self.axes.add_patch(Polygon([_xy(corner) for corner in corners], closed=True, **style))


def _bars(lines: Iterable[Any]) -> Any:
    """Divide polylines into segments. Return the ends of the segments as complex numbers, shape (segments, 2)."""
    ends = [bar for line in lines for bar in pairwise(np.asarray(line).tolist())]
    return np.array(ends, complex).reshape(-1, 2)


def _xy(place: complex) -> tuple[float, float]:
    return float(place.real), float(place.imag)
