"""Motion laws through the entries of a table, and laws that are repeated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rigid.laws import Triple

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

BEYOND = 1e-12  # of a duration, by which an instant may miss the end of a round
BACK = 1e-12  # of a rise, by which a round may miss where it began


class Lasting(Protocol):
    """A motion law that ends."""

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        ...

    @property
    def final_speed(self) -> float:
        """Speed at its end [rad/s or m/s]."""
        ...

    def __call__(self, time: Any) -> Triple:
        """Coordinate, rate and acceleration at given times [s]."""
        ...


@dataclass(frozen=True)
class TableLaw:
    """A coordinate [rad or m] at given times [s], between them a cubic spline with continuous acceleration.

    Where it is to be `repeated`, speed and acceleration at its end are those at its start.
    """

    times: tuple[float, ...]
    coordinates: tuple[float, ...]
    repeated: bool = False

    @property
    def duration(self) -> float:
        """Time of the last entry [s]."""
        return self.times[-1]

    @property
    def final_speed(self) -> float:
        """Speed at the last entry [rad/s or m/s]."""
        return float(self([self.duration])[1][0])

    @cached_property
    def _spline(self) -> tuple[CubicSpline, float]:
        from scipy.interpolate import CubicSpline

        time, value = np.array(self.times), np.array(self.coordinates)
        if not self.repeated:
            return CubicSpline(time, value), 0.0
        slope = (value[-1] - value[0]) / time[-1]
        rest = value - slope * time
        rest[-1] = rest[0]
        return CubicSpline(time, rest, bc_type="periodic"), slope

    def __call__(self, time: Any) -> Triple:
        """Coordinate, rate and acceleration at given times [s], each of their shape."""
        time = np.asarray(time, float)
        spline, slope = self._spline
        at = np.clip(time, 0.0, self.duration)
        return spline(at) + slope * at, spline(at, 1) + slope, spline(at, 2)


@dataclass(frozen=True)
class RepeatedLaw:
    """A motion law over and over again, each time from where the last one ended."""

    law: Lasting

    @property
    def duration(self) -> float:
        """Of one round [s]."""
        return self.law.duration

    @property
    def rise(self) -> float:
        """How far one round goes [rad or m]."""
        first, last = self.law([0.0, self.duration])[0]
        return float(last - first)

    def closes(self, turns: bool) -> bool:
        """Whether one round brings the drive back; `turns`: an angle, which whole turns bring back too."""
        return self.rounds(1) == 1 if turns else abs(self.rise) <= BACK * (1 + abs(self.rise))

    def rounds(self, most: int) -> int:
        """How many rounds bring back an angle, up to whole turns; 0 where more than `most` do."""
        for count in range(1, most + 1):
            rest = count * self.rise
            rest -= 2 * pi * round(rest / (2 * pi))
            if abs(rest) <= count * BACK * (1 + abs(self.rise)):
                return count
        return 0

    def __call__(self, time: Any) -> Triple:
        """Coordinate, rate and acceleration at given times [s], each of their shape."""
        time = np.asarray(time, float)
        rounds = np.floor(time / self.duration + BEYOND)
        coordinate, rate, acceleration = self.law(time - rounds * self.duration)
        return coordinate + rounds * self.rise, rate, acceleration
