"""Marks: lines and circles, as plain data, in axes that move with the links.

A mark has axes, an anchor on a link and sometimes a second anchor. A renderer knows the positions of the links. It
scales each mark and draws it at its anchor. A list of marks therefore stays valid while the mechanism moves.

Lengths are in metres or in symbol sizes. The renderer chooses the symbol size.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from msgspec import Struct

from rigid import Motion, Reals
from rigid.arrays import Complexes
from rigid.joints import Placed

INK, PAPER, SOFT, ACCENT, LOAD, LINK, SHADE, NONE = "ink", "paper", "soft", "accent", "load", "link", "shade", "none"
"""Colour names. `LINK` is the colour of the link of the first anchor."""
UNDER, GROUND_LEVEL, BLOCK_LEVEL, JOINT, OVER = "guide", "ground", "block", "pin", "mark"
LEVELS = (UNDER, GROUND_LEVEL, BLOCK_LEVEL, JOINT, OVER)
"""Levels from back to front. Links are drawn above GROUND_LEVEL and below BLOCK_LEVEL."""
CORNERS = 60  # number of corners of the polygon that replaces a circle
DECIMALS = 9  # number of decimals of coordinates in JSON


class Anchor(NamedTuple):
    """A position on a link: a named point, or `local` coordinates in the axes of the link [m]."""

    link: str
    point: str = ""
    local: complex = 0j


class Line(Struct, frozen=True, eq=False, dict=True):
    """A polyline, or a filled polygon if `closed`.

    The position of each vertex relative to the first anchor is the sum of three vectors: `symbol_offset` [symbol
    sizes], `offset` [m], and `share` * (vector from the first to the second anchor). `symbol_offset` and `offset` are
    complex numbers in the axes of the mark.
    """

    symbol_offset: Any = 0j
    offset: Any = 0j
    share: Any = 0.0
    closed: bool = False

    @cached_property
    def vertices(self) -> tuple[Complexes, Complexes, Reals]:
        """`symbol_offset`, `offset` and `share` as arrays of shape (vertices,)."""
        symbol_offset, offset, share = np.broadcast_arrays(
            np.atleast_1d(np.asarray(self.symbol_offset, complex)),
            np.asarray(self.offset, complex),
            np.asarray(self.share, float),
        )
        return symbol_offset, offset, share


class Mark(Struct, frozen=True, eq=False, dict=True):
    """A symbol, or one part of a symbol. The outline has one colour, and the area has one colour.

    Attributes
    ----------
    kind
        Kind of symbol, such as `pin`.
    at, to
        First anchor, and optional second anchor. With two anchors, the x axis points from the first to the second.
    axis
        Link with which the mark rotates, and direction of the mark's x axis in the axes of this link (a unit vector).
        None if the axes of the mark are parallel to the axes of the ground.
    lines
        Polylines and polygons.
    radius
        Radius of a circle about the anchor: the sum of a value in symbol sizes and a value in metres.
    stroke, fill, width, dashed
        Colours, line width [pixels on a page], and whether the line is dashed.
    level
        One of `LEVELS`.
    drive
        Drive index, or None. While the rate of this drive is negative, the mark is mirrored about the y axis of the
        mark.
    x_axis_of
        Function that returns the x axis at each position of a motion, or None. It is used for a load with a variable
        direction, and for a body that is not a link. A mark with this function ignores `axis` in a motion, but uses
        `axis` in a single posture. At positions at which the function returns a zero vector, the mark is invisible.
    replaces
        Name of a slider, or empty. This mark replaces the symbol of the slider.
    """

    kind: str
    at: Anchor
    lines: tuple[Line, ...] = ()
    radius: tuple[float, float] = (0.0, 0.0)
    to: Anchor | None = None
    axis: tuple[str, complex] | None = None
    stroke: str = INK
    fill: str = NONE
    width: float = 1.4
    dashed: bool = False
    level: str = JOINT
    drive: int | None = None
    x_axis_of: Callable[[Any], Any] | None = None
    replaces: str = ""

    @property
    def shows(self) -> str:
        """Name of the link that the symbol represents, or empty."""
        if self.kind == "rod":
            return self.to.link if self.to else ""
        if self.kind == "wheel":
            return self.axis[0] if self.axis else ""
        return self.at.link if self.kind in ("barrel", "block") else ""

    @cached_property
    def outlines(self) -> tuple[Line, ...]:
        """Lines of the mark, with the circle (if any) as a polygon."""
        if not any(self.radius):
            return self.lines
        circle = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS)
        return (Line(self.radius[0] * circle, self.radius[1] * circle, closed=True), *self.lines)

    @cached_property
    def vertices(self) -> tuple[Complexes, Complexes, Reals]:
        """Vertices of all outlines (see `Line.vertices`)."""
        symbol_offsets, offsets, shares = zip(*(line.vertices for line in self.outlines), strict=True)
        return np.concatenate(symbol_offsets), np.concatenate(offsets), np.concatenate(shares)

    @property
    def polygon_fill(self) -> str:
        """Fill colour if there is exactly one polygon; otherwise `NONE`, because some polygons may be holes."""
        return self.fill if sum(line.closed for line in self.outlines) == 1 else NONE

    @property
    def cells(self) -> list[Any]:
        """Vertex indices of each outline, in the format of cells of a mesh."""
        ends = np.cumsum([len(line.vertices[0]) for line in self.outlines])
        return [*np.split(np.arange(ends[-1]), ends[:-1])]

    def placed(self, place: Any, x_axis: Any, size: float, end: Any = None, mirrored: bool = False) -> Complexes:
        """Return the vertices in the plane of motion [m], shape (vertices,).

        Parameters
        ----------
        place, end
            Positions of the first and second anchor [m].
        x_axis
            Unit vector of the x axis. If `end` is given, it is not used: the x axis points from `place` to `end`.
        size
            Symbol size [m].
        mirrored
            Whether the mark is mirrored about its y axis.
        """
        symbol_offsets, offsets, shares = self.vertices
        local = size * symbol_offsets + offsets
        apart = 0j if end is None else end - place
        direction = x_axis if end is None else apart / max(abs(apart), 1e-300)
        return place + direction * (-np.conj(local) if mirrored else local) + apart * shares

    def direction(self, placed: Placed) -> Any:
        """Return the unit vector of the x axis, shape (...). It is a zero vector if the mark is invisible."""
        if self.x_axis_of is not None and isinstance(placed, Motion):
            return self.x_axis_of(placed)
        if self.axis is None:
            return 1.0
        link, x_axis = self.axis
        return np.asarray(placed.direction[placed.mechanism.index[link]]) * x_axis

    def plain(self, links: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return the mark as JSON data. `links` contains the index of each link by name.

        If `links` is None, the data contains the names of links instead of their indices.
        """

        def link(name: str) -> Any:
            return name if links is None else links[name]

        def anchor_data(each: Anchor) -> dict[str, Any]:
            return {"link": link(each.link), "point": each.point or None, "local": _pair(each.local)}

        lines = []
        for line in self.lines:
            symbol_offset, offset, share = line.vertices
            content = {"symbol_offset": _plain(symbol_offset), "offset": _plain(offset), "share": _plain(share)}
            lines.append({key: value for key, value in {**content, "closed": line.closed}.items() if value})
        style: dict[str, Any] = {"stroke": self.stroke, "fill": self.fill, "width": self.width, "dashed": self.dashed}
        axis = self.axis and {"link": link(self.axis[0]), "way": _pair(self.axis[1])}
        to = self.to and anchor_data(self.to)
        more = {"to": to, "axis": axis, "drive": self.drive, "radius": self.radius, "x_axis": None}
        style["shows"] = link(self.shows) if self.shows else None
        return {"kind": self.kind, "level": self.level, "at": anchor_data(self.at), "lines": lines, **style, **more}


def anchor_position(placed: Placed, at: Anchor) -> Complexes:
    """Return the position of an anchor without elastic displacement [m], shape (...)."""
    number = placed.mechanism.index[at.link]
    local = placed.mechanism.links[number].points[at.point] if at.point else at.local
    return np.asarray(placed.origin[number] + placed.direction[number] * local)


def _pair(place: complex) -> list[float]:
    return [round(complex(place).real, DECIMALS), round(complex(place).imag, DECIMALS)]


def _plain(values: Any) -> Any:
    """Return rounded numbers as a list, or None if all are zero. Complex numbers become (real, imaginary) pairs."""
    parts = np.stack([values.real, values.imag], axis=-1) if np.iscomplexobj(values) else values
    return np.round(parts, DECIMALS).tolist() if values.any() else None


def hull(points: Iterable[Any], flat: float = 0.0) -> Complexes:
    """Return the corners of the convex hull in counter-clockwise order, by the monotone chain algorithm.

    If all points are collinear, return only the two outermost points.

    Parameters
    ----------
    flat
        Tolerance for corners that lie almost on a straight line. A corner and its two neighbours form a triangle. The
        corner is left out if 2 * (area of the triangle) <= flat * (distance from the leftmost to the rightmost
        point)^2.
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
