"""Joint forces in equilibrium with the loads of the links, including drive efforts."""

from collections.abc import Iterable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.closures.conditioning import cancellation_factor, extents, greatest_force, ill_conditioned
from rigid.closures.forces import MAX_UNSTRESSED, JointForces, joint_forces, self_stresses
from rigid.closures.gears import gear_loads
from rigid.constants import mass_constants
from rigid.joints import JointPlace
from rigid.kinematics import Motion
from rigid.kinetostatics.friction import with_friction
from rigid.kinetostatics.loads import given_loads, link_loads


def reactions(motion: Motion) -> JointForces:
    """Forces in all joints and on the ground; nan if singular or statically undetermined.

    They are also nan if friction may lock the mechanism. The order is that of `motion.structure.joints`; each force
    acts on the joint's child link, and the opposite on the parent.
    """
    forces = with_friction(motion, lambda friction, flank: balancing_forces(motion, (), flank, friction))
    if motion.may_be_singular:
        forces.mark(ill_conditioned(motion, force_condition(motion, forces)))
    states = self_stresses(motion.closures, forces.flank)
    for number in forces.friction:
        if any(np.any(np.abs(state.force[number]) + np.abs(state.moment[number]) > MAX_UNSTRESSED) for state in states):
            forces.mark(True)  # an undetermined contact force makes all forces with friction undetermined
    for state in states:
        for values, parts in ((forces.force, state.force), (forces.moment, state.moment)):
            for number, part in enumerate(parts):
                values[number] = _open_where(values[number], part)
    return forces


def _open_where(value: Columns, part: Columns) -> Columns:
    """Set components that take part in a self-stress to nan."""
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
    """Joint forces in equilibrium with all loads; if there are self-stresses, one of many solutions.

    Joint friction is an explicit load here; the mechanism's own friction is ignored.

    Parameters
    ----------
    more
        Additional loads: link number, force in the ground's axes [N], complex, and moment about the origin of the
        link's axes [N m].
    flank
        Loaded flanks of the gears' teeth, see `JointForces`; by default, those that the efforts load.
    friction
        Friction efforts by joint number, see `JointForces`.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        force, moment = link_loads(motion)
        for at, pull, couple in more:
            force[at], moment[at] = force[at] + pull, moment[at] + couple
        return joint_forces(motion.closures, force, moment, flank=flank, friction=friction)


def force_condition(motion: Motion, forces: JointForces) -> Reals:
    """Amplification of round-off in joint forces, (..., positions), see `Motion.condition`.

    It is larger if loads nearly cancel, because the remaining forces then have a larger relative error.
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
    """Moment [N m] or force [N] of each drive along its coordinate, (drives, ..., positions).

    It includes the effort of the rotor's inertia, which does not load the joints.
    """
    efforts = np.empty((len(motion.mechanism.drives), *motion.columns))
    for number, place in enumerate(motion.places):
        if place.joint.drive is not None:
            efforts[place.joint.drive] = place.joint.sense * _effort(place, *forces.without_friction(number))
    for number, drive in enumerate(motion.mechanism.drives):
        if np.any(drive.inertia):
            efforts[number] += drive.inertia * motion.drive_acceleration[number]
    return efforts


def _effort(place: JointPlace, force: Columns, moment: Columns) -> Columns:
    """Like `JointPlace.effort`, but ignore an undetermined force normal to a slider's line."""
    if place.turns:
        return moment
    parts = (np.real(place.along), np.real(force)), (np.imag(place.along), np.imag(force))
    return sum(np.where(part == 0, 0.0, part * of_force) for part, of_force in parts)
