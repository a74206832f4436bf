"""Placed groups of links, factorised once for all small displacements and forces.

Velocities, accelerations and elastic displacements solve the same problem: which rigid-body motion of the links opens
the joints by given gaps? Joint forces solve its transpose. Derivation: docs/theory.md, "One linear problem".
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.decomposition.groups import LINK_CONSTRAINTS, Group
from rigid.joints import JointPlace
from rigid.plane import ZERO, number


class Closure(Struct, frozen=True, eq=False):
    """A placed group of links, i.e. a group with known positions.

    Attributes
    ----------
    tree, cut, rings
        Placed joints of the group (see `Group`).
    duals
        Complex, shape (free, cuts, ..., positions). To open each cut joint c by r_c (complex as in `JointPlace.row`),
        free tree joint k must move by Im(sum over c of duals[k, c] r_c).
    tensions
        tensions[s][c] is the multiplier of cut joint c in self-stress s. There is one self-stress per redundant
        constraint.
    sine
        For a dyad, sine of the angle between its links; for other groups, see `sine_of`. nan if the group does not
        close.
    whole
        Closure with the solutions at singular positions, if `without_singular` set these to nan here; else None.
    """

    group: Group
    tree: tuple[JointPlace, ...]
    cut: tuple[JointPlace, ...]
    duals: Numbers
    tensions: tuple[tuple[Columns, ...], ...] = ()
    sine: Columns = 1.0
    whole: Closure | None = None
    rings: tuple[JointPlace, ...] = ()

    @property
    def joints(self) -> tuple[JointPlace, ...]:
        """Tree joints, cut joints, and welds that close rings."""
        return self.tree + self.cut + self.rings

    @property
    def redundancy(self) -> int:
        """Number of self-stresses: one per entry of `tensions`, and three per ring (x, y, moment)."""
        return len(self.tensions) + LINK_CONSTRAINTS * len(self.rings)


def closure(
    group: Group,
    tree: tuple[JointPlace, ...],
    cut: tuple[JointPlace, ...],
    sine: Columns = 1.0,
    rings: tuple[JointPlace, ...] = (),
) -> Closure:
    """Factorise the linear problem of a placed group for all right-hand sides."""
    effects = columns(group, tree, cut)
    if 2 * len(cut) > len(effects):
        duals, tensions = _redundant_duals(effects, len(cut))
    else:
        duals, tensions = _duals(effects, len(cut)), ()
    return Closure(group, tree, cut, duals, tensions, sine, rings=rings)


def columns(group: Group, tree: Sequence[JointPlace], cut: Sequence[JointPlace]) -> list[list[Columns]]:
    """Return columns[k][c], the gap at cut joint c per unit of the coordinate of free joint k."""
    effects: list[list[Columns]] = [[ZERO] * len(cut) for _ in group.free]
    carrier = {link: number for number, link in enumerate(group.links)}
    for c, closing in enumerate(cut):
        ends = ((closing.joint.child, closing.arm_child, 1.0), (closing.joint.parent, closing.arm_parent, -1.0))
        for end, arm, sign in ends:
            link, reach = end, arm
            while link in carrier:
                at = carrier[link]
                hinge = tree[at]
                reach = reach - hinge.arm_child
                if not hinge.joint.moved:
                    k = group.free.index(at)
                    effects[k][c] = effects[k][c] + closing.row(*hinge.effect(reach, sign))
                reach = reach + hinge.arm_parent
                link = hinge.joint.parent
    return effects


def _duals(effects: list[list[Columns]], cuts: int) -> Numbers:
    """Return the dual vectors of the columns: in closed form for one loop, otherwise by batched inversion."""
    if not effects:
        return np.empty((0, cuts))
    if len(effects) == 2:
        first, second = (number(effect) for (effect,) in effects)  # `number` converts ZERO to 0.0
        across = np.conj(second)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1.0 / np.asarray((across * first).imag)
        duals = np.empty((2, 1, *scale.shape), complex)
        np.multiply(scale, across, out=duals[0, 0, ...])
        np.multiply(-scale, np.conj(first), out=duals[1, 0, ...])
        return duals
    return _complex_rows(np.moveaxis(_inverse(equations(effects)), (-2, -1), (0, 1)))


def _redundant_duals(effects: list[list[Columns]], cuts: int) -> tuple[Numbers, tuple[tuple[Columns, ...], ...]]:
    """Return least-squares dual vectors and self-stress multipliers of a group with redundant constraints."""
    if not effects:
        unit = np.eye(2 * cuts)
        return np.empty((0, cuts)), tuple(tuple(row[0::2] + 1j * row[1::2]) for row in unit)
    matrix = equations(effects)
    good = np.isfinite(matrix).all(axis=(-2, -1))
    inverse = np.full(np.swapaxes(matrix, -2, -1).shape, np.nan)
    inverse[good] = np.linalg.pinv(matrix[good])
    basis = np.full((*matrix.shape[:-2], 2 * cuts, 2 * cuts), np.nan)
    basis[good] = np.linalg.svd(matrix[good])[0]
    rest = np.moveaxis(basis[..., len(effects) :], (-1, -2), (0, 1))
    tensions = tuple(tuple(row[0::2][c] + 1j * row[1::2][c] for c in range(cuts)) for row in rest)
    return _complex_rows(np.moveaxis(inverse, (-2, -1), (0, 1))), tensions


def equations(effects: list[list[Columns]]) -> Reals:
    """Return real and imaginary parts of the columns as matrices, shape (..., positions, 2 cuts, free)."""
    entries = np.array(np.broadcast_arrays(*(entry for column in effects for entry in column)), complex)
    entries = np.moveaxis(entries.reshape(len(effects), -1, *entries.shape[1:]), (1, 0), (-2, -1))
    return np.stack((entries.real, entries.imag), axis=-2).reshape(*entries.shape[:-2], -1, len(effects))


def _complex_rows(rows: Reals) -> Complexes:
    """Convert the rows of an inverse, shape (free, 2 cuts, ..., positions), to dual vectors.

    The product of a dual vector and a gap is the imaginary part of their complex product, so the entries for the real
    part of the gap become imaginary parts.
    """
    return rows[:, 1::2] + 1j * rows[:, 0::2]


def _inverse(matrix: Reals) -> Reals:
    """Invert matrices. The inverse of a singular or non-finite matrix is nan."""
    good: Any = np.isfinite(matrix).all(axis=(-2, -1))
    good[good] = np.linalg.slogdet(matrix[good])[0] != 0
    inverse = np.full_like(matrix, np.nan)
    inverse[good] = np.linalg.inv(matrix[good])
    return inverse


def reach_from(closed: Closure, chain: tuple[int, ...]) -> Columns:
    """Return the vector from the origin of the first joint's child to the last joint of a chain (complex) [m]."""
    reach = closed.tree[chain[0]].arm_child
    for below, above in pairwise(chain):
        reach = reach - closed.tree[below].arm_parent + closed.tree[above].arm_child
    return reach
