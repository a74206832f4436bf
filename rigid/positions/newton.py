"""Place the links of groups that have no closed-form solution, by Newton's method for all positions at once."""

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from rigid.arrays import Columns, Flags, Reals
from rigid.closures.closure import Closure, closure, columns
from rigid.decomposition.groups import Group
from rigid.joints import Joint
from rigid.plane import ROUND_OFF, number
from rigid.positions.partial_posture import PartialPosture
from rigid.postures import Posture, joint_place

MAX_NEWTON_STEPS = 40  # maximum number of steps of Newton's method
# tolerance of Newton's method: the last step must be less than TOLERANCE (1 + |coordinate|), with lengths in units of
# the mechanism size
TOLERANCE = 1e-14
MAX_CLOSED_GAP = 1e-10  # [rad or mechanism sizes] a redundant joint counts as closed if its gap is at most this


def _shape(placed: PartialPosture) -> tuple[int, ...]:
    if placed.shape:
        return placed.shape
    known = (np.shape(value) for value in (*placed.origin, *placed.direction))
    return np.broadcast_shapes(*known, placed.drive.shape[1:], placed.mechanism.designs)


def correct(placed: PartialPosture, group: Group, near: Posture) -> Columns:
    """Compute the positions of a group by Newton's method from a nearby posture, and return the sine of the group.

    Each position is solved independently of the others. If the group does not close at a position, its sine is nan
    there.
    """
    free = [group.tree[number] for number in group.free]
    shape = _shape(placed)
    start = np.stack([np.broadcast_to(joint.coordinate(near), shape) for joint in free])
    return sine_of(tree_closure(placed, group, newton(placed, group, start)))


def require_closed(placed: PartialPosture, group: Group) -> None:
    """Set a group without free joints to nan at each position at which one of its redundant joints does not close."""
    size = placed.mechanism.size if group.cut or group.rings else 1.0
    for joint in group.cut + group.rings:
        closed = joint.closes(placed, MAX_CLOSED_GAP, MAX_CLOSED_GAP * size)
        placed.origin[joint.child] = placed.origin[joint.child] + np.where(closed, 0.0, np.nan)


def tree_closure(placed: PartialPosture, group: Group, coordinates: Any) -> Closure:
    """Place the links of a group for given coordinates of its free joints, and return the closure."""
    free = iter(coordinates)
    for joint in group.tree:
        placed.place_child(joint, placed.coordinate(joint) if joint.moved else next(free))
    tree, cut = (tuple(joint_place(placed, joint) for joint in joints) for joints in (group.tree, group.cut))
    return closure(group, tree, cut)


def closes(placed: PartialPosture, group: Group, coordinates: Any, factor: Columns) -> Flags:
    """Return whether a group with the given free coordinates has gaps of at most `factor` times round-off."""
    closed = tree_closure(placed, group, coordinates)
    return _closed_to_round_off(placed, closed, [gap / factor for gap in _gaps(placed, closed)])


def newton(placed: PartialPosture, group: Group, coordinates: Reals, steps: int = MAX_NEWTON_STEPS) -> Reals:
    """Compute the coordinates of the free joints that close a group, by Newton's method from `coordinates`.

    The result has the shape (free, ..., positions). It is nan at positions at which the method does not converge.
    """
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
            # near a singular position, round-off prevents the steps from becoming small: accept a solution if the
            # joints are closed to within round-off and the steps hardly decrease any more
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
    """Return whether the gaps of all cut joints can be explained by round-off."""

    def is_round_off(joint: Joint, gap: Columns) -> Flags:
        ends = ((joint.child, joint.at_child), (joint.parent, joint.at_parent))
        size = sum(np.abs(placed.origin[link]) + np.abs(local) for link, local in ends)
        return joint.within(gap, 2 * ROUND_OFF, ROUND_OFF * size)

    return np.all([is_round_off(place.joint, gap) for place, gap in zip(closed.cut, gaps, strict=True)], axis=0)


def _redundant_joints_fit(group: Group, closed: Closure, gaps: Sequence[Columns]) -> Flags:
    """Return whether a group with redundant joints closes: all gaps that remain are below `MAX_CLOSED_GAP`.

    For redundant joints, Newton's method minimises the gaps by least squares. The gaps are relative to the largest
    derivative of a gap with respect to a free coordinate.
    """
    effects = (np.abs(number(e)) for column in columns(group, closed.tree, closed.cut) for e in column)
    return reduce(np.maximum, map(np.abs, gaps)) <= MAX_CLOSED_GAP * reduce(np.maximum, effects)


def sine_of(closed: Closure) -> Columns:
    """Return the sine of a group, a measure of its distance from singular positions.

    It is the smallest singular value of the matrix of the loop equations after each column is scaled to length 1. For a
    dyad that closes at a pin, it is between |s|/sqrt(2) and |s|, where s is the sine of the dyad (see `dyads`). If a
    slider closes the group, its equation for rotation is multiplied by the length of the longest arm, so that the
    result does not depend on the unit of length.
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
