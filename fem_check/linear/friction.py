"""Joint friction as loads on the bodies, computed from the constraint forces of the frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from fem_check.linear.frame import Frame, FramePlace, parts_on
from fem_check.linear.ties import Tie
from rigid import Friction, Slider, velocity_of
from rigid.arrays import Reals

MAX_CHANGE = 1e-13  # largest change of the efforts at convergence, relative to the largest force
REST_SPEED = 1e-9  # a joint slower than this is at rest; relative to the largest speed

Load = tuple[FramePlace | None, Any, Any]


class JointFriction(Struct, frozen=True, eq=False):
    """Joint friction after an iteration.

    Attributes
    ----------
    efforts
        Friction moment [N m] or force [N] on the second link of each pin or the block of each slider, by joint name,
        shape (..., positions).
    changing
        True at the positions at which the last iteration changed the efforts, shape (..., positions).
    """

    frame: Frame
    efforts: Any = None
    changing: Any = True

    @property
    def converged(self) -> bool:
        """Whether the last iteration changed no effort."""
        return not self.frame.motion.mechanism.friction or not np.any(self.changing)

    @property
    def where_converged(self) -> JointFriction:
        """Copy in which the efforts are nan at positions at which the iteration did not converge."""
        efforts = {name: np.where(self.changing, np.nan, effort) for name, effort in (self.efforts or {}).items()}
        return replace(self, efforts=efforts)

    @property
    def loads(self) -> Sequence[Load]:
        """Friction on both links of each joint: place, force (complex) [N], and moment [N m]."""
        return tuple(load for name, effort in (self.efforts or {}).items() for load in self._loads(name, effort))

    def _loads(self, name: str, effort: Reals) -> Iterator[Load]:
        slider = _slider(self.frame, name)
        if slider is None:
            first, second = _links(self.frame, name)
            yield self.frame.place(second, name), 0.0, effort
            yield self.frame.place(first, name), 0.0, -effort
        else:
            owner, block = self.frame.sides[name]
            yield block, effort * self.frame.along(slider), 0.0
            yield from parts_on(owner, -effort * self.frame.along(slider), 0.0)

    def after(self, constraints: Sequence[Tie], multipliers: Reals, size: float) -> JointFriction:
        """Return the friction after the next iteration.

        `multipliers` are the constraint forces of the solution with the friction of this iterate; moments are divided
        by `size`. `constraints` are the corresponding constraints, in the order of the multipliers.
        """
        friction = self.frame.motion.mechanism.friction
        efforts, row = {}, 0
        for tie in constraints:
            own = multipliers[..., row : row + len(tie.rows)]
            if tie.name in friction and len(tie.rows) == 2:
                efforts[tie.name] = self._effort(tie, friction[tie.name], own, size)
            row += len(tie.rows)
        known = self.efforts or {}
        greatest = np.abs(multipliers).max(axis=-1, initial=0.0) * max(size, 1.0)
        changes = [np.abs(effort - known.get(name, 0.0)) for name, effort in efforts.items()]
        changing = np.max(changes, axis=0) > MAX_CHANGE * greatest if changes else np.False_
        return replace(self, efforts=efforts, changing=changing)

    def _effort(self, tie: Tie, friction: Friction, multipliers: Reals, size: float) -> Reals:
        """Return the friction effort on the second link of a pin or on the block of a slider, from the multipliers."""
        motion, slider = self.frame.motion, _slider(self.frame, tie.name)
        part, across = (multipliers[..., k] * (size if row.turns else 1.0) for k, row in enumerate(tie.rows))
        omega = motion.angular_velocity
        points = [(link, point) for link in motion.mechanism.links for point in link.points]
        if slider is None:
            first, second = _links(self.frame, tie.name)
            rate, press = omega[second] - omega[first], friction.radius * np.hypot(part, across)
            fastest = np.abs(omega).max(axis=0)
        else:
            rate, press = self._slide(slider), np.maximum(np.abs(part), 2 * np.abs(across) / friction.length)
            fastest = np.max([np.abs(velocity_of(motion, link.name, point)) for link, point in points], axis=0)
        moves = np.where(np.abs(rate) > REST_SPEED * fastest, np.sign(rate), 0.0)
        return -friction.coefficient * press * moves - friction.viscosity * rate

    def _slide(self, slider: Slider) -> Reals:
        """Return the velocity of a block relative to its guiding link, along its line [m/s]."""
        motion = self.frame.motion
        owner = motion.mechanism.index[slider.on]
        line = self.frame.along(slider)
        block = velocity_of(motion, slider.link, slider.point)
        ahead = (
            motion.direction[motion.mechanism.index[slider.link]]
            * motion.mechanism.links[motion.mechanism.index[slider.link]].points[slider.point]
        )
        here = motion.origin[motion.mechanism.index[slider.link]] + ahead
        under = motion.velocity[owner] + 1j * motion.angular_velocity[owner] * (here - motion.origin[owner])
        return (np.conj(line) * (block - under)).real


def _slider(frame: Frame, name: str) -> Slider | None:
    return next((slider for slider in frame.motion.mechanism.sliders if slider.name == name), None)


def _links(frame: Frame, point: str) -> tuple[int, int]:
    """Return the indices of the two links of a pin."""
    first, second = (at for at, link in enumerate(frame.motion.mechanism.links) if point in link.points)
    return first, second
