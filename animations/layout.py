"""Scale and view of a picture: chosen once for all positions, so that nothing jumps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from animations.diagrams import Diagram, peak, round_below
from animations.shapes import Complexes, beams
from elastic import Deflection, sample
from rigid import position_of

TALLEST = 0.17  # greatest ordinate, of the mechanism's size
FARTHEST = 0.10  # greatest displacement in an automatic exaggeration
PIN = 0.026  # a pin's diameter
HEAD, FOOT, MARGIN = 0.13, 0.15, 0.03  # of the picture's height: kept for words, for the legend, and empty


@dataclass(frozen=True)
class Style:
    """How a picture is made.

    Attributes
    ----------
    title
        Over the picture.
    size
        Width and height in pixels, multiples of 16, as films need.
    scale
        Length that one unit of the field is drawn with [m]; None: the largest ordinate is 17 % of the mechanism's size.
    deformed
        Draw the deformed shape over the diagram too.
    exaggeration
        Of the deformed shape; None: a round number that makes the largest displacement about a tenth of the mechanism.
    outlines
        Corners of links' bodies in the links' own axes [m], complex, by the links' names.
    """

    title: str = ""
    size: tuple[int, int] = (1280, 720)
    scale: float | None = None
    deformed: bool = False
    exaggeration: float | None = None
    outlines: Mapping[str, Sequence[complex]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what no picture can be made of."""
        if min(self.size) < 160 or self.size[0] % 16 or self.size[1] % 16:
            raise ValueError(
                f"picture size {self.size[0]} x {self.size[1]}: both must be multiples of 16, 160 at least"
            )
        if self.exaggeration is not None and not self.exaggeration > 0:
            raise ValueError(f"exaggeration {self.exaggeration:g}: it must be positive")
        if self.scale is not None and not self.scale > 0:
            raise ValueError(f"scale {self.scale:g}: it must be positive")


@dataclass(frozen=True, eq=False)
class Layout:
    """Scales of one diagram of one mechanism.

    Attributes
    ----------
    peak
        Greatest absolute value of the diagram over the cycle, in its unit.
    scale
        Length of an ordinate of one unit [m].
    exaggeration
        Of the deformed shape.
    pin
        Diameter of a pin [m].
    corner, pixels
        Lower left corner of the view [m] and pixels a metre.
    """

    peak: float
    scale: float
    exaggeration: float
    pin: float
    corner: complex
    pixels: float


def drawable(deflection: Deflection, diagram: Diagram) -> NDArray[np.intp]:
    """Numbers of the positions that can be drawn: those that are neither singular nor out of reach.

    Raises
    ------
    ValueError
        Several designs at once, or no such position.
    """
    motion = deflection.motion
    if len(motion.columns) != 1:
        raise ValueError(f"pictures show one design, and these columns have shape {motion.columns}: take one design")
    parts = [motion.origin, deflection.shift, deflection.w, deflection.u]
    if diagram.field is not None:
        values = sample(deflection, diagram.field, [0.0, 1.0]).swapaxes(1, 2)
        beams_known = np.isfinite(values).any(axis=(1, 2))
        if len(values) and not beams_known.any() and np.isfinite(deflection.w).any():
            raise ValueError(f"the {diagram.title} is not known: the sections do not tell their dimensions")
        parts.append(values[beams_known])
    good = np.logical_and.reduce([np.isfinite(part).all(axis=tuple(range(part.ndim - 1))) for part in parts])
    if not good.any():
        raise ValueError(f"none of the {good.size} positions can be drawn: all are singular or out of reach")
    return np.flatnonzero(good)


def layout(deflection: Deflection, diagram: Diagram, style: Style) -> Layout:
    """Scales that show every position whole."""
    picked = drawable(deflection, diagram)
    skeleton = _skeleton(deflection)[:, picked]
    size = float(max(np.ptp(skeleton.real), np.ptp(skeleton.imag)))
    if size == 0.0:
        raise ValueError("the mechanism has no extent: there is nothing to draw")
    greatest = peak(deflection, diagram)
    scale = style.scale or (TALLEST * size / greatest if greatest and diagram.field else 0.0)
    exaggeration = 0.0
    if diagram.field is None or style.deformed:
        moved = greatest if diagram.field is None else peak(deflection, Diagram("", "", "m", None))
        exaggeration = style.exaggeration or (max(1.0, round_below(FARTHEST * size / moved)) if moved else 1.0)
    tips = [_tips(deflection, diagram.field, scale)[:, picked].ravel()] if diagram.field and scale else []
    if exaggeration:
        own = sample(deflection, "u", [0.0, 0.5, 1.0]) + 1j * sample(deflection, "w", [0.0, 0.5, 1.0])
        place = beams(deflection)
        stations = place.start[..., None] + (place.length[:, None] * place.along)[..., None] * np.array([0.0, 0.5, 1.0])
        tips.append((stations + exaggeration * place.along[..., None] * own)[:, picked].ravel())
    for name, corners in style.outlines.items():
        if name in deflection.motion.mechanism.index:
            tips += [position_of(deflection.motion, name, complex(corner))[picked] for corner in corners]
    pin = PIN * size
    return Layout(
        greatest, scale, exaggeration, pin, *_view(np.concatenate([skeleton.ravel(), *tips]), pin, style.size)
    )


def _skeleton(deflection: Deflection) -> Complexes:
    """Places of all points of all links, shape (points, positions)."""
    motion = deflection.motion
    links = enumerate(motion.mechanism.links)
    return np.array([position_of(motion, at, name) for at, link in links for name in link.points])


def _tips(deflection: Deflection, field: str, scale: float) -> Complexes:
    """Ends of ordinates of every beam, shape (beams, positions, stations)."""
    stations = np.linspace(0.0, 1.0, 17)
    place = beams(deflection)
    axis = place.start[..., None] + (place.length[:, None] * place.along)[..., None] * stations
    tips: Complexes = axis + 1j * scale * place.along[..., None] * np.nan_to_num(sample(deflection, field, stations))
    return tips


def _view(points: Complexes, pin: float, size: tuple[int, int]) -> tuple[complex, float]:
    """Corner of the view and pixels a metre, such that points and the symbols about them stay between head and foot."""
    width, height = size
    pad = 2.8 * pin
    left, right = points.real.min() - pad, points.real.max() + pad
    low, high = points.imag.min() - pad, points.imag.max() + pad
    room = (width - 2 * MARGIN * height, (1.0 - HEAD - FOOT - 2 * MARGIN) * height)
    pixels = min(room[0] / (right - left), room[1] / (high - low))
    middle = width / 2 + 1j * (FOOT + (1.0 - HEAD - FOOT) / 2) * height
    return complex(left + right, low + high) / 2 - middle / pixels, float(pixels)
