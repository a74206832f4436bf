"""Positions of all links, group by group: driven links, dyads in closed form, any other group by Newton's method."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np

from rigid.closure import Closure, closure
from rigid.decomposition.groups import Group, Structure
from rigid.drawing import Drawing
from rigid.joints import joint_place
from rigid.mechanism import Mechanism
from rigid.plane import ROUND_OFF
from rigid.positions import change_points
from rigid.positions.drive_path import Way, way_through
from rigid.positions.dyad_places import place_dyad
from rigid.positions.newton import correct, follow, require_closed
from rigid.positions.placement import Placement
from rigid.postures import Posture

AT_MOST = 1e-6  # slack behind a singular position


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
    follows = near is None and any(group.free for group in structure.groups)
    way = way_through(mechanism, drive, lead) if follows else Way(drive)
    walk = Walk(mechanism, structure, way, near)
    for number in range(len(structure.groups)):
        walk.step(number)
    placed = walk.placed.at(way.asked)
    closures = []
    sines = iter(placed.sine)
    for group in structure.groups:
        tree, cut = (tuple(joint_place(placed, joint) for joint in joints) for joints in (group.tree, group.cut))
        closures.append(closure(group, tree, cut, next(sines) if group.free else 1.0))
    return placed, tuple(closures)


def _closed_form(group: Group) -> bool:
    """Whether a group is a driven link or a dyad."""
    return not group.free or (len(group.links) == len(group.free) == 2 and len(group.cut) == 1)


class Walk:
    """Placing of the groups one after the other, with the change points met on the way."""

    def __init__(self, mechanism: Mechanism, structure: Structure, way: Way, near: Posture | None) -> None:
        links = len(mechanism.links)
        self.placed = Placement(mechanism, way.drive, [0.0] * links, [1.0] * links, near=near, approach=way.approach)
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
            require_closed(placed, group)
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
        """Touches of a dyad's sine with zero all along the way."""
        rows = change_points.suspects(sine).reshape(-1, sine.shape[-1] - 2)
        found = [
            change_points.touches(lambda places: self._sine_at(places, number), np.flatnonzero(row) + 1, at)
            for at, row in enumerate(rows)
        ]
        if any(found):
            self.changes[number] = [[touch for touch in touched if self._onward(touch)] for touched in found]

    def _onward(self, touch: float) -> bool:
        """Whether the drives go on at a place, rather than turn back there."""
        place = round(touch)
        drive = self.placed.drive
        if abs(touch - place) > change_points.SAME or not 0 < place < drive.shape[1] - 1:
            return touch > change_points.SAME
        return bool(np.dot(drive[:, place] - drive[:, place - 1], drive[:, place + 1] - drive[:, place]) > 0)

    def _sine_at(self, places: Any, number: int) -> Any:
        """s of a dyad anywhere on the way."""
        grid = np.arange(self.placed.drive.shape[1])
        drive = np.array([np.interp(places, grid, row) for row in self.placed.drive])
        other = Walk(self.placed.mechanism, self.structure, Way(drive), self.near)
        other.places, other.changes = places, {k: v for k, v in self.changes.items() if k < number}
        for k in range(number + 1):
            other.step(k)
        sine = other.placed.sine[-1]
        return np.broadcast_to(sine, np.broadcast_shapes(np.shape(sine), (len(places),)))
