"""Model of a beam: a row of equal finite elements, clamped at the first node.

Numbering, integration, assembly and condensation are done by scikit-fem. With the usual assembly, round-off grows with
the fourth power of the number of elements (docs/validity.md). Two measures prevent this:

- Each element is integrated on [0, 1], because scikit-fem loses digits far from the origin. For this, all elements of
the mesh coincide, but the `Basis` numbers their dofs as those of a row of elements.
- An element has two deformations, which are zero in a rigid motion. Residuals are computed from these deformations and
the element stiffnesses for them. For constant rigidity, these stiffnesses are small integers (thirds of integers in
tension), so their products with displacements have no round-off.
"""

from functools import cached_property
from typing import Any

import numpy as np

from fem_check.linear.elements import QUADRATURE_DEGREE, ElementKind
from rigid import Reals

PRISMATIC = (1.0,)
REFINEMENTS = 3  # number of iterative refinements of a solution; with 1000 elements, each adds 4 correct digits
# bits of a nodal value that are multiplied at a time: 53, minus those needed for a stiffness and for the sum of a row
EXACT_BITS = 44


class ElementRow:
    """Row of equal elements of length 1 that is clamped at the first node.

    Parameters
    ----------
    kind
        Element type.
    elements
        Number of elements.
    rigidity
        Coefficients of the rigidity as a polynomial in xi (0 at the first node, 1 at the last node).
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
        """Basis of scikit-fem with all elements on [0, 1], and with the numbering of dofs of a row of elements."""
        from skfem import Basis, MeshLine

        cells = np.arange(2 * self.elements).reshape(-1, 2)
        alike = MeshLine(np.tile([0.0, 1.0], self.elements)[None], np.ascontiguousarray(cells.T))
        return Basis(alike, self.kind.element(), intorder=QUADRATURE_DEGREE, dofs=self._numbering)

    @cached_property
    def _rigidity(self) -> Reals:
        """Rigidity at all quadrature points, shape (elements, points)."""
        return np.asarray(np.polynomial.polynomial.polyval(self.xi, self.rigidity), float)

    @cached_property
    def deformation_stiffness(self) -> Reals:
        """Element stiffness for the two deformations times `kind.integer_factor`, shape (elements, 2, 2).

        The entries are integers if the rigidity is constant.
        """
        local = self.kind.form.elemental(self.basis, rigidity=self._rigidity).tolocal()
        deformation_stiffness: Reals = (
            self.kind.integer_factor * local[:, self.kind.deformation_dofs][:, :, self.kind.deformation_dofs]
        )
        return np.round(deformation_stiffness) if self.rigidity == PRISMATIC else deformation_stiffness

    @cached_property
    def _factor(self) -> Any:
        """Factorisation of the clamped stiffness matrix, used for all loads and refinements."""
        from scipy.sparse.linalg import splu
        from skfem import condense

        matrix = self.kind.integer_factor * self.kind.form.assemble(self.basis, rigidity=self._rigidity)
        inner = condense(matrix, D=np.arange(self.kind.nodal), expand=False)
        return splu(inner.tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def spread(self, functions: Reals, couples: bool = False) -> Reals:
        """Return the virtual work of distributed loads on the shape functions of each element.

        Parameters
        ----------
        functions
            Loads at `xi`, shape (loads, elements, points).
        couples
            True if the loads are moments per unit length, which do work on slopes.

        Returns
        -------
        Array of shape (loads, elements, dofs of an element).
        """
        from fem_check.linear.forms import pushed, twisted

        form = twisted if couples else pushed
        return np.array([form.elemental(self.basis, load=load).tolocal() for load in functions])

    def respond(self, spread: Reals, nodal: Reals) -> tuple[Reals, Reals]:
        """Return nodal values and element forces under distributed and nodal loads.

        Iterative refinement makes the result accurate to round-off. The residual has no round-off for prismatic beams
        and little for tapered ones. The forces of all corrections are summed: forces that are computed from the final
        displacements would lose digits, because they are small differences of large products.

        Parameters
        ----------
        spread
            Loads on the dofs of the elements, shape (loads, elements, dofs of an element).
        nodal
            Loads on the dofs of the row, shape (dofs, more loads).

        Returns
        -------
        Nodal values, shape (dofs of a node, loads, nodes), and forces on the dofs of the elements, shape
        (dofs of an element, loads, elements). The second axis contains the loads of `spread`, then those of `nodal`.
        """
        kind, dofs = self.kind, self.dofs
        loads = np.concatenate((spread, np.zeros((nodal.shape[1], *spread.shape[1:]))))
        left = np.zeros((self.size, len(loads)))
        np.add.at(left, dofs, kind.integer_factor * np.moveaxis(loads, 0, -1))
        left[:, len(spread) :] += kind.integer_factor * nodal
        force = -np.moveaxis(loads, -1, 0)
        total = np.zeros_like(left)
        for _ in range(REFINEMENTS):
            part = np.zeros_like(left)
            part[kind.nodal :] = self._factor.solve(left[kind.nodal :])
            total += part
            for piece in _coarse_and_fine(part):
                opened = np.einsum("ij,ejq->eiq", kind.deformations, piece[dofs])
                resisted = np.einsum(
                    "ji,eqj->ieq", kind.deformations, np.einsum("eij,ejq->eqi", self.deformation_stiffness, opened)
                )
                np.subtract.at(left, dofs, np.moveaxis(resisted, 0, 1))
                force = force + np.moveaxis(resisted, 1, 2) / kind.integer_factor
        nodes = self.elements + 1
        return total[: nodes * kind.nodal].reshape(nodes, kind.nodal, -1).transpose(1, 2, 0), force

    @cached_property
    def influence(self) -> tuple[Reals, Reals]:
        """Responses to a unit load on each nodal dof, see `respond`. They are zero for loads on the clamped dofs."""
        ends = self.kind.nodal * (self.elements + 1)
        unit = np.eye(self.size)[:, :ends]
        unit[: self.kind.nodal] = 0.0
        return self.respond(np.zeros((0, *self.dofs.shape)), unit)


def _coarse_and_fine(values: Reals) -> tuple[Reals, Reals]:
    """Split the values into two parts that add up to them.

    Each part has so few bits that its products with integer stiffnesses are summed without round-off.
    """
    _, exponent = np.frexp(np.abs(values).max(axis=0))
    coarse = np.ldexp(np.rint(np.ldexp(values, EXACT_BITS - exponent)), exponent - EXACT_BITS)
    return coarse, values - coarse
