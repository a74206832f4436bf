"""All joints of a mechanism as constraints on the coordinates (x, y, angle) of the moving links.

This formulation does not use groups, dyads or an order of solution. The joint and gear constraints are also implemented
in `rigid.joints` and `rigid.closures`. The duplication is intended: each implementation checks the other. Derivation:
docs/dynamics.md.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from rigid.arrays import Complexes, Flags, Integers, Reals
from rigid.constants import per_row
from rigid.decomposition.order import structure
from rigid.joints import Joint
from rigid.mechanism import Mechanism

# factor of the Jacobian rows of drives, gears and welds: the QR decomposition then keeps these rows, and drops only
# rows of joints as redundant
DRIVE_WEIGHT = 1e6


class ConstraintTable(Struct, frozen=True, eq=False):
    """All joints of a mechanism, as arrays (joints, ..., 1) that broadcast to (joints, ..., positions).

    After the joints, the arrays also contain a row for the driver of each gear. Such a row adds no constraints. Each
    joint connects two links, the owner and the block. For a slider, the owner is the link with the line and the block
    is the sliding link. For a pin, the owner is the parent and the block is the child.

    Attributes
    ----------
    joints
        Joints in the order of `Structure.joints`.
    owner, block
        Link indices, each of shape (joints,).
    foot
        Joint point in the axes of the owner (complex) [m].
    tip
        Joint point in the axes of the block (complex) [m].
    along
        Unit vector of a slider's line in the axes of the owner; 1 for a pin.
    turn
        Fixed angle of the block relative to the owner of a slider or weld [rad]; 0 for a pin.
    slides
        True if the joint is a slider, shape (joints, 1, ...).
    moved
        Joints whose coordinates are prescribed or used by a gear, as indices into the arrays above. The order is:
        joints with drives, followers of gears, welds, drivers of gears.
    shares
        Matrix that multiplies the coordinates of the joints in `moved`, shape (drives + gears + welds, moved). Each
        product is the quantity that one constraint prescribes. The rows are the constraints of the drives, then of
        gears, then of welds. For a gear, the quantity is (follower - ratio * driver), and for a weld, it is the angle.
    steady
        Constant entries of the Jacobian, and 0 for the entries that depend on the posture. The shape is (2 joints +
        moved, 3 links). Each joint has two rows. One row for each joint in `moved` follows. The columns are x, y and
        angle of each link.
    places
        Flat indices in `steady` of the entries that depend on the posture.
    parts
        For each entry of `places`, the index of its value among the derivatives that `constraint_matrix` computes.
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
    """Return the constraint table of a mechanism.

    `ndim` is the number of axes of shape (..., positions) in the arrays of postures.
    """
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
    """Compute `steady`, `places` and `parts` of `ConstraintTable`."""
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
    """Return `ConstraintTable.moved` and `ConstraintTable.shares`.

    `drives` and `gears` are the numbers of drives and gears. The drivers of gears are numbered after the joints.
    """
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


class Constraints(Struct, frozen=True, eq=False):
    """Constraints at a posture.

    Attributes
    ----------
    toward
        Complex factor for each joint, shape (joints, ..., positions). For a slider, multiply a vector by this factor to
        get its component along the slider's line (real part) and across the line (imaginary part). For a pin, the
        factor is 1.
    vector
        Vector from the owner's origin to the joint point of the block (complex) [m].
    foot
        Vector from the owner's origin to the joint point of the owner (complex) [m].
    tip
        Vector from the block's origin to the joint point of the block (complex) [m].
    """

    table: ConstraintTable
    toward: Complexes
    vector: Complexes
    foot: Complexes
    tip: Complexes

    @property
    def opening(self) -> Complexes:
        """Vector from the owner's joint point to the block's joint point (complex) [m], multiplied by `toward`."""
        return self.toward * (self.vector - self.foot)


def constraints_at(table: ConstraintTable, origin: Complexes, direction: Complexes) -> Constraints:
    """Return the constraints for given origins and unit vectors of the links, each of shape (links, ..., positions)."""
    owner, block = table.owner, table.block
    tip, axes = direction[block] * table.tip, direction[owner]
    toward = np.where(table.slides, np.conj(axes * table.along), 1.0)
    return Constraints(table, toward, origin[block] + tip - origin[owner], axes * table.foot, tip)


def constraint_matrix(here: Constraints) -> Reals:
    """Return the constraint Jacobian, shape (..., positions, rows, 3 n).

    The columns are x, y and angle of each of the n moving links. Each joint has two rows. For a pin or weld, they are x
    and y of the gap. For a slider, they are the relative rotation and the displacement across the line. Each drive,
    gear and weld adds one row. There are more rows than columns if the mechanism has redundant constraints.
    """
    table, toward, joints = here.table, here.toward, 2 * here.table.count
    shape, count = here.vector.shape[1:], len(toward)
    effects = np.empty((*shape, 6, count), complex)  # derivatives of `opening`
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
    """Return the second time derivatives of the constraints for zero accelerations of all links.

    The shape is (..., positions, rows), with the rows of `constraint_matrix`.

    Parameters
    ----------
    velocity, omega
        Velocities of the origins (complex) [m/s] and angular velocities [rad/s] of the links, shape (links, ...,
        positions).
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
    """Return the indices of as many independent rows as `matrix` has columns.

    If constraints are redundant, rows of drives, gears and welds are kept in preference to rows of joints.
    """
    if matrix.shape[0] == matrix.shape[1]:
        return np.arange(len(matrix))
    from scipy.linalg import qr

    weight = np.where(np.arange(len(matrix)) < 2 * table.count, 1.0, DRIVE_WEIGHT)
    return np.sort(qr((matrix * weight[:, None]).T, mode="r", pivoting=True)[1][: matrix.shape[1]])


def unwound_angles(table: ConstraintTable, angle: Reals, drive: Reals) -> Reals:
    """Return the angles of all links [rad], shifted by full turns to agree with the drive coordinates `drive`.

    The shape is (links, 1).
    """
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
