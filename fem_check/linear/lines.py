"""Model of a beam: a row of equal finite elements, clamped at the first node.

Numbering, integration, assembly and condensation are done by scikit-fem. In a plain assembly, round-off grows with the
fourth power of the number of elements (docs/validity.md). Two measures prevent this:

- Each element is integrated on [0, 1], where scikit-fem is exact. The `Basis` combines the numbering of the row with a
mesh of coincident elements.
- Residuals are computed from the stiffness against the two deformations of an element, because a rigid motion needs no
energy. For constant rigidity, these stiffnesses are small integers (thirds in tension), so their products with
displacements are exact.
"""

from functools import cached_property
from typing import Any

import numpy as np

from fem_check.linear.elements import QUADRATURE_DEGREE, ElementKind
from rigid import Reals

PRISMATIC = (1.0,)
REFINEMENTS = 3  # rounds of refinement; each adds the accuracy of the factorisation, 4 digits for 1000 elements
EXACT_BITS = 44  # bits used of a nodal value: 53 minus the bits of a stiffness and of a row sum


class ElementRow:
    """Row of equal elements of length 1, clamped at the first node.

    Parameters
    ----------
    kind, elements
        Element type and number of elements.
    rigidity
        Polynomial in xi, which runs from 0 at the first node to 1 at the last.
    """

    def __init__(self, kind: ElementKind, elements: int, rigidity: tuple[float, ...] = PRISMATIC) -> None:
        from skfem import MeshLine
        from skfem.assembly import Dofs

        self.kind, self.elements, self.rigidity = kind, elements, rigidity
        self._numbering = Dofs(MeshLine(np.arange(elements + 1.0)[None]), kind.element())
        self.dofs, self.size = self._numbering.element_dofs.T, self._numbering.N
        self.xi = (np.arange(elements)[:, None] + kind.points) / elements

    @cached_property
    def basis(self) -> Any:
        """Basis of scikit-fem, numbered as a row, with each element on [0, 1]."""
        from skfem import Basis, MeshLine

        cells = np.arange(2 * self.elements).reshape(-1, 2)
        alike = MeshLine(np.tile([0.0, 1.0], self.elements)[None], np.ascontiguousarray(cells.T))
        return Basis(alike, self.kind.element(), intorder=QUADRATURE_DEGREE, dofs=self._numbering)

    @cached_property
    def _rigid_at(self) -> Reals:
        """Rigidity at all quadrature points, shape (elements, points)."""
        return np.asarray(np.polynomial.polynomial.polyval(self.xi, self.rigidity), float)

    @cached_property
    def resists(self) -> Reals:
        """Element stiffness against the two deformations, shape (elements, 2, 2); integer for constant rigidity."""
        local = self.kind.form.elemental(self.basis, rigidity=self._rigid_at).tolocal()
        resists: Reals = self.kind.whole * local[:, self.kind.opened][:, :, self.kind.opened]
        return np.round(resists) if self.rigidity == PRISMATIC else resists

    @cached_property
    def _factor(self) -> Any:
        """Factorisation of the clamped stiffness matrix, used for all loads and refinements."""
        from scipy.sparse.linalg import splu
        from skfem import condense

        matrix = self.kind.whole * self.kind.form.assemble(self.basis, rigidity=self._rigid_at)
        inner = condense(matrix, D=np.arange(self.kind.nodal), expand=False)
        return splu(inner.tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def spread(self, functions: Reals, couples: bool = False) -> Reals:
        """Return the virtual work of distributed loads on the shape functions of each element.

        Parameters
        ----------
        functions
            Loads at `xi`, shape (loads, elements, points).
        couples
            True if the loads are moments per length, which do work on slopes.

        Returns
        -------
        Array of shape (loads, elements, dofs of an element).
        """
        from fem_check.linear.forms import pushed, twisted

        form = twisted if couples else pushed
        return np.array([form.elemental(self.basis, load=load).tolocal() for load in functions])

    def respond(self, spread: Reals, nodal: Reals) -> tuple[Reals, Reals]:
        """Return nodal values and element forces under distributed and nodal loads.

        Iterative refinement makes the result accurate to round-off. The residual is exact for prismatic beams and
        almost exact for tapered ones. The forces are summed over the corrections, because they are small differences
        of large displacements.

        Parameters
        ----------
        spread
            Loads on the dofs of the elements, shape (loads, elements, dofs of an element).
        nodal
            Loads on the dofs of the row, shape (dofs, more loads).

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
        """Responses to unit loads on each nodal dof, see `respond`; zero for the clamped dofs."""
        ends = self.kind.nodal * (self.elements + 1)
        unit = np.eye(self.size)[:, :ends]
        unit[: self.kind.nodal] = 0.0
        return self.respond(np.zeros((0, *self.dofs.shape)), unit)


def _halves(values: Reals) -> tuple[Reals, Reals]:
    """Split the values of each column into two parts with products with stiffnesses that sum without round-off."""
    _, exponent = np.frexp(np.abs(values).max(axis=0))
    coarse = np.ldexp(np.rint(np.ldexp(values, EXACT_BITS - exponent)), exponent - EXACT_BITS)
    return coarse, values - coarse
