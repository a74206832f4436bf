"""Positions of all links, group by group: driven links, dyads in closed form, any other group by Newton's method."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid import change_points
from rigid.closure import Closure, closure
from rigid.drawing import Drawing
from rigid.dyad_places import place_dyad
from rigid.dyads import ROUND_OFF
from rigid.march import correct, follow
from rigid.mechanism import Mechanism
from rigid.placement import Placement
from rigid.structure import Group, Structure

if TYPE_CHECKING:
    from rigid.postures import Posture

AT_MOST = 1e-6  # slack behind a singular position
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
            placed.sine.append(place_dyad(placed, group, self.drawing, self._near_side(group, self.near)))
            return
        if number in self.changes:
            shape = np.shape(self.changes[number])[:-1] if len(self.changes[number]) > 1 else ()
            signs = change_points.flips(self.changes[number], self.places, shape)
            placed.sine.append(place_dyad(placed, group, self.drawing, signs))
            return
        sine = self._with_slack(group, 1.0)
        shallow = np.ndim(sine) and not np.abs(sine).min() >= change_points.SHALLOW  # else nothing is suspect
        if shallow and self.places is None and change_points.suspects(sine).any():
            self._find_changes(number, sine)
        if self.changes.get(number):
            places = np.arange(placed.drive.shape[-1], dtype=float)
            signs = change_points.flips(self.changes[number], places, np.shape(sine)[:-1])
            sine = self._with_slack(group, signs)
        placed.sine.append(sine)

    def _with_slack(self, group: Group, flip: Any) -> Any:
        """Place a dyad; where a singular position before it has cost digits, it may miss by as many."""
        placed = self.placed
        sine = place_dyad(placed, group, self.drawing, flip)
        if placed.sine and np.isnan(np.min(sine)):
            worst = reduce(np.minimum, (np.square(before) for before in placed.sine))
            placed.slack = np.minimum(ROUND_OFF / np.maximum(worst, ROUND_OFF), AT_MOST)
            sine = place_dyad(placed, group, self.drawing, flip)
            placed.slack = ROUND_OFF
        return sine

    def _near_side(self, group: Group, near: Posture) -> Any:
        """-1 where the links of a dyad are nearer to a posture when folded the other way than drawn."""
        links = list(group.links)
        away = []
        for flip in (1.0, -1.0):
            place_dyad(self.placed, group, self.drawing, flip)
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
