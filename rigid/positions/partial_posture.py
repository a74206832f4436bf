"""Positions of the links placed so far."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.drawing import Drawing
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.plane import ROUND_OFF, unit
from rigid.postures import Posture

MAX_DRIVER_TURNS = 8  # number of turns of a gear's driver, each way, among which the nearest to a posture is chosen


@dataclass(eq=False)
class PartialPosture:
    """Links placed so far: origins [m] and unit vectors of their axes, one array of shape (..., positions) per link."""

    mechanism: Mechanism
    drive: Reals
    origin: list[Columns]
    direction: list[Columns]
    sine: list[Columns] = field(default_factory=list)  # sine of every group except driven links
    slack: Columns = ROUND_OFF  # squared sines above -slack count as zero
    near: Posture | None = None  # see `motion`
    shape: tuple[int, ...] = ()  # shape of the columns
    led: dict[Any, Reals] = field(default_factory=dict)  # approximate angles of joints that drive gears [rad]
    seen: dict[Any, Any] = field(default_factory=dict)  # their exact angles

    def coordinate(self, joint: Joint) -> Columns:
        """Coordinate of a joint moved by a drive or a gear [rad or m]; 0 for a weld."""
        if joint.drive is not None:
            return self.drive[joint.drive]
        if joint.gear is None:
            return 0.0
        drawing = Drawing(self.mechanism)
        followed: Columns = drawing.coordinate(joint)
        turns = []
        for ratio, driver in joint.gear.sources:
            drawn = drawing.coordinate(driver)
            now = self.coordinate(driver) if driver.moved else self._measured(driver, drawn)
            # the driver's coordinate may have the opposite sense in the gear
            followed = followed + ratio * driver.sense * (now - drawn)
            if joint.turns and driver.turns and not driver.moved:
                turns.append(2 * np.pi * ratio)
        for turn in turns if self.near is not None else ():
            followed = self._nearest(joint, followed, turn)
        return followed

    def _nearest(self, joint: Joint, coordinate: Reals, turn: float) -> Columns:
        """Angle of a follower, with the number of turns of its driver that brings it closest to the posture `near`."""
        assert self.near is not None
        seen = self.near.direction[joint.child] * np.conj(self.direction[joint.parent])
        angles = [
            coordinate + turn * count for count in sorted(range(-MAX_DRIVER_TURNS, MAX_DRIVER_TURNS + 1), key=abs)
        ]
        away = np.array([np.abs(unit(joint.sense * angle) - seen) for angle in angles])
        return np.choose(np.argmin(np.round(away, 9), axis=0), angles)

    def _measured(self, joint: Joint, near: float) -> Columns:
        """Coordinate of a placed joint; angles are continuous over the positions."""
        measured = joint.coordinate(self)
        if not joint.turns:
            return measured
        key = (joint.name, joint.parent, joint.child)
        expected = self.led.get(key)
        if expected is not None and np.isfinite(expected).any():
            self.seen[key] = measured + 2 * np.pi * np.round((expected - measured) / (2 * np.pi))
            return self.seen[key]
        whole = np.unwrap(np.atleast_1d(measured), axis=-1)
        return whole + 2 * np.pi * np.round((near - whole[..., :1]) / (2 * np.pi))

    def hang(self, joint: Joint, coordinate: Columns) -> None:
        """Place a joint's child by the joint's coordinate [rad or m]."""
        self.origin[joint.child], self.direction[joint.child] = joint.child_place(self, coordinate)
