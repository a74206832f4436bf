"""Drive efforts by two further methods: virtual work, and Lagrange multipliers.

Both give the same as `drive_efforts(motion, reactions(motion))`, the Newton-Euler method; the three share only the
loads. Derivations: docs/dynamics.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Flags, Reals
from rigid.closures.conditioning import SINGULAR
from rigid.closures.forces import MAX_UNSTRESSED, JointForces
from rigid.closures.gears import gear_loads
from rigid.constants import mass_constants
from rigid.dynamics.constraints import Constraints, constraint_matrix, constraint_table, constraints_at
from rigid.dynamics.rubbing import friction_loads, friction_of
from rigid.joints import JointPlace
from rigid.kinematics import Motion, unit_motions, with_rates
from rigid.kinetostatics.friction import sliding_rate
from rigid.kinetostatics.loads import given_loads, link_loads
from rigid.kinetostatics.statics import reactions
from rigid.parts import MechanismError
from rigid.plane import cross, dot

# largest number of friction iterations, and largest change of converged efforts, relative to their size
MAX_ROUNDS, TOLERANCE = 200, 1e-13


@dataclass(frozen=True, eq=False)
class EquationOfMotion:
    """`inertia @ drive_acceleration + bias = force + effort`, one row per drive.

    Attributes
    ----------
    inertia
        Reduced inertia [kg m^2, kg m or kg], symmetric, shape (drives, drives, ..., positions).
    bias
        Efforts due to centripetal and Coriolis accelerations [N m or N], shape (drives, ..., positions).
    force
        Reduced weights and loads without joint friction [N m or N], shape (drives, ..., positions).
    """

    inertia: Reals
    bias: Reals
    force: Reals


def equation_of_motion(motion: Motion) -> EquationOfMotion:
    """Equation of motion in the drive coordinates, at the positions and rates of a motion.

    References
    ----------
    Scutaru, Vlase, Marin, equations (41) to (43): with one drive, inertia is alpha and bias is beta omega^2.
    """
    units = unit_motions(motion)
    inertia = np.stack([[_inertia_power(unit, other) for other in units] for unit in units])
    for number, drive in enumerate(motion.mechanism.drives):
        inertia[number, number] += drive.inertia
    coasting = with_rates(motion, motion.drive_rate)
    bias = np.stack([_acceleration_power(unit, coasting) for unit in units])
    return EquationOfMotion(inertia, bias, _reduced_loads(motion, units))


def reduced_inertia(motion: Motion) -> tuple[Reals, Reals]:
    """alpha and beta of `alpha eps + beta omega^2 = Q` for one drive, each (..., positions).

    beta is half the derivative of alpha with respect to the drive's coordinate.

    Raises
    ------
    MechanismError
        The mechanism does not have exactly one drive.
    """
    if len(motion.mechanism.drives) != 1:
        raise MechanismError(f"{len(motion.mechanism.drives)} drives: one reduced inertia belongs to one drive")
    unit = with_rates(motion, 1.0)
    return _inertia_power(unit, unit) + motion.mechanism.drives[0].inertia, _acceleration_power(unit, unit)


def virtual_work_efforts(motion: Motion) -> Reals:
    """Moment [N m] or force [N] of each drive by virtual work, (drives, ..., positions).

    Friction does not follow from virtual work and is taken from `reactions`.
    """
    equation = equation_of_motion(motion)
    rate2 = motion.drive_acceleration.reshape(-1, *[1] * (len(motion.columns) - 1), motion.columns[-1])
    inertia: Reals = np.einsum("jk...,k...->j...", equation.inertia, rate2)
    efforts: Reals = inertia + equation.bias - equation.force
    if motion.mechanism.friction:
        units = unit_motions(motion)
        for number, effort in reactions(motion).friction.items():
            efforts = efforts - np.stack([effort * sliding_rate(unit, number) for unit in units])
    return efforts


def _inertia_power(motion: Motion, other: Motion) -> Reals:
    """Mass-weighted product of two velocity states: twice the kinetic energy if equal."""
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    arm = motion.direction * first
    omega, turned = 1j * motion.angular_velocity, 1j * other.angular_velocity
    power: Reals = (
        mass.real * dot(motion.velocity, other.velocity)
        + dot(motion.velocity, turned * arm)
        + dot(other.velocity, omega * arm)
        + second * motion.angular_velocity * other.angular_velocity
    )[1:].sum(axis=0)
    return power


def _acceleration_power(unit: Motion, motion: Motion) -> Reals:
    """Power of the inertia of one motion on the velocities of another."""
    mass, first, second = mass_constants(unit.mechanism, len(unit.columns))
    arm = unit.direction * first
    force = mass * motion.acceleration + motion.turning * arm
    moment = cross(arm, motion.acceleration) + second * motion.angular_acceleration
    power: Reals = (dot(unit.velocity, force) + unit.angular_velocity * moment)[1:].sum(axis=0)
    return power


def _reduced_loads(motion: Motion, units: list[Motion]) -> Reals:
    """Power of weights and loads at unit drive rates, shape (drives, ..., positions)."""
    mechanism = motion.mechanism
    mass, first, _ = mass_constants(mechanism, len(motion.columns))
    weight, tilt = mass * mechanism.gravity, cross(motion.direction * first, mechanism.gravity)
    power = np.stack([(dot(u.velocity, weight) + u.angular_velocity * tilt)[1:].sum(axis=0) for u in units])
    for at, pull, couple in given_loads(motion):
        power += [dot(unit.velocity[at], pull) + unit.angular_velocity[at] * couple for unit in units]
    return power


def multiplier_forces(motion: Motion) -> JointForces:
    """Joint forces by Lagrange multipliers, one linear system for the whole mechanism.

    Returns the same as `reactions`; pass it to `drive_efforts` for the efforts. nan at singular positions, and for
    redundant mechanisms where the loads do not determine the force. Friction is iterated; nan without convergence.
    """
    forces = _multiplier_forces(motion, {})
    if not motion.mechanism.friction:
        return forces
    before: dict[int, Any] = {}
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


def _multiplier_forces(motion: Motion, friction: Mapping[int, Reals]) -> JointForces:
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


def _multipliers(matrix: Reals, load: Reals, good: Flags) -> Reals:
    """Multipliers that balance the loads, (..., positions, rows); nan if not `good`."""
    multipliers = np.full((*good.shape, matrix.shape[-2]), np.nan)
    solve = np.linalg.solve if matrix.shape[-1] == matrix.shape[-2] else _determined
    multipliers[good] = solve(np.swapaxes(matrix[good], -1, -2), -load[good][..., None])[..., 0]
    return multipliers


def _tooth_row(motion: Motion, place: JointPlace, push: Columns) -> Reals:
    """Approach rate of two teeth along their line of action, per rate of the coordinates."""
    teeth = place.teeth
    assert teeth is not None
    row = np.zeros((*motion.columns, 3 * len(motion.mechanism.links)))
    for link, arm, sign in ((teeth.wheel, place.arm(teeth.wheel) + teeth.reach, 1.0), (teeth.body, teeth.arm, -1.0)):
        for axis, part in enumerate((np.real(push), np.imag(push), cross(arm, push))):
            row[..., 3 * link + axis] += sign * part
    return row[..., 3:]


def _determined(matrix: Reals, load: Reals) -> Reals:
    """Multipliers of a redundant mechanism determined by equilibrium; nan for the others."""
    multipliers = np.linalg.pinv(matrix) @ load
    self_stress = np.linalg.svd(matrix)[2][..., matrix.shape[-2] :, :]
    stressed = np.linalg.norm(self_stress, axis=-2) > MAX_UNSTRESSED
    multipliers[stressed] = np.nan
    return multipliers


def _joint_forces(
    motion: Motion, here: Constraints, multiplier: Reals, ground: tuple[Complexes, Reals], flank: Mapping[int, Reals]
) -> JointForces:
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
