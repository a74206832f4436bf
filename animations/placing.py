"""Placement of moving labels: cost of hiding parts of the drawing, and removal of overlaps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from animations.layout import FOOT, HEAD, View
from animations.legend import LETTER_WIDTH
from animations.shapes import QUIET, Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style
from rigid import Reals
from rigid.arrays import Flags, Integers

LINKS = ("link", "curve", "outline")  # levels of shapes that belong to links, except thin lines in the colour `QUIET`
CROSSING_COST, COVER_COST = 10.0, 1000.0  # costs of a label that covers a thin line, a link or another label
POINT_COST = 0.35  # area of a point of a solid body / area of a step of a line one pixel wide


@dataclass(frozen=True, eq=False)
class Label:
    """Text, constant or for each position, and the position of its centre [pixels], complex.

    Attributes
    ----------
    half
        Half width + i half height [pixels].
    shown
        True at positions at which the label is visible; None if it is always visible.
    """

    text: str | Sequence[str]
    middle: Complexes
    height: float
    ink: str
    half: complex
    shown: NDArray[Any] | None = None

    def at(self, position: int) -> str:
        """Return the text at a position, or "" if the label is hidden."""
        if self.shown is not None and not self.shown[position]:
            return ""
        return self.text if isinstance(self.text, str) else self.text[position]


def half_of(text: str, height: float) -> complex:
    """Return half width + i half height of a text [pixels]."""
    return complex(0.5 * LETTER_WIDTH * len(text) + 0.15, 0.6) * height


def within(way: Complexes, half: Any) -> Flags:
    """Return whether a point is inside a box, given its offset from the centre and the half size of the box."""
    return (np.abs(way.real) < half.real) & (np.abs(way.imag) < half.imag)


def meeting(one: Label, other: Label) -> Flags:
    """Return for each position whether two labels overlap."""
    return within(one.middle - other.middle, one.half + other.half)


def without_overlaps(labels: Sequence[Label]) -> list[Label]:
    """Hide each label at positions at which it overlaps an earlier label that is visible."""
    kept: list[Label] = []
    for label in labels:
        free = np.ones(len(label.middle), bool) if label.shown is None else label.shown.copy()
        for other in kept:
            free &= ~(meeting(label, other) & (True if other.shown is None else other.shown))
        kept.append(label if free.all() else replace(label, shown=free))
    return kept


def kept_inside(middle: Complexes, half: complex, style: Style) -> Complexes:
    """Shift the centres of a text [pixels] such that it is inside the picture and clear of title and legend."""
    (width, height), unit = style.size, style.unit
    return np.clip(middle.real, half.real, width - half.real) + 1j * np.clip(
        middle.imag, FOOT * unit + half.imag, height - HEAD * unit - half.imag
    )


@dataclass(frozen=True, eq=False)
class Ink:
    """Everything that is drawn at a sample of positions, divided into small pieces.

    Attributes
    ----------
    positions
        Indices of the positions.
    places, areas
        Centres [pixels], complex, and areas of the pieces, one array per position. An area is the length [pixels] times
        `FlatShape.width`.
    of_links
        True for pieces that belong to a link, one array per position.
    """

    positions: list[int]
    places: list[Complexes]
    areas: list[Reals]
    of_links: list[Flags]

    def nearest(self, positions: Integers) -> Integers:
        """Return the index of the sample nearest to each position."""
        return np.abs(positions[:, None] - self.positions).argmin(axis=1)

    def hidden(self, middle: Complexes, half: complex) -> Reals:
        """Return the area that texts of equal size hide at the sampled positions, shape (positions, texts).

        Parameters
        ----------
        middle
            Centres of the texts at all positions of the mechanism, shape (texts, positions).
        """
        return self._hidden(middle, half)[..., 0]

    def cost(self, middle: Complexes, half: complex, height: float) -> Reals:
        """Return the cost of texts for the arguments of `hidden`, in letter heights of a line one pixel wide."""
        area, links = np.moveaxis(self._hidden(middle, half), -1, 0)
        return area / height + CROSSING_COST * (area > 0) + COVER_COST * (links > 0)

    def _hidden(self, middle: Complexes, half: complex) -> Reals:
        """Return the hidden area of everything and of links, shape (positions, texts, 2)."""
        areas_hidden = []
        for position, places, areas, links in zip(self.positions, self.places, self.areas, self.of_links, strict=True):
            here = middle[:, position]
            low, high = here.real.min() + 1j * here.imag.min() - half, here.real.max() + 1j * here.imag.max() + half
            near = within(places - (low + high) / 2, (high - low) / 2)
            both = np.stack([areas[near], areas[near] * links[near]], -1)
            areas_hidden.append(within(places[near] - here[:, None], half) @ both)
        return np.array(areas_hidden)


def ink_of(
    shapes: Sequence[FlatShape], bodies: Sequence[SolidShape], view: View, positions: Sequence[int], step: float
) -> Ink:
    """Split the lines of shapes into pieces no longer than `step` [pixels], and add the points of solid bodies."""
    pairs, widths, first, links = [np.zeros((0, 2), int)], [np.zeros(0)], 0, [np.zeros(0, bool)]
    for shape in shapes:
        for line in shape.lines:
            pairs.append(first + np.stack([line[:-1], line[1:]], -1))
            widths.append(np.full(len(line) - 1, shape.width))
            links.append(np.full(len(line) - 1, shape.level in LINKS and shape.ink != QUIET))
        first += len(shape.place(positions[0]))
    start, end = np.concatenate(pairs).T
    width, is_link = np.concatenate(widths), np.concatenate(links)
    places, areas, of_links = [], [], []
    for position in positions:
        points = view.flat(np.concatenate([np.zeros(0), *(shape.place(position) for shape in shapes)]))
        vector = points[end] - points[start]
        count = np.maximum(np.ceil(np.abs(vector) / step), 1).astype(int)
        piece = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[piece]
        solid = np.concatenate([np.zeros((0, 3)), *(view.solid(body.place(position)[0]) for body in bodies)])
        places.append(np.append(points[start][piece] + share * vector[piece], solid[:, 0] + 1j * solid[:, 1]))
        areas.append(np.append((np.abs(vector) * width / count)[piece], np.full(len(solid), POINT_COST * step)))
        of_links.append(np.append(is_link[piece], np.ones(len(solid), bool)))
    return Ink(list(positions), places, areas, of_links)
