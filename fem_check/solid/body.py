"""Finite element model of a link as a plane body of quadratic quadrilaterals: stiffness, loads and supports."""

from functools import cached_property
from typing import Any

import numpy as np

from fem_check.solid.outline import Powers, SolidOutline, grid
from rigid import Reals
from rigid.arrays import Integers

PIN_RADIUS = 0.5  # radius of the disk on which a joint force acts, relative to the smallest depth of the beams there
QUADRATURE_DEGREE = 6  # degree of exact integration on a straight element


class SolidLink:
    """Link in plane stress, meshed with nine-node elements.

    Let E be Young's modulus, t the thickness and h the depth of the outline. E t is chosen such that E t h equals EA of
    the beam. E t h^3/12 then equals EI.

    Parameters
    ----------
    outline
        Outline of the link.
    poisson
        Poisson's ratio.
    across
        Number of elements across the depth; must be even.

    Attributes
    ----------
    grid
        Mesh.
    basis
        Vector basis of scikit-fem on the mesh.
    places
        Positions of the quadrature points (complex) [m], shape (elements, points).
    xi
        x'/l of the quadrature points along their beam, shape (elements, points). Values beyond the ends of the beam are
        replaced by 0 or 1.
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
        """Evaluate `values(strip, xi)` at all quadrature points, shape (elements, points)."""
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
        """Part of the beam length that belongs to an element, divided by the element's area [1/m], (elements, points).

        A load per length times this factor is a load per area.
        """
        area = self.basis.dx.sum(axis=1)
        return np.broadcast_to((self.grid.share / area)[:, None], self.xi.shape)

    def stiffness(self) -> Any:
        """Assemble the sparse stiffness matrix of all dofs."""
        from fem_check.solid.forms import plane_stress

        membrane = self.stretching / (1.0 - self.poisson**2)
        return plane_stress.assemble(self.basis, membrane=membrane, poisson=self.poisson)

    def load_vector(self, load: Any) -> Reals:
        """Return the load vector of a force per area (complex) [N/m^2], given as an array (elements, points)."""
        from fem_check.solid.forms import pushed

        load = np.broadcast_to(load, self.xi.shape)
        return pushed.assemble(self.basis, load=np.array((load.real, load.imag)))

    def free_strain_load(self, strip: int) -> Reals:
        """Return the load vector of a free strain of 1 in all directions in a beam."""
        from fem_check.solid.forms import free_strain

        own = (self.grid.strip == strip)[:, None]
        return free_strain.assemble(self.basis, stress=np.where(own, self.stretching / (1 - self.poisson), 0.0))

    def pin(self, point: int) -> Reals:
        """Return the load vectors of a unit force along x, a unit force along y and a unit moment at a joint.

        The shape is (3, dofs). The loads are distributed over a disk of radius R about the joint, with the weight
        `(1 - r^2/R^2)^2` at the distance r. The scalar products of these vectors with the displacements of all dofs are
        the mean displacement along x, the mean displacement along y, and the mean rotation of the disk.
        """
        center = self.outline.points[point]
        arm = self.places - center
        weight = np.maximum(1.0 - np.abs(arm) ** 2 / (PIN_RADIUS * self.outline.depth_at(point)) ** 2, 0.0) ** 2
        weight = weight / (weight * self.basis.dx).sum()
        middle = (weight * arm * self.basis.dx).sum()
        arm = arm - middle
        turning = self.load_vector(1j * arm * weight / (weight * np.abs(arm) ** 2 * self.basis.dx).sum())
        return np.array(
            (
                self.load_vector(weight) + middle.imag * turning,
                self.load_vector(1j * weight) - middle.real * turning,
                turning,
            )
        )

    @cached_property
    def rigid_motions(self) -> Reals:
        """Displacements of all dofs in unit rigid motions, shape (3, dofs): along x, along y, about the origin."""
        rows = np.zeros((3, self.basis.N))
        x, y = self.basis.split_indices()
        rows[0, x], rows[1, y] = 1.0, 1.0
        rows[2, x], rows[2, y] = -self.basis.doflocs[1, x], self.basis.doflocs[0, y]
        return rows

    def fixed_dofs(self) -> Integers:
        """Return the dofs that are fixed to prevent rigid motions: two of one node and one of a distant node."""
        first, last = self.grid.axis[0][0], self.grid.axis[0][-1]
        way = self.outline.way(self.outline.strips[0])
        dofs = self.basis.nodal_dofs
        return np.array((*dofs[:, first], dofs[1 if abs(way.real) >= abs(way.imag) else 0, last]))

    def displaced(self, loads: Reals) -> Reals:
        """Compute the displacements of all dofs under loads in equilibrium, both of shape (loads, dofs).

        The result equals `solve(*condense(...))` of scikit-fem, but all loads share one factorisation.
        """
        from scipy.sparse.linalg import splu
        from skfem import condense

        fixed_dofs = self.fixed_dofs()
        inner = self.basis.complement_dofs(fixed_dofs)
        matrix = condense(self.stiffness(), D=fixed_dofs, expand=False)
        displacements = np.zeros_like(loads)
        displacements[:, inner] = (
            splu(matrix.tocsc(), diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            .solve(np.ascontiguousarray(loads[:, inner].T))
            .T
        )
        return displacements
