"""Positions of all links of a mechanism, without velocities."""

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Complex, Complexes
from rigid.joints import Placed
from rigid.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class Posture:
    """Positions of all links of a mechanism.

    Attributes
    ----------
    origin
        Origin of each link's axes (complex) [m], shape (links, ...), in the order of `Mechanism.links`.
    direction
        Unit vector of each link's x axis (complex), shape (links, ...).
    """

    mechanism: Mechanism
    origin: Complexes
    direction: Complexes

    def place(self, link: int, local: Complex) -> Complexes:
        """Return the position of a point given in link axes [m], shape (...)."""
        return np.asarray(self.origin[link] + self.direction[link] * local)

    def point(self, link: str, point: str) -> Complexes:
        """Return the position of a link's point given by name [m], shape (...)."""
        number = self.mechanism.index[link]
        return self.place(number, self.mechanism.links[number].points[point])

    def __repr__(self) -> str:
        return f"Posture({len(self.origin)} links, columns {self.origin.shape[1:]})"


def posture(motion: Placed, places: object = ...) -> Posture:
    """Return the postures of a motion at all columns, or at the selected ones."""
    at = (slice(None), *places) if isinstance(places, tuple) else (slice(None), places)
    return Posture(motion.mechanism, np.asarray(motion.origin)[at], np.asarray(motion.direction)[at])
