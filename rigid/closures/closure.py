"""Placed groups, each solved once for all small displacements and forces.

Velocities, accelerations and the elastic displacements of the links all answer one question: how must every link move
as a rigid body so that the joints have given gaps? Joint forces answer its transpose. Derivation: docs/theory.md, "One
linear problem".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.decomposition.groups import RIGID, Group
from rigid.joints import JointPlace
from rigid.plane import ZERO, number


@dataclass(frozen=True, eq=False)
class Closure:
    """A placed group.

    Attributes
    ----------
    tree, cut, rings
        The joints of the group, placed.
    duals
        Complex, shape (free, cuts, ..., positions): to open the cut joints by r_c, free tree joint k takes the
        coordinate Im(sum over c of duals[k, c] r_c).
    tensions
        tensions[s][c]: multipliers of the cut joints that balance one another, for every condition that the group has
        beyond its freedoms.
    sine
        At which the links of a dyad meet; of other groups what stands for it; nan where the group does not close.
    whole
        The group as it was before singular positions were marked in it.
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
        """Tree joints, cut joints, then the welds of rings."""
        return self.tree + self.cut + self.rings

    @property
    def redundancy(self) -> int:
        """Number of the self-stresses: of the `tensions`, then x, y and moment of the weld of every ring."""
        return len(self.tensions) + RIGID * len(self.rings)


def closure(
    group: Group,
    tree: tuple[JointPlace, ...],
    cut: tuple[JointPlace, ...],
    sine: Columns = 1.0,
    rings: tuple[JointPlace, ...] = (),
) -> Closure:
    """Solve a placed group once for all right-hand sides."""
    effects = columns(group, tree, cut)
    duals, tensions = _surplus(effects, len(cut)) if 2 * len(cut) > len(effects) else (_duals(effects, len(cut)), ())
    return Closure(group, tree, cut, duals, tensions, sine, rings=rings)


def columns(group: Group, tree: Sequence[JointPlace], cut: Sequence[JointPlace]) -> list[list[Columns]]:
    """Gap that opens at cut joint c per unit of free coordinate k: columns[k][c]."""
    effects: list[list[Columns]] = [[ZERO] * len(cut) for _ in group.free]
    carrier = {link: number for number, link in enumerate(group.links)}
    for c, closing in enumerate(cut):
        ends = ((closing.joint.child, closing.arm_child, 1.0), (closing.joint.parent, closing.arm_parent, -1.0))
        for end, arm, sign in ends:
            link, reach = end, arm
            while link in carrier:
                number = carrier[link]
                hinge = tree[number]
                reach = reach - hinge.arm_child
                if not hinge.joint.moved:
                    k = group.free.index(number)
                    effects[k][c] = effects[k][c] + closing.row(*hinge.effect(reach, sign))
                reach = reach + hinge.arm_parent
                link = hinge.joint.parent
    return effects


def _duals(effects: list[list[Columns]], cuts: int) -> Numbers:
    """Dual vectors of the columns: in closed form for one loop, by one batched inverse for several."""
    if not effects:
        return np.empty((0, cuts))
    if len(effects) == 2:
        first, second = (number(effect) for (effect,) in effects)  # a joint on the line of another's motion opens none
        across = np.conj(second)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1.0 / np.asarray((across * first).imag)
        duals = np.empty((2, 1, *scale.shape), complex)
        np.multiply(scale, across, out=duals[0, 0, ...])
        np.multiply(-scale, np.conj(first), out=duals[1, 0, ...])
        return duals
    return _paired(np.moveaxis(_inverse(equations(effects)), (-2, -1), (0, 1)))


def _surplus(effects: list[list[Columns]], cuts: int) -> tuple[Numbers, tuple[tuple[Columns, ...], ...]]:
    """Dual vectors by least squares, and multipliers that balance one another, of a group with surplus conditions."""
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
    return _paired(np.moveaxis(inverse, (-2, -1), (0, 1))), tensions


def equations(effects: list[list[Columns]]) -> Reals:
    """Real and imaginary parts of the columns as a matrix per position, shape (..., positions, 2 cuts, free)."""
    entries = np.array(np.broadcast_arrays(*(entry for column in effects for entry in column)), complex)
    entries = np.moveaxis(entries.reshape(len(effects), -1, *entries.shape[1:]), (1, 0), (-2, -1))
    return np.stack((entries.real, entries.imag), axis=-2).reshape(*entries.shape[:-2], -1, len(effects))


def _paired(rows: Reals) -> Complexes:
    """Dual vectors from the rows of an inverse, shape (free, 2 cuts, ..., positions)."""
    return rows[:, 1::2] + 1j * rows[:, 0::2]


def _inverse(matrix: Reals) -> Reals:
    """Inverses; nan where a matrix is singular or not finite."""
    good: Any = np.isfinite(matrix).all(axis=(-2, -1))
    good[good] = np.linalg.slogdet(matrix[good])[0] != 0
    inverse = np.full_like(matrix, np.nan)
    inverse[good] = np.linalg.inv(matrix[good])
    return inverse


def reach_from(closed: Closure, chain: tuple[int, ...]) -> Columns:
    """From the origin of the link that the first of a chain of tree joints carries to the last [m], complex."""
    reach = closed.tree[chain[0]].arm_child
    for below, above in pairwise(chain):
        reach = reach - closed.tree[below].arm_parent + closed.tree[above].arm_child
    return reach
