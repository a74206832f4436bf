"""Shape functions and stiffnesses of the two element types of beams, as arrays for an element of length 1.

The element starts at the origin, because scikit-fem constructs its Hermite element from powers of the coordinate, which
lose digits far from the origin. Sliding blocks divide elements at a different point at each position. With the arrays
here, thousands of such elements are evaluated at once. scikit-fem would need a `Basis` for each position.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Reals

QUADRATURE_DEGREE = 13  # degree of exact integration: rigidities up to degree 11, loads up to degree 10


class ElementKind(Struct, frozen=True, eq=False):
    """Element type, for an element of length 1.

    Attributes
    ----------
    element
        Element class of scikit-fem. The class is stored instead of an element, because Hermite elements keep data of
        their mesh.
    form
        Weak form of the stiffness.
    nodal
        Number of dofs per node. The dofs of both end nodes come first.
    order
        The stiffness for displacements is proportional to length^(-order).
    turns
        1 for each dof that is a slope, 0 for a displacement, shape (dofs,).
    deformations
        The two deformations of the element per unit of each dof, shape (2, dofs).
    deformation_dofs
        Indices of the two dofs that equal the deformations if all other dofs are zero.
    integer_factor
        Factor by which the stiffness matrix of a prismatic element is multiplied to obtain integers.
    shape
        Shape functions at the quadrature points, shape (dofs, points).
    strain
        Curvature (bending) or strain (tension, shear) of the shape functions at these points, shape (dofs, points).
    points, weights
        Quadrature points from 0 to 1, and their weights, each of shape (points,).
    """

    element: type
    form: Any
    nodal: int
    order: int
    turns: Reals
    deformations: Reals
    deformation_dofs: list[int]
    integer_factor: float
    shape: Reals
    strain: Reals
    points: Reals
    weights: Reals

    def __repr__(self) -> str:
        return f"ElementKind({self.element.__name__})"

    def stiffness(self, rigidity: Reals, length: Any = 1.0) -> Reals:
        """Return stiffness matrices for given rigidities and lengths of many elements.

        For an element of length 1, the result equals `form.elemental(basis, rigidity=...)` of scikit-fem.

        Parameters
        ----------
        rigidity
            Rigidity at the quadrature points, shape (..., points).
        length
            Lengths of the elements, shape (...).

        Returns
        -------
        Array of shape (..., dofs, dofs).
        """
        matrix = np.einsum("...g,ig,jg->...ij", rigidity * self.weights, self.strain, self.strain)
        scale = np.power.outer(np.asarray(length, float), self.turns)
        unit = np.power(np.asarray(length, float), -self.order)[..., None, None]
        return matrix * unit * scale[..., :, None] * scale[..., None, :]

    def rigid(self, distance: Any) -> Reals:
        """Return the matrix R for a rigid-body motion: dofs of a node = R @ dofs of another node, shape (..., m, m).

        `distance` is the distance along the beam from the other node to the node.
        """
        matrix = np.zeros((*np.shape(distance), self.nodal, self.nodal))
        matrix[...] = np.eye(self.nodal)
        for slope in np.flatnonzero(self.turns[: self.nodal]):
            matrix[..., 0, slope] = distance
        return matrix

    def sampled(self, stations: Any, derivative: bool = False) -> Reals:
        """Evaluate the shape functions or their slopes at stations from 0 to 1, shape (dofs, stations)."""
        basis = basis_of_one(self.element, (np.atleast_2d(stations), np.ones(np.size(stations))))
        return np.array([_values(function[0].grad if derivative else function[0]) for function in basis.basis])


def basis_of_one(element: type, quadrature: Any = None) -> Any:
    """Return the basis of scikit-fem on the element from 0 to 1."""
    from skfem import Basis, MeshLine

    given = {"intorder": QUADRATURE_DEGREE} if quadrature is None else {"quadrature": quadrature}
    return Basis(MeshLine(np.array([[0.0, 1.0]])), element(), **given)


def _values(field: Any) -> Reals:
    return np.asarray(field).reshape(-1)


@lru_cache(maxsize=1)
def hermite() -> ElementKind:
    """Return the cubic element for bending, with the dofs w, slope, w, slope."""
    from skfem import ElementLineHermite

    from fem_check.linear.forms import bending

    deformations = np.array([[1.0, 1.0, -1.0, 0.0], [1.0, 0.0, -1.0, 1.0]])
    return _kind(ElementLineHermite, bending, 2, 3, (0, 1, 0, 1), deformations, [1, 3], 1.0)


@lru_cache(maxsize=1)
def quadratic() -> ElementKind:
    """Return the quadratic Lagrange element for tension and shear, with dofs at start, end and middle."""
    from skfem import ElementLineP2

    from fem_check.linear.forms import stretching

    deformations = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    return _kind(ElementLineP2, stretching, 1, 1, (0, 0, 0), deformations, [1, 2], 3.0)


def _kind(
    element: type,
    form: Any,
    nodal: int,
    order: int,
    turns: tuple[int, ...],
    deformations: Reals,
    deformation_dofs: list[int],
    integer_factor: float,
) -> ElementKind:
    basis = basis_of_one(element)
    shape = np.array([_values(function[0]) for function in basis.basis])
    strain = np.array([_values(function[0].hess if order == 3 else function[0].grad) for function in basis.basis])
    points, weights = np.asarray(basis.global_coordinates()).reshape(-1), basis.dx[0]
    return ElementKind(
        element,
        form,
        nodal,
        order,
        np.array(turns),
        deformations,
        deformation_dofs,
        integer_factor,
        shape,
        strain,
        points,
        weights,
    )
