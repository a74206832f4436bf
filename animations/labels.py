"""Labels that move with the mechanism: names of points and links, and the peak value."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from animations.diagrams import STATIONS, Diagram, steady, values_of
from animations.layers import Stack
from animations.layout import Scales, View
from animations.leaders import is_clear, link_edges, longest, with_leader
from animations.placing import COVER_COST, Ink, Label, half_of, kept_inside, within
from animations.shapes import Complexes, FlatShape, beams, moved_beams
from animations.solid_mechanism import sections_of
from animations.style import Style
from animations.symbols import moved_place
from elastic import Deflection
from rigid import Reals
from rigid.arrays import Integers

# Candidate directions from a point to its name (`SIDES`), and from the end of the largest ordinate to its value.
# `PEAK_SIDES` are relative to the direction of that ordinate.
SIDES = np.exp(0.25j * np.pi * np.array([1, 3, 2, 0, 4, 5, 7, 6]))
PEAK_SIDES = np.exp(0.25j * np.pi * np.array([0, 1, -1, 4, 3, -3, 2, -2]))
PLACES = (24, 17, 31, 10, 38)  # indices of the `STATIONS` at which the name of a link may be placed
GAPS = (0.25, 1.0, 2.0, 3.0)  # [letter heights] possible distances of a name from its point or link
PEAK_GAPS = (0.0, 0.8, 1.6)  # [letter heights] possible additional distances of the peak value from the ordinate
MIN_LENGTH = 4.0  # [pin radii] a name is placed beside a line of its link only if the line is longer than this
DOT_RADIUS = 0.35  # radius of the dot at the peak, relative to the diameter of a pin
# Costs of the place of a label. The unit is the cost of hiding a line one letter height long and one pixel wide.
FARTHER_COST = 2.0  # for each further step in `GAPS` or `PEAK_GAPS`
LATER_COST = 0.2  # for each further step in `PLACES`
WRONG_POINT_COST = 25.0  # if the name is nearer to another point than to its own
OUTSIDE_COST = 50.0  # if the label had to be shifted to be inside the picture
LEFT_OUT_COST = 200.0  # if the label is hidden
LEADER_COST = 10.0  # if the name of a link needs a leader line
CHANGE_COST = 100.0  # for each change in side, distance or visibility from one sampled position to the next


def name_labels(
    deflection: Deflection, scales: Scales, view: View, style: Style, ink: Ink, moved: float, stack: Stack | None = None
) -> list[Label]:
    """Place the requested names so that they cover no link and few other lines, and seldom change sides.

    A name is hidden at positions of the mechanism at which hiding costs less than every possible place. Names of points
    are placed before names of links.

    Parameters
    ----------
    ink
        Everything that is drawn, at a sample of positions.
    moved
        Exaggeration factor of the displacements.
    stack
        Layers of the links, if they are drawn solid.
    """
    height, pin = 0.026 * style.unit, 0.5 * scales.pin * view.pixels
    mechanism = deflection.motion.mechanism
    labels: list[Label] = []
    if "names" in style.show:
        numbers = {name: at for at, link in reversed(list(enumerate(mechanism.links))) for name in link.points}
        places = {name: view.flat(moved_place(deflection, at, name, moved)) for name, at in numbers.items()}
        points = np.array(list(places.values()))
        for name, place in places.items():
            there, cost = _around(place, half_of(name, height), pin, height)
            nearest = np.min(np.abs(there - points[:, None]), axis=0)
            cost = cost + WRONG_POINT_COST * (nearest < (1 - 1e-9) * np.abs(there - place))
            labels.append(_label(name, height, "ink", there, cost, style, ink, labels))
    if "links" not in style.show:
        return labels
    beam_of = {at: beam for beam, (at, _) in reversed(list(enumerate(mechanism.beams)))}
    axes = moved_beams(deflection, moved)
    lines = np.array([axes(position) for position in range(deflection.motion.columns[-1])])
    edges = link_edges(deflection, scales, view, style, moved, stack)
    for at, link in enumerate(mechanism.links[1:], 1):
        if " " in link.name:
            continue  # do not label the block of a slot
        half = half_of(link.name, height)
        aside = view.aside(stack.middle[at]) if stack else 0.0
        line = longest(edges[at], STATIONS) if at in edges else None
        if at in beam_of:
            depth = sections_of(deflection, scales)[beam_of[at]].depth.max() if stack else 0.0
            there, cost = _beside(view.flat(lines[:, beam_of[at]] + aside), half, 0.5 * depth * view.pixels, height)
        elif line is not None and np.abs(line[0, -1] - line[0, 0]) > MIN_LENGTH * pin:
            there, cost = _beside(line, half, pin, height)
        else:
            middle = np.mean([moved_place(deflection, at, name, moved) for name in link.points], axis=0)
            there, cost = _around(view.flat(middle + aside), half, pin * (len(link.points) == 1), height)
        cost = cost + LEADER_COST * ~is_clear(there, half, height, edges, at)
        label = _label(link.name, height, "soft", there, cost, style, ink, labels)
        labels.append(with_leader(label, edges, at) if at in edges else label)
    return labels


def _around(place: Complexes, half: complex, free: float, height: float) -> tuple[Complexes, Reals]:
    """Return possible places of a name around a point [pixels], and the cost of each place.

    The places have the shape (candidates, positions) and the costs (candidates, 1). `half` is half the size of the
    text. `free` is the radius to keep free around the point.
    """
    corners = SIDES / np.maximum(np.abs(SIDES.real), np.abs(SIDES.imag))
    ways = np.concatenate([_reach(corners, half) + SIDES * (free + gap * height) for gap in GAPS])
    there: Complexes = place + ways[:, None]
    cost: Reals = np.repeat(FARTHER_COST * np.arange(len(GAPS)), len(SIDES))
    return there, cost[:, None]


def _beside(line: Complexes, half: complex, free: float, height: float) -> tuple[Complexes, Reals]:
    """Return possible places of a name on both sides of a beam [pixels], and the cost of each place.

    The places have the shape (candidates, positions) and the costs (candidates, 1).

    Parameters
    ----------
    line
        Axis of the beam at the stations [pixels], complex, shape (positions, stations).
    """
    chord = line[:, -1] - line[:, 0]
    across = 1j * chord / np.maximum(np.abs(chord), 1e-9)
    clear = np.abs(across.real) * half.real + np.abs(across.imag) * half.imag + free
    ways = [side * across * (clear + gap * height) for gap in GAPS for side in (1, -1)]
    there = np.concatenate([line[:, place] + np.array(ways) for place in PLACES])
    farther = FARTHER_COST * np.repeat(np.arange(len(GAPS)), 2)
    return there, np.add.outer(LATER_COST * np.arange(len(PLACES)), farther).reshape(-1, 1)


def _label(
    text: str, height: float, colour: str, there: Complexes, cost: Reals, style: Style, ink: Ink, others: list[Label]
) -> Label:
    """Choose one of the places `there` for a name at each position of the mechanism, or hide the name."""
    half, steps = half_of(text, height), np.arange(there.shape[1])
    inside = kept_inside(there, half, style)
    cost = cost + OUTSIDE_COST * (np.abs(inside - there) > 0)
    for other in others:
        seen = True if other.shown is None else other.shown
        cost = cost + COVER_COST * (within(inside - other.middle, half + other.half) & seen)
    sampled = cost[:, ink.positions].T + ink.cost(inside, half, height)
    side = _sides(np.append(sampled, np.full((len(sampled), 1), LEFT_OUT_COST), axis=1))[ink.nearest(steps)]
    shown = side < len(there)
    middle = inside[np.where(shown, side, 0), steps]
    return Label(text, middle, height, colour, half, None if shown.all() else shown)


def _sides(cost: Reals) -> Integers:
    """Choose a place at each sampled position so that the total cost is smallest.

    The total is the sum of `cost`, shape (positions, places), plus `CHANGE_COST` for each change in place.
    """
    best, before = cost[0], []
    for here in cost[1:]:
        stays = best <= best.min() + CHANGE_COST
        before.append(np.where(stays, np.arange(len(best)), best.argmin()))
        best = here + np.where(stays, best, best.min() + CHANGE_COST)
    sides = [int(best.argmin())]
    for earlier in reversed(before):
        sides.append(int(earlier[sides[-1]]))
    return np.array(sides[::-1])


def _reach(direction: Complexes, half: complex) -> Complexes:
    """Return the vector from a point to the centre of a text box that touches the point [pixels].

    `direction` is the direction of the vector, scaled so that the larger of |x| and |y| is 1.
    """
    return direction.real * half.real + 1j * direction.imag * half.imag


class LargestValue(Struct, frozen=True, eq=False):
    """Value with the largest magnitude in a diagram at each position, among the `STATIONS` of all beams.

    Attributes
    ----------
    value
        Value with its sign [unit of the field].
    place, along
        End of the ordinate of the value [m], and unit vector of the beam that has the value, complex.
    depth
        Depth of that beam at the value [m]; zero unless the links are drawn solid.
    """

    value: Reals
    place: Complexes
    along: Complexes
    depth: Reals


def peak_of(
    deflection: Deflection, diagram: Diagram, scales: Scales, view: View, stack: Stack | None = None
) -> LargestValue:
    """Find the value with the largest magnitude at each position."""
    values = values_of(deflection, diagram)
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0).swapaxes(0, 1)  # positions, beams, stations
    beam, station = np.unravel_index(sizes.reshape(len(sizes), -1).argmax(-1), sizes.shape[1:])
    position = np.arange(len(sizes))
    value, along = values[beam, position, station], beams(deflection).along[beam, position]
    place = _axes(deflection, scales)[position, beam, station]
    depth = np.zeros(len(place))
    if stack:
        place = place + np.array([view.aside(stack.middle[at]) for at, _ in deflection.motion.mechanism.beams])[beam]
        depth = np.array([section.depth for section in sections_of(deflection, scales)])[beam, station]
    if scales.scale:
        place = place + 1j * scales.scale * along * value
    return LargestValue(value, place, along, depth)


def _axes(deflection: Deflection, scales: Scales) -> Complexes:
    """Return the axes of the beams as drawn [m], complex, shape (positions, beams, stations)."""
    axes = moved_beams(deflection, 0.0 if scales.scale else scales.exaggeration)
    return np.array([axes(position) for position in range(deflection.motion.columns[-1])])


def peak_label(
    deflection: Deflection,
    diagram: Diagram,
    scales: Scales,
    view: View,
    style: Style,
    names: Sequence[Label] = (),
    marks: Sequence[FlatShape] = (),
    stack: Stack | None = None,
    ink: Ink | None = None,
) -> tuple[Complexes, Label]:
    """Place a label at the value with the largest magnitude at each position.

    Parameters
    ----------
    names, marks
        Labels and lines that the label should not cover, in addition to the links.
    stack
        Layers of the links, if they are drawn solid.
    ink
        Everything that is drawn, at a sample of positions.

    Returns
    -------
    End of the ordinate of the value [m], complex, shape (positions,), and the label.
    """
    peak = peak_of(deflection, diagram, scales, view, stack)
    value, place, along, depth = peak.value, peak.place, peak.along, peak.depth
    position = np.arange(len(place))
    links = view.flat(_axes(deflection, scales).reshape(len(place), -1))
    aside = np.where(value < 0 if scales.scale else along.real < 0, -1j, 1j) * along
    written = steady(scales.peak, diagram.unit)
    text, height = [written(float(each)) for each in value], 0.03 * style.unit
    half = half_of(max(text, key=len), height)
    ways = aside * PEAK_SIDES[:, None]
    off = (DOT_RADIUS * scales.pin + depth / 2) * view.pixels + 0.2 * height
    corner = _reach(ways / np.maximum(np.abs(ways.real), np.abs(ways.imag)), half)
    away = np.concatenate([corner + ways * (off + gap * height) for gap in PEAK_GAPS])
    middles = kept_inside(view.flat(place) + away, half, style)
    cost: Any = FARTHER_COST * np.repeat(np.arange(len(PEAK_GAPS)), len(ways))[:, None]
    cost = cost + OUTSIDE_COST * (np.abs(middles - view.flat(place) - away) > 0)
    cost = cost + sum(COVER_COST * within(name.middle - middles, half + name.half) for name in names)
    marked = (view.flat(np.array([mark.place(int(each)) for each in position])) for mark in marks)
    for points in (links, *marked):
        hidden = within(points - middles[..., None], half)
        cost = cost + COVER_COST * (hidden.any(axis=-1) + hidden.mean(axis=-1))
    if ink:
        cost = cost + ink.cost(middles, half, height)[ink.nearest(position)].T
    return place, Label(text, middles[_sides(cost.T), position], height, "ink", half)
