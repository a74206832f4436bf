"""Constraints between bodies: welds, pins, sliders, locked drives and gears."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import JointCompliance
from fem_check.linear.frame import Frame, FramePlace, Side, parts_on
from fem_check.linear.meshes import Flanks, tooth_forces
from fem_check.pins import gap_sense, pins
from rigid import Mechanism, PinDrive, SliderDrive, structure
from rigid.arrays import Columns

Part = tuple[FramePlace | None, Any, Any]
"""Place (None for the ground), and force (complex) and moment on it due to a unit multiplier of the constraint."""
Sides = tuple[Side, FramePlace | None]
"""Locations of a joint on the parent and on the child."""


class Row(Struct, frozen=True, eq=False):
    """Scalar constraint on displacements.

    The constraint requires that the work of a unit multiplier equals `misfit` - `compliance` * multiplier. This work is
    the sum of force times displacement and moment times rotation over all parts.

    Attributes
    ----------
    parts
        Forces and moments of a unit multiplier. The first part acts on the child.
    turns
        True if the constraint fixes an angle by a moment [N m], False if it fixes a displacement by a force [N].
    compliance
        Compliance of the joint [m/N or rad/(N m)].
    misfit
        Unloaded displacement [m] or rotation [rad] of the child relative to the parent.
    """

    parts: tuple[Part, ...]
    turns: bool = False
    compliance: float = 0.0
    misfit: Columns = 0.0


class Tie(Struct, frozen=True, eq=False):
    """Constraints of a weld, joint, drive or gear.

    `rows` are the scalar constraints. `drive` is the index of the drive, and `gear` the index of the gear if it has
    teeth; otherwise they are None.
    """

    name: str
    rows: tuple[Row, ...]
    drive: int | None = None
    gear: int | None = None


def ties(frame: Frame, joints: Mapping[str, JointCompliance], flanks: Flanks) -> Iterator[Tie]:
    """Yield all constraints: welds of beams, pins, sliders, locked drives and gears.

    Parameters
    ----------
    joints
        Compliance and misfit of joints, by name.
    flanks
        Loaded flanks of gear teeth, by gear index; 0 (no flank) for missing gears.

    Raises
    ------
    ValueError
        If a joint name is unknown or ambiguous.
    """
    mechanism = frame.motion.mechanism
    _require_joints(mechanism, joints)
    for (_, point), (hub, *others) in frame.ends.items():
        yield from (Tie(point, (*_no_displacement((hub, other)), _no_rotation((hub, other)))) for other in others)

    def soft(name: str, ends: tuple[int, int], rows: tuple[Row, ...]) -> tuple[Row, ...]:
        return _with_compliance(mechanism, joints.get(name), name, ends, rows)

    for point, parent, child, welded in pins(mechanism):
        sides = frame.place(parent, point), frame.place(child, point)
        rows = (*_no_displacement(sides), _no_rotation(sides)) if welded is not None else _no_displacement(sides)
        yield Tie(point, soft(point, (parent, child), rows))
    for slider in mechanism.sliders:
        ends = mechanism.index[slider.on], mechanism.index[slider.link]
        across = _no_displacement_along(frame.sides[slider.name], 1j * frame.along(slider))
        yield Tie(slider.name, soft(slider.name, ends, (across, _no_rotation(frame.sides[slider.name]))))
    for number, drive in enumerate(mechanism.drives):
        name, ends, row = _coordinate(frame, drive)
        yield Tie(name, soft(name, ends, (row,)), number)
    for number, gear in enumerate(mechanism.gears):
        name, ends, row = _coordinate(frame, gear.follower)
        (made,) = soft(name, ends, (row,))
        parts = tooth_forces(frame, gear, flanks.get(number, 0.0))
        if parts is None:
            _, _, led = _coordinate(frame, gear.driver)
            driven = tuple((place, -gear.ratio * force, -gear.ratio * moment) for place, force, moment in led.parts)
            yield Tie(name, (replace(made, parts=row.parts + driven),))
        else:
            yield Tie(name, (replace(made, parts=parts),), gear=number)


def _no_displacement_along(sides: Sides, direction: Columns) -> Row:
    """Return the constraint on the displacement of the child relative to the parent along a unit vector."""
    parent, child = sides
    return Row(((child, direction, 0.0), *parts_on(parent, -direction, 0.0)))


def _no_displacement(sides: Sides) -> tuple[Row, Row]:
    return _no_displacement_along(sides, 1.0), _no_displacement_along(sides, 1j)


def _no_rotation(sides: Sides) -> Row:
    parent, child = sides
    return Row(((child, 0.0, 1.0), *parts_on(parent, 0.0, -1.0)), turns=True)


def _coordinate(frame: Frame, drive: PinDrive | SliderDrive) -> tuple[str, tuple[int, int], Row]:
    """Return the name, the links and the constraint row of the coordinate of a drive or gear."""
    mechanism = frame.motion.mechanism
    name, (parent, child) = drive.joint, mechanism.ends(drive)
    if drive.turns:
        return name, (parent, child), _no_rotation((frame.place(parent, name), frame.place(child, name)))
    return name, (parent, child), _no_displacement_along(frame.sides[name], frame.along(mechanism.slider(name)))


def _require_joints(mechanism: Mechanism, joints: Mapping[str, JointCompliance]) -> None:
    """Raise ValueError if a joint name is unknown or ambiguous."""
    names = [joint.name for joint in structure(mechanism).joints]
    for name in joints:
        count = names.count(name)
        if count != 1:
            meant = f'{count} joints are named "{name}"' if count else f'no joint is named "{name}"'
            raise ValueError(f"joint compliance or misfit: {meant}")


def _with_compliance(
    mechanism: Mechanism, compliance: JointCompliance | None, name: str, ends: tuple[int, int], rows: tuple[Row, ...]
) -> tuple[Row, ...]:
    """Return the constraints of a joint with its compliance and misfit."""
    if compliance is None:
        return rows
    sense = gap_sense(mechanism, name, *ends)
    changed = []
    for row in rows:
        soft, wanted = (
            (compliance.rotation, compliance.turn)
            if row.turns
            else (compliance.translation, np.real(np.conj(row.parts[0][1]) * compliance.gap))
        )
        changed.append(Row(row.parts, row.turns, soft, sense * wanted))
    return tuple(changed)
