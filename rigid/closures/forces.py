"""Joint forces in equilibrium with given loads on the links (the transpose of `rigid.closures.displacements`)."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct, field

from rigid.arrays import Columns, Flags
from rigid.closures.closure import Closure, reach_from
from rigid.closures.gears import gear_loads
from rigid.decomposition.groups import LINK_CONSTRAINTS
from rigid.joints import JointPlace
from rigid.plane import ZERO, cross, dot, number
from rigid.teeth import loaded_flank

MAX_UNSTRESSED = 1e-9
"""Largest component of a unit self-stress at a joint that counts as zero."""


class JointForces(Struct, frozen=True, eq=False, dict=True):
    """Force and moment of each joint on its child. The opposite force and moment act on the parent.

    Attributes
    ----------
    closures
        Placed groups.
    force
        For each joint of `Structure.joints`, force (complex) [N] of shape (..., positions).
    moment
        Moment about the joint's point [N m]; 0.0 for a free pin. If the joint follows a gear, the component of `force`
        or `moment` along the joint coordinate is the effort of the gear. This effort acts through the teeth and not on
        the parent (see `rigid.closures.gears.gear_loads`).
    ground_load
        Load on the ground from springs, gears and other loads, without the joints: force (complex) [N], and moment
        about the origin of coordinates [N m].
    flank
        Loaded flank (sign of the effort) of each toothed gear, by index of the follower's joint.
    friction
        Friction effort on the child along the free motion, included in `force` or `moment` [N or N m], by joint index.
    sliding
        Sliding rate of the child relative to the parent, which friction opposes [rad/s or m/s], by joint index.
    feedback
        Loop gain of friction, shape (..., positions): the relative growth of friction due to the joint forces that
        friction itself causes. If the gain is 1 or more, the mechanism may lock: there is no equilibrium or more than
        one, and all forces are nan.
    """

    closures: tuple[Closure, ...]
    force: list[Columns]
    moment: list[Columns]
    ground_load: tuple[Columns, Columns] = (0.0, 0.0)
    flank: dict[int, Columns] = field(default_factory=dict)
    friction: dict[int, Columns] = field(default_factory=dict)
    sliding: dict[int, Columns] = field(default_factory=dict)
    feedback: Columns = 0.0

    def __repr__(self) -> str:
        return f"JointForces({len(self.force)} joints, columns {np.broadcast_shapes(*map(np.shape, self.force))})"

    @cached_property
    def ground_force(self) -> Columns:
        """Force of the mechanism on the ground (complex) [N], shape (..., positions)."""
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

    @property
    def locked(self) -> Flags:
        """Whether friction may lock the mechanism, shape (..., positions)."""
        return np.greater_equal(self.feedback, 1.0)

    def without_friction(self, number: int) -> tuple[Columns, Columns]:
        """Return the force and moment of a joint on its child due to constraint, drive and gear, without friction."""
        force, moment = self.force[number], self.moment[number]
        if number in self.friction:
            pull, couple = self._places[number].driven(self.friction[number])
            force, moment = force - pull, moment - couple
        return force, moment

    @cached_property
    def in_joints(self) -> list[tuple[Columns, Columns]]:
        """Force and moment that each joint itself exerts on its child: without the effort of a gear, which has teeth.

        The moment of a pin without drive and friction is 0.0.
        """
        return [self._in_joint(at, place) for at, place in enumerate(self._places)]

    def _in_joint(self, at: int, place: JointPlace) -> tuple[Columns, Columns]:
        if place.joint.gear is None:
            return self.force[at], self.moment[at]
        force, moment = self.without_friction(at)
        pull, _ = place.driven(place.effort(force, moment))
        rubbed = place.driven(self.friction.get(at, 0.0))
        return force - pull + rubbed[0], rubbed[1] if place.turns else moment + rubbed[1]

    def mark(self, invalid: Flags | bool) -> None:
        """Set the forces to nan where `invalid` is True, shape (..., positions)."""
        for values in (self.force, self.moment):
            values[:] = [np.where(invalid, np.nan, value) if np.ndim(value) or value else value for value in values]
        self.friction.update({at: np.where(invalid, np.nan, value) for at, value in self.friction.items()})

    @property
    def _places(self) -> list[JointPlace]:
        return [place for closed in self.closures for place in closed.joints]


def joint_forces(
    closures: tuple[Closure, ...],
    force: Sequence[Columns],
    moment: Sequence[Columns],
    tension: tuple[int, int] | None = None,
    flank: Mapping[int, Columns] | None = None,
    friction: Mapping[int, Columns] | None = None,
) -> JointForces:
    """Return the joint forces in equilibrium with given loads on the links.

    Parameters
    ----------
    closures
        Placed groups in the order of solution. They are processed in reverse.
    force, moment
        For each link: force (complex) [N] and moment about the origin of the link [N m], shape (..., positions).
    tension
        Self-stress to add: index of the group, and index of the self-stress in the group (see `Closure.redundancy`).
    flank
        Loaded flanks of gear teeth (see `JointForces`). By default they follow from the signs of the efforts.
    friction
        See `JointForces`.
    """
    force, moment = list(force), list(moment)
    flanks, rubbed = dict(flank or {}), {}
    if friction:
        hinges = [hinge for closed in closures for hinge in closed.joints]
        rubbed = {at: hinges[at].driven(effort) for at, effort in friction.items()}
        for at, (pull, couple) in rubbed.items():
            _add_load(hinges[at].joint.child, hinges[at].arm_child, pull, couple, force, moment)
            _add_load(hinges[at].joint.parent, hinges[at].arm_parent, -pull, -couple, force, moment)
    last = sum(len(closed.joints) for closed in closures)
    results: list[tuple[Columns, Columns]] = []
    for place, closed in reversed(list(enumerate(closures))):
        stressed = tension[1] if tension is not None and tension[0] == place else None
        rings = []
        for number_of_ring, ring in enumerate(closed.rings):
            pull, couple = _in_ring(stressed, len(closed.tensions) + LINK_CONSTRAINTS * number_of_ring)
            _add_load(ring.joint.child, ring.arm_child, pull, couple, force, moment)
            _add_load(ring.joint.parent, ring.arm_parent, -pull, -couple, force, moment)
            rings.append((pull, couple))
        generalised = [_generalised_load(closed, k, force, moment) for k in range(len(closed.group.free))]
        cuts = []
        for c, closing in enumerate(closed.cut):
            needed: Columns = ZERO
            for k, load in enumerate(generalised):
                needed = needed + load * closed.duals[k, c]
            multiplier = (1j * needed).conjugate()
            if stressed is not None and stressed < len(closed.tensions):
                multiplier = multiplier + closed.tensions[stressed][c]
            pull, couple = closing.force(multiplier)
            joint = closing.joint
            _add_load(joint.child, closing.arm_child, pull, couple, force, moment)
            _add_load(joint.parent, closing.arm_parent, -pull, -couple, force, moment)
            cuts.append((pull, couple))
        last -= len(closed.joints)
        if closed.group.loop is not None:
            _load_gears(closed, last, force, moment, flanks)
        trees = [
            _balance(hinge, last + k, force, moment, flanks, closed.group.loop is None)
            for k, hinge in reversed(list(enumerate(closed.tree)))
        ]
        results += [*rings[::-1], *cuts[::-1], *trees]
    results.reverse()
    for at, (pull, couple) in rubbed.items():
        results[at] = results[at][0] + pull, results[at][1] + couple
    pulls, couples = ([number(value) for value in part] for part in zip(*results, strict=True)) if results else ([], [])
    return JointForces(closures, pulls, couples, (number(force[0]), number(moment[0])), flanks, dict(friction or {}))


def _in_ring(stressed: int | None, number: int) -> tuple[Columns, Columns]:
    """Return the load on the child of a weld that closes a ring.

    Such a weld has three self-stresses, of which the first has the index `number`. Each is a unit load. The load is
    zero if `stressed` is the index of a different self-stress.
    """
    if stressed is None or not number <= stressed < number + LINK_CONSTRAINTS:
        return ZERO, ZERO
    return ((1.0, ZERO), (1j, ZERO), (ZERO, 1.0))[stressed - number]


def _load_gears(
    closed: Closure, first: int, force: list[Columns], moment: list[Columns], flanks: dict[int, Columns]
) -> None:
    """Add the loads of mutually driving gears to the links (the transpose of `_release_gears`)."""
    loop = closed.group.loop
    assert loop is not None
    hinges = [closed.tree[number] for number in loop.followers]
    generalised = [_load_along(closed, *each, force, moment) for each in zip(hinges, loop.carried, strict=True)]
    sizes = [
        sum(abs(moment[link]) + abs(reach_from(closed, chain)) * abs(force[link]) for link, chain in carried)
        if hinge.turns
        else sum(abs(force[link]) for link, _ in carried)
        for hinge, carried in zip(hinges, loop.carried, strict=True)
    ]
    for column, k, hinge in zip(loop.release.T, loop.followers, hinges, strict=True):
        effort = -sum((share * load for share, load in zip(column, generalised, strict=True)), start=ZERO)
        at = first + k
        if hinge.teeth is not None and at not in flanks:
            size = sum((abs(share) * each for share, each in zip(column, sizes, strict=True)), start=ZERO)
            flanks[at] = loaded_flank(effort, size)
        for act in gear_loads(hinge, *hinge.driven(effort), flanks.get(at, 0.0)):
            force[act.link] = force[act.link] + act.force
            moment[act.link] = moment[act.link] + (cross(act.arm, act.force) + act.moment)


def _balance(
    hinge: JointPlace, at: int, force: list[Columns], moment: list[Columns], flanks: dict[int, Columns], by_gear: bool
) -> tuple[Columns, Columns]:
    """Return the force and moment of tree joint `at` on its child. All other loads on the child must be known.

    If `by_gear` is True, the loads of the joint's own gear are added to the other links.
    """
    child = hinge.joint.child
    if by_gear and hinge.joint.gear is not None:
        load, couple = force[child], moment[child] - cross(hinge.arm_child, force[child])
        if hinge.teeth is not None and at not in flanks:
            size = abs(load) if not hinge.turns else abs(moment[child]) + abs(hinge.arm_child) * abs(load)
            flanks[at] = loaded_flank(hinge.effort(-load, -couple), size)
        for act in gear_loads(hinge, -load, -couple, flanks.get(at, 0.0)):
            force[act.link] = force[act.link] + act.force
            moment[act.link] = moment[act.link] + (cross(act.arm, act.force) + act.moment)
    load, couple = force[child], ZERO
    if not hinge.turns or hinge.joint.moved:
        couple = moment[child] - cross(hinge.arm_child, load)
    _add_load(hinge.joint.parent, hinge.arm_parent, load, couple, force, moment)
    return -load, -couple


def _generalised_load(closed: Closure, k: int, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Return the generalised force of the link loads on free tree joint k."""
    return _load_along(closed, closed.tree[closed.group.free[k]], closed.group.carried[k], force, moment)


def _load_along(
    closed: Closure,
    hinge: JointPlace,
    carried: Sequence[tuple[int, tuple[int, ...]]],
    force: Sequence[Columns],
    moment: Sequence[Columns],
) -> Columns:
    """Return the generalised force on a tree joint due to the loads on the links that the joint carries."""
    total: Columns = ZERO
    for link, chain in carried:
        if hinge.turns:
            total = total + (moment[link] - cross(reach_from(closed, chain), force[link]))
        else:
            total = total + dot(hinge.along, force[link])
    return total


def _add_load(
    link: int, arm: Columns, pull: Columns, couple: Columns, force: list[Columns], moment: list[Columns]
) -> None:
    """Add a force at the end of an arm, and a moment, to the loads on a moving link."""
    if link:
        force[link] = force[link] + pull
        moment[link] = moment[link] + (cross(arm, pull) + couple)


def loaded_flanks(forces: JointForces) -> dict[int, Columns]:
    """Return the loaded flank of each toothed gear (see `JointForces`)."""
    flanks = {}
    for at, place in enumerate(place for closed in forces.closures for place in closed.joints):
        if place.teeth is not None:
            size = abs(forces.force[at]) * (abs(place.teeth.reach) if place.turns else 1.0)
            flanks[at] = loaded_flank(place.effort(*forces.without_friction(at)), size)
    return flanks


def self_stresses(closures: tuple[Closure, ...], flank: Mapping[int, Columns] | None = None) -> list[JointForces]:
    """Return the self-stresses: joint forces without loads, one set per redundant constraint.

    `flank` gives the loaded flanks of gear teeth (see `JointForces`). By default, each set determines its own flanks.
    """
    if not any(closed.redundancy for closed in closures):
        return []
    unloaded = [ZERO] * (1 + max((link for closed in closures for link in closed.group.links), default=0))
    return [
        joint_forces(closures, unloaded, unloaded, (place, which), flank)
        for place, closed in enumerate(closures)
        for which in range(closed.redundancy)
    ]
