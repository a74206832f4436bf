"""Places of texts that move with the drawing: how much of it they hide, and which are left out where two would meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from animations.layout import FOOT, HEAD, View
from animations.legend import LETTER
from animations.shapes import Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style
from rigid import Reals
from rigid.arrays import Flags

SPOT = 0.35  # steps of a line, one pixel wide, that are as bad to hide as a point of a body: most are at eyes and axles


@dataclass(frozen=True, eq=False)
class Label:
    """A text, one for all positions or one for each, and its middle at every position in pixels, complex.

    Attributes
    ----------
    half
        Half its width and height [pixels].
    shown
        Whether it is seen, at every position; None: always.
    """

    text: str | Sequence[str]
    middle: Complexes
    height: float
    ink: str
    half: complex
    shown: NDArray[Any] | None = None

    def at(self, position: int) -> str:
        """Its text at a position; nothing where it is left out."""
        if self.shown is not None and not self.shown[position]:
            return ""
        return self.text if isinstance(self.text, str) else self.text[position]


def half_of(text: str, height: float) -> complex:
    """Half the width and the height of a text [pixels]."""
    return complex(0.5 * LETTER * len(text) + 0.15, 0.6) * height


def within(way: Complexes, half: Any) -> Flags:
    """Whether something so far from the middle of a box lies in it."""
    inside: Flags = (np.abs(way.real) < half.real) & (np.abs(way.imag) < half.imag)
    return inside


def meeting(one: Label, other: Label) -> Flags:
    """Whether two labels lie over each other, at every position."""
    return within(one.middle - other.middle, one.half + other.half)


def without_overlaps(labels: Sequence[Label]) -> list[Label]:
    """The same labels, each left out where it would lie over one before it that is seen."""
    kept: list[Label] = []
    for label in labels:
        free = np.ones(len(label.middle), bool)
        for other in kept:
            free &= ~(meeting(label, other) & (True if other.shown is None else other.shown))
        kept.append(label if free.all() else replace(label, shown=free))
    return kept


def kept_inside(middle: Complexes, half: complex, style: Style) -> Complexes:
    """Middles moved so that a text stays between the sides, head and foot [pixels]."""
    (width, height), unit = style.size, style.unit
    inside: Complexes = np.clip(middle.real, half.real, width - half.real) + 1j * np.clip(
        middle.imag, FOOT * unit + half.imag, height - HEAD * unit - half.imag
    )
    return inside


@dataclass(frozen=True, eq=False)
class Ink:
    """Everything drawn at some positions, in small pieces.

    Attributes
    ----------
    positions
        Their numbers.
    places, areas
        Middles [pixels], complex, and areas of the pieces, an array each for every position: length [pixels] times
        `FlatShape.width`.
    """

    positions: list[int]
    places: list[Complexes]
    areas: list[Reals]

    def hidden(self, middle: Complexes, half: complex) -> Reals:
        """Drawn area under texts of one size, a mean over the positions.

        Parameters
        ----------
        middle
            Of texts at all positions of the mechanism, shape (texts, positions).
        """
        total = np.zeros(len(middle))
        for position, places, areas in zip(self.positions, self.places, self.areas, strict=True):
            here = middle[:, position]
            far = abs(half) + np.max(np.abs(here - here[0]))
            near = np.abs(places - here[0]) < far
            total += within(places[near] - here[:, None], half) @ areas[near]
        return total / len(self.positions)


def ink_of(
    shapes: Sequence[FlatShape], bodies: Sequence[SolidShape], view: View, positions: Sequence[int], step: float
) -> Ink:
    """The lines of shapes, in pieces not longer than a step [pixels], and the points of bodies."""
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
        areas.append(np.append((np.abs(vector) * width / count)[piece], np.full(len(solid), SPOT * step)))
    return Ink(list(positions), places, areas)
