"""Planar beam elements for large displacements: strains, forces and tangents.

An element has two nodes, each with a position and a rotation. The axes of the element rotate with the mean rotation of
its nodes. The element has three deformations: the elongation and the transverse displacement of its chord in these
axes, and the relative rotation of its nodes (Reissner, On one-dimensional finite-strain beam theory: the plane problem,
ZAMP 23 (1972) 795-804, with one integration point as in Simo and Vu-Quoc, Computer Methods in Applied Mechanics and
Engineering 58 (1986) 79-116).

The compliance is that of the exact solution for a straight piece under end forces. The elements therefore do not lock,
and linear statics are exact at the nodes (residual bending flexibility, MacNeal, Computers and Structures 8 (1978)
175-183). A piece of length h that is bent by the angle t is longer than its chord by h t^2/24. This difference is added
to the elongation.
"""

import numpy as np
from msgspec import Struct

from elastic import Section, Taper
from rigid import Reals
from rigid.arrays import Complexes, Integers

GAUSS = np.polynomial.legendre.leggauss(8)
ENDS = np.array([[-1, 0, 0, 1, 0, 0], [0, -1, 0, 0, 1, 0], [0, 0, 0.5, 0, 0, 0.5], [0, 0, -1, 0, 0, 1]], float)
"""Multiplied by x, y and rotation of both nodes, gives the x and y distances, the mean and the relative rotation."""

Powers = np.polynomial.polynomial.polyval


class Elements(Struct, frozen=True, eq=False):
    """Beam elements, in arrays of shape (elements, ...).

    Attributes
    ----------
    nodes
        Indices of the start and end nodes, shape (elements, 2).
    axis
        Unit vector of the undeformed element's axis x' in link axes, complex.
    length
        Length h [m].
    unloaded_elongation
        Elongation without load [m].
    stiffness
        Stiffness matrices, shape (elements, 3, 3). The rows are the axial force N, the transverse force Q (negative
        shear force, -V) and the moment M at the midpoint. The columns are the elongation, transverse displacement and
        relative rotation.
    damping
        beta of the Kelvin-Voigt law stress = E (strain + beta d strain/dt) [s].
    """

    nodes: Integers
    axis: Complexes
    length: Reals
    unloaded_elongation: Reals
    stiffness: Reals
    damping: Reals


def element_stiffness(section: Section, length: float, first: float, last: float) -> Reals:
    """Return the stiffness matrix of the piece of a beam between xi = `first` and xi = `last`, shape (3, 3).

    For the rows and columns see `Elements.stiffness`. EA and EI must be finite. The matrix is the inverse of the
    flexibility of a piece in equilibrium, with the moment M - Q x at the distance x from the midpoint.
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


class ElementState(Struct, frozen=True, eq=False):
    """State of all elements at several instants.

    Attributes
    ----------
    resultants
        N, Q and M at the midpoint in element axes, shape (instants, elements, 3).
    axis
        Direction of the element axes in ground axes, complex, shape (instants, elements).
    force
        Internal forces and moments that correspond to x, y and rotation of both nodes, shape (instants, elements, 6).
    stiffness, damping
        Derivatives of `force` with respect to the coordinates of the nodes and to their rates, shape (instants,
        elements, 6, 6) each. Empty if not requested.
    power
        Dissipated power [W], shape (instants, elements).
    energy
        Strain energy [J], shape (instants, elements).
    slope
        Derivatives of elongation, transverse displacement and relative rotation with respect to the coordinates of the
        nodes, shape (instants, elements, 3, 6).
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
        True to compute `stiffness` and `damping`.
    assumed
        N, Q and M for the geometric stiffness, shape (instants, elements, 3): the result of `predicted`. By default,
        the current N, Q and M.
    """
    p, rate = (_differences(elements, values) for values in (q, v))
    back = np.conj(elements.axis * np.exp(1j * p[..., 2]))
    chord = back * (p[..., 0] + 1j * p[..., 1])
    h, turn = elements.length, p[..., 3]
    elongation = chord.real - h + h * turn**2 / 24 - elements.unloaded_elongation
    strain = np.stack([elongation, chord.imag, turn], axis=-1)
    B = np.zeros((*chord.shape, 3, 4))
    B[..., 0, 0], B[..., 0, 1], B[..., 0, 2], B[..., 0, 3] = back.real, -back.imag, chord.imag, h * turn / 12
    B[..., 1, 0], B[..., 1, 1], B[..., 1, 2] = back.imag, back.real, -chord.real
    B[..., 2, 3] = 1.0
    strain_rate = np.einsum("peij,pej->pei", B, rate)
    elastic = np.einsum("eij,pej->pei", elements.stiffness, strain)
    viscous = np.einsum("eij,pej->pei", elements.stiffness * elements.damping[:, None, None], strain_rate)
    resultants = elastic + viscous
    force = np.einsum("peij,pei,jk->pek", B, resultants, ENDS)
    stiffness = damping = np.zeros((0, 0, 6, 6))
    if tangent:
        stiffness, damping = _tangents(elements, back, chord, B, resultants if assumed is None else assumed, rate)
    power, energy = (viscous * strain_rate).sum(-1), (elastic * strain).sum(-1) / 2
    return ElementState(resultants, np.conj(back), force, stiffness, damping, power, energy, B @ ENDS)


def predicted(elements: Elements, state: ElementState, change: Reals, change_of_rate: Reals) -> Reals:
    """Predict N, Q and M after a step of Newton's method by linearisation, shape (instants, elements, 3).

    A step of Newton's method moves nodes along straight lines. If one node of an element rotates about the other, this
    straight line stretches the element. The spurious axial force would impair the tangent of the next step. N, Q and M
    predicted by linearisation do not contain this force (Magisano, Leonetti and Garcea, Computer Methods in Applied
    Mechanics and Engineering 313 (2017) 986-1005).

    Parameters
    ----------
    change
        Changes of x, y and rotation of all nodes, shape (instants, nodes, 3).
    change_of_rate
        Changes of the rates of x, y and rotation, shape (instants, nodes, 3).
    """
    total: Reals = state.resultants.copy()
    for values, beta in ((change, 1.0), (change_of_rate, elements.damping[:, None])):
        ends = values[:, elements.nodes].reshape(len(values), -1, 6)
        strain = (state.slope @ ends[..., None])[..., 0]
        total += beta * np.einsum("eij,pej->pei", elements.stiffness, strain)
    return total


def _differences(elements: Elements, values: Reals) -> Reals:
    """Return x and y distance, mean rotation and relative rotation of the two nodes, shape (instants, elements, 4)."""
    start, end = values[:, elements.nodes[:, 0]], values[:, elements.nodes[:, 1]]
    between, mean = end - start, (end[..., 2] + start[..., 2]) / 2
    return np.stack([between[..., 0], between[..., 1], mean, between[..., 2]], axis=-1)


def _tangents(
    elements: Elements, back: Complexes, chord: Complexes, B: Reals, resultants: Reals, rate: Reals
) -> tuple[Reals, Reals]:
    """Return the derivatives of the forces with respect to the coordinates of the nodes and to their rates."""
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
    stiffness = weighted @ B + np.einsum("pei,peijk->pejk", resultants, H) + beta * (weighted @ changed)
    return ENDS.T @ stiffness @ ENDS, ENDS.T @ damping @ ENDS
