"""Moving labels: names of points and links, and the peak value."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from animations.diagrams import Diagram, steady, values_of
from animations.layers import Stack
from animations.layout import Scales, View
from animations.placing import Ink, Label, half_of, kept_inside, within
from animations.shapes import Complexes, FlatShape, beams, moved_beams
from animations.solid_mechanism import sections_of
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection
from rigid import Reals
from rigid.arrays import Integers

SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 2, 0, 4, 5, 7, 6]))  # candidate directions from a point to its name
NAME_GAPS = (0.25, 1.0)  # distances between a name and its point, in letter heights
PEAK_SIDES = np.exp(0.25j * np.pi * np.array([0, 1, -1, 4, 3, -3, 2, -2]))  # directions from the ordinate's end
DOT_RADIUS = 0.35  # radius of the peak dot, relative to a pin's diameter
# Penalties of a label's position, measured as letter heights of a hidden line one pixel wide: farther from its point,
# over another label, nearer to another point, partly outside.
FARTHER_COST, OVERLAP_COST, WRONG_POINT_COST, OUTSIDE_COST = 1.0, 25.0, 25.0, 50.0
CHANGE_COST = 3.0  # penalty if a label changes sides between two sampled positions, in the same unit


def name_labels(
    deflection: Deflection, scales: Scales, view: View, style: Style, ink: Ink, moved: float
) -> list[Label]:
    """Place the requested names of points and links so that they hide little of the drawing and rarely change sides.

    Parameters
    ----------
    ink
        Everything drawn, at a sample of positions.
    moved
        Exaggeration of the displacements.
    """
    height = 0.026 * style.unit
    labels: list[Label] = []
    named = list(_named(deflection, style, moved))
    points = np.array([view.flat(place) for _, place, _, is_point in named if is_point])
    for text, place, pin, is_point in named:
        anchor = view.flat(place)
        half = half_of(text, height)
        away = [0.5 * pin * scales.pin * view.pixels + share * height for share in NAME_GAPS]
        ways = np.concatenate([_reach(SIDES, half) + SIDES * each for each in away])
        there = anchor + ways[:, None]
        cost = FARTHER_COST * (np.arange(len(ways)) >= len(SIDES))[:, None] + OUTSIDE_COST * (
            np.abs(kept_inside(there, half, style) - there) > 0
        )
        if is_point:
            nearest = np.min(np.abs(there - points[:, None]), axis=0)
            cost += WRONG_POINT_COST * (nearest < (1 - 1e-9) * np.abs(there - anchor))
        for other in labels:
            cost += OVERLAP_COST * within(there - other.middle, half + other.half)
        steps = np.arange(there.shape[1])
        nearest_sample = np.abs(steps[:, None] - ink.positions).argmin(axis=1)
        side = _sides(ink.hidden(there, half) / height + cost[:, ink.positions].T)[nearest_sample]
        best = kept_inside(there[side, steps], half, style)
        labels.append(Label(text, best, height, "ink" if is_point else "soft", half))
    return labels


def _sides(cost: Reals) -> Integers:
    """Return the side at each position that minimises the cost, shape (positions, sides), plus that of changes."""
    best, before = cost[0], []
    for here in cost[1:]:
        stays = best <= best.min() + CHANGE_COST
        before.append(np.where(stays, np.arange(len(best)), best.argmin()))
        best = here + np.where(stays, best, best.min() + CHANGE_COST)
    sides = [int(best.argmin())]
    for earlier in reversed(before):
        sides.append(int(earlier[sides[-1]]))
    return np.array(sides[::-1])


def _named(deflection: Deflection, style: Style, moved: float) -> Iterator[tuple[str, Complexes, bool, bool]]:
    """Yield each name, its position [m], whether to clear a pin, and whether it names a point."""
    links = deflection.motion.mechanism.links
    if "names" in style.show:
        points = {name: number for number, link in reversed(list(enumerate(links))) for name in link.points}
        for name, number in points.items():
            yield name, moved_place(deflection, number, name, moved), True, True
    for number, link in enumerate(links[1:] if "links" in style.show else (), 1):
        names = list(link.points)[:2]
        middle = np.mean([moved_place(deflection, number, name, moved) for name in names], axis=0)
        yield link.name, middle, len(names) == 1, False


def _reach(way: Complexes, half: complex) -> Complexes:
    """Offset from the edge of a text box to its middle, in a direction [pixels]."""
    return way.real * half.real + 1j * way.imag * half.imag


def peak_label(
    deflection: Deflection,
    diagram: Diagram,
    scales: Scales,
    view: View,
    style: Style,
    names: Sequence[Label] = (),
    marks: Sequence[FlatShape] = (),
    stack: Stack | None = None,
) -> tuple[Complexes, Label]:
    """Label the value of largest magnitude at each position, from 49 stations per beam.

    Parameters
    ----------
    names, marks
        Labels and lines to avoid if possible, in addition to the links.
    stack
        Layers of the links, if they are drawn solid.

    Returns
    -------
    Its position [m], complex, shape (positions,), and the label.
    """
    values = values_of(deflection, diagram)
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0).swapaxes(0, 1)  # positions, beams, stations
    beam, station = np.unravel_index(sizes.reshape(len(sizes), -1).argmax(-1), sizes.shape[1:])
    position = np.arange(len(sizes))
    value, along = values[beam, position, station], beams(deflection).along[beam, position]
    axis = moved_beams(deflection, 0.0 if scales.scale else scales.exaggeration)
    lines = np.array([axis(int(each)) for each in position])
    place = lines[position, beam, station]
    links = view.flat(lines.reshape(len(lines), -1))
    depth = np.zeros(len(place))
    if stack:
        place = place + np.array([view.aside(stack.middle[at]) for at, _ in deflection.motion.mechanism.beams])[beam]
        depth = np.array([section.depth for section in sections_of(deflection, scales)])[beam, station]
    if scales.scale:
        place = place + 1j * scales.scale * along * value
    aside = np.where(value < 0 if scales.scale else along.real < 0, -1j, 1j) * along
    written = steady(scales.peak, diagram.unit)
    text, height = [written(float(each)) for each in value], 0.03 * style.unit
    half = half_of(max(text, key=len), height)
    ways = aside * PEAK_SIDES[:, None]
    off = (DOT_RADIUS * scales.pin + depth / 2) * view.pixels + 0.2 * height
    corner = ways / np.maximum(np.abs(ways.real), np.abs(ways.imag))
    middles = view.flat(place) + _reach(corner, half) + ways * off
    hides: Any = 1.0 * (np.abs(kept_inside(middles, half, style) - middles) > 0)
    hides = hides + sum(within(name.middle - middles, half + name.half) for name in names)
    marked = (view.flat(np.array([mark.place(int(each)) for each in position])) for mark in marks)
    for points in (links, *marked):
        hidden = within(points - middles[..., None], half)
        hides = hides + 0.5 * hidden.any(axis=-1) + hidden.mean(axis=-1)
    return place, Label(text, kept_inside(middles[hides.argmin(0), position], half, style), height, "ink", half)
