"""Labels that move with the mechanism: names of points and links, and the value at the peak of every position."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from animations.diagrams import SHAPE, STATIONS, Diagram, steady
from animations.layers import Stack
from animations.layout import FOOT, HEAD, Scales, View
from animations.legend import LETTER
from animations.shapes import Complexes, beams, moved_beams
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection, sample

SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 2, 0, 4, 5, 7, 6]))  # of its place, where a name may stand
DOT = 0.35  # radius of the dot at the peak, of a pin's diameter
WORST = 40.0  # points of the drawing that are as bad to hide as another label


@dataclass(frozen=True, eq=False)
class Label:
    """A text, one for all positions or one for each, and its middle at every position in pixels, complex."""

    text: str | Sequence[str]
    middle: Complexes
    height: float
    ink: str

    def at(self, position: int) -> str:
        """Its text at a position."""
        return self.text if isinstance(self.text, str) else self.text[position]


def name_labels(
    deflection: Deflection, scales: Scales, view: View, style: Style, drawn: Mapping[int, Complexes], moved: float
) -> list[Label]:
    """Names of points and links as the style asks for them, each on that side of its place where it hides least.

    Parameters
    ----------
    drawn
        Points of what is drawn at some positions, in pixels.
    moved
        The exaggeration of the places.
    """
    height, picked = 0.026 * style.size[1], list(drawn)
    labels: list[Label] = []
    for text, place, pin in _named(deflection, style, moved):
        anchor, half = view.flat(place), _half(text, height)
        ways = _reach(SIDES, half) + SIDES * (0.5 * pin * scales.pin * view.pixels + 0.25 * height)
        cost = [_hidden(anchor[picked] + way, half, drawn, labels, style.size) for way in ways]
        labels.append(Label(text, anchor + ways[int(np.argmin(cost))], height, "ink" if pin else "soft"))
    return labels


def _named(deflection: Deflection, style: Style, moved: float) -> Iterator[tuple[str, Complexes, float]]:
    """Names, their places [m] at all positions, and 1.0 where a pin is to be left free."""
    links = deflection.motion.mechanism.links
    if "names" in style.show:
        points = {name: number for number, link in reversed(list(enumerate(links))) for name in link.points}
        for name, number in points.items():
            yield name, moved_place(deflection, number, name, moved), 1.0
    for number, link in enumerate(links[1:] if "links" in style.show else (), 1):
        names = list(link.points)[:2]
        yield link.name, np.mean([moved_place(deflection, number, name, moved) for name in names], axis=0), 0.0


def _hidden(
    middle: Complexes, half: complex, drawn: Mapping[int, Complexes], others: Sequence[Label], size: tuple[int, int]
) -> float:
    """How much a label hides, over some positions: points of the drawing, other labels, itself beyond the picture."""
    hides: Any = 0.0
    for centre, (position, points) in zip(middle, drawn.items(), strict=True):
        hides += np.count_nonzero(_inside(points - centre, half))
        for other in others:
            hides += WORST * _inside(other.middle[position] - centre, half + _half(other.at(position), other.height))
        low, high = centre - half, centre + half
        hides += WORST * (low.real < 0 or high.real > size[0] or low.imag < FOOT * size[1])
        hides += WORST * (high.imag > (1.0 - HEAD) * size[1])
    return float(hides)


def _inside(way: Any, half: complex) -> Any:
    return (np.abs(way.real) < half.real) & (np.abs(way.imag) < half.imag)


def _half(text: str, height: float) -> complex:
    """Half the width and the height of a text [pixels]."""
    return complex(0.5 * LETTER * len(text) + 0.1, 0.55) * height


def _reach(way: Complexes, half: complex) -> Complexes:
    """From the nearest corner or side of a text that stands in a direction to its middle [pixels]."""
    reach: Complexes = way.real * half.real + 1j * way.imag * half.imag
    return reach


def peak_label(
    deflection: Deflection,
    diagram: Diagram,
    scales: Scales,
    view: View,
    style: Style,
    names: Sequence[Label] = (),
    stack: Stack | None = None,
) -> tuple[Complexes, Label]:
    """The value of largest magnitude of every position, of those at 49 stations of every beam.

    Returns
    -------
    Where it is drawn [m], complex, shape (positions,), and its label.
    """
    if diagram is SHAPE:
        values = np.abs(sample(deflection, "u", STATIONS) + 1j * sample(deflection, "w", STATIONS))
    else:
        values = sample(deflection, str(diagram.field), STATIONS)
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0).swapaxes(0, 1)  # positions, beams, stations
    beam, station = np.unravel_index(sizes.reshape(len(sizes), -1).argmax(-1), sizes.shape[1:])
    position = np.arange(len(sizes))
    value, along = values[beam, position, station], beams(deflection).along[beam, position]
    axis = moved_beams(deflection, 0.0 if scales.scale else scales.exaggeration)
    place = np.array([axis(int(p))[b, s] for p, b, s in zip(position, beam, station, strict=True)])
    if stack:
        place = place + np.array([view.aside(stack.middle[at]) for at, _ in deflection.motion.mechanism.beams])[beam]
    if scales.scale:
        place = place + 1j * scales.scale * along * value
    written = steady(scales.peak, diagram.unit)
    text, height = [written(float(each)) for each in value], 0.03 * style.size[1]
    half = _half(max(text, key=len), height)
    way = np.where(value < 0, -1j, 1j) * along if scales.scale else np.full(len(place), 1j)
    ways = way * np.array([1, -1, 1j, -1j])[:, None]  # beyond the ordinate, or where it hides no name
    middles = view.flat(place) + _reach(ways, half) + ways * (DOT * scales.pin * view.pixels + 0.2 * height)
    hides = [_inside(name.middle - middles, half + _half(str(name.text), name.height)) for name in names]
    middle = middles[np.any(hides, axis=0).argmin(0) if hides else 0, position]
    low, high = complex(0, FOOT * style.size[1]) + half, complex(style.size[0], (1.0 - HEAD) * style.size[1]) - half
    kept = np.clip(middle.real, low.real, high.real) + 1j * np.clip(middle.imag, low.imag, high.imag)
    return place, Label(text, kept, height, "ink")
