"""Sliding blocks on beams: the element under the block is subdivided at each position.

Assembly and condensation are vectorised over the positions here, because scikit-fem would need a mesh and a matrix for
each position. The tests compare with an element that is subdivided in a mesh of scikit-fem.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_check.linear.lines import ElementRow
from fem_check.linear.unit_beam import UnitBeam
from rigid.arrays import Reals

MIN_NODE_DISTANCE = 1e-14  # smallest distance of a block from a node, relative to the length of the element


class Divided:
    """Element under a block, split in two at the block, with condensed inner dofs.

    In shapes, (...) stands for the columns and m for the number of dofs of a node. Values are for elements of length 1.

    Attributes
    ----------
    number
        Index of the element, shape (...).
    place
        Position of the block in the element, from 0 to 1.
    carry
        Displacement of the block per unit displacement of the ends of the element, shape (..., m, 2 m).
    """

    def __init__(self, line: ElementRow, xi: Any) -> None:
        self.line, m, columns = line, line.kind.nodal, np.shape(xi)
        xi = np.where(np.isfinite(xi), xi, 0.5)
        self.number = np.clip(np.floor(xi * line.elements), 0, line.elements - 1).astype(int)
        self.place = np.clip(xi * line.elements - self.number, MIN_NODE_DISTANCE, 1.0 - MIN_NODE_DISTANCE)
        between = [3 * m + k for k in range(len(line.kind.shape) - 2 * m)]
        start, end, here = (list(range(k * m, k * m + m)) for k in (0, 1, 2))
        size = 3 * m + 2 * len(between)
        self.parts = [
            (0.0 * self.place, self.place, start + here + between),
            (self.place, 1.0 - self.place, here + end + [k + len(between) for k in between]),
        ]
        matrix: Reals = np.zeros((*columns, size, size))
        for low, length, dofs in self.parts:
            rigidity: Any = np.polynomial.polynomial.polyval(self._along(low, length), line.rigidity)
            rows, others = np.ix_(dofs, dofs)
            matrix[..., rows, others] += line.kind.stiffness(rigidity, length)
        inner, ends = slice(2 * m, None), slice(0, 2 * m)
        scale = 1.0 / np.sqrt(np.diagonal(matrix[..., inner, inner], axis1=-2, axis2=-1))
        scaled = matrix[..., inner, inner] * scale[..., :, None] * scale[..., None, :]
        soft = np.linalg.inv(scaled) * scale[..., :, None] * scale[..., None, :]
        self.soft = soft[..., :m, :]
        self.carry = self._carried(-self.soft @ matrix[..., inner, ends])

    def _carried(self, carry: Any) -> Reals:
        """Compute the share of the nearer end from rigid motion, to limit round-off."""
        m, rigid = self.line.kind.nodal, self.line.kind.rigid
        by_start, by_end = carry[..., :m], carry[..., m:]
        from_start = np.concatenate((rigid(self.place) - by_end @ rigid(1.0), by_end), axis=-1)
        from_end = np.concatenate((by_start, rigid(self.place - 1.0) - by_start @ rigid(-1.0)), axis=-1)
        return np.where(self.place[..., None, None] < 0.5, from_start, from_end)

    def _along(self, low: Reals, length: Reals) -> Reals:
        """Return the quadrature points of a part of the element as xi of the beam, shape (..., points)."""
        inside = low[..., None] + length[..., None] * self.line.kind.points
        return (self.number[..., None] + inside) / self.line.elements

    def of_nodes(self, values: Reals) -> Reals:
        """Return the displacement of the block from nodal values, shape (m, loads, nodes) or (m, loads, ..., nodes)."""
        moving = values.ndim > 3
        m = len(values)
        ends = []
        for node in (self.number, self.number + 1):
            if moving:
                ends += list(np.take_along_axis(values, node[None, None, ..., None], -1)[..., 0])
            else:
                ends += list(values[:, :, node])
        found: Reals = np.einsum("...ij,jq...->iq...", self.carry, np.array(ends))
        return found.reshape(m, *found.shape[1:])

    def of_spread(self, load_at: Any, couples: bool = False) -> Reals:
        """Return the displacement of the block due to loads or couples along the clamped element, (m, loads, ...)."""
        kind, m = self.line.kind, self.line.kind.nodal
        total: Any = 0.0
        for low, length, dofs in self.parts:
            q = load_at(self._along(low, length))
            shape = kind.sampled(kind.points, derivative=True) if couples else kind.shape
            work = np.einsum("q...g,dg,g->...qd", q, shape, kind.weights)
            work *= (length[..., None] ** (kind.turns if couples else 1 + kind.turns))[..., None, :]
            inside = [k for k, dof in enumerate(dofs) if dof >= 2 * m]
            soft = self.soft[..., [dofs[k] - 2 * m for k in inside]]
            total = total + np.einsum("...md,...qd->mq...", soft, work[..., inside])
        return total

    def of_point(self, other: Divided) -> Reals:
        """Return the displacement of the block due to unit loads of another block on the element, shape (m, m, ...)."""
        if other is self:
            return np.moveaxis(self.soft[..., : self.line.kind.nodal], (-2, -1), (0, 1))
        kind, m = self.line.kind, self.line.kind.nodal
        total: Any = 0.0
        for part, (low, length, dofs) in enumerate(self.parts):
            here = (other.number == self.number) & ((other.place <= self.place) == (part == 0))
            local = np.clip((other.place - low) / length, 0.0, 1.0)
            work = np.array(
                [kind.sampled(local.ravel(), derivative=k > 0).reshape(-1, *local.shape) / length**k for k in range(m)]
            )
            work = np.moveaxis(work, (0, 1), (-2, -1)) * length[..., None, None] ** kind.turns * here[..., None, None]
            inside = [k for k, dof in enumerate(dofs) if dof >= 2 * m]
            soft = self.soft[..., [dofs[k] - 2 * m for k in inside]]
            total = total + np.einsum("...md,...qd->mq...", soft, work[..., inside])
        return total

    def pushed(self) -> tuple[Reals, Reals]:
        """Return nodal values and element forces under unit loads of the block.

        Returns
        -------
        Arrays of shape (m, m loads, ..., nodes) and (dofs of an element, m loads, ..., elements).
        """
        m, elements = self.line.kind.nodal, np.arange(self.line.elements)
        values, forces = self.line.influence
        dofs = self.line.dofs[self.number][..., : 2 * m]
        moved = np.einsum("i...jn,...qj->iq...n", values[:, dofs], self.carry)
        resisted = np.einsum("i...jn,...qj->iq...n", forces[:, dofs], self.carry)
        for j in range(2 * m):
            given = np.moveaxis(self.carry[..., j], -1, 0)[..., None]
            resisted[j] -= np.where(elements == self.number[..., None], given, 0.0)
        return moved, resisted


class BlockResponse:
    """Response of a unit beam to the loads of a block, and displacement of the block.

    Attributes
    ----------
    beam, xi
        Index of the beam, and position of the block on it, shape (...).
    w, phi, u, slide
        Displacement of the block under the loads of `UnitBeam`, shape (loads, ...).
    nodes
        u, w, phi, slide, N, V, M at the nodes, shape (loads, ..., nodes). The loads are an axial force for u and N, a
        transverse force and a moment for w, phi, V and M, and a transverse force for slide.
    """

    def __init__(self, beam: int, xi: Reals, unit: UnitBeam) -> None:
        self.beam, self.xi, self.unit = beam, xi, unit
        n = float(unit.bending.elements)
        self.across, self.along, self.sheared = (
            Divided(line, xi) for line in (unit.bending, unit.stretching, unit.sliding)
        )
        self.w, self.phi = self._under(self.across, np.array((unit.w, unit.phi / n)), n**-4)
        self.phi = self.phi * n
        (self.u,) = self._under(self.along, unit.u[None], n**-2)
        (self.slide,) = self._under(self.sheared, unit.slide[None], n**-2)
        self.nodes = self._nodes(n)

    def _under(self, divided: Divided, values: Reals, unit: float) -> Reals:
        nodal = divided.of_nodes(values)
        stations = len(self.unit.stations)
        nodal[:, :stations] += unit * divided.of_spread(self.unit.load_at)
        if divided is self.across:
            n = float(self.unit.bending.elements)
            nodal[:, stations : 2 * stations] += unit * n * divided.of_spread(self.unit.load_at, couples=True)
        return nodal

    def _nodes(self, n: float) -> dict[str, Reals]:
        (w, phi), forces = self.across.pushed()
        scale = np.array([n**-3, n**-2]).reshape(2, *[1] * np.ndim(self.xi), 1)
        (u,), along = self.along.pushed()
        (slide,), _ = self.sheared.pushed()
        return {
            "u": u / n,
            "w": w * scale,
            "phi": phi * scale * n,
            "slide": slide / n,
            "N": _at_nodes(-along[0], along[1]),
            "V": _at_nodes(forces[0], -forces[2]) * scale * n**3,
            "M": _at_nodes(-forces[1], forces[3]) * scale * n**2,
        }

    def under(self, other: BlockResponse) -> tuple[Reals, Reals, Reals, Reals]:
        """Return u, w, phi, slide of this block under unit loads of another block on the beam, shape (loads, ...)."""
        n = float(self.unit.bending.elements)
        scale = np.array([n**-3, n**-2]).reshape(2, *[1] * np.ndim(self.xi))
        given = np.array((other.nodes["w"], other.nodes["phi"] / n))
        w, phi = self.across.of_nodes(given) + scale * self.across.of_point(other.across)
        (u,) = self.along.of_nodes(other.nodes["u"][None]) + self.along.of_point(other.along) / n
        (slide,) = self.sheared.of_nodes(other.nodes["slide"][None]) + self.sheared.of_point(other.sheared) / n
        return u, w, phi * n, slide


def _at_nodes(starts: Reals, ends: Reals) -> Reals:
    """Return a section force at the nodes: at the start of each element and at the end of the last one."""
    return np.concatenate((starts, ends[..., -1:]), axis=-1)
