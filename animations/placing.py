"""Placement of moving labels: cost of hiding parts of the drawing, and removal of overlaps."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from animations.layout import FOOT, HEAD, View
from animations.legend import LETTER_WIDTH
from animations.shapes import QUIET, Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style
from rigid import Reals
from rigid.arrays import Flags, Integers

# `FlatShape.level` of shapes that belong to links. Shapes in the colour `QUIET` are exceptions.
LINKS = ("link", "curve", "outline")
CROSSING_COST = 10.0  # cost of a label that covers anything that is drawn (unit: see the costs in `labels`)
COVER_COST = 1000.0  # additional cost if it covers a link or another label
POINT_AREA = 0.35  # area in `Ink` for each point of a solid body, relative to `step` (see `ink_of`) times one pixel


class Label(Struct, frozen=True, eq=False):
    """Text that moves with the mechanism.

    Attributes
    ----------
    text
        Text, either constant or one text for each position.
    middle
        Centre of the text at each position [pixels], complex.
    half
        Half width + i half height [pixels].
    shown
        True at positions at which the label is visible; None if it is always visible.
    foot
        End of the leader line at each position [pixels], complex; nan at positions without a leader line.
    """

    text: str | Sequence[str]
    middle: Complexes
    height: float
    ink: str
    half: complex
    shown: NDArray[Any] | None = None
    foot: Complexes | None = None

    def leader(self, position: int) -> Complexes:
        """Return both ends of the leader line at a position [pixels], or the text's centre twice if there is none."""
        middle = self.middle[position]
        foot = middle if self.foot is None or not self.at(position) else self.foot[position]
        if np.isnan(foot):
            foot = middle
        way, half = foot - middle, self.half
        edge = complex(np.clip(way.real, -half.real, half.real), np.clip(way.imag, -half.imag, half.imag))
        return np.array([foot, middle + edge])

    def at(self, position: int) -> str:
        """Return the text at a position, or "" if the label is hidden."""
        if self.shown is not None and not self.shown[position]:
            return ""
        return self.text if isinstance(self.text, str) else self.text[position]


def half_of(text: str, height: float) -> complex:
    """Return half width + i half height of a text [pixels]."""
    return complex(0.5 * LETTER_WIDTH * len(text) + 0.15, 0.6) * height


def within(way: Complexes, half: Any) -> Flags:
    """Return whether a point is inside a box. `way` is its offset from the centre, `half` half the size of the box."""
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


class Ink(Struct, frozen=True, eq=False):
    """Everything that is drawn at a sample of positions, divided into small pieces.

    Attributes
    ----------
    positions
        Indices of the positions.
    places, areas
        Centres [pixels], complex, and areas of the pieces, one array per position. The area of a piece of a line is its
        length [pixels] times `FlatShape.width`.
    of_links
        True for pieces that belong to a link, one array per position.
    """

    positions: list[int]
    places: list[Complexes]
    areas: list[Reals]
    of_links: list[Flags]

    def nearest(self, positions: Integers) -> Integers:
        """Return the index in `self.positions` of the sampled position nearest to each of `positions`."""
        return np.abs(positions[:, None] - self.positions).argmin(axis=1)

    def hidden(self, middle: Complexes, half: complex) -> Reals:
        """Return the area [pixels^2] that each text hides at each sampled position, shape (positions, texts).

        Parameters
        ----------
        middle
            Centres of the texts at all positions of the mechanism [pixels], complex, shape (texts, positions).
        half
            Half width + i half height, equal for all texts [pixels].
        """
        return self._hidden(middle, half)[..., 0]

    def cost(self, middle: Complexes, half: complex, height: float) -> Reals:
        """Return the cost of each text at each sampled position, shape (positions, texts).

        The cost 1 is that of hiding a line one letter height long and one pixel wide. `middle` and `half` are as in
        `hidden`.
        """
        area, links = np.moveaxis(self._hidden(middle, half), -1, 0)
        return area / height + CROSSING_COST * (area > 0) + COVER_COST * (links > 0)

    def _hidden(self, middle: Complexes, half: complex) -> Reals:
        """Return two hidden areas: of everything drawn, and of links alone, shape (positions, texts, 2)."""
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
        areas.append(np.append((np.abs(vector) * width / count)[piece], np.full(len(solid), POINT_AREA * step)))
        of_links.append(np.append(is_link[piece], np.ones(len(solid), bool)))
    return Ink(list(positions), places, areas, of_links)
