"""Positions of all links, group by group: driven links, dyads in closed form, any other group by Newton's method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid import change_points, dyads
from rigid.closure import Closure, Columns, closure
from rigid.drawing import Drawing
from rigid.march import correct, follow
from rigid.mechanism import Mechanism
from rigid.placement import Placement, carried
from rigid.plane import cross, dot
from rigid.structure import Group, Joint, Structure

if TYPE_CHECKING:
    from rigid.posture import Posture

STRIDE = 0.1  # of a pin's drive on the way from the drawing [rad]
SLIDES = 20  # steps of a slider's drive on that way


def place(
    mechanism: Mechanism, structure: Structure, drive: Any, near: Posture | None = None, lead: Any = None
) -> tuple[Placement, tuple[Closure, ...]]:
    """Every link at every position.

    Parameters
    ----------
    drive
        Coordinates of the drives [rad or m], shape (drives, positions).
    near
        As for `motion`.
    lead
        Coordinates of the drives that are passed between the drawing and the first position, shape (drives, n).
    """
    drawing, asked = Drawing(mechanism), drive.shape[1]
    drive = drive if lead is None else np.concatenate([lead, drive], axis=1)
    if near is None and not all(_closed_form(group) for group in structure.groups):
        drive = np.concatenate([_lead(structure, drawing, drive), drive], axis=1)
    walk = Walk(mechanism, structure, drive, near)
    walk.placed.approach = drive.shape[1] - asked
    for number in range(len(structure.groups)):
        walk.step(number)
    placed = walk.placed.arrived()
    closures = []
    sines = iter(placed.sine)
    for group in structure.groups:
        tree, cut = (tuple(placed.joint(joint) for joint in joints) for joints in (group.tree, group.cut))
        closures.append(closure(group, tree, cut, next(sines) if group.free else 1.0))
    return placed, tuple(closures)


def _closed_form(group: Group) -> bool:
    """Whether a group is a driven link or a dyad."""
    return not group.free or (len(group.links) == len(group.free) == 2 and len(group.cut) == 1)


def _lead(structure: Structure, drawing: Drawing, drive: Any) -> Any:
    """Coordinates of the drives on the way from the drawing to the first position, that excluded."""
    drawn = drawn_coordinates(structure, drawing, drive[:, 0])
    slides = [joint.slider is not None for joint in structure.joints if joint.drive is not None]
    turned = np.abs(drive[:, 0] - drawn).max(where=~np.array(slides, bool), initial=0.0)
    moved = np.abs(drive[:, 0] - drawn).max(where=np.array(slides, bool), initial=0.0)
    steps = max(int(np.ceil(turned / STRIDE)), SLIDES if moved else 0)
    return drawn[:, None] + (drive[:, :1] - drawn[:, None]) * (np.arange(steps) / max(steps, 1))


def drawn_coordinates(structure: Structure, drawing: Drawing, start: Any) -> Any:
    """Coordinates of the drives as drawn, by whole turns as near to a position as they can be."""
    drawn = np.array(start, float)
    for joint in structure.joints:
        if joint.drive is not None:
            value = drawing.coordinate(joint)
            near = start[joint.drive]
            drawn[joint.drive] = value if joint.slider else near - np.angle(np.exp(1j * (near - value)))
    return drawn


class Walk:
    """Placing of the groups one after the other, with the change points met on the way."""

    def __init__(self, mechanism: Mechanism, structure: Structure, drive: Any, near: Posture | None) -> None:
        links = len(mechanism.links)
        self.placed = Placement(mechanism, drive, [0.0] * links, [1.0] * links)
        self.structure, self.near = structure, near
        self.drawing = Drawing(mechanism)
        self.changes: dict[int, list[list[float]]] = {}
        self.places: Any = None

    def step(self, number: int) -> None:
        """Place the links of one group, those before it being placed."""
        group, placed = self.structure.groups[number], self.placed
        if not group.free:
            for joint in group.tree:
                placed.hang(joint, placed.coordinate(joint))
        elif _closed_form(group):
            self._dyad(number)
        elif self.near is not None:
            placed.sine.append(correct(placed, group, self.near))
        else:
            placed.sine.append(follow(placed, group, self.drawing))

    def _dyad(self, number: int) -> None:
        """Place a dyad, on its smooth branch."""
        group, placed = self.structure.groups[number], self.placed
        if self.near is not None:
            placed.sine.append(_place_dyad(placed, group, self.drawing, self._near_side(group, self.near)))
            return
        if number in self.changes:
            shape = np.shape(self.changes[number])[:-1] if len(self.changes[number]) > 1 else ()
            signs = change_points.flips(self.changes[number], self.places, shape)
            placed.sine.append(_place_dyad(placed, group, self.drawing, signs))
            return
        sine = _place_dyad(placed, group, self.drawing, 1.0)
        if self.places is None and np.ndim(sine) and change_points.suspects(sine).any():
            self._find_changes(number, sine)
        if self.changes.get(number):
            places = np.arange(placed.drive.shape[-1], dtype=float)
            signs = change_points.flips(self.changes[number], places, np.shape(sine)[:-1])
            sine = _place_dyad(placed, group, self.drawing, signs)
        placed.sine.append(sine)

    def _near_side(self, group: Group, near: Posture) -> Any:
        """-1 where the links of a dyad are nearer to a posture when folded the other way than drawn."""
        links = list(group.links)
        away = []
        for flip in (1.0, -1.0):
            _place_dyad(self.placed, group, self.drawing, flip)
            away.append(sum(np.abs(self.placed.direction[link] - near.direction[link]) for link in links))
        return np.where(away[1] < away[0], -1.0, 1.0)

    def _find_changes(self, number: int, sine: Any) -> None:
        """Touches of a dyad's sine with zero, on the way from the drawing to the first position and over all."""
        rows = change_points.suspects(sine).reshape(-1, sine.shape[-1] - 2)
        path = _Path(self)

        def sine_at(places: Any) -> Any:
            return path.sine(places, number)

        found = [change_points.touches(sine_at, np.flatnonzero(row) + 1, at) for at, row in enumerate(rows)]
        if not any(found):
            return
        for at, touched in enumerate(found):
            before = path.touches_before(sine_at, at)
            found[at] = before + [touch for touch in touched if path.onward or touch > change_points.SAME]
        self.changes[number] = found


class _Path:
    """The way of the drives: from the drawing (place -1) to the first position (0) and through the others."""

    def __init__(self, walk: Walk) -> None:
        self.walk = walk
        drive = walk.placed.drive
        drawn = drawn_coordinates(walk.structure, walk.drawing, drive[:, 0])
        self.way = np.column_stack([drawn, drive])
        step = drive[:, 1] - drive[:, 0]
        self.onward = bool(np.dot(drive[:, 0] - drawn, step) > 0)

    def sine(self, places: Any, number: int) -> Any:
        """s of a dyad anywhere on the way."""
        grid = np.arange(-1.0, self.way.shape[1] - 1)
        drive = np.array([np.interp(places, grid, row) for row in self.way])
        other = Walk(self.walk.placed.mechanism, self.walk.structure, drive, self.walk.near)
        other.places, other.changes = places, {k: v for k, v in self.walk.changes.items() if k < number}
        for k in range(number + 1):
            other.step(k)
        return np.broadcast_to(
            other.placed.sine[-1], np.broadcast_shapes(np.shape(other.placed.sine[-1]), (len(places),))
        )

    def touches_before(self, sine_at: Any, row: int) -> list[float]:
        """Touches between the drawing and the first position."""
        places = np.linspace(-1.0, 0.0, change_points.POINTS)
        size = sine_at(places).reshape(-1, len(places))[row]
        near = places[1:-1][change_points.suspects(size)]
        found: list[float] = []
        for place in near:
            low, high = place - 1.0 / (len(places) - 1), place + 1.0 / (len(places) - 1)
            touch = change_points.touch(lambda at: sine_at(at).reshape(-1, len(at))[row], low, high)
            if touch is not None and touch < -change_points.SAME:
                found.append(touch)
        return sorted({round(touch, 4): touch for touch in found}.values())


def _place_dyad(placed: Placement, group: Group, drawing: Drawing, flip: Any) -> Any:
    """Find the dyad's type and place its two links; `flip` is -1 where it folds the other way than drawn."""
    outer: Sequence[Joint] = sorted(group.tree, key=lambda joint: joint.slider is not None)
    inner = group.cut[0]
    if inner.slider is None:
        solve = (_two_pins, _pin_and_slide, _two_slides)[sum(joint.slider is not None for joint in outer)]
    else:
        solve = _slide_between if outer[1].slider is None else _slide_on_slide
    return solve(placed, outer[0], outer[1], inner, drawing, flip)


def _end(joint: Joint, link: int) -> Any:
    """A joint's point in the axes of one of its links."""
    return joint.at_child if joint.child == link else joint.at_parent


def _hold(placed: Placement, outer: Joint, pin: Columns, direction: Columns) -> None:
    """Place the child of an outer pin."""
    placed.direction[outer.child] = direction
    placed.origin[outer.child] = pin - carried(direction, outer.at_child)


def _carry(placed: Placement, outer: Joint) -> Columns:
    """Place the child of an outer slider at slide 0; return its displacement per unit slide."""
    placed.hang(outer, 0.0)
    assert outer.slider is not None
    return placed.direction[outer.parent if outer.sense > 0 else outer.child] * (outer.sense * outer.slider.direction)


def _two_pins(placed: Placement, one: Joint, other: Joint, inner: Joint, drawing: Drawing, flip: Any) -> Columns:
    first, second = placed.point(one.parent, one.at_parent), placed.point(other.parent, other.at_parent)
    drawn = [drawing.at(joint.name) for joint in (one, other, inner)]
    base = drawn[1] - drawn[0]
    side = flip * drawing.side(cross(base, drawn[2] - drawn[0]) / (abs(base) or 1.0), (one, other, inner))
    arms = _end(inner, one.child) - one.at_child, _end(inner, other.child) - other.at_child
    direction, opposite, sine = dyads.circle_circle(first, second, *arms, side)
    _hold(placed, one, first, direction)
    _hold(placed, other, second, opposite)
    return sine


def _pin_and_slide(placed: Placement, pin: Joint, slide: Joint, inner: Joint, drawing: Drawing, flip: Any) -> Columns:
    center = placed.point(pin.parent, pin.at_parent)
    along = _carry(placed, slide)
    start = placed.point(slide.child, _end(inner, slide.child))
    ahead = drawing.along(slide) * slide.sense
    side = flip * drawing.side(dot(ahead, drawing.at(inner.name) - drawing.at(pin.name)), (pin, slide, inner))
    direction, way, sine = dyads.circle_line(center, _end(inner, pin.child) - pin.at_child, start, along, side)
    placed.origin[slide.child] = placed.origin[slide.child] + way * along
    _hold(placed, pin, center, direction)
    return sine


def _two_slides(placed: Placement, one: Joint, other: Joint, inner: Joint, drawing: Drawing, flip: Any) -> Columns:
    along, across = _carry(placed, one), _carry(placed, other)
    starts = [placed.point(joint.child, _end(inner, joint.child)) for joint in (one, other)]
    way, opposite, sine = dyads.line_line(starts[1] - starts[0], along, across)
    placed.origin[one.child] = placed.origin[one.child] + way * along
    placed.origin[other.child] = placed.origin[other.child] + opposite * across
    return sine


def _slide_between(placed: Placement, one: Joint, other: Joint, inner: Joint, drawing: Drawing, flip: Any) -> Columns:
    slider = inner.slider
    assert slider is not None
    owner_link = inner.parent if inner.sense > 0 else inner.child
    owner, block = (one, other) if one.child == owner_link else (other, one)
    pins = [placed.point(joint.parent, joint.at_parent) for joint in (owner, block)]
    foot = slider.origin + slider.turn * (block.at_child - _end(inner, block.child)) - owner.at_child
    ahead = drawing.along(inner)
    side = flip * drawing.side(dot(ahead, drawing.at(block.name) - drawing.at(owner.name)), (owner, block, inner))
    direction, _, sine = dyads.slotted(pins[0], pins[1], foot, slider.direction, side)
    _hold(placed, owner, pins[0], direction)
    _hold(placed, block, pins[1], direction * slider.turn)
    return sine


def _slide_on_slide(placed: Placement, pin: Joint, slide: Joint, inner: Joint, drawing: Drawing, flip: Any) -> Columns:
    center = placed.point(pin.parent, pin.at_parent)
    along = _carry(placed, slide)
    assert inner.slider is not None
    block = inner.child if inner.sense > 0 else inner.parent
    turn = inner.slider.turn
    toward = turn if block == pin.child else np.conj(turn)
    _hold(placed, pin, center, placed.direction[slide.child] * toward)
    owner = pin.child if block == slide.child else slide.child
    across = placed.direction[owner] * inner.slider.direction
    gap = placed.point(pin.child, _end(inner, pin.child)) - placed.point(slide.child, _end(inner, slide.child))
    way, _, sine = dyads.line_line(gap, along, across)
    placed.origin[slide.child] = placed.origin[slide.child] + way * along
    return sine
