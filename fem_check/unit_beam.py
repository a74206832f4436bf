"""A cantilever of length 1 and rigidities 1, in scikit-fem: what every beam of every link is a multiple of.

Elements have length 1 while they are assembled and lie at the origin. scikit-fem builds its Hermite element from powers
of the coordinate, which loses digits far from the origin; there, its stiffnesses are small integers (along the beam,
thirds of them), so that what quadrature adds to them can be taken off and residuals can be had without round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigid import Reals

STATIONS = np.linspace(0.0, 1.0, 4)
"""Where along a beam its distributed load is given; the unit loads are the cubics through these."""

REFINEMENTS = 3
EXACT_BITS = 44  # of a nodal value: 53 less those of a stiffness and of the sum of a row


@dataclass(frozen=True, eq=False)
class UnitBeam:
    """Response of a beam clamped at its start to unit loads, at its nodes.

    Attributes
    ----------
    xi
        Nodes, shape (nodes,).
    w, phi, V, M
        Under a transverse load that is 1 at one of `STATIONS` and 0 at the others, then under a force and a moment at
        the end, shape (stations + 2, nodes).
    u, N
        Under a longitudinal load likewise, then under a force at the end, shape (stations + 1, nodes).
    """

    xi: Reals
    w: Reals
    phi: Reals
    V: Reals
    M: Reals
    u: Reals
    N: Reals


@dataclass(frozen=True, eq=False)
class _Element:
    """An element of length 1 at the origin.

    `stiffness` is an integer multiple, `whole` times its own; `nodal` counts the dofs of a node; `shape` holds the
    shape functions (dofs, points) at the quadrature's `points`, with its `weights`.
    """

    stiffness: Reals
    whole: float
    nodal: int
    shape: Reals
    points: Reals
    weights: Reals


@lru_cache(maxsize=8)
def unit_beam(elements: int) -> UnitBeam:
    """Cantilever of some equal elements: Hermite across, quadratic Lagrange along.

    Raises
    ------
    ValueError
        Fewer than one element.

    Examples
    --------
    A force at the end bends it by 1/3.

    >>> float(unit_beam(4).w[-2, -1].round(12))
    0.333333333333
    """
    if elements < 1:
        raise ValueError(f"{elements} elements: a beam takes one or more")
    from skfem import ElementLineHermite, ElementLineP2
    from skfem.helpers import dd, ddot, dot, grad

    n = float(elements)
    bending = _element(ElementLineHermite(), lambda u, v, _: ddot(dd(u), dd(v)), 1.0)
    loads, dofs = _consistent_loads(bending, ElementLineHermite(), elements)
    (w, phi), (V, minus_M, minus_V, M) = _clamped(bending, loads / n**4, np.diag((n**-3, n**-2)), dofs)
    stretching = _element(ElementLineP2(), lambda u, v, _: dot(grad(u), grad(v)), 3.0)
    along, line = _consistent_loads(stretching, ElementLineP2(), elements)
    (u,), (minus_N, N, _) = _clamped(stretching, along / n**2, np.diag((1 / n,)), line)
    return UnitBeam(
        np.arange(n + 1) / n,
        w,
        phi * n,
        _at_nodes(V, -minus_V) * n**3,
        _at_nodes(-minus_M, M) * n**2,
        u,
        _at_nodes(-minus_N, N) * n,
    )


def _element(element: Any, energy: Any, whole: float) -> _Element:
    """The element's integer stiffness and shape functions at quadrature points exact for the unit loads."""
    from skfem import Basis, BilinearForm, MeshLine

    basis = Basis(MeshLine(np.array([[0.0, 1.0]])), element, intorder=7)
    shape = np.array([np.asarray(function[0])[0] for function in basis.basis])
    stiffness = np.round(whole * BilinearForm(energy).elemental(basis).tolocal()[0])
    return _Element(
        stiffness, whole, element.nodal_dofs, shape, np.asarray(basis.global_coordinates())[0, 0], basis.dx[0]
    )


def _consistent_loads(one: _Element, element: Any, elements: int) -> tuple[Reals, Any]:
    """Work of the unit loads on the shape functions, shape (stations, elements, dofs), and scikit-fem's dof numbers."""
    from skfem import MeshLine
    from skfem.assembly import Dofs

    xi = (np.arange(elements)[:, None] + one.points) / elements
    lagrange = np.ones((len(STATIONS), *xi.shape))
    for k, station in enumerate(STATIONS):
        for other in np.delete(STATIONS, k):
            lagrange[k] *= (xi - other) / (station - other)
    mesh = MeshLine(np.arange(elements + 1.0)[None])
    return np.einsum("qeg,dg,g->qed", lagrange, one.shape, one.weights), Dofs(mesh, element).element_dofs.T


def _clamped(one: _Element, loads: Reals, tip: Reals, dofs: Any) -> tuple[Reals, Reals]:
    """Values at the nodes and forces on the elements, clamped at the first node, loaded along and at the last.

    Solved to round-off of the result: what is left after a solution is computed exactly, solved for again, and the
    correction kept apart, because forces are small differences of large displacements.

    Returns
    -------
    Nodal values, shape (dofs of a node, loads, nodes), and forces on the dofs of the elements, shape
    (dofs of an element, loads, elements).
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import splu

    rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
    columns = np.tile(dofs, dofs.shape[1]).ravel()
    matrix = csr_matrix((np.tile(one.stiffness.ravel(), len(dofs)), (rows, columns)))
    inner = slice(one.nodal, None)  # the dofs of the first node come first
    factor = splu(matrix[inner, inner].tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    loads = np.concatenate((loads, np.zeros((one.nodal, *loads.shape[1:]))))
    left = np.zeros((matrix.shape[0], len(loads)))
    np.add.at(left, dofs, one.whole * np.moveaxis(loads, 0, -1))
    left[dofs[-1, one.nodal : 2 * one.nodal], -one.nodal :] += one.whole * tip
    force = -np.moveaxis(loads, -1, 0)
    total = np.zeros_like(left)
    for _ in range(REFINEMENTS):
        part = np.zeros_like(left)
        part[inner] = factor.solve(left[inner])
        total += part
        for piece in _halves(part):
            left -= np.asarray(matrix @ piece)
            force = force + np.einsum("ij,ejq->iqe", one.stiffness, piece[dofs]) / one.whole
    nodes = len(dofs) + 1
    return total[: nodes * one.nodal].reshape(nodes, one.nodal, -1).transpose(1, 2, 0), force


def _halves(values: Reals) -> tuple[Reals, Reals]:
    """Two parts of the values, column by column, whose products with the stiffnesses add up without round-off."""
    _, exponent = np.frexp(np.abs(values).max(axis=0))
    coarse = np.ldexp(np.rint(np.ldexp(values, EXACT_BITS - exponent)), exponent - EXACT_BITS)
    return coarse, values - coarse


def _at_nodes(starts: Reals, ends: Reals) -> Reals:
    """A section force at the nodes: at the start of every element, and at the end of the last."""
    return np.concatenate((starts, ends[:, -1:]), axis=1)
