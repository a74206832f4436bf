"""Planar beam elements for large displacements: strains, forces and tangents.

An element has two nodes, each with a position and a rotation. The axes of the element rotate with the mean rotation of
its nodes. Its strains are the stretch and shear of the chord in these axes and the relative rotation of the nodes
(Reissner, On one-dimensional finite-strain beam theory: the plane problem, ZAMP 23 (1972) 795-804, with one integration
point as in Simo and Vu-Quoc, Computer Methods in Applied Mechanics and Engineering 58 (1986) 79-116). The compliance is
that of the exact solution for a straight piece under end forces. The elements therefore do not lock, and linear statics
are exact at the nodes (residual bending flexibility, MacNeal, Computers and Structures 8 (1978) 175-183). A bent piece
is longer than its chord by h turn^2/24, which is included in the stretch.
"""

from dataclasses import dataclass

import numpy as np

from elastic import Section, Taper
from rigid import Reals
from rigid.arrays import Complexes, Integers

GAUSS = np.polynomial.legendre.leggauss(8)
ENDS = np.array([[-1, 0, 0, 1, 0, 0], [0, -1, 0, 0, 1, 0], [0, 0, 0.5, 0, 0, 0.5], [0, 0, -1, 0, 0, 1]], float)
"""Matrix that converts x, y and rotation of both nodes to x and y distance, mean rotation and relative rotation."""

Powers = np.polynomial.polynomial.polyval


@dataclass(frozen=True, eq=False)
class Elements:
    """Beam elements, in arrays of shape (elements, ...).

    Attributes
    ----------
    nodes
        Indices of the start and end nodes, shape (elements, 2).
    axis
        Unit vector of x' in link axes, complex.
    length
        Length h [m].
    free
        Elongation without load [m].
    stiffness
        Stiffness matrices, which map stretch, shear and relative rotation to N, Q = -V and M, shape (elements, 3, 3).
    damping
        beta of the Kelvin-Voigt law stress = E (strain + beta d strain/dt) [s].
    """

    nodes: Integers
    axis: Complexes
    length: Reals
    free: Reals
    stiffness: Reals
    damping: Reals


def element_stiffness(section: Section, length: float, first: float, last: float) -> Reals:
    """Return the stiffness matrix of the piece of a beam between two values of xi, shape (3, 3).

    It maps stretch, shear and relative rotation to N, Q and M at the midpoint. EA and EI must be finite. It is the
    inverse of the flexibility of a piece in equilibrium, with the moment M - Q x at the distance x from the midpoint.
    """
    taper = section.taper or Taper()
    places, weights = (GAUSS[0] + 1) / 2, GAUSS[1] / 2
    xi, part = first + (last - first) * places, (last - first) * length
    x, weights = part * (places - 0.5), part * weights
    stretch = weights / (float(section.EA) * Powers(xi, taper.EA))
    bend = weights / (float(section.EI) * Powers(xi, taper.EI))
    shear = weights / (float(section.kGA) * Powers(xi, taper.kGA))
    flexibility = np.zeros((3, 3))
    flexibility[0, 0] = stretch.sum()
    flexibility[1, 1] = (bend * x**2).sum() + shear.sum()
    flexibility[1, 2] = flexibility[2, 1] = -(bend * x).sum()
    flexibility[2, 2] = bend.sum()
    return np.asarray(np.linalg.inv(flexibility), float)


@dataclass(frozen=True, eq=False)
class ElementState:
    """State of all elements at several instants.

    Attributes
    ----------
    resultants
        N, Q and M at the midpoint in element axes, shape (instants, elements, 3).
    axis
        Direction of the element axes in ground axes, complex, shape (instants, elements).
    force
        Internal force on x, y and rotation of both nodes, shape (instants, elements, 6).
    stiffness, damping
        Derivatives of the force with respect to position and velocity, shape (instants, elements, 6, 6), or empty if
        not requested.
    power
        Dissipated power [W], and in `energy` the stored energy [J], shape (instants, elements).
    slope
        Derivatives of stretch, shear and relative rotation with respect to the coordinates of the nodes, shape
        (instants, elements, 3, 6).
    """

    resultants: Reals
    axis: Complexes
    force: Reals
    stiffness: Reals
    damping: Reals
    power: Reals
    energy: Reals
    slope: Reals


def element_state(elements: Elements, q: Reals, v: Reals, tangent: bool, assumed: Reals | None = None) -> ElementState:
    """Compute the forces and tangents of all elements.

    Parameters
    ----------
    q, v
        x, y and rotation of each node and their rates, shape (instants, nodes, 3).
    tangent
        True to compute the derivatives.
    assumed
        Resultants to use for the geometric stiffness instead of the current ones, see `predicted`.
    """
    p, rate = (_differences(elements, values) for values in (q, v))
    back = np.conj(elements.axis * np.exp(1j * p[..., 2]))
    chord = back * (p[..., 0] + 1j * p[..., 1])
    h, turn = elements.length, p[..., 3]
    strain = np.stack([chord.real - h + h * turn**2 / 24 - elements.free, chord.imag, turn], axis=-1)
    B = np.zeros((*chord.shape, 3, 4))
    B[..., 0, 0], B[..., 0, 1], B[..., 0, 2], B[..., 0, 3] = back.real, -back.imag, chord.imag, h * turn / 12
    B[..., 1, 0], B[..., 1, 1], B[..., 1, 2] = back.imag, back.real, -chord.real
    B[..., 2, 3] = 1.0
    strain_rate = np.einsum("peij,pej->pei", B, rate)
    elastic = np.einsum("eij,pej->pei", elements.stiffness, strain)
    viscous = np.einsum("eij,pej->pei", elements.stiffness * elements.damping[:, None, None], strain_rate)
    held = elastic + viscous
    force = np.einsum("peij,pei,jk->pek", B, held, ENDS)
    stiffness = damping = np.zeros((0, 0, 6, 6))
    if tangent:
        stiffness, damping = _tangents(elements, back, chord, B, held if assumed is None else assumed, rate)
    power, energy = (viscous * strain_rate).sum(-1), (elastic * strain).sum(-1) / 2
    return ElementState(held, np.conj(back), force, stiffness, damping, power, energy, B @ ENDS)


def predicted(elements: Elements, state: ElementState, change: Reals, change_of_rate: Reals) -> Reals:
    """Predict the resultants after a step of Newton's method, shape (instants, elements, 3).

    A step moves nodes along straight lines. If a node should rotate about another one, the step stretches the element
    between them, and the spurious axial force would impair the next tangent. The predicted resultants do not contain
    this force (Magisano, Leonetti and Garcea, Computer Methods in Applied Mechanics and Engineering 313 (2017)
    986-1005).

    Parameters
    ----------
    change, change_of_rate
        Changes of x, y and rotation of all nodes, and changes of their rates, shape (instants, nodes, 3).
    """
    total: Reals = state.resultants.copy()
    for values, beta in ((change, 1.0), (change_of_rate, elements.damping[:, None])):
        ends = values[:, elements.nodes].reshape(len(values), -1, 6)
        strain = (state.slope @ ends[..., None])[..., 0]
        total += beta * np.einsum("eij,pej->pei", elements.stiffness, strain)
    return total


def _differences(elements: Elements, values: Reals) -> Reals:
    """Return the difference of the positions and the mean and relative rotation, shape (instants, elements, 4)."""
    start, end = values[:, elements.nodes[:, 0]], values[:, elements.nodes[:, 1]]
    between, mean = end - start, (end[..., 2] + start[..., 2]) / 2
    return np.stack([between[..., 0], between[..., 1], mean, between[..., 2]], axis=-1)


def _tangents(
    elements: Elements, back: Complexes, chord: Complexes, B: Reals, held: Reals, rate: Reals
) -> tuple[Reals, Reals]:
    """Return the derivatives of the forces with respect to position and velocity."""
    H = np.zeros((*chord.shape, 3, 4, 4))
    H[..., 0, 0, 2] = H[..., 0, 2, 0] = back.imag
    H[..., 0, 1, 2] = H[..., 0, 2, 1] = back.real
    H[..., 0, 2, 2], H[..., 0, 3, 3] = -chord.real, elements.length / 12
    H[..., 1, 0, 2] = H[..., 1, 2, 0] = -back.real
    H[..., 1, 1, 2] = H[..., 1, 2, 1] = back.imag
    H[..., 1, 2, 2] = -chord.imag
    weighted = np.swapaxes(B, -1, -2) @ elements.stiffness
    beta = elements.damping[:, None, None]
    damping = beta * (weighted @ B)
    changed = (H @ rate[..., None, :, None])[..., 0]
    stiffness = weighted @ B + np.einsum("pei,peijk->pejk", held, H) + beta * (weighted @ changed)
    return ENDS.T @ stiffness @ ENDS, ENDS.T @ damping @ ENDS
