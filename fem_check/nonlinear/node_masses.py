"""Inertia of the nodes: lumped mass, first moment and moment of inertia.

The mass of a beam is lumped at its nodes by the trapezoidal rule with end corrections (Euler and Maclaurin),

    integral of f over an element = h (f_1 + f_2)/2 + h^2 (f_1' - f_2')/12,  f = m (virtual displacement)(acceleration),

where w' is the rotation. The corrections are first moments about the nodes, and cancel between elements. With the exact
stiffness, the error is of order four, as with a consistent mass matrix, but nodes are not coupled. The mass at the end
of a beam thus has an arm of h/6 and the corresponding moment of inertia, which a second difference of the masses near
the end compensates. The mass, centre and moment of inertia of a uniform beam are exact.
"""

from dataclasses import dataclass

import numpy as np

from rigid import Reals
from rigid.arrays import Complexes


@dataclass(frozen=True, eq=False)
class NodeMasses:
    """Mass [kg], first moment in link axes [kg m], complex, and moment of inertia [kg m^2] of the nodes."""

    mass: Reals
    first: Complexes
    inertia: Reals


@dataclass(frozen=True, eq=False)
class MassState:
    """Inertia forces of the nodes, (instants, nodes, 3), their derivatives, (instants, nodes, 3, 3), and energy."""

    force: Reals
    stiffness: Reals
    damping: Reals
    mass: Reals
    energy: Reals


def mass_state(masses: NodeMasses, q: Reals, v: Reals, a: Reals, gravity: complex) -> MassState:
    """Compute inertia minus weight of all nodes from q, v, a of shape (instants, nodes, 3)."""
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


def gathered(line: Reals, slope: tuple[float, float], length: float) -> tuple[Reals, Reals, Reals]:
    """Return the mass, axial first moment and moment of inertia at the nodes of a beam.

    Parameters
    ----------
    line
        Mass per length at the nodes [kg/m].
    slope
        Derivative of the mass per length at both ends [kg/m^2].
    length
        Element length [m].
    """
    weights, h = gathering_weights(len(line) - 1), length
    mass, first, inertia = h * weights * line, np.zeros_like(line), np.zeros_like(line)
    mass[0] += h**2 / 12 * slope[0]
    mass[-1] -= h**2 / 12 * slope[1]
    first[0], first[-1] = h**2 / 12 * line[0], -(h**2) / 12 * line[-1]
    inertia[0], inertia[-1] = h**3 / 72 * line[0], h**3 / 72 * line[-1]
    return mass, first, inertia


def gathering_weights(count: int) -> Reals:
    """Return the weights of the nodes of a beam with equal elements, in element lengths.

    Examples
    --------
    Mass l and moment of inertia l^3/3 about the start of a uniform beam, including the arms and inertia at the ends:

    >>> weights = gathering_weights(8)
    >>> float(weights.sum().round(12)), float((weights @ np.arange(9) ** 2 - 16 / 12 + 2 / 72).round(9))
    (8.0, 170.666666667)
    """
    weights = np.ones(count + 1)
    weights[[0, -1]] /= 2
    if count > 1:
        for number, change in enumerate((-1 / 144, 2 / 144, -1 / 144)):
            weights[number] += change
            weights[-1 - number] += change
    return weights
