"""Posture of a mechanism while the positions of its links are computed, one group after another."""

from typing import Any

import numpy as np
from msgspec import Struct, field

from rigid.arrays import Columns, Reals
from rigid.drawing import Drawing
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.plane import ROUND_OFF, unit
from rigid.postures import Posture

# if the number of full turns of a gear's driver is unknown, up to this many are tried in each direction
MAX_DRIVER_TURNS = 8


class PartialPosture(Struct, eq=False):
    """Origins [m] and unit vectors of links: for each link, complex arrays of shape (..., positions).

    They are valid only for links that have already been placed.
    """

    mechanism: Mechanism
    drive: Reals
    origin: list[Columns]
    direction: list[Columns]
    # sine of each group with free joints that has been placed, see `newton.sine_of`
    sine: list[Columns] = field(default_factory=list)
    slack: Columns = ROUND_OFF  # squared sines of dyads between -slack and 0 count as 0
    near: Posture | None = None  # posture that selects the branch, see `motion`
    shape: tuple[int, ...] = ()  # shape (..., positions) of the arrays; () if it is not prescribed
    # approximate and exact angles of undriven joints that drive gears [rad]
    driver_angles: dict[Any, Reals] = field(default_factory=dict)
    exact_driver_angles: dict[Any, Any] = field(default_factory=dict)

    def coordinate(self, joint: Joint) -> Columns:
        """Return the coordinate that a drive or gear prescribes for a joint [rad or m]; 0 for a weld."""
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
            # `sense` is -1 if the gear counts the driver's coordinate in the opposite direction
            followed = followed + ratio * driver.sense * (now - drawn)
            if joint.turns and driver.turns and not driver.moved:
                turns.append(2 * np.pi * ratio)
        for turn in turns if self.near is not None else ():
            followed = self._nearest(joint, followed, turn)
        return followed

    def _nearest(self, joint: Joint, coordinate: Reals, turn: float) -> Columns:
        """Return the possible angle of a gear's follower that is closest to its angle in the posture `near`.

        The number of full turns of the driver is unknown. Without full turns, the angle of the follower is
        `coordinate`. Each full turn of the driver adds `turn` to it.
        """
        assert self.near is not None
        target = self.near.direction[joint.child] * np.conj(self.direction[joint.parent])
        angles = [
            coordinate + turn * count for count in sorted(range(-MAX_DRIVER_TURNS, MAX_DRIVER_TURNS + 1), key=abs)
        ]
        away = np.array([np.abs(unit(joint.sense * angle) - target) for angle in angles])
        return np.choose(np.argmin(np.round(away, 9), axis=0), angles)

    def _measured(self, joint: Joint, near: float) -> Columns:
        """Return the coordinate of a joint between two links that have been placed. Angles include full turns.

        If `driver_angles` contains an approximate angle, the result is the possible angle closest to it. Otherwise, the
        angle at the first position is the one closest to `near`, and full turns are counted from position to position.
        """
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

    def place_child(self, joint: Joint, coordinate: Columns) -> None:
        """Place the child of a joint for a given coordinate of the joint [rad or m]."""
        self.origin[joint.child], self.direction[joint.child] = joint.child_place(self, coordinate)
