"""Where every link is, apart from how it moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Complex, Complexes
from rigid.joints import Placed
from rigid.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class Posture:
    """Where the links of a mechanism are.

    Attributes
    ----------
    origin
        Of every link's axes [m], complex, shape (links, ...), links in the order of the mechanism.
    direction
        Unit vector of every link's x' axis, complex, shape (links, ...).
    """

    mechanism: Mechanism
    origin: Complexes
    direction: Complexes

    def place(self, link: int, local: Complex) -> Complexes:
        """Place of a point given in a link's axes [m], shape (...)."""
        return np.asarray(self.origin[link] + self.direction[link] * local)

    def point(self, link: str, point: str) -> Complexes:
        """Place of a link's point [m], shape (...)."""
        number = self.mechanism.index[link]
        return self.place(number, self.mechanism.links[number].points[point])

    def __repr__(self) -> str:
        return f"Posture({len(self.origin)} links, columns {self.origin.shape[1:]})"


def posture(motion: Placed, places: object = ...) -> Posture:
    """The postures of a motion, or those at some of its columns."""
    at = (slice(None), *places) if isinstance(places, tuple) else (slice(None), places)
    return Posture(motion.mechanism, np.asarray(motion.origin)[at], np.asarray(motion.direction)[at])
