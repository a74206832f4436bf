"""Joint friction by the second formulation, reimplemented as an independent check."""

from collections.abc import Iterator, Mapping

import numpy as np

from rigid.arrays import Columns, Complexes, Reals
from rigid.closures.forces import JointForces
from rigid.decomposition.order import structure
from rigid.joints import Joint
from rigid.kinematics import Motion
from rigid.points import position_of, velocity_of

REST_SPEED = 1e-9  # speed of a joint at rest, relative to the largest speed


def friction_of(motion: Motion, forces: JointForces) -> dict[int, Reals]:
    """Moment or force of friction on the child by joint number, shape (..., positions)."""
    mechanism, efforts = motion.mechanism, {}
    fastest = np.max(
        [np.abs(velocity_of(motion, link.name, point)) for link in mechanism.links for point in link.points], 0
    )
    for number, joint in enumerate(structure(mechanism).joints):
        friction = mechanism.friction.get(joint.name)
        if friction is None:
            continue
        force, moment = forces.force[number], forces.moment[number]
        if joint.turns:
            rate = motion.angular_velocity[joint.child] - motion.angular_velocity[joint.parent]
            press, least = friction.radius * np.abs(force), np.abs(motion.angular_velocity).max(axis=0)
        else:
            rate, across = _slide(motion, joint)
            rate = rate if joint.ordered else -rate
            normal = np.abs((np.conj(across) * force).real)
            press, least = np.maximum(normal, 2 * np.abs(moment) / friction.length), fastest
        moves = np.where(np.abs(rate) > REST_SPEED * least, np.sign(rate), 0.0)
        efforts[number] = np.broadcast_to(
            -friction.coefficient * press * moves - friction.viscosity * rate, motion.columns
        )
    return efforts


def _slide(motion: Motion, joint: Joint) -> tuple[Reals, Complexes]:
    """Sliding velocity of a slider's point on its line [m/s], and the normal vector."""
    owner, block, point = joint.owner, joint.block, joint.at(joint.block)
    along = motion.direction[owner] * joint.line
    arm = position_of(motion, block, point) - motion.origin[owner]
    carried = motion.velocity[owner] + 1j * motion.angular_velocity[owner] * arm
    return (np.conj(along) * (velocity_of(motion, block, point) - carried)).real, 1j * along


def friction_loads(motion: Motion, friction: Mapping[int, Reals]) -> Iterator[tuple[int, Columns, Columns]]:
    """Yield link number, friction force [N], complex, and moment about the link's origin [N m]."""
    mechanism = motion.mechanism
    for number, effort in friction.items():
        joint = structure(mechanism).joints[number]
        if joint.turns:
            yield joint.child, 0.0, effort
            yield joint.parent, 0.0, -effort
            continue
        place = position_of(motion, joint.block, joint.at(joint.block))
        pull = effort * motion.direction[joint.owner] * joint.line
        for link, force in ((joint.child, pull), (joint.parent, -pull)):
            yield link, force, (np.conj(place - motion.origin[link]) * force).imag
