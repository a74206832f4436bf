"""Inertia of the nodes: lumped mass, first moment and moment of inertia.

The mass of a beam is lumped at its nodes by the trapezoidal rule with end corrections (Euler and Maclaurin),

    integral of f over an element = h (f_1 + f_2)/2 + h^2 (f_1' - f_2')/12,

where h is the length of the element and f = (mass per length) (virtual displacement) (acceleration). The slopes of
displacement and acceleration in f' are replaced by the rotation and the angular acceleration of the node. The end
corrections become first moments about the nodes, and cancel at nodes between two equal elements. With the exact
stiffness, the error is of order four in h, as with a consistent mass matrix, but the nodes are not coupled.

The mass at the end of a beam thus has its centre at the distance h/6 from the node, and the corresponding moment of
inertia. This moment of inertia is compensated by small changes of the masses at the last three nodes (-1, 2 and -1
times 1/144 of the mass of an element). The mass, centre and moment of inertia of a uniform beam are exact.
"""

import numpy as np
from msgspec import Struct

from rigid import Reals
from rigid.arrays import Complexes


class NodeMasses(Struct, frozen=True, eq=False):
    """Inertia of the nodes, in arrays of shape (nodes,).

    Attributes
    ----------
    mass
        Mass [kg].
    first
        First moment of mass about the node, in link axes (complex) [kg m].
    inertia
        Moment of inertia about the node [kg m^2].
    """

    mass: Reals
    first: Complexes
    inertia: Reals


class MassState(Struct, frozen=True, eq=False):
    """Inertia of all nodes at several instants.

    Attributes
    ----------
    force
        Mass times acceleration, minus weight, for x, y and rotation, shape (instants, nodes, 3).
    stiffness, damping, mass
        Derivatives of `force` with respect to coordinates, rates and accelerations, each of shape (instants, nodes, 3,
        3).
    energy
        Kinetic energy [J], shape (instants, nodes).
    """

    force: Reals
    stiffness: Reals
    damping: Reals
    mass: Reals
    energy: Reals


def mass_state(masses: NodeMasses, q: Reals, v: Reals, a: Reals, gravity: complex) -> MassState:
    """Compute the inertia of all nodes, see `MassState`.

    q, v, a are x, y and rotation of the nodes, their rates and accelerations, each of shape (instants, nodes, 3).
    """
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


def lumped_inertia(line: Reals, slope: tuple[float, float], length: float) -> tuple[Reals, Reals, Reals]:
    """Return the mass, the first moment along the beam and the moment of inertia of each node of a beam.

    Parameters
    ----------
    line
        Mass per length at the nodes [kg/m].
    slope
        Derivative of the mass per length along the beam, at its start and at its end [kg/m^2].
    length
        Element length [m].
    """
    weights, h = lumping_weights(len(line) - 1), length
    mass, first, inertia = h * weights * line, np.zeros_like(line), np.zeros_like(line)
    mass[0] += h**2 / 12 * slope[0]
    mass[-1] -= h**2 / 12 * slope[1]
    first[0], first[-1] = h**2 / 12 * line[0], -(h**2) / 12 * line[-1]
    inertia[0], inertia[-1] = h**3 / 72 * line[0], h**3 / 72 * line[-1]
    return mass, first, inertia


def lumping_weights(count: int) -> Reals:
    """Return the masses of the nodes of a uniform beam, relative to the mass of an element.

    `count` is the number of elements.

    Examples
    --------
    Eight elements of length 1 and mass 1 have the mass 8 and the moment of inertia 8^3/3 about the start. The moment of
    inertia includes the first moments and the moments of inertia of the end nodes.

    >>> weights = lumping_weights(8)
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
