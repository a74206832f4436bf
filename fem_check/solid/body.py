"""Link as a body of quadratic quadrilaterals: stiffness, loads and supports."""

from functools import cached_property
from typing import Any

import numpy as np

from fem_check.solid.outline import Powers, SolidOutline, grid
from rigid import Reals
from rigid.arrays import Integers

PIN_RADIUS = 0.5  # radius over which a joint force is spread, in depths of the thinnest beam that ends there
QUADRATURE_DEGREE = 6  # degree of exact integration on a straight element


class SolidLink:
    """Link in plane stress with nine-node elements.

    The thickness t makes E t h equal to the beam's EA; with the outline's depth h, E t h^3/12 is its EI.

    Parameters
    ----------
    outline
        SolidOutline of the link.
    poisson
        Poisson's ratio.
    across
        Number of elements across the depth; must be even.

    Attributes
    ----------
    grid, basis
        Mesh, and scikit-fem's vector basis on it.
    xi
        Position along the beam of all quadrature points, shape (elements, points), clipped to the beam's ends.
    """

    def __init__(self, outline: SolidOutline, poisson: float, across: int) -> None:
        from skfem import Basis, ElementQuad2, ElementVector, MeshQuad

        self.outline, self.poisson, self.grid = outline, poisson, grid(outline, across)
        mesh = MeshQuad(
            np.array((self.grid.points.real, self.grid.points.imag)), np.ascontiguousarray(self.grid.cells.T)
        )
        self.basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=QUADRATURE_DEGREE)
        x, y = np.asarray(self.basis.global_coordinates())
        self.places = x + 1j * y
        starts = np.array([outline.points[strip.start] for strip in outline.strips])[self.grid.strip]
        ways = np.array([outline.way(strip) for strip in outline.strips])[self.grid.strip]
        self.xi = np.clip(((self.places - starts[:, None]) / ways[:, None]).real, 0.0, 1.0)

    def along(self, values: Any) -> Reals:
        """Evaluate a function of strip and xi at all quadrature points, (elements, points)."""
        at_points: Reals = np.empty_like(self.xi)
        for k, strip in enumerate(self.outline.strips):
            own = self.grid.strip == k
            at_points[own] = values(strip, self.xi[own])
        return at_points

    @cached_property
    def stretching(self) -> Reals:
        """E t [N/m] at the quadrature points."""
        return self.along(lambda strip, xi: Powers(xi, strip.EA) / strip.depth(xi))

    @cached_property
    def spread(self) -> Reals:
        """Beam length per area at the quadrature points [1/m]; it converts loads per length to loads per area."""
        area = self.basis.dx.sum(axis=1)
        return np.broadcast_to((self.grid.share / area)[:, None], self.xi.shape)

    def stiffness(self) -> Any:
        """Sparse stiffness matrix of all dofs."""
        from fem_check.solid.forms import plane_stress

        membrane = self.stretching / (1.0 - self.poisson**2)
        return plane_stress.assemble(self.basis, membrane=membrane, poisson=self.poisson)

    def under(self, load: Any) -> Reals:
        """Load vector of a force per area [N/m^2], complex, shape (elements, points)."""
        from fem_check.solid.forms import pushed

        load = np.broadcast_to(load, self.xi.shape)
        return pushed.assemble(self.basis, load=np.array((load.real, load.imag)))

    def strained(self, strip: int) -> Reals:
        """Load vector of a unit isotropic free strain of a beam."""
        from fem_check.solid.forms import swollen

        own = (self.grid.strip == strip)[:, None]
        return swollen.assemble(self.basis, swelling=np.where(own, self.stretching / (1 - self.poisson), 0.0))

    def pin(self, point: int) -> Reals:
        """Load vectors of unit forces along x and y and a unit moment at a joint, (3, dofs).

        They are spread over a disk about the point with the smooth weight `(1 - r^2/R^2)^2`. Multiplied by
        displacements they give the mean displacement and rotation of the disk.
        """
        center = self.outline.points[point]
        arm = self.places - center
        weight = np.maximum(1.0 - np.abs(arm) ** 2 / (PIN_RADIUS * self.outline.depth_at(point)) ** 2, 0.0) ** 2
        weight = weight / (weight * self.basis.dx).sum()
        middle = (weight * arm * self.basis.dx).sum()
        arm = arm - middle
        turning = self.under(1j * arm * weight / (weight * np.abs(arm) ** 2 * self.basis.dx).sum())
        return np.array(
            (self.under(weight) + middle.imag * turning, self.under(1j * weight) - middle.real * turning, turning)
        )

    @cached_property
    def rigid(self) -> Reals:
        """Displacements of all dofs by rigid motions along x and y and about the origin, (3, dofs)."""
        rows = np.zeros((3, self.basis.N))
        x, y = self.basis.split_indices()
        rows[0, x], rows[1, y] = 1.0, 1.0
        rows[2, x], rows[2, y] = -self.basis.doflocs[1, x], self.basis.doflocs[0, y]
        return rows

    def held(self) -> Integers:
        """Supports against rigid motions: two dofs of a node, one of a distant node."""
        first, last = self.grid.axis[0][0], self.grid.axis[0][-1]
        way = self.outline.way(self.outline.strips[0])
        dofs = self.basis.nodal_dofs
        return np.array((*dofs[:, first], dofs[1 if abs(way.real) >= abs(way.imag) else 0, last]))

    def displaced(self, loads: Reals) -> Reals:
        """Displacements of all dofs under balanced loads, shapes (loads, dofs).

        Equals scikit-fem's `solve(*condense(...))`, with one factorisation for all loads.
        """
        from scipy.sparse.linalg import splu
        from skfem import condense

        held = self.held()
        inner = self.basis.complement_dofs(held)
        matrix = condense(self.stiffness(), D=held, expand=False)
        displacements = np.zeros_like(loads)
        displacements[:, inner] = (
            splu(matrix.tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            .solve(np.ascontiguousarray(loads[:, inner].T))
            .T
        )
        return displacements
