"""Forces in all joints that balance given loads of the links: the transpose of the displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rigid.closure import Closure, reach_from
from rigid.gears import gear_loads, input_arm
from rigid.joints import Columns, JointPlace
from rigid.plane import ZERO, cross, dot, number


@dataclass(frozen=True, eq=False)
class JointForces:
    """Force and moment of every joint on its child link; the parent gets the opposite.

    Attributes
    ----------
    closures
        The placed groups.
    force
        Complex [N], one array of shape (..., positions) per joint in the order of `Structure.joints`.
    moment
        About the joint's point [N m]; 0.0 for a free pin.
    ground_load
        What acts on the ground besides the joints, springs for example: force [N], complex, and moment about the origin
        of coordinates [N m].
    """

    closures: tuple[Closure, ...]
    force: list[Columns]
    moment: list[Columns]
    ground_load: tuple[Columns, Columns] = (0.0, 0.0)

    def __repr__(self) -> str:
        return f"JointForces({len(self.force)} joints, columns {np.broadcast_shapes(*map(np.shape, self.force))})"

    @cached_property
    def ground_force(self) -> Columns:
        """Force of the mechanism on the ground [N], complex, shape (..., positions)."""
        on_ground = [self.force[at] for at, place in enumerate(self._places) if place.joint.parent == 0]
        return self.ground_load[0] - sum(on_ground)

    @cached_property
    def ground_moment(self) -> Columns:
        """Moment of the mechanism on the ground about the origin of coordinates [N m], shape (..., positions)."""
        total = self.ground_load[1]
        for at, place in enumerate(self._places):
            if place.joint.parent == 0:
                total = total - (cross(place.arm_parent, self.force[at]) + self.moment[at])
        return total

    def mark(self, lost: Any) -> None:
        """Make the forces nan at some positions, bool, shape (..., positions)."""
        for values in (self.force, self.moment):
            values[:] = [np.where(lost, np.nan, value) if np.ndim(value) or value else value for value in values]

    @property
    def _places(self) -> list[JointPlace]:
        return [place for closed in self.closures for place in closed.joints]


def joint_forces(
    closures: tuple[Closure, ...],
    force: Sequence[Columns],
    moment: Sequence[Columns],
    tension: tuple[int, int] | None = None,
) -> JointForces:
    """Joint forces that balance a given force and moment about its origin on every link.

    Parameters
    ----------
    closures
        The placed groups, in the order of solution; the forces go through them backwards.
    force, moment
        Per link, complex [N] and real [N m], shape (..., positions).
    tension
        Number of a group, and of one of its `Closure.tensions`, that is in force besides.
    """
    force, moment = list(force), list(moment)
    results: list[tuple[Columns, Columns]] = []
    for place, closed in reversed(list(enumerate(closures))):
        held = [_held(closed, k, force, moment) for k in range(len(closed.group.free))]
        cuts = []
        for c, closing in enumerate(closed.cut):
            needed: Columns = ZERO
            for k, load in enumerate(held):
                needed = needed + load * closed.duals[k, c]
            multiplier = (1j * needed).conjugate()
            if tension is not None and tension[0] == place:
                multiplier = multiplier + closed.tensions[tension[1]][c]
            pull, couple = closing.force(multiplier)
            joint = closing.joint
            _push(joint.child, closing.arm_child, pull, couple, force, moment)
            _push(joint.parent, closing.arm_parent, -pull, -couple, force, moment)
            cuts.append((pull, couple))
        trees = [_balance(hinge, force, moment) for hinge in reversed(closed.tree)]
        results += [*cuts[::-1], *trees]
    results.reverse()
    pulls, couples = ([number(value) for value in part] for part in zip(*results, strict=True)) if results else ([], [])
    return JointForces(closures, pulls, couples, (number(force[0]), number(moment[0])))


def _balance(hinge: JointPlace, force: list[Columns], moment: list[Columns]) -> tuple[Columns, Columns]:
    """Force and moment of a tree joint on its child, whose other loads are all known by now."""
    child = hinge.joint.child
    load, couple = force[child], ZERO
    if not hinge.turns or hinge.joint.moved:
        couple = moment[child] - cross(hinge.arm_child, load)
    _push(hinge.joint.parent, hinge.arm_parent, load, couple, force, moment)
    if hinge.joint.gear is not None:
        driver = hinge.joint.gear.driver
        for link, pull, turn in gear_loads(hinge, -load, -couple):
            _push(link, input_arm(driver), pull, turn, force, moment)
    return -load, -couple


def _held(closed: Closure, k: int, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Generalised force of the links' loads on free tree joint k."""
    hinge = closed.tree[closed.group.free[k]]
    total: Columns = ZERO
    for link, chain in closed.group.carried[k]:
        if hinge.turns:
            total = total + (moment[link] - cross(reach_from(closed, chain), force[link]))
        else:
            total = total + dot(hinge.along, force[link])
    return total


def _push(link: int, arm: Columns, pull: Columns, couple: Columns, force: list[Columns], moment: list[Columns]) -> None:
    """Add a force at the end of an arm, and a moment, to what a moving link feels."""
    if link:
        force[link] = force[link] + pull
        moment[link] = moment[link] + (cross(arm, pull) + couple)


def self_stresses(closures: tuple[Closure, ...]) -> list[JointForces]:
    """Joint forces that balance without any load, one set for every surplus condition of the mechanism."""
    if not any(closed.tensions for closed in closures):
        return []
    nothing = [ZERO] * (1 + max((link for closed in closures for link in closed.group.links), default=0))
    return [
        joint_forces(closures, nothing, nothing, (place, which))
        for place, closed in enumerate(closures)
        for which in range(len(closed.tensions))
    ]
