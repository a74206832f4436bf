"""Motion of the rigid links for laws and loads, by differences of their positions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem_check.nonlinear.nodes import NotCheckedError
from fem_check.nonlinear.rigid_places import RigidPlaces, coordinates
from rigid import Mechanism, structure
from rigid.arrays import Complexes, Reals
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
    def _places(self) -> tuple[Complexes, Reals]:
        return self._seen(self.rigid.at(self.time))

    @cached_property
    def _rates(self) -> tuple[Reals, ...]:
        """First and second derivatives of origins and angles, each (2, links, instants)."""
        step = self._step
        around = np.maximum(self.time, self.rigid.start - OFFSETS[0] * step)  # no positions before the start
        places = self.rigid.at((around[:, None] + step * OFFSETS).ravel())
        values = places.reshape(len(self.time), POINTS, -1)
        powers = np.arange(POINTS)
        fit = np.linalg.inv(OFFSETS[:, None] ** powers)
        share = ((self.time - around) / step)[:, None]
        once = powers * share ** np.maximum(powers - 1, 0) @ fit / step
        twice = powers * (powers - 1) * share ** np.maximum(powers - 2, 0) @ fit / step**2
        return tuple(
            np.einsum("pk,pkc->pc", weights, values).reshape(len(self.time), -1, 3) for weights in (once, twice)
        )

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

    @staticmethod
    def _seen(places: Reals) -> tuple[Complexes, Reals]:
        return (places[..., 0] + 1j * places[..., 1]).T, places[..., 2].T

    @property
    def origin(self) -> Complexes:
        """Origin of each link's axes [m], complex, shape (links, instants)."""
        return self._places[0]

    @property
    def direction(self) -> Complexes:
        """Unit vector of each link's x' axis, complex."""
        way: Complexes = np.exp(1j * self._places[1])
        return way

    @property
    def velocity(self) -> Complexes:
        """Velocity of the origins [m/s], complex."""
        return self._seen(self._rates[0])[0]

    @property
    def angular_velocity(self) -> Reals:
        """Angular velocity of the links [rad/s]."""
        spin: Reals = self._seen(self._rates[0])[1]
        return spin

    @property
    def acceleration(self) -> Complexes:
        """Acceleration of the origins [m/s^2], complex."""
        return self._seen(self._rates[1])[0]

    @property
    def turning(self) -> Complexes:
        """Angular acceleration times i minus squared angular velocity [1/s^2], complex."""
        return np.asarray(1j * self._seen(self._rates[1])[1] - self.angular_velocity**2, complex)

    def __getattr__(self, name: str) -> Any:
        """Raise NotCheckedError for any other attribute of a motion."""
        raise NotCheckedError(
            f'a load uses the motion\'s "{name}": the nonlinear check provides positions, velocities and accelerations'
        )
