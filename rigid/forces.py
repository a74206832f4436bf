"""Forces in all joints that balance given loads of the links: the transpose of the displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rigid.closure import Closure, Columns, JointPlace, reach_from
from rigid.plane import cross, dot, is_zero, minus, plus, times


@dataclass(frozen=True, eq=False)
class JointForces:
    """What every joint does to its child link; the parent gets the opposite.

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

    @cached_property
    def ground_force(self) -> Columns:
        """Force of the mechanism on the ground [N], complex, shape (..., positions)."""
        on_ground = [number for number, place in enumerate(self._places) if place.joint.parent == 0]
        return self.ground_load[0] - sum(self.force[number] for number in on_ground)

    @cached_property
    def ground_moment(self) -> Columns:
        """Moment of the mechanism on the ground about the origin of coordinates [N m], shape (..., positions)."""
        total = self.ground_load[1]
        for number, place in enumerate(self._places):
            if place.joint.parent == 0:
                total = total - (_about(place.arm_parent, self.force[number]) + self.moment[number])
        return total

    def mark(self, lost: Any) -> None:
        """Make the forces nan at some positions, bool, shape (..., positions)."""
        for values in (self.force, self.moment):
            values[:] = [value if is_zero(value) else np.where(lost, np.nan, value) for value in values]

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
    for number, closed in reversed(list(enumerate(closures))):
        held = [_held(closed, k, force, moment) for k in range(len(closed.group.free))]
        cuts = []
        for c, closing in enumerate(closed.cut):
            needed: Columns = 0.0
            for k, load in enumerate(held):
                needed = plus(needed, times(load, closed.duals[k, c]))
            multiplier = np.conj(1j * needed)
            if tension is not None and tension[0] == number:
                multiplier = multiplier + closed.tensions[tension[1]][c]
            pull, twist = multiplier, 0.0
            if closing.along is not None:
                pull, twist = times(multiplier.imag, 1j * closing.along), multiplier.real
            joint = closing.joint
            _push(joint.child, closing.arm_child, pull, twist, force, moment)
            _push(joint.parent, closing.arm_parent, -pull, minus(0.0, twist), force, moment)
            cuts.append((pull, twist))
        trees = [_balance(hinge, force, moment) for hinge in reversed(closed.tree)]
        results += [*cuts[::-1], *trees]
    results.reverse()
    pulls, twists = [pull for pull, _ in results], [twist for _, twist in results]
    return JointForces(closures, pulls, twists, (force[0], moment[0]))


def _balance(hinge: JointPlace, force: list[Columns], moment: list[Columns]) -> tuple[Columns, Columns]:
    """Force and moment of a tree joint on its child, whose other loads are all known by now."""
    child = hinge.joint.child
    load, twist = force[child], 0.0
    if hinge.along is not None or hinge.joint.moved:
        twist = minus(moment[child], _about(hinge.arm_child, load))
    _push(hinge.joint.parent, hinge.arm_parent, load, twist, force, moment)
    if hinge.joint.gear is not None:
        _lead(hinge, load, twist, force, moment)
    return minus(0.0, load), minus(0.0, twist)


def _lead(hinge: JointPlace, load: Columns, twist: Columns, force: list[Columns], moment: list[Columns]) -> None:
    """Pass what moves a geared joint on to the joint that drives it, whose work it is."""
    gear = hinge.joint.gear
    assert gear is not None
    along = hinge.along
    effort = hinge.joint.sense * gear.ratio * (twist if along is None else dot(along, load))
    on, link = gear.ends
    if gear.driver.slider is None:
        _push(link, 0.0, 0.0, effort, force, moment)
        _push(on, 0.0, 0.0, -effort, force, moment)
    else:
        slider = gear.driver.slider
        _push(link, slider.turn * gear.driver.at_child, times(effort, slider.direction), 0.0, force, moment)


def _held(closed: Closure, k: int, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Generalised force of the links' loads on free tree joint k."""
    hinge = closed.tree[closed.group.free[k]]
    total: Columns = 0.0
    for link, chain in closed.group.carried[k]:
        if hinge.along is not None:
            total = plus(total, dot(hinge.along, force[link]))
        else:
            total = plus(total, minus(moment[link], _about(reach_from(closed, chain), force[link])))
    return total


def _about(arm: Columns, pull: Columns) -> Columns:
    """Moment of a force at the end of an arm."""
    return 0.0 if is_zero(arm) or is_zero(pull) else cross(arm, pull)


def _push(link: int, arm: Columns, pull: Columns, twist: Columns, force: list[Columns], moment: list[Columns]) -> None:
    """Add a force at the end of an arm, and a moment, to what a moving link feels."""
    if link:
        force[link] = plus(force[link], pull)
        moment[link] = plus(moment[link], plus(_about(arm, pull), twist))


def self_stresses(closures: tuple[Closure, ...]) -> list[JointForces]:
    """Joint forces that balance without any load, one set for every surplus condition of the mechanism."""
    if not any(closed.tensions for closed in closures):
        return []
    nothing = [0.0] * (1 + max((link for closed in closures for link in closed.group.links), default=0))
    return [
        joint_forces(closures, nothing, nothing, (number, which))
        for number, closed in enumerate(closures)
        for which in range(len(closed.tensions))
    ]
