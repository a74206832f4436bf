"""Solid bodies (prisms and beams) as moving points and fixed polygons.

Coordinates are x and y in the plane of motion, and z towards the viewer [m].
"""

from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct

from animations.diagrams import STATIONS
from animations.shapes import Cells, Complexes
from elastic import Section, Taper
from rigid import Reals
from rigid.arrays import Integers

CIRCLE_CORNERS = 24  # number of corners of a circle


class SolidShape(Struct, frozen=True, eq=False):
    """Points with polygons between them.

    Attributes
    ----------
    place
        Function that returns the points [m] and unit normals at a position, each of shape (points, 3).
    faces
        Point indices of the polygons.
    fill
        Name of the colour, see `paints`.
    opacity
        Opacity, 1 for an opaque body.
    values
        Function that returns the values that colour the points at a position, or None for a single colour.
    """

    place: Callable[[int], tuple[Reals, Reals]]
    faces: Cells
    fill: str = "metal"
    opacity: float = 1.0
    values: Callable[[int], Reals] | None = None


def prism(
    place: Callable[[int], Complexes],
    corners: int,
    low: float,
    high: float,
    fill: str = "metal",
    opacity: float = 1.0,
    smooth: bool = False,
) -> SolidShape:
    """Extrude a plane polygon from z = `low` to z = `high`; use `smooth` for curved outlines."""
    ring = np.arange(corners)
    after = np.roll(ring, -1)
    sides = 2 * corners + 4 * ring[:, None] + np.arange(4)

    def at(position: int) -> tuple[Reals, Reals]:
        points = place(position)
        if np.sum((np.conj(points) * points[after]).imag) < 0:
            points = points[::-1]  # make the outline counter-clockwise, so that faces are lit from outside
        way = points[after] - points
        out = -1j * way / np.maximum(np.abs(way), 1e-300)
        first = second = out
        if smooth:
            first = out + np.roll(out, 1)
            first = first / np.maximum(np.abs(first), 1e-300)
            second = np.roll(first, -1)
        edges = np.stack([points, points[after], points[after], points], -1).ravel()
        normals = np.stack([first, second, second, first], -1).ravel()
        flat = np.zeros(corners, complex)
        return (
            spatial(np.concatenate([points, points, edges]), np.concatenate(
                [np.full(corners, high), np.full(corners, low), np.tile([low, low, high, high], corners)])),
            spatial(np.concatenate([flat, flat, normals]),
                    np.repeat([1.0, -1.0, 0.0], [corners, corners, 4 * corners])),
        )  # fmt: skip

    return SolidShape(at, (ring, ring[::-1] + corners, *sides), fill, opacity)


def _along(taper: Sequence[float]) -> Reals:
    """Evaluate a taper polynomial at the stations."""
    return np.polynomial.polynomial.polyval(STATIONS, np.array(taper)) * np.ones(len(STATIONS))


class CrossSections(Struct, frozen=True, eq=False):
    """Depth (in the plane of motion) and width (normal to the plane) at the stations of a beam [m].

    `round` is True if the section is round.
    """

    depth: Reals
    width: Reals
    round: bool


def cross_sections(section: Section, thin: float) -> CrossSections:
    """Return the cross-sections of a beam.

    If the dimensions are unknown, the section is round with the diameter `thin` [m]. If only the width is unknown, the
    section is a rectangle with the given area and depth.
    """
    fibre, area, width = (float(np.ravel(value)[0]) for value in (section.fibre, section.area, section.width))
    if not np.isfinite(fibre):
        return CrossSections(np.full(len(STATIONS), thin), np.full(len(STATIONS), thin), True)
    taper = section.taper or Taper()
    depth = 2 * fibre * _along(taper.fibre)
    across = width * _along(taper.width) if np.isfinite(width) else area * _along(taper.EA) / depth
    return CrossSections(depth, across, section.round)


def beam_bodies(
    axes: Callable[[int], Complexes],
    sections: Sequence[CrossSections],
    layers: Sequence[float],
    values: Callable[[int], Reals] | None,
) -> SolidShape:
    """Build a single body of all beams.

    Parameters
    ----------
    axes
        Function that returns the axes of the beams at a position [m], complex, shape (beams, stations).
    layers
        z of the axis of each beam [m].
    values
        Function that returns the values of a field at a position, shape (beams, stations).
    """
    rings = [_ring(each.round) for each in sections]
    counts = [len(y) for y, *_ in rings]
    first = len(STATIONS) * np.cumsum([0, *counts])
    faces: list[Complexes] = []
    for start, count, (*_, pairs) in zip(first, counts, rings, strict=False):
        row = start + count * np.arange(len(STATIONS))[:, None, None]
        quads = np.concatenate([row[:-1] + pairs, row[1:] + pairs[:, ::-1]], -1)
        faces += list(quads.reshape(-1, 4))

    def at(position: int) -> tuple[Reals, Reals]:
        points, normals = [], []
        for axis, each, z, (y, across, normal, _) in zip(axes(position), sections, layers, rings, strict=True):
            way = np.gradient(axis)
            side = (1j * way / np.abs(way))[:, None]
            points.append(spatial(axis[:, None] + side * each.depth[:, None] * y, z + each.width[:, None] * across))
            normals.append(spatial(side * normal.real, np.broadcast_to(normal.imag, side.shape[:1] + normal.shape)))
        return np.concatenate(points), np.concatenate(normals)

    if values is None:
        return SolidShape(at, tuple(faces))
    known = values
    return SolidShape(at, tuple(faces), values=lambda position: np.concatenate(
        [np.repeat(row, count) for row, count in zip(known(position), counts, strict=True)]))  # fmt: skip


def _ring(is_round: bool) -> tuple[Reals, Reals, Complexes, Integers]:
    """Return a section of depth 1 and width 1, as a ring of points.

    The result contains the coordinates y and z of the points, the normals at the points as complex numbers y + i z, and
    the index pairs of neighbouring points.
    """
    if is_round:
        turn = np.exp(2j * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS)
        return (
            turn.real / 2,
            turn.imag / 2,
            turn,
            np.stack([np.arange(CIRCLE_CORNERS), np.roll(np.arange(CIRCLE_CORNERS), -1)], -1),
        )
    y = np.array([0.5, 0.5, 0.5, -0.5, -0.5, -0.5, -0.5, 0.5])
    z = np.array([-0.5, 0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5])
    return y, z, np.repeat([1.0, 1j, -1.0, -1j], 2), np.arange(8).reshape(4, 2)


def spatial(plane: Complexes, z: Reals) -> Reals:
    """Return points in space from points in the plane (complex) and their z, shape (points, 3)."""
    return np.stack([plane.real.ravel(), plane.imag.ravel(), np.ravel(z)], -1)
