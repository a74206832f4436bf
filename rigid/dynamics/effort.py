"""Equation of motion in the drive coordinates by virtual work; derivation: docs/dynamics.md."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid.arrays import Reals
from rigid.constants import mass_constants
from rigid.kinematics import Motion, with_rates
from rigid.kinetostatics.loads import given_loads
from rigid.parts import MechanismError
from rigid.plane import cross, dot


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
    units = motion.units
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
    (unit,) = motion.units
    return _inertia_power(unit, unit) + motion.mechanism.drives[0].inertia, _acceleration_power(unit, unit)


def _inertia_power(motion: Motion, other: Motion) -> Reals:
    """Mass-weighted product of two velocity states: twice the kinetic energy if equal."""
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    arm = motion.direction * first
    omega, turned = 1j * motion.angular_velocity, 1j * other.angular_velocity
    return (
        mass.real * dot(motion.velocity, other.velocity)
        + dot(motion.velocity, turned * arm)
        + dot(other.velocity, omega * arm)
        + second * motion.angular_velocity * other.angular_velocity
    )[1:].sum(axis=0)


def _acceleration_power(unit: Motion, motion: Motion) -> Reals:
    """Power of the inertia forces of one motion on the velocities of another."""
    mass, first, second = mass_constants(unit.mechanism, len(unit.columns))
    arm = unit.direction * first
    force = mass * motion.acceleration + motion.turning * arm
    moment = cross(arm, motion.acceleration) + second * motion.angular_acceleration
    return (dot(unit.velocity, force) + unit.angular_velocity * moment)[1:].sum(axis=0)


def _reduced_loads(motion: Motion, units: Sequence[Motion]) -> Reals:
    """Power of weights and loads at unit drive rates, shape (drives, ..., positions)."""
    mechanism = motion.mechanism
    mass, first, _ = mass_constants(mechanism, len(motion.columns))
    weight, tilt = mass * mechanism.gravity, cross(motion.direction * first, mechanism.gravity)
    power = np.stack([(dot(u.velocity, weight) + u.angular_velocity * tilt)[1:].sum(axis=0) for u in units])
    for at, pull, couple in given_loads(motion):
        power += [dot(unit.velocity[at], pull) + unit.angular_velocity[at] * couple for unit in units]
    return power
