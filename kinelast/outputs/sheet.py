"""Symbols of a mechanism on matplotlib axes: plates, bars, pins, supports, sliders, drives, names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid import GROUND, Posture, Slider
from rigid.plane import cross

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK = "#1b1b1b"
PAPER = "#ffffff"
LINKS = ("#0b5fa5", "#b3541e", "#2e7d4f", "#7a3b8f", "#8a6d00", "#a02c4a", "#31717f", "#5d5d5d")
FLAT = 1e-6


class MechanismAxes:
    """Drawing of a mechanism in one posture, and the size of its symbols.

    Parameters
    ----------
    places
        Places of points by link and point [m], if different from this posture.
    extent
        Corners of the drawing [m], which set the size of the symbols.
    strokes
        Lines of further symbols: name of a link, and points in link axes [m].
    """

    axes: Axes

    def __init__(
        self,
        here: Posture,
        places: Mapping[tuple[str, str], complex] | None = None,
        extent: tuple[complex, complex] | None = None,
        strokes: Iterable[tuple[str, Sequence[Any]]] = (),
    ) -> None:
        self.here = here
        self.strokes = [*strokes]
        self.mechanism = here.mechanism
        self.places = {
            (link.name, point): complex(np.ravel(here.point(link.name, point))[0])
            for link in self.mechanism.links
            for point in link.points
        } | dict(places or {})
        self.pins = self._pins()
        everywhere = np.array(extent or [*self.places.values()])
        x, y = np.ptp(everywhere.real), np.ptp(everywhere.imag)
        large = float(max(x, y, 1e-9)) / 45
        self.unit = float(np.clip(0.4 * self._shortest(), 0.4 * large, large))
        self.letters = float(np.sqrt(self.unit / large))
        self.extent = float(x) + 12 * self.unit, float(y) + 12 * self.unit
        self.colors = {
            link.name: LINKS[number % len(LINKS)] for number, link in enumerate(self.mechanism.links[1:])
        } | {GROUND: INK}

    def _shortest(self) -> float:
        """Smallest distance between points of a link, which symbols may not cover."""
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
        """Draw everything from back to front."""
        # longest first, so that a short link on top of it stays visible
        for name in sorted(self.colors, key=self._span, reverse=True):
            if name != GROUND:
                self._link(name)
        self.draw_joints()

    def draw_joints(self) -> None:
        """Draw joints, drives and names of points on top of the links."""
        for slider in self.mechanism.sliders:
            self._slider(slider)
        for point, links in self.pins.items():
            self._pin(point, links)
        for drive in self.mechanism.drives:
            self._drive(drive)
        for link, points in self.strokes:
            at = self.mechanism.index[link]
            origin, way = (np.ravel(part[at])[0] for part in (self.here.origin, self.here.direction))
            self._line([complex(origin + way * point) for point in points], color=INK, linewidth=1.4, zorder=7)
        for owner, point in self.places:
            self._point_name(owner, point)

    def _span(self, name: str) -> float:
        """Return the greatest distance of a link's points from its first point."""
        spots = [place for (link, _), place in self.places.items() if link == name]
        return max(abs(spot - spots[0]) for spot in spots)

    def _link(self, name: str) -> None:
        """Draw a line through the points of a link, or the convex outline of a plate."""
        color = self.colors[name]
        spots = [place for (link, _), place in self.places.items() if link == name]
        hull = _hull(spots)
        if len(hull) > 2:
            self._patch(hull, facecolor=color, alpha=0.16, zorder=2)
            self._line([*hull, hull[0]], color=color, linewidth=1.8, zorder=3)
            self._text(complex(np.mean(hull)), name, color=color, fontsize=10)
        elif len(hull) == 2:
            self._line(hull, color=color, linewidth=3.2, zorder=3, solid_capstyle="round")
            way = (hull[1] - hull[0]) / abs(hull[1] - hull[0])
            across = 1j * way * (1 if way.real >= 0 else -1)
            self.beside((hull[0] + hull[1]) / 2, across * self.unit, name, color=color, fontsize=10)
        else:
            block = self._block_line(next(point for link, point in self.places if link == name))
            self.beside(spots[0], -2.5j * self.unit * (block or 1.0), name, color=color, fontsize=10)

    def _block_line(self, point: str) -> complex | None:
        """Return the direction of the slider with its block at a point, to the right or up."""
        for slider in self.mechanism.sliders:
            if slider.point == point:
                along = self._along(slider)
                return along if (along.real, along.imag) > (FLAT, 0) or along.imag > 1 - FLAT else -along
        return None

    def _along(self, slider: Slider) -> complex:
        owner = self.mechanism.index[slider.on]
        return complex(np.ravel(self.here.direction[owner] * slider.direction)[0])

    def _pin(self, point: str, links: list[str]) -> None:
        place = self.places[links[0], point]
        if GROUND in links:
            self._support(place)
        if point in self.mechanism.welded_points:
            corners = [place + 0.5 * self.unit * corner for corner in (1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j)]
            self._patch(corners, facecolor=INK, edgecolor=INK, zorder=6)
            return
        self._circle(place, 0.55 * self.unit, facecolor=PAPER, edgecolor=INK, linewidth=1.5, zorder=6)

    def _support(self, place: complex) -> None:
        """Draw the triangle of a fixed pin with hatched ground."""
        foot, half = -2.0j * self.unit, 1.3 * self.unit
        corners = [place, place + foot - half, place + foot + half]
        self._patch(corners, facecolor=PAPER, edgecolor=INK, linewidth=1.4, zorder=4)
        self._hatched(place + foot, 1.0, 2.1 * self.unit)

    def _hatched(self, middle: complex, along: complex, half: float) -> None:
        """Draw a ground line with hatching on its right."""
        from matplotlib.collections import LineCollection

        ends = [middle - half * along, middle + half * along]
        self._line(ends, color=INK, linewidth=1.4, zorder=4)
        feet = middle + np.arange(-half, half * (1 + 1e-9), 0.6 * self.unit) * along
        strokes = [(_xy(foot), _xy(foot + along * (-0.6 - 0.75j) * self.unit)) for foot in feet]
        self.axes.add_collection(LineCollection(strokes, colors=INK, linewidths=0.8, zorder=4))

    def _slider(self, slider: Slider) -> None:
        """Draw the line and its block, with two hatched rails on the ground."""
        place = self.places[slider.link, slider.point]
        along = self._along(slider)
        color = self.colors[slider.link]
        half = 1.6 * self.unit
        if slider.on == GROUND:
            for side in (along, -along):
                self._hatched(place - 1.05j * self.unit * side, side, 5 * self.unit)
        else:
            rail = 6 * self.unit * along
            self._line([place - rail, place + rail], color=self.colors[slider.on], linewidth=1.4, zorder=1)
        corners = [place + along * complex(x, y) for x, y in self._box(half, 0.62 * half)]
        self._patch(corners, facecolor=PAPER, edgecolor=color, linewidth=1.8, zorder=5)

    @staticmethod
    def _box(half: float, high: float) -> tuple[tuple[float, float], ...]:
        return (-half, -high), (half, -high), (half, high), (-half, high)

    def _drive(self, drive: Any) -> None:
        """Draw an arrow around a driven pin or along a driven slider."""
        style = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.3, "mutation_scale": 11, "zorder": 7}
        if drive.turns:
            place, radius = self.places[drive.link, drive.at], 2.1 * self.unit
            angles = np.radians(np.linspace(-20, 215, 40))
            arc = place + radius * np.exp(1j * angles)
            self._line(list(arc[:-2]), color=INK, linewidth=1.3, zorder=7)
            start, end, style["arrowstyle"] = arc[-3], arc[-1], "-|>"
        else:
            slider = self.mechanism.slider(drive.joint)
            along = self._along(slider)
            start = self.places[slider.link, slider.point] + (1.9 + 0j) * self.unit * along
            end = start + 3.2 * self.unit * along
        self.axes.annotate("", _xy(end), _xy(start), arrowprops={**style, "shrinkA": 0, "shrinkB": 0}, zorder=7)

    def _point_name(self, link: str, point: str) -> None:
        """Draw the name of each joint once, and that of a traced point with a dot."""
        shared = self.pins.get(point, [link])
        if shared[0] != link:
            return
        place = self.places[link, point]
        if len(shared) == 1 and point not in self.mechanism.slider_points.values():
            self._circle(place, 0.28 * self.unit, facecolor=INK, edgecolor=INK, zorder=6)
        block = self._block_line(point)
        if block is None:
            self._text(place + self._aside(point, place), point, color=INK, fontsize=11, fontweight="bold")
        else:
            self.beside(place, 2.5j * self.unit * block, point, color=INK, fontsize=11, fontweight="bold")

    def _aside(self, point: str, place: complex) -> complex:
        """Return a free direction at a joint, away from its links and its support."""
        ways = []
        for link in self.pins.get(point, [name for name, other in self.places if other == point]):
            others = [spot for (name, other), spot in self.places.items() if name == link and other != point]
            ways += [spot - place for spot in others if link != GROUND and abs(spot - place) > 0]
            if link == GROUND:
                ways.append(-1j)
        taken = np.angle(np.array(ways)) if ways else np.array([0.0])
        trial = np.radians(np.arange(0, 360, 15) + 45)
        room = np.abs(np.angle(np.exp(1j * (trial[:, None] - taken)))).min(axis=1)
        distance = 2.0 if any(d.turns and d.joint == point for d in self.mechanism.drives) else 1.5
        return complex(np.exp(1j * trial[int(room.argmax())])) * (distance + 0.9 * (distance > 1.5)) * self.unit

    def _line(self, spots: list[complex], **style: Any) -> None:
        self.axes.plot([spot.real for spot in spots], [spot.imag for spot in spots], **style)

    def _patch(self, corners: list[complex], **style: Any) -> None:
        from matplotlib.patches import Polygon

        self.axes.add_patch(Polygon([_xy(corner) for corner in corners], closed=True, **style))

    def _circle(self, place: complex, radius: float, **style: Any) -> None:
        from matplotlib.patches import Circle

        self.axes.add_patch(Circle(_xy(place), radius, **style))

    def beside(self, place: complex, offset: complex, words: str, **style: Any) -> None:
        """Draw words at an offset from a place."""
        lean = offset.real / abs(offset)
        side = "center" if abs(lean) < 0.35 else "left" if lean > 0 else "right"
        self._text(place + offset, words, ha=side, **style)

    def _text(self, place: complex, words: str, **style: Any) -> None:
        box = {"boxstyle": "round,pad=0.12", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.75}
        style = {"ha": "center", "va": "center", "zorder": 8, "bbox": box, **style}
        self.axes.text(*_xy(place), words, **{**style, "fontsize": self.letters * style["fontsize"]})


def _xy(place: complex) -> tuple[float, float]:
    return float(place.real), float(place.imag)


def _hull(places: list[complex]) -> list[complex]:
    """Return the corners of the convex outline counter-clockwise, or the two ends of collinear points."""
    spots = sorted(set(places), key=lambda place: (place.real, place.imag))
    if len(spots) < 3:
        return spots
    flat = FLAT * abs(spots[-1] - spots[0]) ** 2

    def chain(ordered: list[complex]) -> list[complex]:
        kept: list[complex] = []
        for spot in ordered:
            while len(kept) > 1 and cross(kept[-1] - kept[-2], spot - kept[-1]) <= flat:
                kept.pop()
            kept.append(spot)
        return kept[:-1]

    return chain(spots) + chain(spots[::-1])
