"""Constraints between bodies: welds, pins, sliders, locked drives and gears."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic import JointCompliance
from fem_check.linear.frame import Frame, FramePlace, Side, parts_on
from fem_check.linear.meshes import Flanks, tooth_forces
from fem_check.pins import gap_sense, pins
from rigid import Mechanism, PinDrive, SliderDrive, structure
from rigid.arrays import Columns

Part = tuple[FramePlace | None, Any, Any]
"""Place (None for the ground), and force, complex, and moment on it due to a unit multiplier of the row."""
Sides = tuple[Side, FramePlace | None]


@dataclass(frozen=True, eq=False)
class Row:
    """Scalar constraint on displacements.

    The work of a unit multiplier, i.e. the sum of force or moment times displacement over the parts, equals
    `wanted` - `soft` * multiplier. The child is the first part. If `turns` is True, the row constrains an angle by a
    moment [N m], otherwise a displacement by a force [N].
    """

    parts: tuple[Part, ...]
    turns: bool = False
    soft: float = 0.0
    wanted: Columns = 0.0


@dataclass(frozen=True, eq=False)
class Tie:
    """Constraints of a weld, joint, drive or gear.

    `drive` is the index of a drive, and `gear` the index of a gear with teeth.
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
        Loaded flanks of gear teeth. A missing gear has the flank 0.

    Raises
    ------
    ValueError
        If a joint name is unknown or ambiguous.
    """
    mechanism = frame.motion.mechanism
    _require_joints(mechanism, joints)
    for (_, point), (hub, *others) in frame.ends.items():
        yield from (Tie(point, (*_held((hub, other)), _not_turned((hub, other)))) for other in others)

    def soft(name: str, ends: tuple[int, int], rows: tuple[Row, ...]) -> tuple[Row, ...]:
        return _softened(mechanism, joints.get(name), name, ends, rows)

    for point, parent, child, welded in pins(mechanism):
        sides = frame.place(parent, point), frame.place(child, point)
        rows = (*_held(sides), _not_turned(sides)) if welded is not None else _held(sides)
        yield Tie(point, soft(point, (parent, child), rows))
    for slider in mechanism.sliders:
        ends = mechanism.index[slider.on], mechanism.index[slider.link]
        across = _moved(frame.sides[slider.name], 1j * frame.along(slider))
        yield Tie(slider.name, soft(slider.name, ends, (across, _not_turned(frame.sides[slider.name]))))
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


def _moved(sides: Sides, direction: Columns) -> Row:
    """Return the constraint that prevents displacement of the child relative to the parent along a unit vector."""
    parent, child = sides
    return Row(((child, direction, 0.0), *parts_on(parent, -direction, 0.0)))


def _held(sides: Sides) -> tuple[Row, Row]:
    return _moved(sides, 1.0), _moved(sides, 1j)


def _not_turned(sides: Sides) -> Row:
    parent, child = sides
    return Row(((child, 0.0, 1.0), *parts_on(parent, 0.0, -1.0)), turns=True)


def _coordinate(frame: Frame, drive: PinDrive | SliderDrive) -> tuple[str, tuple[int, int], Row]:
    """Return the name, the links and the constraint row of the coordinate of a drive or gear."""
    mechanism = frame.motion.mechanism
    name, (parent, child) = drive.joint, mechanism.ends(drive)
    if drive.turns:
        return name, (parent, child), _not_turned((frame.place(parent, name), frame.place(child, name)))
    return name, (parent, child), _moved(frame.sides[name], frame.along(mechanism.slider(name)))


def _require_joints(mechanism: Mechanism, joints: Mapping[str, JointCompliance]) -> None:
    """Raise ValueError if a joint name is unknown or ambiguous."""
    names = [joint.name for joint in structure(mechanism).joints]
    for name in joints:
        count = names.count(name)
        if count != 1:
            meant = f'{count} joints are named "{name}"' if count else f'no joint is named "{name}"'
            raise ValueError(f"joint compliance or misfit: {meant}")


def _softened(
    mechanism: Mechanism, compliance: JointCompliance | None, name: str, ends: tuple[int, int], rows: tuple[Row, ...]
) -> tuple[Row, ...]:
    """Apply the compliance and misfit of a joint to its rows."""
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
