"""Displacements of rigid links that open the joints by given gaps: velocities, accelerations, elastic compatibility."""

from collections.abc import Mapping, Sequence

from rigid.arrays import Columns
from rigid.closures.closure import Closure, reach_from
from rigid.closures.gears import gear_input, rack_arm
from rigid.joints import Joint, JointPlace
from rigid.plane import ZERO, imaginary

Openings = list[list[tuple[Columns, Columns]]]
"""Opening of each cut joint of each group before the free joints move: displacement (complex) and rotation."""


def displacements(
    closures: Sequence[Closure],
    gaps: Sequence[Columns],
    turns: Sequence[Columns],
    turning: Sequence[Columns],
    flank: Mapping[int, Columns] | None = None,
) -> tuple[list[Columns], list[Columns], Openings]:
    """Displace and rotate every link so that the joints open by given gaps.

    Parameters
    ----------
    closures
        Placed groups in the order of solution.
    gaps, turns
        For each joint of `Structure.joints`: displacement (complex) and rotation of the child relative to the parent.
        Components that the joint leaves free are ignored.
    turning
        Initial value of a complex factor for each link. The factor times a vector on the link is the displacement of
        the end of this vector relative to its start. For small displacements, the factor is i times the rotation, and
        the initial value is ZERO. For accelerations, the factor is i eps - w^2, and the initial value is -w^2.
    flank
        Loaded flanks of gear teeth (see `JointForces`). If given, the teeth stay in contact for any gaps. Otherwise
        the gear ratios apply, as in a motion without gaps.

    Returns
    -------
    Displacements (complex) and `turning` of all links, each of shape (..., positions), ZERO for the ground; and the
    openings of the cut joints. The imaginary part of `turning` is the rotation.
    """
    shift: list[Columns] = [ZERO] * len(turning)
    turning = list(turning)
    openings: Openings = []
    number = 0
    for closed in closures:
        for hinge in closed.tree:
            joint = hinge.joint
            parent, child = joint.parent, joint.child
            if joint.moved or not hinge.turns:
                turning[child] = turning[child] + imaginary(turning[parent].imag + turns[number])
            at_joint = _moved(shift, turning, parent, hinge.arm_parent) + gaps[number]
            if joint.gear is not None and closed.group.loop is None:
                moved = shift, turning, at_joint
                gap, turn = hinge.driven(_gear_input(hinge, *moved, None if flank is None else flank.get(number)))
                at_joint, turning[child] = at_joint + gap, turning[child] + imaginary(turn)
            shift[child] = at_joint - turning[child] * hinge.arm_child
            number += 1
        if closed.group.loop is not None:
            _release_gears(closed, number - len(closed.tree), shift, turning, flank)
        lacking = []
        for closing in closed.cut:
            lacking.append(_residual(closing, shift, turning, gaps[number], turns[number]))
            number += 1
        number += len(closed.rings)
        openings.append(lacking)
        residuals = [closing.row(*opening) for closing, opening in zip(closed.cut, lacking, strict=True)]
        _release(closed, residuals, shift, turning)
    return shift, turning, openings


def _gear_input(
    place: JointPlace, shift: list[Columns], turning: list[Columns], at_joint: Columns, flank: Columns | None
) -> Columns:
    """Return the motion that a gear imposes on its follower.

    `at_joint` is the displacement of the child at the joint without this motion.
    """

    def moved(joint: Joint, link: int) -> tuple[Columns, Columns]:
        if joint is place.joint:
            moved_here = at_joint if link == joint.child else _moved(shift, turning, link, place.arm_parent)
            return moved_here, turning[link].imag
        arm = rack_arm(joint) if place.teeth is None or flank is None else place.teeth.arm - place.teeth.reach_body
        return _moved(shift, turning, link, arm), turning[link].imag

    return gear_input(place, moved, flank)


def _moved(shift: list[Columns], turning: list[Columns], link: int, arm: Columns) -> Columns:
    """Return the displacement of the end of a link's arm."""
    return shift[link] + turning[link] * arm


def _residual(
    closing: JointPlace, shift: list[Columns], turning: list[Columns], gap: Columns, turn: Columns
) -> tuple[Columns, Columns]:
    """Return the opening of a cut joint: required minus actual displacement, and rotation (ZERO at a pin)."""
    parent, child = closing.joint.parent, closing.joint.child
    opened = _moved(shift, turning, child, closing.arm_child) - _moved(shift, turning, parent, closing.arm_parent)
    if closing.turns:
        return gap - opened, ZERO
    return gap - opened, turn - (turning[child].imag - turning[parent].imag)


def _release(closed: Closure, residuals: Sequence[Columns], shift: list[Columns], turning: list[Columns]) -> None:
    """Move the free tree joints so that the cut joints close."""
    for k, number in enumerate(closed.group.free):
        hinge = closed.tree[number]
        rotation: Columns = ZERO  # i times the motion along the joint coordinate
        for c, residual in enumerate(residuals):
            rotation = rotation + closed.duals[k, c] * residual
        if hinge.turns and rotation.ndim:
            rotation.real[...] = 0.0
        elif hinge.turns:
            rotation = imaginary(rotation.imag)
        _carry(closed, hinge, closed.group.carried[k], rotation, shift, turning)


def _release_gears(
    closed: Closure, first: int, shift: list[Columns], turning: list[Columns], flank: Mapping[int, Columns] | None
) -> None:
    """Move the followers of mutually driving gears. `first` is the index of the group's first tree joint."""
    loop = closed.group.loop
    assert loop is not None
    given = []
    for number in loop.followers:
        hinge = closed.tree[number]
        at_joint = _moved(shift, turning, hinge.joint.child, hinge.arm_child)
        own_flank = None if flank is None else flank.get(first + number)
        given.append(_gear_input(hinge, shift, turning, at_joint, own_flank))
    for row, number, carried in zip(loop.release, loop.followers, loop.carried, strict=True):
        moved = sum((share * each for share, each in zip(row, given, strict=True)), start=ZERO)
        _carry(closed, closed.tree[number], carried, imaginary(moved), shift, turning)


def _carry(
    closed: Closure,
    hinge: JointPlace,
    carried: Sequence[tuple[int, tuple[int, ...]]],
    rotation: Columns,
    shift: list[Columns],
    turning: list[Columns],
) -> None:
    """Move the links that a tree joint carries. The imaginary part of `rotation` is the joint motion."""
    for link, chain in carried:
        if hinge.turns:
            shift[link] = shift[link] - rotation * reach_from(closed, chain)
            turning[link] = turning[link] + rotation
        else:
            shift[link] = shift[link] + rotation.imag * hinge.along
