"""Placement of groups without closed form, by Newton's method at all positions at once."""

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from rigid.arrays import Columns, Flags, Reals
from rigid.closures.closure import Closure, closure, columns
from rigid.decomposition.groups import Group
from rigid.joint_places import joint_place
from rigid.joints import Joint
from rigid.plane import ROUND_OFF, number
from rigid.positions.partial_posture import PartialPosture
from rigid.postures import Posture

MAX_NEWTON_STEPS = 40  # maximum number of Newton steps
TOLERANCE = 1e-14  # largest final step: angle [rad], or slide / mechanism size
MAX_CLOSED_GAP = 1e-10  # largest gap of a closed redundant joint: angle [rad], or distance / mechanism size


def _shape(placed: PartialPosture) -> tuple[int, ...]:
    if placed.shape:
        return placed.shape
    known = (np.shape(value) for value in (*placed.origin, *placed.direction))
    return np.broadcast_shapes(*known, placed.drive.shape[1:], placed.mechanism.designs)


def correct(placed: PartialPosture, group: Group, near: Posture) -> Columns:
    """Place a group from a nearby posture, independently at each position, and return its sine (nan if it is open)."""
    free = [group.tree[number] for number in group.free]
    shape = _shape(placed)
    start = np.stack([np.broadcast_to(joint.coordinate(near), shape) for joint in free])
    return sine_of(tree_closure(placed, group, newton(placed, group, start)))


def require_closed(placed: PartialPosture, group: Group) -> None:
    """Set a driven group to nan at positions where its redundant joints do not close."""
    size = placed.mechanism.size if group.cut or group.rings else 1.0
    for joint in group.cut + group.rings:
        closed = joint.closes(placed, MAX_CLOSED_GAP, MAX_CLOSED_GAP * size)
        placed.origin[joint.child] = placed.origin[joint.child] + np.where(closed, 0.0, np.nan)


def tree_closure(placed: PartialPosture, group: Group, coordinates: Any) -> Closure:
    """Place the links of a group for given coordinates of its free joints, and return the closure."""
    free = iter(coordinates)
    for joint in group.tree:
        placed.hang(joint, placed.coordinate(joint) if joint.moved else next(free))
    tree, cut = (tuple(joint_place(placed, joint) for joint in joints) for joints in (group.tree, group.cut))
    return closure(group, tree, cut)


def closes(placed: PartialPosture, group: Group, coordinates: Any, factor: Columns) -> Flags:
    """Return whether given coordinates of the free joints close a group to `factor` times round-off."""
    closed = tree_closure(placed, group, coordinates)
    return _closed_to_round_off(placed, closed, [gap / factor for gap in _gaps(placed, closed)])


def newton(placed: PartialPosture, group: Group, coordinates: Reals, steps: int = MAX_NEWTON_STEPS) -> Reals:
    """Return the coordinates of the free joints that close a group; nan if there is no solution."""
    per_coordinate = (-1, *[1] * (coordinates.ndim - 1))
    sense = np.reshape([group.tree[number].sense for number in group.free], per_coordinate)
    unit = np.reshape(np.where(group.angles, 1.0, placed.mechanism.size), per_coordinate)
    done = np.zeros(coordinates.shape[1:], bool)
    length_before: Any = np.inf
    with np.errstate(all="ignore"):
        for _ in range(steps):
            closed = tree_closure(placed, group, coordinates)
            gaps = _gaps(placed, closed)
            step = -np.stack([sum((row[cut] * gap).imag for cut, gap in enumerate(gaps)) for row in closed.duals])
            coordinates = coordinates + sense * step
            length = (np.abs(step) / unit).max(axis=0)
            converged = np.all(np.abs(step) < TOLERANCE * (unit + np.abs(coordinates)), axis=0)
            # near a singular position, round-off keeps the steps large: accept closed joints if steps stop decreasing
            converged |= _closed_to_round_off(placed, closed, gaps) & (length > length_before / 4)
            if closed.tensions:
                converged &= _redundant_joints_fit(group, closed, gaps)
            length_before, done = length, done | converged
            if np.all(done | ~np.isfinite(coordinates).all(axis=0)):
                break
    return np.where(done, coordinates, np.nan)


def _gaps(placed: PartialPosture, closed: Closure) -> list[Columns]:
    """Return the gaps of the cut joints."""
    return [place.joint.gap(placed) for place in closed.cut]


def _closed_to_round_off(placed: PartialPosture, closed: Closure, gaps: Sequence[Columns]) -> Flags:
    """Return whether the gaps of all cut joints are round-off."""

    def is_round_off(joint: Joint, gap: Columns) -> Flags:
        ends = ((joint.child, joint.at_child), (joint.parent, joint.at_parent))
        size = sum(np.abs(placed.origin[link]) + np.abs(local) for link, local in ends)
        return joint.within(gap, 2 * ROUND_OFF, ROUND_OFF * size)

    return np.all([is_round_off(place.joint, gap) for place, gap in zip(closed.cut, gaps, strict=True)], axis=0)


def _redundant_joints_fit(group: Group, closed: Closure, gaps: Sequence[Columns]) -> Flags:
    """Return whether the gaps that least squares leave are small, relative to the effects of the free joints."""
    effects = (np.abs(number(e)) for column in columns(group, closed.tree, closed.cut) for e in column)
    return reduce(np.maximum, map(np.abs, gaps)) <= MAX_CLOSED_GAP * reduce(np.maximum, effects)


def sine_of(closed: Closure) -> Columns:
    """Return the sine of a group: the smallest singular value of the loop equations, with unit columns.

    For a dyad that closes at a pin, the value lies between |s| and |s|/sqrt(2), where s is the sine of the dyad.
    Rotations at sliders that close the group count as displacements of the longest arm, so that the value does not
    depend on the unit of length.
    """
    table = columns(closed.group, closed.tree, closed.cut)
    effect = np.array(np.broadcast_arrays(*(entry for column in table for entry in column)), complex)
    effect = effect.reshape(len(table), -1, *effect.shape[1:])
    turning = list(closed.group.angles)
    sliding = np.array(closed.group.guides)
    if sliding.any() and any(turning):
        moved = np.where(sliding.reshape(-1, *[1] * (effect.ndim - 2)), np.abs(effect.imag), np.abs(effect))
        longest = moved[turning].max(axis=(0, 1))
        effect.real[:, sliding] *= np.where(longest > 0, longest, 1.0)
    matrix = np.moveaxis(np.stack([effect.real, effect.imag], axis=2), 0, 2)
    matrix = matrix.reshape(-1, *matrix.shape[2:])
    matrix = matrix / np.sqrt((matrix**2).sum(axis=0))
    flat = np.moveaxis(matrix, (0, 1), (-2, -1))
    good = np.isfinite(flat).all(axis=(-2, -1))
    smallest = np.full(good.shape, np.nan)
    smallest[good] = np.linalg.svd(flat[good], compute_uv=False)[..., -1]
    return smallest
