"""Joint forces and drive efforts by two further methods, virtual work and Lagrange multipliers.

Both give the same as `reactions`, the Newton-Euler method, and share only the loads with it. Derivation:
docs/dynamics.md.
"""

import numpy as np
from msgspec.structs import replace

from rigid import SINGULAR, position_of, reactions, structure, velocity_of
from rigid.closures import MAX_UNSTRESSED, gear_loads
from rigid.closures.forces import JointForces
from rigid.dynamics import equation_of_motion
from rigid.dynamics.constraints import constraint_matrix, constraint_table, constraints_at
from rigid.kinetostatics import link_loads
from rigid.kinetostatics.friction import sliding_rate
from rigid.plane import cross

# maximum number of friction iterations, and largest change of converged efforts, relative to their size
MAX_ROUNDS, TOLERANCE = 200, 1e-13
REST_SPEED = 1e-9  # speed of a joint at rest, relative to the largest speed


def virtual_work_efforts(motion):
    """Moment [N m] or force [N] of each drive by virtual work, (drives, ..., positions).

    Friction does not follow from virtual work and is taken from `reactions`.
    """
    equation = equation_of_motion(motion)
    rate2 = motion.drive_acceleration.reshape(-1, *[1] * (len(motion.columns) - 1), motion.columns[-1])
    inertia = np.einsum("jk...,k...->j...", equation.inertia, rate2)
    efforts = inertia + equation.bias - equation.force
    if motion.mechanism.friction:
        units = motion.units
        for number, effort in reactions(motion).friction.items():
            efforts = efforts - np.stack([effort * sliding_rate(unit, number) for unit in units])
    return efforts


def multiplier_forces(motion):
    """Joint forces by Lagrange multipliers, one linear system for the whole mechanism.

    Returns the same as `reactions`; pass it to `drive_efforts` for the efforts. nan at singular positions, and for
    redundant mechanisms where the loads do not determine the force. Friction is iterated; nan without convergence.
    """
    forces = _multiplier_forces(motion, {})
    if not motion.mechanism.friction:
        return forces
    before = {}
    for _ in range(MAX_ROUNDS):
        efforts = friction_of(motion, forces)
        off = [np.abs(efforts[at] - before.get(at, np.inf)) - TOLERANCE * np.abs(efforts[at]) for at in efforts]
        lost = np.max(off, axis=0) > 0
        before = efforts
        if not lost.any():
            break
        forces = _multiplier_forces(motion, efforts)
    if lost.any():
        forces.mark(lost)
    return forces


def _multiplier_forces(motion, friction):
    """Joint forces for given friction efforts, by joint number."""
    links, columns = len(motion.mechanism.links), motion.columns
    here = constraints_at(constraint_table(motion.mechanism, len(columns)), motion.origin, motion.direction)
    force, moment = (np.stack([np.broadcast_to(value, columns) for value in part]) for part in link_loads(motion))
    ground = force[0].copy(), moment[0].copy()
    for link, pull, couple in friction_loads(motion, friction):
        force[link] += pull
        moment[link] += couple
    load = np.stack([force[1:].real, force[1:].imag, moment[1:]], axis=1).reshape(3 * (links - 1), *columns)
    load = np.moveaxis(load, 0, -1)
    good = motion.condition <= SINGULAR
    matrix = constraint_matrix(here)
    multiplier = _multipliers(matrix, load, good)
    followers = [(number, place) for number, place in enumerate(motion.places) if place.joint.gear is not None]
    efforts = 2 * here.table.count + len(motion.mechanism.drives)  # row number of the first gear
    flank = {}
    for row, (number, place) in enumerate(followers, efforts):
        if place.teeth is not None:
            effort = place.joint.sense * multiplier[..., row]
            flank[number] = np.where(np.abs(effort) > MAX_UNSTRESSED * np.abs(load).max(-1), np.sign(effort), 0.0)
            matrix[..., row, :] = (
                place.teeth.sense * place.joint.sense * _tooth_row(motion, place, place.teeth.push(flank[number]))
            )
    if flank:
        multiplier = _multipliers(matrix, load, good)
    held = _joint_forces(motion, here, np.moveaxis(multiplier, -1, 0), ground, flank)
    for number, effort in friction.items():
        pull, couple = motion.places[number].driven(effort)
        held.force[number], held.moment[number] = held.force[number] + pull, held.moment[number] + couple
    return replace(held, friction=dict(friction))


def _multipliers(matrix, load, good):
    """Multipliers that balance the loads, (..., positions, rows); nan if not `good`."""
    multipliers = np.full((*good.shape, matrix.shape[-2]), np.nan)
    solve = np.linalg.solve if matrix.shape[-1] == matrix.shape[-2] else _determined
    multipliers[good] = solve(np.swapaxes(matrix[good], -1, -2), -load[good][..., None])[..., 0]
    return multipliers


def _tooth_row(motion, place, push):
    """Approach rate of two teeth along their line of action, per rate of the coordinates."""
    teeth = place.teeth
    row = np.zeros((*motion.columns, 3 * len(motion.mechanism.links)))
    for link, arm, sign in ((teeth.wheel, place.arm(teeth.wheel) + teeth.reach, 1.0), (teeth.body, teeth.arm, -1.0)):
        for axis, part in enumerate((np.real(push), np.imag(push), cross(arm, push))):
            row[..., 3 * link + axis] += sign * part
    return row[..., 3:]


def _determined(matrix, load):
    """Multipliers of a redundant mechanism determined by equilibrium; nan for the others."""
    multipliers = np.linalg.pinv(matrix) @ load
    self_stress = np.linalg.svd(matrix)[2][..., matrix.shape[-2] :, :]
    stressed = np.linalg.norm(self_stress, axis=-2) > MAX_UNSTRESSED
    multipliers[stressed] = np.nan
    return multipliers


def _joint_forces(motion, here, multiplier, ground, flank):
    """Convert multipliers to forces and moments on the joints' children."""
    table = here.table
    count = table.count
    pulls, couples = [], []
    moving = np.tensordot(table.shares.T, multiplier[2 * count :], 1)
    effort = dict(zip(table.moved.tolist(), moving, strict=True))
    for number, joint in enumerate(table.joints):
        first, second = multiplier[2 * number], multiplier[2 * number + 1]
        if joint.turns:
            pulls.append(first + 1j * second)
            couples.append(effort.get(number, 0.0))
        else:
            pulls.append(joint.sense * np.conj(here.toward[number]) * (effort.get(number, 0.0) + 1j * second))
            couples.append(joint.sense * first)
    pull, couple = ground
    for number, place in enumerate(motion.places):
        if place.joint.gear is not None:
            for act in gear_loads(place, pulls[number], couples[number], flank.get(number, 0.0)):
                if act.link == 0:
                    pull, couple = pull + act.force, couple + cross(act.arm, act.force) + act.moment
    return JointForces(motion.closures, pulls, couples, (pull, couple), dict(flank))


def friction_of(motion, forces):
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


def _slide(motion, joint):
    """Sliding velocity of a slider's point on its line [m/s], and the normal vector."""
    owner, block, point = joint.owner, joint.block, joint.at(joint.block)
    along = motion.direction[owner] * joint.line
    arm = position_of(motion, block, point) - motion.origin[owner]
    carried = motion.velocity[owner] + 1j * motion.angular_velocity[owner] * arm
    return (np.conj(along) * (velocity_of(motion, block, point) - carried)).real, 1j * along


def friction_loads(motion, friction):
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
