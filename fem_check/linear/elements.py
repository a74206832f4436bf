"""Tables of the two element types of beams, for an element of length 1.

The element starts at the origin: scikit-fem builds its Hermite element from powers of the coordinate, which lose
digits far from it. Slider blocks and moving nodes need different elements at each position. The tables evaluate
thousands at once; scikit-fem would need a `Basis` per position.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigid import Reals

QUADRATURE_DEGREE = 13  # degree of exact integration: rigidities up to degree 11, loads up to degree 10


@dataclass(frozen=True, eq=False, repr=False)
class ElementKind:
    """Element type, of length 1.

    Attributes
    ----------
    element, form
        scikit-fem's element class (its Hermite elements store mesh data), and the weak form of the stiffness.
    nodal
        Number of dofs per node; the dofs of both end nodes come first.
    order
        The stiffness scales with length to the power -order.
    turns
        Per dof: 1 for a slope times the length, 0 for a displacement.
    opens
        Deformations per dof, shape (2, dofs); `opened` are the dofs equal to them if all others are zero.
    whole
        Factor that makes the prismatic stiffness integer.
    shape, strain, points, weights
        Shape functions, and curvature or strain, at the quadrature points, shape (dofs, points).
    """

    element: type
    form: Any
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

    def __repr__(self) -> str:
        return f"ElementKind({self.element.__name__})"

    def stiffness(self, rigidity: Reals, length: Any = 1.0) -> Reals:
        """Stiffness matrices for given lengths and rigidities.

        Equals scikit-fem's `form.elemental(basis, rigidity=...)`, vectorised over elements.

        Parameters
        ----------
        rigidity
            Shape (..., points).
        length
            Shape (...).

        Returns
        -------
        Shape (..., dofs, dofs).
        """
        matrix = np.einsum("...g,ig,jg->...ij", rigidity * self.weights, self.strain, self.strain)
        scale = np.power.outer(np.asarray(length, float), self.turns)
        unit = np.power(np.asarray(length, float), -self.order)[..., None, None]
        return matrix * unit * scale[..., :, None] * scale[..., None, :]

    def rigid(self, distance: Any) -> Reals:
        """Rigid-body motion of a node per motion of another, `distance` before it, (..., m, m)."""
        matrix = np.zeros((*np.shape(distance), self.nodal, self.nodal))
        matrix[...] = np.eye(self.nodal)
        for slope in np.flatnonzero(self.turns[: self.nodal]):
            matrix[..., 0, slope] = distance
        return matrix

    def sampled(self, stations: Any, derivative: bool = False) -> Reals:
        """Shape functions, or their slopes, at stations from 0 to 1, shape (dofs, stations)."""
        basis = basis_of_one(self.element, (np.atleast_2d(stations), np.ones(np.size(stations))))
        return np.array([_values(function[0].grad if derivative else function[0]) for function in basis.basis])


def basis_of_one(element: type, quadrature: Any = None) -> Any:
    """scikit-fem's basis on the element from 0 to 1."""
    from skfem import Basis, MeshLine

    given = {"intorder": QUADRATURE_DEGREE} if quadrature is None else {"quadrature": quadrature}
    return Basis(MeshLine(np.array([[0.0, 1.0]])), element(), **given)


def _values(field: Any) -> Reals:
    return np.asarray(field).reshape(-1)


@lru_cache(maxsize=1)
def hermite() -> ElementKind:
    """Cubic elements for bending: dofs w, slope, w, slope."""
    from skfem import ElementLineHermite

    from fem_check.linear.forms import bending

    opens = np.array([[1.0, 1.0, -1.0, 0.0], [1.0, 0.0, -1.0, 1.0]])
    return _kind(ElementLineHermite, bending, 2, 3, (0, 1, 0, 1), opens, [1, 3], 1.0)


@lru_cache(maxsize=1)
def quadratic() -> ElementKind:
    """Quadratic Lagrange elements for tension and shear: dofs start, end, middle."""
    from skfem import ElementLineP2

    from fem_check.linear.forms import stretching

    opens = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    return _kind(ElementLineP2, stretching, 1, 1, (0, 0, 0), opens, [1, 2], 3.0)


def _kind(
    element: type,
    form: Any,
    nodal: int,
    order: int,
    turns: tuple[int, ...],
    opens: Reals,
    opened: list[int],
    whole: float,
) -> ElementKind:
    basis = basis_of_one(element)
    shape = np.array([_values(function[0]) for function in basis.basis])
    strain = np.array([_values(function[0].hess if order == 3 else function[0].grad) for function in basis.basis])
    points, weights = np.asarray(basis.global_coordinates()).reshape(-1), basis.dx[0]
    return ElementKind(
        element, form, nodal, order, np.array(turns), opens, opened, whole, shape, strain, points, weights
    )
