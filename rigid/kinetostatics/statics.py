"""Joint forces and drive efforts that are in equilibrium with the loads on the links."""

from collections.abc import Iterable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.closures.conditioning import cancellation_factor, extents, greatest_force, has_no_result
from rigid.closures.forces import MAX_UNSTRESSED, JointForces, joint_forces, self_stresses
from rigid.closures.gears import gear_loads
from rigid.constants import mass_constants
from rigid.joints import JointPlace
from rigid.kinematics import Motion
from rigid.kinetostatics.friction import forces_with_friction
from rigid.kinetostatics.loads import given_loads, link_loads


def reactions(motion: Motion) -> JointForces:
    """Return the forces in all joints and on the ground.

    The forces are in the order of `motion.structure.joints`. Each force acts on the child link of the joint, and the
    opposite force acts on the parent. Forces are nan at singular positions, and at positions at which friction may lock
    the mechanism. Statically indeterminate forces are also nan.
    """
    forces = forces_with_friction(motion, lambda friction, flank: balancing_forces(motion, (), flank, friction))
    if motion.may_be_singular:
        forces.mark(has_no_result(motion, force_condition(motion, forces)))
    states = self_stresses(motion.closures, forces.flank)
    for number in forces.friction:
        if any(np.any(np.abs(state.force[number]) + np.abs(state.moment[number]) > MAX_UNSTRESSED) for state in states):
            forces.mark(True)  # if the contact force of a joint with friction is indeterminate, all forces are
    for state in states:
        for values, parts in ((forces.force, state.force), (forces.moment, state.moment)):
            for number, part in enumerate(parts):
                values[number] = _without_indeterminate(values[number], part)
    return forces


def _without_indeterminate(value: Columns, part: Columns) -> Columns:
    """Set each component of a joint force to nan if it is not zero in the self-stress `part`."""
    if not np.iscomplexobj(part):
        return (
            np.where(np.abs(part) > MAX_UNSTRESSED, np.nan, value) if np.any(np.abs(part) > MAX_UNSTRESSED) else value
        )
    result = np.empty(np.broadcast(value, part).shape, complex)
    result.real = np.where(np.abs(part.real) > MAX_UNSTRESSED, np.nan, np.real(value))
    result.imag = np.where(np.abs(part.imag) > MAX_UNSTRESSED, np.nan, np.imag(value))
    return result


def balancing_forces(
    motion: Motion,
    more: Iterable[tuple[int, Columns, Columns]] = (),
    flank: Mapping[int, Columns] | None = None,
    friction: Mapping[int, Columns] | None = None,
) -> JointForces:
    """Return joint forces that are in equilibrium with all loads.

    If there are self-stresses, this is one of many solutions.

    Friction of the mechanism is ignored, except for the efforts given in `friction`.

    Parameters
    ----------
    more
        Additional loads: link index, force in ground axes (complex) [N], and moment about the link's origin [N m].
    flank
        Loaded flanks of gear teeth (see `JointForces`). By default they are determined by the signs of the efforts.
    friction
        Friction efforts by joint index (see `JointForces`).
    """
    with np.errstate(invalid="ignore", over="ignore"):
        force, moment = link_loads(motion)
        for at, pull, couple in more:
            force[at], moment[at] = force[at] + pull, moment[at] + couple
        return joint_forces(motion.closures, force, moment, flank=flank, friction=friction)


def force_condition(motion: Motion, forces: JointForces) -> Reals:
    """Return the amplification of round-off in the joint forces, shape (..., positions) (see `Motion.condition`).

    If loads nearly cancel, the remaining joint forces are small. Their relative error, and the amplification, are then
    larger.
    """
    mechanism = motion.mechanism
    mass, first, second = (np.abs(part) for part in mass_constants(mechanism, len(motion.columns)))
    with np.errstate(all="ignore"):
        relative, turning = np.abs(motion.acceleration) + abs(mechanism.gravity), np.abs(motion.turning)
        force: list[Any] = list(mass * relative + first * turning)
        moment: list[Any] = list(first * relative + second * turning)
        for at, pull, couple in given_loads(motion):
            force[at] = force[at] + np.abs(pull)
            moment[at] = moment[at] + np.abs(couple)
        pulls = iter(forces.force)
        for closed in motion.closures:
            for place, pull in zip(closed.joints, pulls, strict=False):
                if place.joint.parent not in closed.group.links:
                    force[place.joint.parent] = force[place.joint.parent] + np.abs(pull)
        for number, place in enumerate(motion.places):
            if place.joint.gear is not None:
                flank = forces.flank.get(number, 0.0)
                for act in gear_loads(place, *forces.without_friction(number), flank):
                    force[act.link] = force[act.link] + abs(act.force)
                    moment[act.link] = moment[act.link] + abs(act.moment)
        whole = [turn + size * push for turn, size, push in zip(moment, extents(mechanism), force, strict=True)]
        bounds = (greatest_force(closed, force, whole) for closed in motion.closures)
        greatest = reduce(np.maximum, (np.abs(pull) for pull in forces.force), 0.0)
        return motion.condition * cancellation_factor(reduce(np.maximum, bounds, 0.0), greatest)


def drive_efforts(motion: Motion, forces: JointForces) -> Reals:
    """Return the moment [N m] or force [N] of each drive in the direction of its coordinate, (drives, ..., positions).

    The efforts include the inertia of rotors, although it does not load the joints.
    """
    inertias = [np.shape(drive.inertia) for drive in motion.mechanism.drives]
    efforts = np.empty((len(inertias), *np.broadcast_shapes(motion.columns, *inertias)))
    for number, place in enumerate(motion.places):
        if place.joint.drive is not None:
            efforts[place.joint.drive] = place.joint.sense * _effort(place, *forces.without_friction(number))
    for number, drive in enumerate(motion.mechanism.drives):
        if np.any(drive.inertia):
            efforts[number] += drive.inertia * motion.drive_acceleration[number]
    return efforts


def _effort(place: JointPlace, force: Columns, moment: Columns) -> Columns:
    """Return `JointPlace.effort`. For a slider, it is finite even if the force normal to the line is nan."""
    if place.turns:
        return moment
    parts = (np.real(place.along), np.real(force)), (np.imag(place.along), np.imag(force))
    return sum(np.where(part == 0, 0.0, part * of_force) for part, of_force in parts)
