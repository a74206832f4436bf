"""Outlines of links as plane bodies, and their quadrilateral meshes.

Each beam is a strip along its axis. Its depth is that of the rectangular section with the same EA and EI. Where strips
of a link meet, they are cut along mitres and joined. At a point at which only one beam ends, its strip extends beyond
the point by half its depth.
"""

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from rigid import Reals
from rigid.arrays import Columns, Complexes, Integers

# largest distance of an outer corner from the common point of two beams, relative to the depth of the deeper beam; a
# corner that is farther away is cut off, because the tip carries no load
MAX_MITRE = 1.0
MAX_CORNER_REACH = 0.4  # largest extent of an inner corner along a beam, relative to the length of the beam
MIN_SINE = 0.05  # if the sine of the angle between two beams is smaller, one continues the other without a corner
MAX_ELEMENTS = 75  # largest length of an element = 2 max(depth, beam length / MAX_ELEMENTS) / `across`
# length of an element near an end of the beam = (depth + 4 ELEMENT_GROWTH (distance from the end)) / `across`
ELEMENT_GROWTH = 0.4
# Rows of elements near a mitre (cut between two beams) are oblique up to this distance from the end of the beam:
# SKEW_LENGTH times the extent of the mitre along the beam, plus the largest depth
SKEW_LENGTH = 3.0
MERGE_DISTANCE = 1e-9  # mesh points closer than this are merged; relative to the size of the link

Powers = np.polynomial.polynomial.polyval


class OutlineError(ValueError):
    """Raised if a link cannot be modelled as a plane body.

    The reason is that two beams meet at too small an angle, or that a beam is deeper than long.
    """


class Strip(Struct, frozen=True):
    """Beam of a link. Strips are hashable.

    Attributes
    ----------
    start, end
        Indices of the points of the link.
    EA, EI
        Axial [N] and bending rigidity [N m^2], as polynomials in xi.
    mass
        Mass per length [kg/m], as a polynomial in xi.
    """

    start: int
    end: int
    EA: tuple[float, ...]
    EI: tuple[float, ...]
    mass: tuple[float, ...] = (0.0,)

    def depth(self, xi: Columns) -> Columns:
        """Return the depth of the rectangle with the same EA and EI, sqrt(12 EI/EA) [m]."""
        return np.sqrt(12.0 * Powers(xi, self.EI) / Powers(xi, self.EA))


class SolidOutline(Struct, frozen=True):
    """Link as strips between its points.

    `points` are complex [m], in the axes of the link.
    """

    points: tuple[complex, ...]
    strips: tuple[Strip, ...]

    def way(self, strip: Strip) -> complex:
        """Return the vector from the start to the end of a strip."""
        return self.points[strip.end] - self.points[strip.start]

    def ends_at(self, point: int) -> list[tuple[int, int]]:
        """Return the strips that end at a point, each with the index of the end (0 or 1)."""
        found = [(k, 0) for k, strip in enumerate(self.strips) if strip.start == point]
        return found + [(k, 1) for k, strip in enumerate(self.strips) if strip.end == point]

    def depth_at(self, point: int) -> float:
        """Return the smallest depth of the strips that end at a point."""
        return min(float(self.strips[k].depth(float(end))) for k, end in self.ends_at(point))


class QuadGrid(Struct, frozen=True, eq=False):
    """Quadrilateral mesh of a link.

    Attributes
    ----------
    points
        Positions of the mesh points (complex) [m].
    cells
        Indices of the four corners of each element, counter-clockwise, shape (elements, 4).
    strip
        Index of the strip of each element, shape (elements,).
    share
        Part of the beam length that belongs to each element [m], shape (elements,). These parts add up to the length of
        the strip. They are zero for elements beyond the end points of the strip.
    axis
        Indices of the mesh points on the axis of each strip, from start to end.
    xi
        x'/l of these points.
    """

    points: Complexes
    cells: Integers
    strip: Integers
    share: Reals
    axis: tuple[Integers, ...]
    xi: tuple[Reals, ...]


def grid(outline: SolidOutline, across: int) -> QuadGrid:
    """Mesh a link with `across` elements (an even number) across the depth of each beam.

    Raises
    ------
    OutlineError
        If two beams meet at too sharp an angle, or a beam is deeper than it is long.
    """
    corners = [corner for point in range(len(outline.points)) for corner in _corners(outline, point)]
    sides = {(k, end, side): place for k, end, side, place in corners}
    places, cells, owners, shares, axes, stations = [], [], [], [], [], []
    first = 0
    for k in range(len(outline.strips)):
        rows, share, xi, before = _rows(outline, k, sides, across)
        numbers = first + np.arange(rows.size).reshape(rows.shape)
        places.append(rows.ravel())
        quads = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
        cells.append(np.stack([quad.ravel() for quad in quads], axis=1))
        shares.append(np.repeat(share / across, across))
        owners.append(np.full(len(cells[-1]), k))
        axes.append(numbers[before : before + len(xi), across // 2])
        stations.append(xi)
        first += rows.size
    points, number = _merged(np.concatenate(places), max(abs(outline.way(strip)) for strip in outline.strips))
    return QuadGrid(
        points,
        number[np.concatenate(cells)],
        np.concatenate(owners),
        np.concatenate(shares),
        tuple(number[axis] for axis in axes),
        tuple(stations),
    )


def _corners(outline: SolidOutline, point: int) -> Iterator[tuple[int, int, int, complex]]:
    """Yield the corners of strips that meet at a point.

    Each item contains the index of the strip, its end (0 or 1), the side (+1 left or -1 right of its axis), and the
    position of the corner (complex) [m].
    """
    ends = outline.ends_at(point)
    if len(ends) < 2:
        return
    out = [outline.way(outline.strips[k]) * (1 - 2 * end) for k, end in ends]
    order = sorted(range(len(ends)), key=lambda number: float(np.angle(out[number])))
    for one, other in zip(order, order[1:] + order[:1], strict=True):
        (k, end), (j, stop) = ends[one], ends[other]
        place = _corner(outline, (k, end, out[one]), (j, stop, out[other]))
        yield k, end, 1 - 2 * end, outline.points[point] + place
        yield j, stop, 2 * stop - 1, outline.points[point] + place


def _corner(
    outline: SolidOutline, first_strip: tuple[int, int, complex], next_strip: tuple[int, int, complex]
) -> complex:
    """Return the intersection of the left edge of a strip and the right edge of the next strip.

    The intersection is relative to the common point of the strips (complex) [m]. `first_strip` and `next_strip` contain
    the index of the strip, the end (0 or 1) at the common point, and the vector from the common point along the axis of
    the strip.
    """
    (k, end, first_way), (j, stop, turned) = first_strip, next_strip
    first, second = (float(outline.strips[number].depth(float(at))) for number, at in ((k, end), (j, stop)))
    d, e = first_way / abs(first_way), turned / abs(turned)
    sine, cosine = (np.conj(d) * e).imag, (np.conj(d) * e).real
    if abs(sine) < MIN_SINE and cosine < 0:
        return complex(1j * (d * first - e * second) / 4)
    sharp = sine > 0 and cosine >= 0
    reach = np.inf if sine == 0 else (second + first * cosine) / (2 * sine)
    back = np.inf if sine == 0 else (first + second * cosine) / (2 * sine)
    if sharp and (reach > MAX_CORNER_REACH * abs(first_way) or back > MAX_CORNER_REACH * abs(turned)):
        angle = np.degrees(np.angle(np.conj(d) * e))
        raise OutlineError(f"two beams meet at {angle:.3g} degrees, {first:.3g} and {second:.3g} m deep: too sharp")
    corner = 1j * d * first / 2 + reach * d
    return complex(corner if sharp else corner * min(1.0, MAX_MITRE * max(first, second) / abs(corner)))


def _rows(
    outline: SolidOutline, k: int, sides: dict[tuple[int, int, int], complex], across: int
) -> tuple[Complexes, Reals, Reals, int]:
    """Return the mesh points of a strip in rows across its depth.

    Returns
    -------
    Points (complex) [m], shape (rows, across + 1). Beam length between neighbouring rows [m], 0 beyond the end points.
    xi of the rows between the end points. Number of rows before the start point.
    """
    strip = outline.strips[k]
    way, start = outline.way(strip), outline.points[strip.start]
    length, axis = abs(way), way / abs(way)
    if _deepest(strip) > length:
        raise OutlineError(f"a beam of {length:.3g} m is as deep as it is long")
    eta, xi = np.linspace(-1.0, 1.0, across + 1), _stations(strip, length, across)
    skew = np.zeros((2, len(eta)))
    hubs = []
    for end, point in enumerate((strip.start, strip.end)):
        if (k, end, 1) in sides:
            arms = [(sides[k, end, side] - outline.points[point]) / axis for side in (-1, 1)]
            hubs.append(np.abs(eta) * np.where(eta > 0, arms[1], arms[0]))
            skew[end] = hubs[-1].real
        else:
            hubs.append(1j * eta * strip.depth(float(end)) / 2)
    x = xi[:, None] * length
    for own, way_in in zip(skew, (x, length - x), strict=True):
        x = (
            x
            + own * np.maximum(1.0 - way_in / min(length, SKEW_LENGTH * np.abs(own).max() + _deepest(strip)), 0.0) ** 2
        )
    rows = x + 1j * eta * strip.depth(np.clip(x / length, 0.0, 1.0)) / 2
    rows[0], rows[-1] = hubs[0], length + hubs[1]
    share = np.diff(xi) * length
    before, after = ((k, end, 1) not in sides for end in (0, 1))
    steps = np.arange(1, across // 2 + 1)[:, None] / across
    if before:
        rows = np.concatenate((rows[0] - steps[::-1] * strip.depth(0.0), rows))
        share = np.concatenate((np.zeros(len(steps)), share))
    if after:
        rows = np.concatenate((rows, rows[-1] + steps * strip.depth(1.0)))
        share = np.concatenate((share, np.zeros(len(steps))))
    return start + axis * rows, share, xi, len(steps) if before else 0


def _deepest(strip: Strip) -> float:
    return float(strip.depth(np.linspace(0.0, 1.0, 33)).max())


def _stations(strip: Strip, length: float, across: int) -> Reals:
    """Return xi of the rows of mesh points between the ends of a beam.

    The elements are about square at the ends, and longer towards the middle (see `ELEMENT_GROWTH`, `MAX_ELEMENTS`).
    """
    fine = np.linspace(0.0, 1.0, 2001)
    depth = strip.depth(fine)
    near = (depth + 4 * ELEMENT_GROWTH * length * np.minimum(fine, 1 - fine)) / across
    longest = np.maximum(depth, length / MAX_ELEMENTS) * 2 / across
    density = length / np.minimum(near, longest)
    total = np.concatenate(([0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(fine))))
    count = int(np.ceil(total[-1] / 2)) * 2
    return np.interp(np.linspace(0.0, total[-1], count + 1), total, fine)


def _merged(places: Complexes, size: float) -> tuple[Complexes, Integers]:
    """Merge coincident points, and return the new index of each old point."""
    pairs = np.round(np.stack((places.real, places.imag), axis=1) / (MERGE_DISTANCE * size) + np.pi)
    _, kept, number = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    return places[kept], number.reshape(-1)
