"""Positions of all links, without velocities."""

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Complex, Complexes
from rigid.joints import Placed
from rigid.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class Posture:
    """Positions of the links of a mechanism.

    Attributes
    ----------
    origin
        Origin of each link's axes [m], complex, shape (links, ...), in the order of the mechanism.
    direction
        Unit vector of each link's x' axis, complex, shape (links, ...).
    """

    mechanism: Mechanism
    origin: Complexes
    direction: Complexes

    def place(self, link: int, local: Complex) -> Complexes:
        """Position of a point given in a link's axes [m], shape (...)."""
        return np.asarray(self.origin[link] + self.direction[link] * local)

    def point(self, link: str, point: str) -> Complexes:
        """Position of a link's point [m], shape (...)."""
        number = self.mechanism.index[link]
        return self.place(number, self.mechanism.links[number].points[point])

    def __repr__(self) -> str:
        return f"Posture({len(self.origin)} links, columns {self.origin.shape[1:]})"


def posture(motion: Placed, places: object = ...) -> Posture:
    """Postures of a motion, optionally only at selected columns."""
    at = (slice(None), *places) if isinstance(places, tuple) else (slice(None), places)
    return Posture(motion.mechanism, np.asarray(motion.origin)[at], np.asarray(motion.direction)[at])
