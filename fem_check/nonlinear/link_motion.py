"""Motion of the rigid links for laws and loads, by differences of their positions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.rigid_places import RigidPlaces, as_complex, coordinates
from rigid import Mechanism, structure
from rigid.arrays import Reals
from rigid.decomposition import Structure

MAX_STRIDE = 5e-3
"""Largest drive movement within a difference [rad], or relative to the mechanism's size."""
MIN_STEP, SAMPLES = 1e-7, 501
"""Smallest difference step [s], and number of instants at which drive movements are checked."""
POINTS = 6
OFFSETS = np.arange(POINTS) - (POINTS - 1) / 2


@dataclass(frozen=True, eq=False)
class RigidLinkMotion:
    """Positions, velocities and accelerations of the rigid links, as in `rigid.Motion`.

    Attributes
    ----------
    time
        [s], shape (instants,).
    rigid
        Positions of the links at any time.
    """

    time: Reals
    rigid: RigidPlaces

    @property
    def mechanism(self) -> Mechanism:
        """The moving mechanism."""
        return self.rigid.mechanism

    @property
    def structure(self) -> Structure:
        """Joints of the mechanism."""
        return structure(self.mechanism)

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the instants."""
        return self.time.shape

    @cached_property
    def drive(self) -> Reals:
        """Coordinates of the drives, shape (drives, instants)."""
        return coordinates(self.rigid.laws, self.time).T

    @cached_property
    def link_positions(self) -> Reals:
        """x, y and angle of each link, shape (links, instants, 3)."""
        return np.swapaxes(self.rigid.at(self.time), 0, 1)

    @cached_property
    def link_rates(self) -> tuple[Reals, Reals]:
        """First and second derivatives of `link_positions`."""
        step = self._step
        around = np.maximum(self.time, self.rigid.start - OFFSETS[0] * step)  # no positions before the start
        places = self.rigid.at((around[:, None] + step * OFFSETS).ravel())
        values = places.reshape(len(self.time), POINTS, -1)
        powers = np.arange(POINTS)
        fit = np.linalg.inv(OFFSETS[:, None] ** powers)
        share = ((self.time - around) / step)[:, None]
        once = powers * share ** np.maximum(powers - 1, 0) @ fit / step
        twice = powers * (powers - 1) * share ** np.maximum(powers - 2, 0) @ fit / step**2
        rate, acceleration = (
            np.einsum("pk,pkc->pc", weights, values).reshape(len(self.time), -1, 3) for weights in (once, twice)
        )
        return np.swapaxes(rate, 0, 1), np.swapaxes(acceleration, 0, 1)

    @property
    def _step(self) -> float:
        """Difference step [s]: drives move less than a stride, and it is short between instants."""
        first, last = float(self.time.min()), float(self.time.max())
        scale = np.array([1.0 if drive.turns else self.rigid.size for drive in self.mechanism.drives])
        steps = MIN_STEP * 2.0 ** np.arange(24)
        for step in steps:
            fine = np.linspace(first, max(last, first + step), SAMPLES)
            apart = coordinates(self.rigid.laws, fine + step) - coordinates(self.rigid.laws, fine)
            if (np.abs(apart) / scale).max(initial=0.0) > MAX_STRIDE:
                return float(step)
        return float(steps[-1])

    def __getattr__(self, name: str) -> Any:
        """Return an array of `rigid.Motion` of shape (links, instants), or raise NotCheckedError for others."""
        if name not in ARRAYS:
            raise NotCheckedError(
                f'a load uses the motion\'s "{name}": the nonlinear check provides positions, velocities and '
                "accelerations"
            )
        return ARRAYS[name](self)


ARRAYS: dict[str, Callable[[RigidLinkMotion], Any]] = {
    "origin": lambda motion: as_complex(motion.link_positions),
    "direction": lambda motion: np.exp(1j * motion.link_positions[..., 2]),
    "velocity": lambda motion: as_complex(motion.link_rates[0]),
    "angular_velocity": lambda motion: motion.link_rates[0][..., 2],
    "acceleration": lambda motion: as_complex(motion.link_rates[1]),
    "turning": lambda motion: 1j * motion.link_rates[1][..., 2] - motion.link_rates[0][..., 2] ** 2,
}
"""Arrays of `rigid.Motion` that loads may use."""
