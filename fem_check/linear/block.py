"""Sliding blocks on beams: at each position, the element under the block is divided in two at the block.

Assembly and static condensation are vectorised over the positions here, because scikit-fem would need a mesh and a
matrix for each position. The tests compare with a divided element in a mesh of scikit-fem.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_check.linear.lines import ElementRow
from fem_check.linear.unit_beam import UnitBeam
from rigid.arrays import Reals

MIN_NODE_DISTANCE = 1e-14  # smallest distance of a block from a node, relative to the length of the element


class DividedElement:
    """Element under a block, divided in two at the block. Inner dofs are eliminated by static condensation.

    In shapes, (...) is the shape of one value per design and position, and m is the number of dofs of a node. Values
    are for elements of length 1.

    Attributes
    ----------
    number
        Index of the element, shape (...).
    place
        Position of the block in the element, from 0 to 1, shape (...).
    carry
        Dofs of the block per unit of each dof of the ends of the element, shape (..., m, 2 m).
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
        self.flexibility = soft[..., :m, :]
        self.carry = self._carried(-self.flexibility @ matrix[..., inner, ends])

    def _carried(self, carry: Any) -> Reals:
        """Compute the part of `carry` for the nearer end of the element again, to limit round-off.

        This part follows from the part for the other end, because a rigid motion of both ends moves the block rigidly.
        """
        m, rigid = self.line.kind.nodal, self.line.kind.rigid
        by_start, by_end = carry[..., :m], carry[..., m:]
        from_start = np.concatenate((rigid(self.place) - by_end @ rigid(1.0), by_end), axis=-1)
        from_end = np.concatenate((by_start, rigid(self.place - 1.0) - by_start @ rigid(-1.0)), axis=-1)
        return np.where(self.place[..., None, None] < 0.5, from_start, from_end)

    def _along(self, low: Reals, length: Reals) -> Reals:
        """Return xi of the beam at the quadrature points of a part of the element, shape (..., points)."""
        inside = low[..., None] + length[..., None] * self.line.kind.points
        return (self.number[..., None] + inside) / self.line.elements

    def from_nodal_values(self, values: Reals) -> Reals:
        """Return the dofs of the block for given nodal values, shape (m, loads, ...).

        The nodal values have the shape (m, loads, nodes), or (m, loads, ..., nodes) if they depend on the position.
        """
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

    def under_distributed_loads(self, load_at: Any, couples: bool = False) -> Reals:
        """Return the dofs of the block due to distributed loads on the element, with clamped ends, (m, loads, ...).

        `load_at` returns the loads at given xi. If `couples` is True, the loads are moments per unit length.
        """
        kind, m = self.line.kind, self.line.kind.nodal
        total: Any = 0.0
        for low, length, dofs in self.parts:
            q = load_at(self._along(low, length))
            shape = kind.sampled(kind.points, derivative=True) if couples else kind.shape
            work = np.einsum("q...g,dg,g->...qd", q, shape, kind.weights)
            work *= (length[..., None] ** (kind.turns if couples else 1 + kind.turns))[..., None, :]
            inside = [k for k, dof in enumerate(dofs) if dof >= 2 * m]
            soft = self.flexibility[..., [dofs[k] - 2 * m for k in inside]]
            total = total + np.einsum("...md,...qd->mq...", soft, work[..., inside])
        return total

    def under_other_block(self, other: DividedElement) -> Reals:
        """Return the dofs of the block due to unit loads of a block on the same element, with clamped ends.

        The shape is (m, m loads, ...). The values are zero if the other block is on another element.
        """
        if other is self:
            return np.moveaxis(self.flexibility[..., : self.line.kind.nodal], (-2, -1), (0, 1))
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
            soft = self.flexibility[..., [dofs[k] - 2 * m for k in inside]]
            total = total + np.einsum("...md,...qd->mq...", soft, work[..., inside])
        return total

    def beam_response(self) -> tuple[Reals, Reals]:
        """Return the response of the whole beam to unit loads of the block: nodal values and forces on the elements.

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
    beam
        Index of the beam.
    xi
        Position of the block on the beam, x'/l, shape (...).
    w, phi, u, slide
        Displacement of the block under the loads of `UnitBeam`, shape (loads, ...).
    nodes
        Values at the nodes under unit loads of the block, by field, shape (loads, ..., nodes). The load is an axial
        force for u and N, and a transverse force for slide. For w, phi, V and M, the loads are a transverse force and a
        moment.
    """

    def __init__(self, beam: int, xi: Reals, unit: UnitBeam) -> None:
        self.beam, self.xi, self.unit = beam, xi, unit
        n = float(unit.bending.elements)
        self.across, self.along, self.sheared = (
            DividedElement(line, xi) for line in (unit.bending, unit.stretching, unit.sliding)
        )
        self.w, self.phi = self._under(self.across, np.array((unit.w, unit.phi / n)), n**-4)
        self.phi = self.phi * n
        (self.u,) = self._under(self.along, unit.u[None], n**-2)
        (self.slide,) = self._under(self.sheared, unit.slide[None], n**-2)
        self.nodes = self._nodes(n)

    def _under(self, divided: DividedElement, values: Reals, unit: float) -> Reals:
        nodal = divided.from_nodal_values(values)
        stations = len(self.unit.stations)
        nodal[:, :stations] += unit * divided.under_distributed_loads(self.unit.load_at)
        if divided is self.across:
            n = float(self.unit.bending.elements)
            nodal[:, stations : 2 * stations] += (
                unit * n * divided.under_distributed_loads(self.unit.load_at, couples=True)
            )
        return nodal

    def _nodes(self, n: float) -> dict[str, Reals]:
        (w, phi), forces = self.across.beam_response()
        scale = np.array([n**-3, n**-2]).reshape(2, *[1] * np.ndim(self.xi), 1)
        (u,), along = self.along.beam_response()
        (slide,), _ = self.sheared.beam_response()
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
        """Return u, w, phi, slide of this block under unit loads of another block on the beam, shape (loads, ...).

        For the loads see `nodes`.
        """
        n = float(self.unit.bending.elements)
        scale = np.array([n**-3, n**-2]).reshape(2, *[1] * np.ndim(self.xi))
        given = np.array((other.nodes["w"], other.nodes["phi"] / n))
        w, phi = self.across.from_nodal_values(given) + scale * self.across.under_other_block(other.across)
        (u,) = self.along.from_nodal_values(other.nodes["u"][None]) + self.along.under_other_block(other.along) / n
        (slide,) = (
            self.sheared.from_nodal_values(other.nodes["slide"][None])
            + self.sheared.under_other_block(other.sheared) / n
        )
        return u, w, phi * n, slide


def _at_nodes(starts: Reals, ends: Reals) -> Reals:
    """Return a section force at the nodes: at the start of each element and at the end of the last one."""
    return np.concatenate((starts, ends[..., -1:]), axis=-1)
