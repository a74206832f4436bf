"""Placement of moving labels: the cost of hiding parts of the drawing, and overlaps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from animations.layout import FOOT, HEAD, View
from animations.legend import LETTER_WIDTH
from animations.shapes import Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style
from rigid import Reals
from rigid.arrays import Flags

POINT_COST = 0.35  # cost of hiding a point of a body, in steps of a one pixel line; most are at eyes and axles


@dataclass(frozen=True, eq=False)
class Label:
    """Text, constant or per position, and its middle [pixels], complex.

    Attributes
    ----------
    half
        Half width and half height [pixels].
    shown
        Whether it is visible at each position; None if always.
    """

    text: str | Sequence[str]
    middle: Complexes
    height: float
    ink: str
    half: complex
    shown: NDArray[Any] | None = None

    def at(self, position: int) -> str:
        """Text at a position, or "" if hidden."""
        if self.shown is not None and not self.shown[position]:
            return ""
        return self.text if isinstance(self.text, str) else self.text[position]


def half_of(text: str, height: float) -> complex:
    """Half width and half height of a text [pixels]."""
    return complex(0.5 * LETTER_WIDTH * len(text) + 0.15, 0.6) * height


def within(way: Complexes, half: Any) -> Flags:
    """Whether an offset from the middle of a box is inside it."""
    return (np.abs(way.real) < half.real) & (np.abs(way.imag) < half.imag)


def meeting(one: Label, other: Label) -> Flags:
    """Whether two labels overlap, at each position."""
    return within(one.middle - other.middle, one.half + other.half)


def without_overlaps(labels: Sequence[Label]) -> list[Label]:
    """Hide each label at positions at which it overlaps an earlier, visible one."""
    kept: list[Label] = []
    for label in labels:
        free = np.ones(len(label.middle), bool)
        for other in kept:
            free &= ~(meeting(label, other) & (True if other.shown is None else other.shown))
        kept.append(label if free.all() else replace(label, shown=free))
    return kept


def kept_inside(middle: Complexes, half: complex, style: Style) -> Complexes:
    """Shift the middles [pixels] so that a text stays inside the margins and clear of the title and the legend."""
    (width, height), unit = style.size, style.unit
    return np.clip(middle.real, half.real, width - half.real) + 1j * np.clip(
        middle.imag, FOOT * unit + half.imag, height - HEAD * unit - half.imag
    )


@dataclass(frozen=True, eq=False)
class Ink:
    """Everything drawn at a sample of positions, in small pieces.

    Attributes
    ----------
    positions
        Position numbers.
    places, areas
        Middles [pixels], complex, and areas of the pieces, one array per position. An area is length [pixels] times
        `FlatShape.width`.
    """

    positions: list[int]
    places: list[Complexes]
    areas: list[Reals]

    def hidden(self, middle: Complexes, half: complex) -> Reals:
        """Area that texts of equal size hide at the sampled positions, shape (positions, texts).

        Parameters
        ----------
        middle
            Middles of the texts at all positions of the mechanism, shape (texts, positions).
        """
        areas_hidden = []
        for position, places, areas in zip(self.positions, self.places, self.areas, strict=True):
            here = middle[:, position]
            far = abs(half) + np.max(np.abs(here - here[0]))
            near = np.abs(places - here[0]) < far
            areas_hidden.append(within(places[near] - here[:, None], half) @ areas[near])
        return np.array(areas_hidden)


def ink_of(
    shapes: Sequence[FlatShape], bodies: Sequence[SolidShape], view: View, positions: Sequence[int], step: float
) -> Ink:
    """Split lines into pieces of at most `step` [pixels], and add the points of bodies."""
    pairs, widths, first = [np.zeros((0, 2), int)], [np.zeros(0)], 0
    for shape in shapes:
        for line in shape.lines:
            pairs.append(first + np.stack([line[:-1], line[1:]], -1))
            widths.append(np.full(len(line) - 1, shape.width))
        first += len(shape.place(positions[0]))
    start, end = np.concatenate(pairs).T
    width = np.concatenate(widths)
    places, areas = [], []
    for position in positions:
        points = view.flat(np.concatenate([np.zeros(0), *(shape.place(position) for shape in shapes)]))
        vector = points[end] - points[start]
        count = np.maximum(np.ceil(np.abs(vector) / step), 1).astype(int)
        piece = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[piece]
        solid = np.concatenate([np.zeros((0, 3)), *(view.solid(body.place(position)[0]) for body in bodies)])
        places.append(np.append(points[start][piece] + share * vector[piece], solid[:, 0] + 1j * solid[:, 1]))
        areas.append(np.append((np.abs(vector) * width / count)[piece], np.full(len(solid), POINT_COST * step)))
    return Ink(list(positions), places, areas)
