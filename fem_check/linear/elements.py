"""Lines of equal finite elements, clamped at their first node: what every beam is made of.

An element has length 1 while its matrix is made, and lies at the origin: scikit-fem builds its Hermite element from
powers of the coordinate, which loses digits far from there. A stiffness is kept as what opposes two deformations, those
that are left of the element's freedoms when it cannot move as a whole; so a rigid motion costs no energy whatever the
quadrature, and where the rigidity does not change along the line the stiffnesses are small integers (along the beam,
thirds of them), whose products with displacements can be had without round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rigid import Reals

PRISMATIC = (1.0,)
REFINEMENTS = 3
EXACT_BITS = 44  # of a nodal value: 53 less those of a stiffness and of the sum of a row
QUADRATURE = 13  # degree that is integrated exactly: rigidities may be of the eleventh, loads of the tenth


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of element, of length 1.

    Attributes
    ----------
    element
        scikit-fem's.
    nodal
        How many dofs a node has; those of both end nodes come first.
    order
        The stiffness goes with the length to the power -order.
    turns
        Per dof, 1 where it is a slope times the length, 0 where it is a displacement.
    opens
        Deformations per dof, shape (2, dofs), and `opened`, the dofs that they are when all others are zero.
    whole
        Multiple of the prismatic stiffness that is integer.
    shape, strain, points, weights
        Shape functions and what resists, curvature or strain, at the points of the quadrature, shape (dofs, points).
    """

    element: Any
    nodal: int
    order: int
    turns: Reals
    opens: Reals
    opened: list[int]
    whole: float
    shape: Reals
    strain: Reals
    points: Reals
    weights: Reals

    def stiffness(self, rigidity: Any, length: Any = 1.0) -> Any:
        """Of elements of some length and rigidity at their points, (...) and (..., points): (..., dofs, dofs)."""
        matrix = np.einsum("...g,ig,jg->...ij", rigidity * self.weights, self.strain, self.strain)
        scale = np.power.outer(np.asarray(length, float), self.turns)
        unit = np.power(np.asarray(length, float), -self.order)[..., None, None]
        return matrix * unit * scale[..., :, None] * scale[..., None, :]

    def rigid(self, way: Any) -> Any:
        """Motion of a node per motion of another that lies `way` before it, no deformation between: (..., m, m)."""
        matrix = np.zeros((*np.shape(way), self.nodal, self.nodal))
        matrix[...] = np.eye(self.nodal)
        for slope in np.flatnonzero(self.turns[: self.nodal]):
            matrix[..., 0, slope] = way
        return matrix

    def sampled(self, stations: Any, derivative: bool = False) -> Any:
        """Shape functions, or their slopes, at stations from 0 to 1, shape (dofs, stations)."""
        basis = _basis(self.element, (np.atleast_2d(stations), np.ones(np.size(stations))))
        return np.array([_values(function[0].grad if derivative else function[0]) for function in basis.basis])


def _basis(element: Any, quadrature: Any = None) -> Any:
    from skfem import Basis, MeshLine

    given = {"intorder": QUADRATURE} if quadrature is None else {"quadrature": quadrature}
    return Basis(MeshLine(np.array([[0.0, 1.0]])), element, **given)


def _values(field: Any) -> Any:
    return np.asarray(field).reshape(-1)


@lru_cache(maxsize=1)
def hermite() -> Kind:
    """Cubic elements of beams that bend: dofs w, slope, w, slope."""
    from skfem import ElementLineHermite

    opens = np.array([[1.0, 1.0, -1.0, 0.0], [1.0, 0.0, -1.0, 1.0]])
    return _kind(ElementLineHermite(), 2, 3, (0, 1, 0, 1), opens, [1, 3], 1.0)


@lru_cache(maxsize=1)
def quadratic() -> Kind:
    """Quadratic Lagrange elements of what is stretched or sheared: dofs start, end, middle."""
    from skfem import ElementLineP2

    opens = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    return _kind(ElementLineP2(), 1, 1, (0, 0, 0), opens, [1, 2], 3.0)


def _kind(
    element: Any, nodal: int, order: int, turns: tuple[int, ...], opens: Reals, opened: list[int], whole: float
) -> Kind:
    basis = _basis(element)
    shape = np.array([_values(function[0]) for function in basis.basis])
    strain = np.array([_values(function[0].hess if order == 3 else function[0].grad) for function in basis.basis])
    points, weights = np.asarray(basis.global_coordinates()).reshape(-1), basis.dx[0]
    return Kind(element, nodal, order, np.array(turns), opens, opened, whole, shape, strain, points, weights)


class Line:
    """Equal elements of length 1 in a row, clamped at the first node.

    Parameters
    ----------
    kind, elements
        Of what, and how many.
    rigidity
        Polynomial in xi, from 0 at the first node to 1 at the last.
    """

    def __init__(self, kind: Kind, elements: int, rigidity: tuple[float, ...] = PRISMATIC) -> None:
        from skfem import MeshLine
        from skfem.assembly import Dofs

        self.kind, self.elements, self.rigidity = kind, elements, rigidity
        self.dofs = Dofs(MeshLine(np.arange(elements + 1.0)[None]), kind.element).element_dofs.T
        self.size = int(self.dofs.max()) + 1
        self.xi = (np.arange(elements)[:, None] + kind.points) / elements
        matrix = kind.whole * kind.stiffness(np.polynomial.polynomial.polyval(self.xi, rigidity))
        resists = matrix[:, kind.opened][:, :, kind.opened]
        self.resists = np.round(resists) if rigidity == PRISMATIC else resists

    @cached_property
    def _factor(self) -> Any:
        from scipy.sparse import csr_matrix
        from scipy.sparse.linalg import splu

        opens, dofs, inner = self.kind.opens, self.dofs, slice(self.kind.nodal, None)
        rows, columns = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, dofs.shape[1]).ravel()
        matrix = csr_matrix(((opens.T @ self.resists @ opens).ravel(), (rows, columns)))
        return splu(matrix[inner, inner].tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def spread(self, functions: Any) -> Any:
        """Work of distributed loads, given at `xi`, shape (loads, elements, points), on the shape functions."""
        return np.einsum("qeg,dg,g->qed", functions, self.kind.shape, self.kind.weights)

    def respond(self, spread: Any, nodal: Any) -> tuple[Reals, Reals]:
        """Values at the nodes and forces on the elements under loads along them and at the dofs.

        Solved to round-off of the result: what is left after a solution is computed exactly, or as nearly as tapered
        stiffnesses allow, solved for again, and the correction kept apart, because forces are small differences of
        large displacements.

        Parameters
        ----------
        spread
            On the dofs of the elements, shape (loads, elements, dofs of an element).
        nodal
            On the dofs of the line, shape (dofs, more loads).

        Returns
        -------
        Nodal values, shape (dofs of a node, loads, nodes), and forces on the dofs of the elements, shape
        (dofs of an element, loads, elements).
        """
        kind, dofs = self.kind, self.dofs
        loads = np.concatenate((spread, np.zeros((nodal.shape[1], *spread.shape[1:]))))
        left = np.zeros((self.size, len(loads)))
        np.add.at(left, dofs, kind.whole * np.moveaxis(loads, 0, -1))
        left[:, len(spread) :] += kind.whole * nodal
        force = -np.moveaxis(loads, -1, 0)
        total = np.zeros_like(left)
        for _ in range(REFINEMENTS):
            part = np.zeros_like(left)
            part[kind.nodal :] = self._factor.solve(left[kind.nodal :])
            total += part
            for piece in _halves(part):
                opened = np.einsum("ij,ejq->eiq", kind.opens, piece[dofs])
                resisted = np.einsum("ji,eqj->ieq", kind.opens, np.einsum("eij,ejq->eqi", self.resists, opened))
                np.subtract.at(left, dofs, np.moveaxis(resisted, 0, 1))
                force = force + np.moveaxis(resisted, 1, 2) / kind.whole
        nodes = self.elements + 1
        return total[: nodes * kind.nodal].reshape(nodes, kind.nodal, -1).transpose(1, 2, 0), force

    @cached_property
    def influence(self) -> tuple[Reals, Reals]:
        """What a unit at every dof of a node does, as `respond`; one at the clamped node does nothing."""
        ends = self.kind.nodal * (self.elements + 1)
        unit = np.eye(self.size)[:, :ends]
        unit[: self.kind.nodal] = 0.0
        return self.respond(np.zeros((0, *self.dofs.shape)), unit)


def _halves(values: Reals) -> tuple[Reals, Reals]:
    """Two parts of the values, column by column, whose products with the stiffnesses add up without round-off."""
    _, exponent = np.frexp(np.abs(values).max(axis=0))
    coarse = np.ldexp(np.rint(np.ldexp(values, EXACT_BITS - exponent)), exponent - EXACT_BITS)
    return coarse, values - coarse
