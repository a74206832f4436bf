"""Small displacements and forces of a placed mechanism: one linear problem with many right-hand sides.

Velocities, accelerations and the elastic displacements of the links all answer one question: how must every link move
as a rigid body so that the joints have given gaps? Reactions answer its transpose. Each group is solved once, into dual
vectors, and then asked as often as wanted. Derivation: docs/theory.md, "One linear problem".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.plane import cross, dot
from rigid.structure import Group, Joint

Columns = Any  # an array of shape (..., positions), or 0.0 where it is zero at every position


@dataclass(frozen=True, eq=False)
class JointPlace:
    """A joint where it is now.

    Attributes
    ----------
    joint
        What it joins.
    arm_parent, arm_child
        From the origin of either link's axes to the joint's point [m], complex.
    along
        Unit vector of a slider's line; None for a pin.
    """

    joint: Joint
    arm_parent: Columns
    arm_child: Columns
    along: Columns = None

    def row(self, displacement: Columns, rotation: Columns) -> Columns:
        """The two conditions of a cut joint on a relative displacement and rotation, as one complex number.

        A pin: the displacement. A slider: rotation + i (displacement across its line).
        """
        return displacement if self.along is None else rotation + 1j * cross(self.along, displacement)


@dataclass(frozen=True, eq=False)
class Closure:
    """A placed group.

    Attributes
    ----------
    tree, cut
        The joints of the group, placed.
    duals
        duals[k][c], complex, (..., positions): the coordinate of free tree joint k that gap r_c at the cut joints takes
        is sum over c of cross(duals[k][c], r_c).
    """

    group: Group
    tree: tuple[JointPlace, ...]
    cut: tuple[JointPlace, ...]
    duals: tuple[tuple[Columns, ...], ...]

    @property
    def joints(self) -> tuple[JointPlace, ...]:
        """Tree joints, then cut joints."""
        return self.tree + self.cut


def swing(rate: Columns, arm: Columns) -> Columns:
    """The product i rate arm: displacement at the end of an arm that turns; 0.0 where either is."""
    if isinstance(rate, float) or (isinstance(arm, float) and arm == 0.0):
        return 0.0
    return (1j * rate) * arm


def closure(group: Group, tree: tuple[JointPlace, ...], cut: tuple[JointPlace, ...]) -> Closure:
    """Solve a placed group once for all right-hand sides."""
    effects = columns(group, tree, cut)
    return Closure(group, tree, cut, _duals(effects))


def columns(group: Group, tree: Sequence[JointPlace], cut: Sequence[JointPlace]) -> list[list[Columns]]:
    """Gap that opens at cut joint c per unit of free coordinate k: columns[k][c]."""
    columns: list[list[Columns]] = [[0.0] * len(cut) for _ in group.free]
    carrier = {link: number for number, link in enumerate(group.links)}
    for c, closing in enumerate(cut):
        ends = ((closing.joint.child, closing.arm_child, 1.0), (closing.joint.parent, closing.arm_parent, -1.0))
        for end, arm, sign in ends:
            link, reach = end, arm
            while link in carrier:
                number = carrier[link]
                hinge = tree[number]
                reach = reach - hinge.arm_child
                if hinge.joint.drive is None:
                    turning = hinge.along is None
                    shift, rotation = (1j * reach, 1.0) if turning else (hinge.along, 0.0)
                    k = group.free.index(number)
                    columns[k][c] = columns[k][c] + sign * closing.row(shift, rotation)
                reach = reach + hinge.arm_parent
                link = hinge.joint.parent
    return columns


def _duals(columns: list[list[Columns]]) -> tuple[tuple[Columns, ...], ...]:
    """Dual vectors of the columns: in closed form for one loop, by one batched inverse for several."""
    if not columns:
        return ()
    if len(columns) == 2:
        (one,), (other,) = columns
        scale = 1.0 / cross(other, one)
        return ((other * scale,), (one * -scale,))
    matrix = _real_matrix(columns)
    inverse = _inverse(matrix)
    rows = np.moveaxis(inverse, (-2, -1), (0, 1))
    return tuple(tuple(row[1::2][c] - 1j * row[0::2][c] for c in range(len(columns) // 2)) for row in rows)


def _real_matrix(columns: list[list[Columns]]) -> np.ndarray[Any, Any]:
    """(..., positions, 2 cuts, free) of Re, Im of the columns."""
    parts = [
        np.broadcast_arrays(*[part(entry) for column in columns for entry in column]) for part in (np.real, np.imag)
    ]
    n = len(columns)
    stacked = np.array(parts, dtype=float).reshape(2, n, n // 2, *np.shape(parts[0][0]))
    ordered = np.moveaxis(stacked, (2, 0, 1), (-3, -2, -1))
    return ordered.reshape(*ordered.shape[:-3], n, n)


def _inverse(matrix: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Inverses; nan where a matrix is singular or not finite."""
    good = np.isfinite(matrix).all(axis=(-2, -1))
    good[good] = np.linalg.slogdet(matrix[good])[0] != 0
    inverse = np.full_like(matrix, np.nan)
    inverse[good] = np.linalg.inv(matrix[good])
    return inverse


def displacements(
    closures: Sequence[Closure], links: int, gaps: Sequence[Columns], turns: Sequence[Columns]
) -> tuple[list[Columns], list[Columns]]:
    """Displacement of every link's origin and its rotation, so that the joints open by given gaps.

    Parameters
    ----------
    closures
        The placed groups, in the order of solution.
    links
        Number of links, the ground among them.
    gaps, turns
        Per joint, in the order of `Structure.joints`: displacement of the child's point from the parent's, complex, and
        rotation of the child from the parent; a component that the joint leaves free is ignored.

    Returns
    -------
    Two lists over the links: complex displacements and rotations, shape (..., positions), 0.0 for the ground.
    """
    shift: list[Columns] = [0.0] * links
    angle: list[Columns] = [0.0] * links
    number = 0
    for closed in closures:
        for hinge in closed.tree:
            parent, child = hinge.joint.parent, hinge.joint.child
            carried = hinge.along is not None or hinge.joint.drive is not None
            angle[child] = (angle[parent] if carried else 0.0) + (turns[number] if carried else 0.0)
            at_pin = shift[parent] + swing(angle[parent], hinge.arm_parent) + gaps[number]
            shift[child] = at_pin - swing(angle[child], hinge.arm_child)
            number += 1
        residuals = []
        for closing in closed.cut:
            parent, child = closing.joint.parent, closing.joint.child
            opened = shift[child] + swing(angle[child], closing.arm_child)
            opened = opened - shift[parent] - swing(angle[parent], closing.arm_parent)
            turned = angle[child] - angle[parent]
            residuals.append(closing.row(gaps[number] - opened, turns[number] - turned))
            number += 1
        free = [sum(cross(dual, gap) for dual, gap in zip(row, residuals, strict=True)) for row in closed.duals]
        _release(closed, free, shift, angle)
    return shift, angle


def _release(closed: Closure, free: Sequence[Columns], shift: list[Columns], angle: list[Columns]) -> None:
    """Add the motion of the free tree joints to the links behind them."""
    for k, number in enumerate(closed.group.free):
        hinge = closed.tree[number]
        for link, path in zip(closed.group.links, closed.group.path, strict=True):
            if k not in path:
                continue
            if hinge.along is not None:
                shift[link] = shift[link] + free[k] * hinge.along
                continue
            shift[link] = shift[link] - swing(free[k], _reach(closed, link, number))
            angle[link] = angle[link] + free[k]


def _reach(closed: Closure, link: int, number: int) -> Columns:
    """From the origin of a link back to the tree joint that carries it directly or through others."""
    carrier = closed.group.links.index(link)
    reach = closed.tree[carrier].arm_child
    while carrier != number:
        hinge = closed.tree[carrier]
        carrier = closed.group.links.index(hinge.joint.parent)
        reach = reach - hinge.arm_parent + closed.tree[carrier].arm_child
    return reach


@dataclass(frozen=True, eq=False)
class JointForces:
    """What every joint does to its child link; the parent gets the opposite.

    Attributes
    ----------
    force
        Complex [N], one array of shape (..., positions) per joint in the order of `Structure.joints`.
    moment
        About the joint's point [N m]; 0.0 for a free pin.
    ground_force, ground_moment
        What the mechanism does to the ground: shaking force [N] and moment about the origin of coordinates [N m].
    """

    force: list[Columns]
    moment: list[Columns]
    ground_force: Columns
    ground_moment: Columns


def joint_forces(closures: Sequence[Closure], force: Sequence[Columns], moment: Sequence[Columns]) -> JointForces:
    """Joint forces that balance a given force and moment about its origin on every link.

    Parameters
    ----------
    closures
        The placed groups, in the order of solution; the forces go through them backwards.
    force, moment
        Per link, complex [N] and real [N m], shape (..., positions).
    """
    force, moment = list(force), list(moment)
    results: list[list[tuple[Columns, Columns]]] = []
    for closed in reversed(closures):
        held = [_cut_load(closed, k, force, moment) for k in range(len(closed.group.free))]
        cuts = []
        for c, closing in enumerate(closed.cut):
            multiplier = 1j * sum(-load * closed.duals[k][c] for k, load in enumerate(held))
            if closing.along is None:
                pull, twist = multiplier, 0.0
            else:
                pull, twist = multiplier.imag * (1j * closing.along), multiplier.real
            _apply(closing, pull, twist, force, moment)
            cuts.append((pull, twist))
        trees = []
        for hinge in reversed(closed.tree):
            child = hinge.joint.child
            pull = -force[child]
            bare_pin = hinge.along is None and hinge.joint.drive is None
            twist = 0.0 if bare_pin else -(moment[child] - cross(hinge.arm_child, force[child]))
            _apply(hinge, pull, twist, force, moment)
            trees.append((pull, twist))
        results.append(trees[::-1] + cuts)
    ordered = [pair for group in reversed(results) for pair in group]
    return JointForces([pull for pull, _ in ordered], [twist for _, twist in ordered], force[0], moment[0])


def _cut_load(closed: Closure, k: int, force: Sequence[Columns], moment: Sequence[Columns]) -> Columns:
    """Generalised force of the links' loads on free tree joint k."""
    number = closed.group.free[k]
    hinge = closed.tree[number]
    total: Columns = 0.0
    for link, path in zip(closed.group.links, closed.group.path, strict=True):
        if k not in path:
            continue
        if hinge.along is not None:
            total = total + dot(hinge.along, force[link])
        else:
            arm = _reach(closed, link, number)
            total = total + (moment[link] - (cross(arm, force[link]) if np.ndim(arm) or arm else 0.0))
    return total


def _apply(place: JointPlace, pull: Columns, twist: Columns, force: list[Columns], moment: list[Columns]) -> None:
    """Put a joint's force and moment on its child and their opposites on its parent."""
    for link, arm, sign in ((place.joint.child, place.arm_child, 1.0), (place.joint.parent, place.arm_parent, -1.0)):
        about = (cross(arm, pull) if np.ndim(arm) or arm else 0.0) + twist
        force[link] = force[link] + pull if sign > 0 else force[link] - pull
        moment[link] = moment[link] + about if sign > 0 else moment[link] - about
