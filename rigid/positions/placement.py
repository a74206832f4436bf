"""Where the links placed so far are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid.closure import Columns, JointPlace
from rigid.mechanism import Mechanism
from rigid.plane import dot, unit
from rigid.positions.drawing import Drawing
from rigid.positions.dyads import ROUND_OFF
from rigid.topology.structure import Joint

if TYPE_CHECKING:
    from rigid.postures import Posture

TURNS = 8  # of a gear's driver either way, that a posture is compared with


@dataclass(eq=False)
class Placement:
    """Links placed so far: origins [m] and unit vectors of their axes, per link, shape (..., positions)."""

    mechanism: Mechanism
    drive: Any
    origin: list[Columns]
    direction: list[Columns]
    sine: list[Columns] = field(default_factory=list)  # of every group but the driven links
    slack: Columns = ROUND_OFF  # how far below zero the square of a sine is still zero
    near: Posture | None = None  # as for `motion`
    shape: tuple[int, ...] = ()  # of the columns
    led: dict[Any, Any] = field(default_factory=dict)  # about where the joints are that drive gears [rad]
    seen: dict[Any, Any] = field(default_factory=dict)  # and where they are

    def point(self, link: int, local: Any) -> Columns:
        """Place of a point given in a link's axes."""
        return self.origin[link] + carried(self.direction[link], local)

    def joint(self, joint: Joint) -> JointPlace:
        """A joint of two placed links."""
        parent, child = joint.parent, joint.child
        arm_parent = carried(self.direction[parent], joint.at_parent)
        arm_child = carried(self.direction[child], joint.at_child)
        if joint.slider is None:
            return JointPlace(joint, arm_parent, arm_child)
        owner = parent if joint.sense > 0 else child
        if joint.sense > 0:
            arm_parent = self.origin[child] + arm_child - self.origin[parent]
        else:
            arm_child = self.origin[parent] + arm_parent - self.origin[child]
        return JointPlace(joint, arm_parent, arm_child, self.direction[owner] * joint.slider.direction)

    def coordinate(self, joint: Joint) -> Columns:
        """Coordinate of a joint that a drive or a gear moves [rad or m]."""
        if joint.drive is not None:
            return self.drive[joint.drive]
        assert joint.gear is not None
        drawing, driver = Drawing(self.mechanism), joint.gear.driver
        led = self.coordinate(driver) if driver.moved else self._measured(driver, drawing.coordinate(driver))
        found = drawing.coordinate(joint) + joint.gear.ratio * (led - drawing.coordinate(driver))
        if self.near is None or driver.moved or driver.slider is not None or joint.slider is not None:
            return found
        return self._nearest(joint, found, 2 * np.pi * joint.gear.ratio)

    def _nearest(self, joint: Joint, coordinate: Any, turn: float) -> Columns:
        """A follower's angle with that number of its driver's turns that puts it nearest to a posture."""
        assert self.near is not None
        seen = self.near.direction[joint.child] * np.conj(self.direction[joint.parent])
        angles = [coordinate + turn * count for count in sorted(range(-TURNS, TURNS + 1), key=abs)]
        away = np.array([np.abs(unit(joint.sense * angle) - seen) for angle in angles])
        return np.choose(np.argmin(np.round(away, 9), axis=0), angles)

    def _measured(self, joint: Joint, near: float) -> Columns:
        """Coordinate of a placed joint: an angle without jumps from one position to the next, or a slide."""
        parent, child = joint.parent, joint.child
        if joint.slider is None:
            turned = np.angle(self.direction[child] * np.conj(self.direction[parent]))
            key = (joint.name, parent, child)
            expected = self.led.get(key)
            if expected is not None and np.isfinite(expected).any():
                self.seen[key] = turned + 2 * np.pi * np.round((expected - turned) / (2 * np.pi))
                return self.seen[key]
            whole = np.unwrap(np.atleast_1d(turned), axis=-1)
            return whole + 2 * np.pi * np.round((near - whole[..., :1]) / (2 * np.pi))
        opened = self.point(child, joint.at_child) - self.point(parent, joint.at_parent)
        return dot(self.direction[parent] * joint.slider.direction, opened)

    def hang(self, joint: Joint, coordinate: Columns) -> None:
        """Place a joint's child: `coordinate` is the angle from the parent [rad], or the slide [m]."""
        parent, child = joint.parent, joint.child
        slide: Columns = 0.0
        if joint.slider is None:
            self.direction[child] = self.direction[parent] * unit(joint.sense * coordinate)
        else:
            self.direction[child] = beside(joint, self.direction[parent])
            slide = (
                joint.sense
                * coordinate
                * (self.direction[parent if joint.sense > 0 else child] * joint.slider.direction)
            )
        at_parent = self.point(parent, joint.at_parent)
        self.origin[child] = at_parent - carried(self.direction[child], joint.at_child) + slide


def carried(direction: Columns, local: Any) -> Columns:
    """A vector of a link's axes in the ground's; 0.0 for the origin."""
    return 0.0 if isinstance(local, (int, float, complex)) and local == 0 else direction * local


def beside(joint: Joint, direction: Columns) -> Columns:
    """Direction of a slider's child from that of its parent."""
    assert joint.slider is not None
    turn = joint.slider.turn
    return direction * (turn if joint.sense > 0 else np.conj(turn))
