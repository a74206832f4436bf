"""Inertia of nodes: mass, first moment and moment of inertia of what turns with each.

The mass of a beam is gathered at its nodes by Gregory's rule, which is the trapezoidal one with its ends corrected by
differences: 3/8, 7/6, 23/24, 1, 1, ... times what is between two nodes (Davis and Rabinowitz, Methods of Numerical
Integration, 2nd ed., Academic Press 1984, section 2.9). Together with exact stiffness it is of the fourth order, as a
consistent mass is, keeps mass, centre and moment of inertia of a uniform beam, and couples no nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid import Reals


@dataclass(frozen=True, eq=False)
class Masses:
    """Of all nodes: `mass` [kg], `first` moment [kg m], complex, in the link's axes, `inertia` [kg m^2], (nodes,)."""

    mass: Reals
    first: Any
    inertia: Reals


@dataclass(frozen=True, eq=False)
class MassState:
    """What the nodes need to be accelerated so, (instants, nodes, 3), and its derivatives, (instants, nodes, 3, 3)."""

    force: Reals
    stiffness: Reals
    damping: Reals
    mass: Reals
    energy: Reals


def mass_state(masses: Masses, q: Reals, v: Reals, a: Reals, gravity: complex) -> MassState:
    """Inertia less weight of all nodes; q, v, a of shape (instants, nodes, 3)."""
    arm = masses.first * np.exp(1j * q[..., 2])
    felt = a[..., 0] + 1j * a[..., 1] - gravity
    spin, turning = v[..., 2], 1j * a[..., 2] - v[..., 2] ** 2
    push = masses.mass * felt + arm * turning
    force = np.stack([push.real, push.imag, masses.inertia * a[..., 2] + (np.conj(arm) * felt).imag], axis=-1)
    stiffness, damping, mass = np.zeros((3, *spin.shape, 3, 3))
    by_turn, by_spin, along = 1j * arm * turning, -2.0 * spin * arm, 1j * arm
    stiffness[..., 0, 2], stiffness[..., 1, 2] = by_turn.real, by_turn.imag
    stiffness[..., 2, 2] = -(np.conj(arm) * felt).real
    damping[..., 0, 2], damping[..., 1, 2] = by_spin.real, by_spin.imag
    mass[..., 0, 0] = mass[..., 1, 1] = masses.mass
    mass[..., 2, 2] = masses.inertia
    mass[..., 0, 2] = mass[..., 2, 0] = along.real
    mass[..., 1, 2] = mass[..., 2, 1] = along.imag
    velocity = v[..., 0] + 1j * v[..., 1]
    energy = masses.mass * np.abs(velocity) ** 2 / 2 + masses.inertia * spin**2 / 2
    energy += spin * (np.conj(arm) * velocity).imag
    return MassState(force, stiffness, damping, mass, energy)


def gathering_weights(count: int) -> Reals:
    """Weights of an integral over a beam of so many equal elements at its nodes, in lengths of an element.

    Examples
    --------
    >>> float(gathering_weights(8) @ np.arange(9) ** 2)  # 8^3/3
    170.66666666666666
    """
    few = {1: [1 / 2, 1 / 2], 2: [1 / 3, 4 / 3, 1 / 3], 3: [3 / 8, 9 / 8, 9 / 8, 3 / 8]}
    if count in few:
        return np.array(few[count])
    weights = np.ones(count + 1)
    for number, change in enumerate((-5 / 8, 1 / 6, -1 / 24)):
        weights[[number, -1 - number]] += change
    return weights
