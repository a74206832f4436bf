"""Lines of equal finite elements, clamped at their first node: the model of every beam.

scikit-fem numbers, integrates, assembles and condenses. Two things are done here, both for round-off, which in a plain
assembly grows with the fourth power of the elements (docs/validity.md). Every element is integrated where
scikit-fem is exact, from 0 to 1: the `Basis` takes the numbering of the row, and a mesh whose elements lie one upon
the other. And what a solution leaves is computed from stiffnesses that oppose two deformations, those that are left of
the element's freedoms when it cannot move as a whole: a rigid motion costs no energy, and where the rigidity does not
change along the line they are small integers (along the beam, thirds of them), whose products with displacements can be
had without round-off.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from fem_check.linear.elements import QUADRATURE, ElementKind
from rigid import Reals

PRISMATIC = (1.0,)
REFINEMENTS = 3  # rounds: each gains the digits that the factorisation leaves, four at a thousand elements
EXACT_BITS = 44  # of a nodal value: 53 less those of a stiffness and of the sum of a row


class Line:
    """Equal elements of length 1 in a row, clamped at the first node.

    Parameters
    ----------
    kind, elements
        Of what, and how many.
    rigidity
        Polynomial in xi, from 0 at the first node to 1 at the last.
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
        """scikit-fem's basis: numbered as a row, every element from 0 to 1."""
        from skfem import Basis, MeshLine

        cells = np.arange(2 * self.elements).reshape(-1, 2)
        alike = MeshLine(np.tile([0.0, 1.0], self.elements)[None], np.ascontiguousarray(cells.T))
        return Basis(alike, self.kind.element(), intorder=QUADRATURE, dofs=self._numbering)

    @cached_property
    def _rigid_at(self) -> Reals:
        """Rigidity at all points of quadrature, shape (elements, points)."""
        return np.asarray(np.polynomial.polynomial.polyval(self.xi, self.rigidity), float)

    @cached_property
    def resists(self) -> Reals:
        """Stiffness of every element against its two deformations, (elements, 2, 2); integers of a prismatic line."""
        local = self.kind.form.elemental(self.basis, rigidity=self._rigid_at).tolocal()
        resists: Reals = self.kind.whole * local[:, self.kind.opened][:, :, self.kind.opened]
        return np.round(resists) if self.rigidity == PRISMATIC else resists

    @cached_property
    def _factor(self) -> Any:
        """Factors of the matrix, clamped: kept, unlike those of scikit-fem's `solve`, for all loads and refinements."""
        from scipy.sparse.linalg import splu
        from skfem import condense

        matrix = self.kind.whole * self.kind.form.assemble(self.basis, rigidity=self._rigid_at)
        inner = condense(matrix, D=np.arange(self.kind.nodal), expand=False)
        return splu(inner.tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def spread(self, functions: Reals, couples: bool = False) -> Reals:
        """Work of distributed loads on the shape functions of every element.

        Parameters
        ----------
        functions
            The loads at `xi`, shape (loads, elements, points).
        couples
            Whether they are moments per length, which work on slopes.

        Returns
        -------
        Shape (loads, elements, dofs of an element).
        """
        from fem_check.linear.forms import pushed, twisted

        form = twisted if couples else pushed
        return np.array([form.elemental(self.basis, load=load).tolocal() for load in functions])

    def respond(self, spread: Reals, nodal: Reals) -> tuple[Reals, Reals]:
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
        """Response to a unit at every dof of a node, as by `respond`; zero at the clamped node."""
        ends = self.kind.nodal * (self.elements + 1)
        unit = np.eye(self.size)[:, :ends]
        unit[: self.kind.nodal] = 0.0
        return self.respond(np.zeros((0, *self.dofs.shape)), unit)


def _halves(values: Reals) -> tuple[Reals, Reals]:
    """Two parts of the values, column by column, with products with the stiffnesses that add up without round-off."""
    _, exponent = np.frexp(np.abs(values).max(axis=0))
    coarse = np.ldexp(np.rint(np.ldexp(values, EXACT_BITS - exponent)), exponent - EXACT_BITS)
    return coarse, values - coarse
