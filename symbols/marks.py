"""Marks: lines and circles, as plain data, in axes that move with the links.

A mark has axes, an anchor on a link and sometimes a second anchor.
Renderers know the positions of the links. They scale each mark and draw it at its anchor, so that a list of marks
stays valid while the mechanism moves.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rigid import Reals
from rigid.arrays import Complexes
from rigid.joints import Placed

INK, PAPER, SOFT, ACCENT, LOAD, LINK, SHADE, NONE = "ink", "paper", "soft", "accent", "load", "link", "shade", "none"
"""Colour names. `LINK` is the colour of the link at the mark's position."""
UNDER, GROUND_LEVEL, BLOCK_LEVEL, JOINT, OVER = "guide", "ground", "block", "pin", "mark"
LEVELS = (UNDER, GROUND_LEVEL, BLOCK_LEVEL, JOINT, OVER)
"""Levels from back to front. Links are drawn above GROUND_LEVEL and below BLOCK_LEVEL."""
CORNERS = 60  # number of corners of the polygon that replaces a circle
DECIMALS = 9  # decimals of coordinates in JSON


class Spot(NamedTuple):
    """A location on a link: a named point, or `local` coordinates in the link's axes [m]."""

    link: str
    point: str = ""
    local: complex = 0j


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline, or a filled polygon if `closed`.

    Each vertex is the sum of three vectors: `size` [symbol sizes] and `far` [m], which are complex and in the axes of
    the mark, and `share` times the vector from the first to the second anchor.
    """

    size: Any = 0j
    far: Any = 0j
    share: Any = 0.0
    closed: bool = False

    @cached_property
    def vertices(self) -> tuple[Complexes, Complexes, Reals]:
        """`size`, `far` and `share` as arrays of shape (vertices,)."""
        size, far, share = np.broadcast_arrays(
            np.atleast_1d(np.asarray(self.size, complex)), np.asarray(self.far, complex), np.asarray(self.share, float)
        )
        return size, far, share


@dataclass(frozen=True, eq=False)
class Mark:
    """A symbol, or a part of a symbol drawn in the same colours.

    Attributes
    ----------
    kind
        Kind of symbol, such as `pin`.
    at, to
        First anchor, and optional second anchor. With two anchors, the x axis points from the first to the second.
    axis
        Link that the axes rotate with, and direction of the x axis in the axes of this link.
        None for axes parallel to the ground axes.
    lines
        Polylines and polygons.
    radius
        Radius of a circle about the anchor, as two summands: one in symbol sizes, one in metres.
    stroke, fill, width, dashed
        Colours, line width [pixels on a page], and whether the line is dashed.
    level
        One of `LEVELS`.
    drive
        Drive index, or None. While the rate of this drive is negative, the mark is mirrored about its y axis.
    spin
        For a body that is not a link: function that returns the x axis at each position of a motion.
    replaces
        Name of the slider whose symbol this mark replaces, or empty.
    """

    kind: str
    at: Spot
    lines: tuple[Line, ...] = ()
    radius: tuple[float, float] = (0.0, 0.0)
    to: Spot | None = None
    axis: tuple[str, complex] | None = None
    stroke: str = INK
    fill: str = NONE
    width: float = 1.4
    dashed: bool = False
    level: str = JOINT
    drive: int | None = None
    spin: Callable[[Any], Any] | None = None
    replaces: str = ""

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
        sizes, fars, shares = zip(*(line.vertices for line in self.outlines), strict=True)
        return np.concatenate(sizes), np.concatenate(fars), np.concatenate(shares)

    @property
    def body(self) -> str:
        """Fill colour if the mark has exactly one polygon, else `NONE` (one of several polygons may be a hole)."""
        return self.fill if sum(line.closed for line in self.outlines) == 1 else NONE

    @property
    def cells(self) -> list[Any]:
        """Vertex indices of each outline, as cells of a mesh."""
        ends = np.cumsum([len(line.vertices[0]) for line in self.outlines])
        return [*np.split(np.arange(ends[-1]), ends[:-1])]

    def placed(self, place: Any, x_axis: Any, size: float, end: Any = None, mirrored: bool = False) -> Complexes:
        """Return the vertices in the plane of motion [m], shape (vertices,).

        Parameters
        ----------
        place, end
            Positions of the first and second anchor [m].
        x_axis
            Unit vector of the x axis. If `end` is given, the direction from `place` to `end` replaces it.
        size
            Symbol size [m].
        """
        sizes, fars, shares = self.vertices
        local = size * sizes + fars
        apart = 0j if end is None else end - place
        direction = x_axis if end is None else apart / max(abs(apart), 1e-300)
        return place + direction * (-np.conj(local) if mirrored else local) + apart * shares

    def direction(self, placed: Placed) -> Any:
        """Return the unit vector of the x axis, shape (...)."""
        if self.spin is not None:
            return self.spin(placed)
        if self.axis is None:
            return 1.0
        link, x_axis = self.axis
        return np.asarray(placed.direction[placed.mechanism.index[link]]) * x_axis

    def plain(self, links: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return the mark as JSON data. Links appear by their index in `links`, or by name if `links` is None."""

        def link(name: str) -> Any:
            return name if links is None else links[name]

        def spot(each: Spot) -> dict[str, Any]:
            return {"link": link(each.link), "point": each.point or None, "local": _pair(each.local)}

        lines = []
        for line in self.lines:
            size, far, share = line.vertices
            content = {"size": _plain(size), "far": _plain(far), "share": _plain(share), "closed": line.closed}
            lines.append({key: value for key, value in content.items() if value})
        style = {"stroke": self.stroke, "fill": self.fill, "width": self.width, "dashed": self.dashed}
        axis = self.axis and {"link": link(self.axis[0]), "way": _pair(self.axis[1])}
        more = {"to": self.to and spot(self.to), "axis": axis, "drive": self.drive, "radius": self.radius, "spin": None}
        return {"kind": self.kind, "level": self.level, "at": spot(self.at), "lines": lines, **style, **more}


def anchor(placed: Placed, at: Spot) -> Complexes:
    """Return the position of a spot without elastic displacement [m], shape (...)."""
    number = placed.mechanism.index[at.link]
    local = placed.mechanism.links[number].points[at.point] if at.point else at.local
    return np.asarray(placed.origin[number] + placed.direction[number] * local)


def _pair(place: complex) -> list[float]:
    return [round(complex(place).real, DECIMALS), round(complex(place).imag, DECIMALS)]


def _plain(values: Any) -> Any:
    """Return rounded numbers as a list, with complex numbers as (real, imaginary) pairs, or None if all are zero."""
    parts = np.stack([values.real, values.imag], axis=-1) if np.iscomplexobj(values) else values
    return np.round(parts, DECIMALS).tolist() if values.any() else None
