"""Placement of the links of a dyad, for each of the five kinds of dyads."""

from collections.abc import Callable
from functools import lru_cache, reduce
from typing import Any

import numpy as np

from rigid.arrays import Columns
from rigid.decomposition.groups import Group
from rigid.drawing import Drawing
from rigid.joints import Joint, carried, point_of
from rigid.mechanism import Mechanism
from rigid.plane import ROUND_OFF, cross, dot
from rigid.positions import dyads
from rigid.positions.partial_posture import PartialPosture

# a squared sine of a dyad that is negative because of round-off counts as 0 if it is not below minus this value
MAX_SLACK = 1e-6


def place_dyad(placed: PartialPosture, group: Group, drawing: Drawing, flip: Columns) -> Columns:
    """Compute the positions of the links of a dyad, and return its sine (see `dyads`).

    `flip` is 1 for the assembly of the drawing, and -1 for the opposite assembly.
    """
    solve, *joints = _solution(group)
    sine = solve(placed, *joints, drawing, flip)
    for joint in group.fixed:
        placed.place_child(joint, 0.0)
    return sine


def _solution(group: Group) -> tuple[Callable[..., Columns], Joint, Joint, Joint]:
    """Return the function that solves a dyad, the two outer joints (a pin before a slider), and the inner joint."""
    assert group.dyad is not None
    *outer, inner = group.dyad
    first, second = sorted(outer, key=lambda joint: not joint.turns)
    solve: Callable[..., Columns]
    if inner.turns:
        solve = _two_pins if second.turns else _pin_and_slide if first.turns else _two_slides
    else:
        solve = _slide_between if second.turns else _slide_on_slide
    return solve, first, second, inner


def place_dyad_with_slack(placed: PartialPosture, group: Group, drawing: Drawing, flip: Columns) -> Columns:
    """Place a dyad as `place_dyad` does, but allow for inaccurate positions of earlier groups.

    Near their singular positions, where their sine is small, earlier groups are inaccurate because of round-off. A dyad
    that misses closure by no more than this inaccuracy is treated as closed.
    """
    sine = place_dyad(placed, group, drawing, flip)
    if placed.sine and np.isnan(np.min(sine)):
        worst = reduce(np.minimum, (np.square(before) for before in placed.sine))
        placed.slack = np.minimum(ROUND_OFF / np.maximum(worst, ROUND_OFF), MAX_SLACK)
        sine = place_dyad(placed, group, drawing, flip)
        placed.slack = ROUND_OFF
    return sine


def _place_at_pin(placed: PartialPosture, outer: Joint, pin: Columns, direction: Columns) -> None:
    """Place the child of an outer pin, for a given position of the pin and direction of the child."""
    placed.direction[outer.child] = direction
    placed.origin[outer.child] = pin - carried(direction, outer.at_child)


def _place_on_slider(placed: PartialPosture, outer: Joint) -> Columns:
    """Place the child of an outer slider where it is when the slider's coordinate is 0.

    Return the displacement of the child per unit of the coordinate.
    """
    placed.place_child(outer, 0.0)
    return outer.sense * outer.along(placed)


def _two_pins(
    placed: PartialPosture, first_pin: Joint, second_pin: Joint, inner: Joint, drawing: Drawing, flip: Columns
) -> Columns:
    first, second = (
        point_of(placed, first_pin.parent, first_pin.at_parent),
        point_of(placed, second_pin.parent, second_pin.at_parent),
    )
    drawn = _drawn_side(drawing.mechanism, first_pin.name, second_pin.name, inner.name)
    side = flip * (drawn if drawing.rows is None or not np.ndim(drawn) else drawn[drawing.rows])
    arms = inner.at(first_pin.child) - first_pin.at_child, inner.at(second_pin.child) - second_pin.at_child
    direction, opposite, sine = dyads.circle_circle(first, second, *arms, side, placed.slack)
    _place_at_pin(placed, first_pin, first, direction)
    _place_at_pin(placed, second_pin, second, opposite)
    return sine


@lru_cache(maxsize=64)
def _drawn_side(mechanism: Mechanism, first: str, second: str, inner: str) -> Any:
    """Return +1 if the inner pin is drawn to the left of the line from the first to the second outer pin, else -1."""
    drawing = Drawing(mechanism)
    drawn = [drawing.at(name) for name in (first, second, inner)]
    base = drawn[1] - drawn[0]
    length: Any = abs(base)
    return drawing.side(cross(base, drawn[2] - drawn[0]) / np.where(length, length, 1.0), (first, second, inner))


def _pin_and_slide(
    placed: PartialPosture, pin: Joint, slide: Joint, inner: Joint, drawing: Drawing, flip: Columns
) -> Columns:
    center = point_of(placed, pin.parent, pin.at_parent)
    along = _place_on_slider(placed, slide)
    start = point_of(placed, slide.child, inner.at(slide.child))
    ahead = drawing.along(slide) * slide.sense
    side = flip * drawing.side(
        dot(ahead, drawing.at(inner.name) - drawing.at(pin.name)), (pin.name, slide.name, inner.name)
    )
    direction, travel, sine = dyads.circle_line(
        center, inner.at(pin.child) - pin.at_child, start, along, side, placed.slack
    )
    placed.origin[slide.child] = placed.origin[slide.child] + travel * along
    _place_at_pin(placed, pin, center, direction)
    return sine


def _two_slides(
    placed: PartialPosture, first: Joint, second: Joint, inner: Joint, drawing: Drawing, flip: Columns
) -> Columns:
    along, across = _place_on_slider(placed, first), _place_on_slider(placed, second)
    starts = [point_of(placed, joint.child, inner.at(joint.child)) for joint in (first, second)]
    along_first, along_second, sine = dyads.line_line(starts[1] - starts[0], along, across)
    placed.origin[first.child] = placed.origin[first.child] + along_first * along
    placed.origin[second.child] = placed.origin[second.child] + along_second * across
    return sine


def _slide_between(
    placed: PartialPosture, one: Joint, other: Joint, inner: Joint, drawing: Drawing, flip: Columns
) -> Columns:
    owner, block = (one, other) if one.child == inner.owner else (other, one)
    pins = [point_of(placed, joint.parent, joint.at_parent) for joint in (owner, block)]
    foot = inner.at(inner.owner) + inner.turned * (block.at_child - inner.at(block.child)) - owner.at_child
    ahead = drawing.along(inner)
    side = flip * drawing.side(
        dot(ahead, drawing.at(block.name) - drawing.at(owner.name)), (owner.name, block.name, inner.name)
    )
    direction, _, sine = dyads.slotted(pins[0], pins[1], foot, inner.line, side, placed.slack)
    _place_at_pin(placed, owner, pins[0], direction)
    _place_at_pin(placed, block, pins[1], direction * inner.turned)
    return sine


def _slide_on_slide(
    placed: PartialPosture, pin: Joint, slide: Joint, inner: Joint, drawing: Drawing, flip: Columns
) -> Columns:
    center = point_of(placed, pin.parent, pin.at_parent)
    along = _place_on_slider(placed, slide)
    toward = inner.turn if inner.child == pin.child else np.conj(inner.turn)
    _place_at_pin(placed, pin, center, placed.direction[slide.child] * toward)
    across = inner.along(placed)
    gap = point_of(placed, pin.child, inner.at(pin.child)) - point_of(placed, slide.child, inner.at(slide.child))
    travel, _, sine = dyads.line_line(gap, along, across)
    placed.origin[slide.child] = placed.origin[slide.child] + travel * along
    return sine
