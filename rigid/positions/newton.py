"""Positions of a group that no closed form covers: walked from the drawing, then polished all at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.closure import Closure, closure, columns, equations
from rigid.decomposition.groups import Group
from rigid.drawing import Drawing
from rigid.joints import Columns, Joint, coordinate_of, gap_of, joint_place, point_of
from rigid.plane import ROUND_OFF
from rigid.positions.placement import Placement
from rigid.postures import Posture

STEPS = 40
TOLERANCE = 1e-14
COARSE = 72
NEAR = 0.1
FITS = 1e-10


def follow(placed: Placement, group: Group, drawing: Drawing) -> Columns:
    """Place the links of any group, and the sine that stands for its condition.

    All positions that lead there from the drawing, and a coarse selection of the others, are walked one after the
    other, every one corrected by Newton's method over all designs at once. All positions then start between their
    coarse neighbours and are corrected in one batch. Where that does not converge, strays from its start, or folds the
    other way than both neighbours, every position is walked. Positions that cannot be reached are nan.
    """
    free = [group.tree[number] for number in group.free]
    shape = _shape(placed)
    start = np.stack([np.full((*shape[:-1], 1), drawing.coordinate(joint)) for joint in free])
    count = shape[-1]
    asked = count - placed.approach
    coarse = placed.approach + np.unique(np.linspace(0, asked - 1, min(COARSE, asked)).round().astype(int))
    coarse = np.concatenate([np.arange(placed.approach), coarse])
    walked = _walk(placed, group, start, coarse, shape)
    if len(coarse) < count:
        between = _interpolate(coarse, walked, count)
        found = _newton(placed, group, between)
        with np.errstate(invalid="ignore"):
            near = (np.abs(found - between) < NEAR * (1 + np.abs(between))).all()
        if near:
            closed = _hung(placed, group, found)
            if not _refolded(_fold(closed, shape), coarse).any():
                return _sine(closed)
        walked = _walk(placed, group, start, np.arange(count), shape)
    return _sine(_hung(placed, group, walked))


def _shape(placed: Placement) -> tuple[int, ...]:
    """Shape of the columns."""
    known = (np.shape(value) for value in (*placed.origin, *placed.direction))
    return np.broadcast_shapes(*known, placed.drive.shape[1:], placed.mechanism.designs)


def correct(placed: Placement, group: Group, near: Posture) -> Columns:
    """Place the links of any group from a posture near it, every position on its own; nan where none is found."""
    free = [group.tree[number] for number in group.free]
    shape = _shape(placed)
    start = np.stack([np.broadcast_to(coordinate_of(near, joint), shape) for joint in free])
    return _sine(_hung(placed, group, _newton(placed, group, start)))


def _walk(placed: Placement, group: Group, start: Any, positions: Any, shape: tuple[int, ...]) -> Any:
    """Coordinates at some positions, one after the other, each begun on the line through the two before it."""
    found = np.full((len(start), *shape[:-1], len(positions)), np.nan)
    last, guess = start, start
    ahead = _strides(placed.drive[:, positions])
    for number, position in enumerate(positions):
        here = _newton(_at(placed, slice(position, position + 1), shape), group, guess)
        reached = np.isfinite(here)
        guess = np.where(reached, here + ahead[number] * (here - last), guess)
        last = np.where(reached, here, last)
        found[..., number : number + 1] = here
    return found


def _strides(drive: Any) -> Any:
    """How far the drives go on from every position, by how far they came: 0 where they come from nowhere or stop."""
    steps = np.diff(drive, axis=1)
    before, after = steps[:, :-1], steps[:, 1:]
    square = (before**2).sum(axis=0)
    ahead = np.divide((before * after).sum(axis=0), square, out=np.zeros_like(square), where=square > 0)
    return np.concatenate([[0.0], ahead, [0.0]])


def _fold(closed: Closure, shape: tuple[int, ...]) -> Any:
    """Which way a group is folded, as the sign of the determinant of its equations; 0 where it has surplus ones."""
    if closed.tensions:
        return np.zeros(shape)
    matrix = equations(columns(closed.group, closed.tree, closed.cut))
    return np.broadcast_to(np.linalg.slogdet(matrix)[0], shape)


def _refolded(sign: Any, coarse: Any) -> Any:
    """Whether positions between two others that are folded alike are folded the other way."""
    below = np.minimum(np.searchsorted(coarse, np.arange(sign.shape[-1]), side="right") - 1, len(coarse) - 2)
    low, high = sign[..., coarse[below]], sign[..., coarse[below + 1]]
    return (low == high) & (sign * low < 0)


def _interpolate(coarse: Any, walked: Any, count: int) -> Any:
    """Linear between the coarse positions."""
    place = np.interp(np.arange(count), coarse, np.arange(len(coarse)))
    below = np.minimum(place.astype(int), len(coarse) - 2)
    part = place - below
    return walked[..., below] * (1 - part) + walked[..., below + 1] * part


def _at(placed: Placement, positions: slice, shape: tuple[int, ...]) -> Placement:
    """The same placement at a few positions."""

    def cut(value: Columns) -> Columns:
        return np.broadcast_to(value, shape)[..., positions] if np.ndim(value) else value

    origin, direction = ([cut(value) for value in values] for values in (placed.origin, placed.direction))
    return Placement(placed.mechanism, placed.drive[..., positions], origin, direction)


def require_closed(placed: Placement, group: Group) -> None:
    """Make a driven group nan where surplus joints do not fit."""
    if not group.cut:
        return
    size = sum(
        np.abs(point_of(placed, joint.child, joint.at_child) - placed.origin[joint.child]) for joint in group.cut
    )
    for joint in group.cut:
        open_ = np.abs(gap_of(placed, joint)) > FITS * (1.0 + size)
        lost = np.where(open_, np.nan, 0.0)
        placed.origin[joint.child] = placed.origin[joint.child] + lost


def _hung(placed: Placement, group: Group, coordinates: Any) -> Closure:
    """The group with its links placed by the coordinates of the free joints."""
    free = iter(coordinates)
    for joint in group.tree:
        placed.hang(joint, placed.coordinate(joint) if joint.moved else next(free))
    tree, cut = (tuple(joint_place(placed, joint) for joint in joints) for joints in (group.tree, group.cut))
    return closure(group, tree, cut)


def _round_off(placed: Placement, joint: Joint) -> Columns:
    """What a gap may come to by round-off alone."""
    ends = ((joint.child, joint.at_child), (joint.parent, joint.at_parent))
    size = sum(np.abs(placed.origin[link]) + np.abs(local) for link, local in ends)
    return ROUND_OFF * (size if joint.slider is None else size + 1.0)


def _newton(placed: Placement, group: Group, coordinates: Any) -> Any:
    """Coordinates of the free joints that close the group; nan where none are found."""
    sense = np.array([group.tree[number].sense for number in group.free]).reshape(-1, *[1] * (coordinates.ndim - 1))
    done = np.zeros(coordinates.shape[1:], bool)
    before: Any = np.inf
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            closed = _hung(placed, group, coordinates)
            gaps = [gap_of(placed, place.joint) for place in closed.cut]
            step = -np.stack([sum((row[c] * gap).imag for c, gap in enumerate(gaps)) for row in closed.duals])
            coordinates = coordinates + sense * step
            settled = np.all(np.abs(step) < TOLERANCE * (1 + np.abs(coordinates)), axis=0)
            # Near a singular position round-off in the gaps keeps the steps from vanishing: there is no better place.
            length = np.abs(step).max(axis=0)
            shut = [np.abs(gap) <= _round_off(placed, place.joint) for gap, place in zip(gaps, closed.cut, strict=True)]
            settled |= np.all(shut, axis=0) & (length > before / 4)
            before = length
            if closed.tensions:
                size = np.abs([np.abs(entry) for column in columns(group, closed.tree, closed.cut) for entry in column])
                settled &= np.abs(gaps).max(axis=0) <= FITS * size.max(axis=0)
            done = done | settled
            if np.all(done | ~np.isfinite(coordinates).all(axis=0)):
                break
    return np.where(done, coordinates, np.nan)


def _sine(closed: Closure) -> Columns:
    """Smallest singular value of the loop equations, every free joint scaled to unit effect.

    For a dyad that closes at a pin it lies between |s| and |s|/sqrt(2), s the sine at which the links meet. Rotations
    at closing sliders count as the displacement they make at the longest arm, so that no unit of length comes in.
    """
    table = columns(closed.group, closed.tree, closed.cut)
    effect = np.array(np.broadcast_arrays(*(entry for column in table for entry in column)), complex)
    effect = effect.reshape(len(table), -1, *effect.shape[1:])
    turning = [closed.tree[number].along is None for number in closed.group.free]
    sliding = np.array([place.along is not None for place in closed.cut])
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
