"""Scales and view of a picture, which are the same at all positions."""

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from animations.diagrams import MOTION, SHAPE, Diagram, peak, round_below
from animations.shapes import Complexes
from animations.style import Style
from elastic import Deflection, sample
from rigid import Reals, position_of
from symbols import PIN_RADIUS

MAX_ORDINATE = 0.17  # largest ordinate, relative to the size of the mechanism
MAX_DISPLACEMENT = 0.10  # largest displacement with automatic exaggeration, relative to the size of the mechanism
PIN_SIZE, MIN_PIN_SIZE = 0.026, 0.009  # largest and smallest diameter of a pin, relative to the size of the mechanism
MAX_PIN_SHARE = 0.4  # largest diameter of a pin, relative to the shortest link; `MIN_PIN_SIZE` takes precedence
HEAD, FOOT, MARGIN = 0.12, 0.095, 0.03  # heights of title and legend, and width of the margin, relative to `Style.unit`
TILT, YAW = np.radians(28.0), np.radians(-18.0)  # view of solid links: angles to look from above and from the left


class Scales(Struct, frozen=True, eq=False):
    """Scales of a diagram.

    Attributes
    ----------
    peak
        Largest magnitude of the diagram over the cycle [unit of the field].
    scale
        Length of an ordinate per unit of the field [m].
    exaggeration
        Exaggeration factor of the displacements.
    pin
        Diameter of a pin [m].
    size
        Larger of the width and height of the area that the mechanism sweeps [m].
    """

    peak: float
    scale: float
    exaggeration: float
    pin: float
    size: float

    @property
    def symbol(self) -> float:
        """Size of the symbols [m]."""
        return self.pin / (2 * PIN_RADIUS)


class View(Struct, frozen=True, eq=False):
    """Transformation from mechanism coordinates to pixels.

    Attributes
    ----------
    corner, pixels
        Lower left corner of the picture in view coordinates [m], and number of pixels per metre.
    turn
        Rotation from (x, y, z) to (right, up, towards the viewer), shape (3, 3).
    """

    corner: complex
    pixels: float
    turn: Reals

    def flat(self, points: Complexes) -> Complexes:
        """Project points in the plane of motion [m] to pixels, complex."""
        return (_seen(points, self.turn) - self.corner) * self.pixels

    def aside(self, z: float) -> complex:
        """Return the shift in the plane of motion [m] that looks the same in the picture as a shift by `z` [m]."""
        right, up = np.linalg.solve(self.turn[:2, :2], self.turn[:2, 2] * z)
        return complex(right, up)

    def solid(self, points: Reals) -> Reals:
        """Project points in space [m], shape (points, 3), to pixels."""
        return (points @ self.turn.T - [self.corner.real, self.corner.imag, 0.0]) * self.pixels


def turn_of(look: str) -> Reals:
    """Return the rotation of the view for a look, see `View.turn`."""
    if look == "plain":
        return np.eye(3)
    c, s = np.cos((TILT, YAW)), np.sin((TILT, YAW))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, c[0], -s[0]], [0.0, s[0], c[0]]])
    return about_x @ np.array([[c[1], 0.0, -s[1]], [0.0, 1.0, 0.0], [s[1], 0.0, c[1]]])


def drawable(deflection: Deflection, diagram: Diagram) -> NDArray[np.intp]:
    """Return the indices of the positions that can be drawn, i.e. that are neither singular nor unreachable.

    Raises
    ------
    ValueError
        If there are several designs, no position can be drawn, or a diagram is requested but there is no beam.
    """
    motion = deflection.motion
    if len(motion.columns) != 1:
        raise ValueError(f"columns of shape {motion.columns}: pictures show only one design")
    if not deflection.sections and diagram is not MOTION:
        raise ValueError('no link has beams: choose the diagram "motion"')
    parts: list[Any] = [motion.origin]
    if diagram is not MOTION:
        parts += [deflection.shift, deflection.w, deflection.u]
    if diagram.field is not None:
        values = sample(deflection, diagram.field, [0.0, 1.0]).swapaxes(1, 2)
        beams_known = np.isfinite(values).any(axis=(1, 2))
        if len(values) and not beams_known.any() and np.isfinite(deflection.w).any():
            raise ValueError(f"the {diagram.title} is unknown, because the sections have no dimensions")
        parts.append(values[beams_known])
    good = np.logical_and.reduce([np.isfinite(part).all(axis=tuple(range(part.ndim - 1))) for part in parts])
    if not good.any():
        raise ValueError(f"no position can be drawn: all {good.size} are singular or out of reach")
    return np.flatnonzero(good)


def scales_of(deflection: Deflection, diagram: Diagram, style: Style) -> Scales:
    """Choose scales that are suitable for all positions.

    Raises
    ------
    ValueError
        If `drawable` raises it, or the mechanism has no extent.
    """
    skeleton = _skeleton(deflection)[:, drawable(deflection, diagram)]
    size = float(max(np.ptp(skeleton.real), np.ptp(skeleton.imag)))
    if size == 0.0:
        raise ValueError("the mechanism has no extent: all points coincide")
    greatest = peak(deflection, diagram)
    ordinates = diagram.field is not None and style.look == "plain"
    scale = style.scale or MAX_ORDINATE * size / greatest if greatest and ordinates else 0.0
    exaggeration = 0.0
    if diagram is not MOTION and (not ordinates or "deformed" in style.show):
        moved = greatest if diagram is SHAPE else peak(deflection, SHAPE)
        exaggeration = style.exaggeration or (max(1.0, round_below(MAX_DISPLACEMENT * size / moved)) if moved else 1.0)
    pin = min(PIN_SIZE * size, max(MIN_PIN_SIZE * size, MAX_PIN_SHARE * _shortest(deflection)))
    return Scales(greatest, scale, exaggeration, pin, size)


def view_of(places: Iterable[Complexes], style: Style, turn: Reals) -> View:
    """Return the view in which all `places` (view coordinates [m]) fit between the title and the legend."""
    seen = list(places)
    (left, right), (low, high) = (
        (min(part.min() for part in parts), max(part.max() for part in parts))
        for parts in ([each.real for each in seen], [each.imag for each in seen])
    )
    (width, height), unit = style.size, style.unit
    room = (width - 2 * MARGIN * unit, height - (HEAD + FOOT) * unit)
    if {"names", "links"} & set(style.show):
        room = (room[0] - 0.1 * unit, room[1] - 0.07 * unit)
    pixels = min(size / extent for size, extent in zip(room, (right - left, high - low), strict=True) if extent)
    middle = complex(width, height + (FOOT - HEAD) * unit) / 2
    return View(complex(left + right, low + high) / 2 - middle / pixels, float(pixels), turn)


def seen_solid(points: Reals, turn: Reals) -> Complexes:
    """Project points in space, shape (points, 3), to view coordinates [m]."""
    moved = points @ turn.T
    return moved[:, 0] + 1j * moved[:, 1]


def _seen(points: Complexes, turn: Reals) -> Complexes:
    right, up = (complex(turn[0, k], turn[1, k]) for k in (0, 1))
    return points.real * right + points.imag * up


def _skeleton(deflection: Deflection) -> Complexes:
    """Return the positions of all points of all links, shape (points, positions)."""
    motion = deflection.motion
    links = enumerate(motion.mechanism.links)
    return np.array([position_of(motion, at, name) for at, link in links for name in link.points])


def _shortest(deflection: Deflection) -> float:
    """Return the shortest distance between two points of a moving link [m]; infinity if no link has two points."""
    links = deflection.motion.mechanism.links[1:]
    ways = (abs(complex(one - other)) for link in links for one, other in combinations(link.points.values(), 2))
    return min((way for way in ways if way), default=np.inf)
