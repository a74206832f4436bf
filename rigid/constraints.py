"""All joints of a mechanism as one set of conditions on the coordinates (x, y, angle) of all moving links.

An independent way to what the groups answer one after the other: nothing here knows of groups, dyads or an order.
Derivation: docs/dynamics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigid.mechanism import Mechanism
from rigid.structure import Joint
from rigid.tables import per_row


@dataclass(frozen=True, eq=False)
class JointTable:
    """All joints of a mechanism; arrays of shape (joints, ..., 1) that broadcast against (joints, ..., positions).

    The owner of a slider is the link with the line, the block the link that slides; of a pin, its parent and child.

    Attributes
    ----------
    joints
        In the order of `Structure.joints`.
    owner, block
        Numbers of the links, shape (joints,).
    foot, tip
        The joint's point in the axes of the owner and of the block [m], complex.
    along
        Unit vector of a slider's line in the axes of the owner; 1 for a pin.
    turn
        Angle of the block's axes from the owner's in a slider [rad]; 0 for a pin.
    slides
        Whether it is a slider, shape (joints, 1, ...).
    driven
        Numbers of the joints that the drives move, in the order of the drives.
    sense
        Of the driven joints: what multiplies the block's turning or sliding on the owner to give the coordinate.
    """

    joints: tuple[Joint, ...]
    owner: Any
    block: Any
    foot: Any
    tip: Any
    along: Any
    turn: Any
    slides: Any
    driven: Any
    sense: Any


@lru_cache(maxsize=64)
def joint_table(mechanism: Mechanism, ndim: int) -> JointTable:
    """Joints of a mechanism for columns of `ndim` axes."""
    joints = mechanism.structure.joints
    upright = [joint.slider is None or joint.sense > 0 for joint in joints]
    ends = [
        ((joint.parent, joint.at_parent), (joint.child, joint.at_child))[:: 1 if kept else -1]
        for joint, kept in zip(joints, upright, strict=True)
    ]
    sliders = [joint.slider for joint in joints]
    moved = {joint.drive: number for number, joint in enumerate(joints) if joint.drive is not None}
    driven = [moved[drive] for drive in range(len(moved))]
    return JointTable(
        joints,
        np.array([owner for (owner, _), _ in ends]),
        np.array([block for _, (block, _) in ends]),
        per_row([foot for (_, foot), _ in ends], ndim, complex),
        per_row([tip for _, (_, tip) in ends], ndim, complex),
        per_row([slider.direction if slider else 1.0 for slider in sliders], ndim, complex),
        per_row([np.angle(slider.turn) if slider else 0.0 for slider in sliders], ndim, float),
        np.array([slider is not None for slider in sliders]).reshape(-1, *[1] * ndim),
        np.array(driven, int),
        np.array([1.0 if sliders[k] else float(joints[k].sense) for k in driven]),
    )


@dataclass(frozen=True, eq=False)
class Conditions:
    """The joints where the links are.

    Attributes
    ----------
    toward
        What multiplies a vector to give its components along and across a slider's line, those in x and y at a pin;
        complex, shape (joints, ..., positions).
    way
        From the owner's origin to the block's point [m], complex.
    foot, tip
        From the owner's origin to its point, from the block's origin to its point [m], complex.
    """

    table: JointTable
    toward: Any
    way: Any
    foot: Any
    tip: Any

    @property
    def opening(self) -> Any:
        """How far the block's point is from the owner's [m], complex: (along, across), (x, y) at a pin."""
        return self.toward * (self.way - self.foot)


def conditions(table: JointTable, origin: Any, direction: Any) -> Conditions:
    """The joints of links at given origins [m] with given unit vectors, complex, shape (links, ..., positions)."""
    owner, block = table.owner, table.block
    tip = direction[block] * table.tip
    toward = np.where(table.slides, np.conj(direction[owner] * table.along), 1.0)
    return Conditions(table, toward, origin[block] + tip - origin[owner], direction[owner] * table.foot, tip)


def constraint_matrix(here: Conditions, links: int) -> Any:
    """Rates of all conditions per rate of (x, y, angle) of every moving link, shape (..., positions, 3 n, 3 n).

    Rows: two of every joint, (x, y) of a pin, (rotation, across) of a slider; then one of every drive.
    """
    table = here.table
    count, shape = len(table.joints), here.way.shape[1:]
    matrix = np.zeros((*shape, 2 * count + len(table.driven), 3 * links))
    first, second = 2 * np.arange(count), 2 * np.arange(count) + 1
    slides = table.slides.ravel()
    pins, lines = np.flatnonzero(~slides), np.flatnonzero(slides)
    rotating = ((3 * table.block + 2, 1.0), (3 * table.owner + 2, -1.0))
    reach = np.where(table.slides, here.way, here.foot)
    for end, arm, sign in ((table.block, here.tip, 1.0), (table.owner, reach, -1.0)):
        for axis, unit in enumerate((1.0, 1j, 1j * arm)):
            effect = np.moveaxis(sign * unit * here.toward, 0, -1)
            matrix[..., first[pins], 3 * end[pins] + axis] = effect.real[..., pins]
            matrix[..., second, 3 * end + axis] = effect.imag
            for row, (joint, sense) in enumerate(zip(table.driven, table.sense, strict=True), 2 * count):
                if slides[joint]:
                    matrix[..., row, 3 * end[joint] + axis] = effect.real[..., joint] * sense
    for column, sign in rotating:
        matrix[..., first[lines], column[lines]] = sign
        for row, (joint, sense) in enumerate(zip(table.driven, table.sense, strict=True), 2 * count):
            if not slides[joint]:
                matrix[..., row, column[joint]] = sign * sense
    return matrix[..., 3:]


def centripetal(here: Conditions, velocity: Any, spin: Any) -> Any:
    """Second rates of the conditions when no link accelerates, shape (..., positions, 3 n).

    Parameters
    ----------
    velocity, spin
        Of the origins [m/s], complex, and of the links [rad/s], shape (links, ..., positions).
    """
    table = here.table
    owner, block = spin[table.owner], spin[table.block]
    opening = velocity[table.block] + 1j * block * here.tip - velocity[table.owner]
    carried = np.where(table.slides, -2j * owner * opening - owner**2 * here.way, owner**2 * here.foot)
    second = np.moveaxis(here.toward * (carried - block**2 * here.tip), 0, -1)
    slides = table.slides.ravel()
    rows = np.empty((*second.shape[:-1], 2 * second.shape[-1] + len(table.driven)))
    rows[..., 0 : 2 * second.shape[-1] : 2] = np.where(slides, 0.0, second.real)
    rows[..., 1 : 2 * second.shape[-1] : 2] = second.imag
    along = np.where(slides[table.driven], second.real[..., table.driven], 0.0)
    rows[..., 2 * second.shape[-1] :] = along * table.sense
    return rows
