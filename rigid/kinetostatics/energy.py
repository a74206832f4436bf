"""Energy of a moving mechanism, and power of loads and dampers."""

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.constants import mass_constants
from rigid.kinematics import Motion
from rigid.kinetostatics.loads import given_loads
from rigid.plane import dot


def kinetic_energy(motion: Motion) -> Reals:
    """Kinetic energy of all links and rotors [J], shape (..., positions)."""
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    omega = motion.angular_velocity
    momentum = mass * motion.velocity / 2 + 1j * omega * motion.direction * first
    energy: Reals = (dot(motion.velocity, momentum) + second * omega**2 / 2)[1:].sum(axis=0)
    for drive, rate in zip(motion.mechanism.drives, motion.drive_rate, strict=True):
        energy = energy + drive.inertia * rate**2 / 2
    return energy


def potential_energy(motion: Motion) -> Reals:
    """Energy of weights (0 with all mass at the origin) and springs [J], (..., positions)."""
    mass, first, _ = mass_constants(motion.mechanism, len(motion.columns))
    height = dot(motion.mechanism.gravity, mass * motion.origin + motion.direction * first)
    return -height[1:].sum(axis=0) + _sum(motion, "energy")


def dissipated_power(motion: Motion) -> Reals:
    """Power dissipated by dampers [W], shape (..., positions)."""
    return np.zeros(motion.columns) + _sum(motion, "dissipation")


def load_power(motion: Motion) -> Reals:
    """Power of all loads including springs and dampers, without weights [W], (..., positions)."""
    power = np.zeros(motion.columns)
    for at, pull, couple in given_loads(motion):
        power += dot(motion.velocity[at], pull) + motion.angular_velocity[at] * couple
    return power


def _sum(motion: Motion, quantity: str) -> Columns:
    """Sum of a quantity over the loads that define it."""
    known = (getattr(load, quantity, None) for load in motion.mechanism.loads)
    return sum((each(motion) for each in known if each is not None), start=0.0)
