"""All joints of a mechanism as constraints on the coordinates (x, y, angle) of the moving links.

This formulation does not use groups, dyads or an order of solution. It implements joint and gear constraints a second
time on purpose, so that the two formulations check each other. Derivation: docs/dynamics.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rigid.arrays import Complexes, Flags, Integers, Reals
from rigid.constants import per_row
from rigid.decomposition.order import structure
from rigid.joints import Joint
from rigid.mechanism import Mechanism

DRIVE_WEIGHT = 1e6  # weight of the rows of drives, so that they are chosen as independent rows


@dataclass(frozen=True, eq=False)
class ConstraintTable:
    """All joints of a mechanism, as arrays (joints, ..., 1) that broadcast to (joints, ..., positions).

    The joints are followed by the pairs of links whose relative coordinates drive gears, which add no constraints. For
    a slider, the owner is the link with the line and the block is the sliding link. For a pin, they are parent and
    child.

    Attributes
    ----------
    joints
        Joints in the order of `Structure.joints`.
    owner, block
        Link indices, shape (joints,).
    foot, tip
        Joint point in the axes of the owner and in the axes of the block (complex) [m].
    along
        Unit vector of a slider's line in the axes of the owner; 1 for a pin.
    turn
        Fixed angle of the block relative to the owner of a slider or weld [rad]; 0 for a pin.
    slides
        Whether the joint is a slider, shape (joints, 1, ...).
    moved
        Indices of the joints whose coordinates `shares` combines.
    shares
        Coefficients of these coordinates in the constraints, shape (drives + gears + welds, moved). The rows are those
        of drives, then of gears (follower minus ratio times driver), then of the angles of welds.
    steady
        Position-independent part of the rates of all joints, then of the joints in `moved`, per rate of (x, y, angle)
        of each link; shape (2 joints + moved, 3 links).
    places, parts
        Flat indices of the position-dependent entries in the matrix, and indices of the values that
        `constraint_matrix` writes there.
    """

    joints: tuple[Joint, ...]
    owner: Integers
    block: Integers
    foot: Complexes
    tip: Complexes
    along: Complexes
    turn: Reals
    slides: Flags
    moved: Integers
    shares: Reals
    steady: Reals
    places: Integers
    parts: Integers

    @property
    def count(self) -> int:
        """Number of joints."""
        return len(self.joints)


@lru_cache(maxsize=64)
def constraint_table(mechanism: Mechanism, ndim: int) -> ConstraintTable:
    """Return the constraint table of a mechanism for columns of `ndim` axes."""
    joints = structure(mechanism).joints
    drivers = [joint.gear.driver for joint in joints if joint.gear is not None]
    everyone = (*joints, *drivers)
    turned = [not joint.turns and joint.sense < 0 for joint in everyone]
    ends = [
        ((joint.parent, joint.at_parent), (joint.child, joint.at_child))[:: -1 if back else 1]
        for joint, back in zip(everyone, turned, strict=True)
    ]
    moved, shares = _shares(joints, len(mechanism.drives), len(drivers))
    owner, block = (np.array([end[which][0] for end in ends]) for which in (0, 1))
    slides = np.array([not joint.turns for joint in everyone])
    return ConstraintTable(
        joints,
        owner,
        block,
        per_row([foot for (_, foot), _ in ends], ndim, complex),
        per_row([tip for _, (_, tip) in ends], ndim, complex),
        per_row([joint.line for joint in everyone], ndim, complex),
        per_row([np.angle(joint.turned if joint.freedoms else joint.turn) for joint in everyone], ndim, float),
        slides.reshape(-1, *[1] * ndim),
        moved,
        shares,
        *_layout(len(mechanism.links), block, owner, slides, len(joints), moved),
    )


def _layout(
    links: int, block: Integers, owner: Integers, slides: Flags, count: int, moved: Integers
) -> tuple[Reals, Integers, Integers]:
    """Compute `ConstraintTable.steady`, `places` and `parts`."""
    steady = np.zeros((2 * count + len(moved), 3 * links))
    joints = np.arange(count)
    pins, lines = joints[~slides[:count]], joints[slides[:count]]
    turning, sliding = np.flatnonzero(~slides[moved]), np.flatnonzero(slides[moved])
    turned, slid = moved[turning], moved[sliding]
    entries: list[tuple[Integers, Integers, Integers]] = []
    for side, (end, sign) in enumerate(((block, 1.0), (owner, -1.0))):
        for axis in range(3):
            column, first = 3 * end + axis, 2 * (3 * side + axis) * len(slides)
            entries.append((2 * pins, column[pins], first + 2 * pins))
            entries.append((2 * joints + 1, column[joints], first + 2 * joints + 1))
            entries.append((2 * count + sliding, column[slid], first + 2 * slid))
        steady[2 * lines, 3 * end[lines] + 2] = sign
        steady[2 * count + turning, 3 * end[turned] + 2] = sign
    rows, columns, parts = (np.concatenate(each) for each in zip(*entries, strict=True))
    return steady, rows * steady.shape[1] + columns, parts


def _shares(joints: Sequence[Joint], drives: int, gears: int) -> tuple[Integers, Reals]:
    """Return `ConstraintTable.moved` and `shares`. The indices of gear drivers follow those of the joints."""
    followers = [number for number, joint in enumerate(joints) if joint.gear is not None]
    driven = {joint.drive: number for number, joint in enumerate(joints) if joint.drive is not None}
    welds = [number for number, joint in enumerate(joints) if not joint.freedoms]
    moved = [*(driven[drive] for drive in range(drives)), *followers, *welds]
    shares = np.zeros((len(moved), len(moved) + gears))
    for row, number in enumerate(moved):
        shares[row, row] = joints[number].sense if joints[number].turns and joints[number].freedoms else 1.0
    for row, number in enumerate(followers, drives):
        gear = joints[number].gear
        assert gear is not None
        shares[row, len(moved) + row - drives] = -gear.ratio
    return np.array([*moved, *range(len(joints), len(joints) + gears)], int), shares


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints at a posture.

    Attributes
    ----------
    toward
        Complex factor that converts a vector to its components along and across a slider's line, or to x and y at a
        pin, shape (joints, ..., positions).
    vector
        Vector from the owner's origin to the block's point (complex) [m].
    foot, tip
        Vectors from the owner's origin to its point, and from the block's origin to its point (complex) [m].
    """

    table: ConstraintTable
    toward: Complexes
    vector: Complexes
    foot: Complexes
    tip: Complexes

    @property
    def opening(self) -> Complexes:
        """Gap between the joint points (complex) [m]: along + i across a slider's line, or x + i y at a pin."""
        return self.toward * (self.vector - self.foot)


def constraints_at(table: ConstraintTable, origin: Complexes, direction: Complexes) -> Constraints:
    """Return the constraints for given origins [m] and unit vectors of the links, shape (links, ..., positions)."""
    owner, block = table.owner, table.block
    tip, axes = direction[block] * table.tip, direction[owner]
    toward = np.where(table.slides, np.conj(axes * table.along), 1.0)
    return Constraints(table, toward, origin[block] + tip - origin[owner], axes * table.foot, tip)


def constraint_matrix(here: Constraints) -> Reals:
    """Return the constraint Jacobian with respect to (x, y, angle) of moving links, (..., positions, rows, 3 n).

    Each joint has two rows: (x, y) of a pin or (rotation, across) of a slider. Each drive, gear and weld adds one row.
    There are more rows than columns if the mechanism has redundant constraints.
    """
    table, toward, joints = here.table, here.toward, 2 * here.table.count
    shape, count = here.vector.shape[1:], len(toward)
    effects = np.empty((*shape, 6, count), complex)  # effects of (x, y, angle) of block and owner on the gap
    first = effects[..., 0, :] = _last(toward)
    effects[..., 1, :] = 1j * first
    effects[..., 2, :] = _last(1j * here.tip * toward)
    effects[..., 3:5, :] = -effects[..., :2, :]
    effects[..., 5, :] = _last(-1j * np.where(table.slides, here.vector, here.foot) * toward)
    matrix = np.empty((*shape, *table.steady.shape))
    matrix[...] = table.steady
    numbers = effects.reshape(*shape, -1).view(float)
    matrix.reshape(*shape, -1)[..., table.places] = numbers[..., table.parts]
    rows = joints + len(table.shares)
    matrix[..., joints:rows, :] = table.shares @ matrix[..., joints:, :]
    return matrix[..., :rows, 3:]


def _last(values: Complexes) -> Complexes:
    """Move the first axis to the end (ten times as fast as numpy's `moveaxis`)."""
    return values.transpose(*range(1, values.ndim), 0)


def centripetal(here: Constraints, velocity: Complexes, omega: Reals) -> Reals:
    """Return the second time derivatives of the constraints for zero link accelerations, (..., positions, rows).

    Parameters
    ----------
    velocity, omega
        Velocity of the origins (complex) [m/s] and angular velocity [rad/s], shape (links, ..., positions).
    """
    table, count = here.table, here.table.count
    owner, block = omega[table.owner], omega[table.block]
    opening = velocity[table.block] + 1j * block * here.tip - velocity[table.owner]
    carried = np.where(table.slides, -2j * owner * opening - owner**2 * here.vector, owner**2 * here.foot)
    second = _last(here.toward * (carried - block**2 * here.tip))
    slides = table.slides.ravel()
    rows = np.empty((*second.shape[:-1], 2 * count + len(table.shares)))
    rows[..., 0 : 2 * count : 2] = np.where(slides, 0.0, second.real)[..., :count]
    rows[..., 1 : 2 * count : 2] = second.imag[..., :count]
    rows[..., 2 * count :] = np.where(slides, second.real, 0.0)[..., table.moved] @ table.shares.T
    return rows


def independent_rows(table: ConstraintTable, matrix: Reals) -> Integers:
    """Return the indices of a maximal set of independent rows that includes all drives."""
    if matrix.shape[0] == matrix.shape[1]:
        return np.arange(len(matrix))
    from scipy.linalg import qr

    weight = np.where(np.arange(len(matrix)) < 2 * table.count, 1.0, DRIVE_WEIGHT)
    return np.sort(qr((matrix * weight[:, None]).T, mode="r", pivoting=True)[1][: matrix.shape[1]])


def unwound_angles(table: ConstraintTable, angle: Reals, drive: Reals) -> Reals:
    """Return the angles of all links, with full turns that match the drive coordinates [rad], shape (links, 1)."""
    angle = angle.copy()
    target = table.turn.astype(float).copy()[:, 0]
    driven = table.moved[: len(drive)]
    sense = np.diagonal(table.shares)[: len(drive)]
    target[driven] = np.where(table.slides[driven, 0], target[driven], drive * sense)
    fixed = set(np.flatnonzero(table.slides[:, 0])) | set(driven.tolist())
    fixed |= {number for number, joint in enumerate(table.joints) if not joint.freedoms}
    placed = {0}
    for number, joint in enumerate(table.joints):
        if joint.child in placed:
            continue
        placed.add(joint.child)
        if number in fixed:
            sign = 1.0 if table.block[number] == joint.child else -1.0
            actual = angle[joint.child] - angle[joint.parent]
            angle[joint.child] += 2 * np.pi * np.round((sign * target[number] - actual) / (2 * np.pi))
    return angle
