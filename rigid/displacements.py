"""Displacements of all links that open the joints by given gaps: velocities, accelerations, elastic compatibility."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigid.closure import Closure, Columns, JointPlace, reach_from
from rigid.conditioning import Asked, asked_turn
from rigid.plane import dot, imaginary, minus, plus, product, times


def displacements(
    closures: Sequence[Closure],
    gaps: Sequence[Columns],
    turns: Sequence[Columns],
    turning: list[Columns],
    asked: Asked | None = None,
) -> tuple[list[Columns], list[Columns]]:
    """Displacement of every link's origin, and its rotation, so that the joints open by given gaps.

    Parameters
    ----------
    closures
        The placed groups, in the order of solution.
    gaps, turns
        Per joint, in the order of `Structure.joints`: displacement of the child's point from the parent's, complex, and
        rotation of the child from the parent; a component that the joint leaves free is ignored.
    turning
        Per link, what multiplies an arm to give the displacement of its end. For small displacements i times the
        rotation: all 0.0 at the start. For accelerations i eps - w^2, so that it starts as -w^2.
    asked
        Where it is given, what the openings could ask of every group at worst is added to it.

    Returns
    -------
    Two lists over the links, shape (..., positions): complex displacements, and turning with the rotations found in its
    imaginary part. 0.0 for the ground.
    """
    shift: list[Columns] = [0.0] * len(turning)
    turning = list(turning)
    number = 0
    for closed in closures:
        for hinge in closed.tree:
            parent, child = hinge.joint.parent, hinge.joint.child
            if hinge.along is not None or hinge.joint.moved:
                turned = turns[number] if is_still(turning[parent]) else plus(turning[parent].imag, turns[number])
                turning[child] = plus(turning[child], imaginary(turned))
            at_joint = plus(_moved(shift, turning, parent, hinge.arm_parent), gaps[number])
            if hinge.joint.gear is not None:
                led = _led(hinge, shift, turning)
                at_joint = at_joint if hinge.along is None else plus(at_joint, times(led, hinge.along))
                turning[child] = turning[child] if hinge.along is not None else plus(turning[child], imaginary(led))
            shift[child] = minus(at_joint, product(turning[child], hinge.arm_child))
            number += 1
        openings = []
        for closing in closed.cut:
            openings.append(_missing(closing, shift, turning, gaps[number], turns[number]))
            number += 1
        if asked is not None:
            asked.append(asked_turn(closed, openings))
        residuals = [closing.row(*opening) for closing, opening in zip(closed.cut, openings, strict=True)]
        _release(closed, residuals, shift, turning)
    return shift, turning


def is_still(turning: Columns) -> bool:
    """Whether a link does not turn at any position."""
    return isinstance(turning, float)


def _led(hinge: JointPlace, shift: list[Columns], turning: list[Columns]) -> Columns:
    """What a gear moves its follower by, the child from the parent."""
    gear, sense = hinge.joint.gear, hinge.joint.sense
    assert gear is not None
    on, link = gear.ends
    if gear.driver.slider is None:
        return sense * gear.ratio * minus(np.imag(turning[link]), np.imag(turning[on]))
    slider = gear.driver.slider
    moved = _moved(shift, turning, link, slider.turn * gear.driver.at_child)
    return sense * gear.ratio * dot(slider.direction, moved)


def _moved(shift: list[Columns], turning: list[Columns], link: int, arm: Columns) -> Columns:
    """Displacement of the end of an arm of a link."""
    return plus(shift[link], product(turning[link], arm))


def _missing(
    closing: JointPlace, shift: list[Columns], turning: list[Columns], gap: Columns, turn: Columns
) -> tuple[Columns, Columns]:
    """What a cut joint still lacks to its gap: displacement, and rotation where it holds one."""
    parent, child = closing.joint.parent, closing.joint.child
    opened = minus(_moved(shift, turning, child, closing.arm_child), _moved(shift, turning, parent, closing.arm_parent))
    if closing.along is None:
        return minus(gap, opened), 0.0
    turned = minus(np.imag(turning[child]), np.imag(turning[parent]))
    return minus(gap, opened), minus(turn, turned)


def _release(closed: Closure, residuals: Sequence[Columns], shift: list[Columns], turning: list[Columns]) -> None:
    """Let the free tree joints take the coordinates that close the cut ones."""
    for k, number in enumerate(closed.group.free):
        hinge = closed.tree[number]
        spin: Columns = 0.0
        for c, residual in enumerate(residuals):
            spin = plus(spin, product(closed.duals[k, c], residual))
        if hinge.along is None and np.ndim(spin):
            spin.real[...] = 0.0
        elif hinge.along is None:
            spin = imaginary(np.imag(spin))
        for link, chain in closed.group.carried[k]:
            if hinge.along is not None:
                shift[link] = plus(shift[link], times(np.imag(spin), hinge.along))
            else:
                shift[link] = minus(shift[link], product(spin, reach_from(closed, chain)))
                turning[link] = plus(turning[link], spin)
