"""Posture of a mechanism during placement, in which some links are placed."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigid.arrays import Columns, Reals
from rigid.drawing import Drawing
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.plane import ROUND_OFF, unit
from rigid.postures import Posture

MAX_DRIVER_TURNS = 8  # number of turns of a gear's driver to try in each direction


@dataclass(eq=False)
class PartialPosture:
    """Origins [m] and unit vectors of the links placed so far, one array of shape (..., positions) per link."""

    mechanism: Mechanism
    drive: Reals
    origin: list[Columns]
    direction: list[Columns]
    sine: list[Columns] = field(default_factory=list)  # sine of each group with free joints
    slack: Columns = ROUND_OFF  # negative squared sines above -slack count as zero
    near: Posture | None = None  # see `motion`
    shape: tuple[int, ...] = ()  # shape of the columns
    # approximate and exact angles of undriven joints that drive gears [rad]
    driver_angles: dict[Any, Reals] = field(default_factory=dict)
    exact_driver_angles: dict[Any, Any] = field(default_factory=dict)

    def coordinate(self, joint: Joint) -> Columns:
        """Return the coordinate of a joint with a drive or gear [rad or m]; 0 for a weld."""
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
            # the gear may measure the driver's coordinate in the opposite sense
            followed = followed + ratio * driver.sense * (now - drawn)
            if joint.turns and driver.turns and not driver.moved:
                turns.append(2 * np.pi * ratio)
        for turn in turns if self.near is not None else ():
            followed = self._nearest(joint, followed, turn)
        return followed

    def _nearest(self, joint: Joint, coordinate: Reals, turn: float) -> Columns:
        """Return the angle of a follower for the number of driver turns that brings it closest to `near`."""
        assert self.near is not None
        target = self.near.direction[joint.child] * np.conj(self.direction[joint.parent])
        angles = [
            coordinate + turn * count for count in sorted(range(-MAX_DRIVER_TURNS, MAX_DRIVER_TURNS + 1), key=abs)
        ]
        away = np.array([np.abs(unit(joint.sense * angle) - target) for angle in angles])
        return np.choose(np.argmin(np.round(away, 9), axis=0), angles)

    def _measured(self, joint: Joint, near: float) -> Columns:
        """Return the coordinate of a placed joint. Angles are unwrapped over the positions."""
        measured = joint.coordinate(self)
        if not joint.turns:
            return measured
        key = (joint.name, joint.parent, joint.child)
        expected = self.driver_angles.get(key)
        if expected is not None and np.isfinite(expected).any():
            self.exact_driver_angles[key] = measured + 2 * np.pi * np.round((expected - measured) / (2 * np.pi))
            return self.exact_driver_angles[key]
        whole = np.unwrap(np.atleast_1d(measured), axis=-1)
        return whole + 2 * np.pi * np.round((near - whole[..., :1]) / (2 * np.pi))

    def hang(self, joint: Joint, coordinate: Columns) -> None:
        """Place the child of a joint for a given coordinate [rad or m]."""
        self.origin[joint.child], self.direction[joint.child] = joint.child_place(self, coordinate)
