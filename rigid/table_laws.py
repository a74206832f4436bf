"""Motion laws given by tables, and repeated laws."""

from functools import cached_property
from math import pi
from typing import Any, Protocol

import numpy as np
from msgspec import Struct

from rigid.laws import Triple

# an instant at most this long before the end of a period counts as the end; relative to the period
INSTANT_TOLERANCE = 1e-12
CLOSING_TOLERANCE = 1e-12  # largest closing error of a period, relative to 1 + rise


class Lasting(Protocol):
    """A motion law with a finite duration."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        ...

    @property
    def final_speed(self) -> float:
        """Speed at the end [rad/s or m/s]."""
        ...

    def __call__(self, time: Any) -> Triple:
        """Return coordinate, rate and acceleration at given times [s]."""
        ...


class TableLaw(Struct, frozen=True, dict=True):
    """Motion law that interpolates coordinates [rad or m] at given times [s] by a cubic spline.

    If `repeated`, speed and acceleration at the end equal those at the start.
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
    def _spline(self) -> tuple[Any, float]:
        from scipy.interpolate import CubicSpline

        time, value = np.array(self.times), np.array(self.coordinates)
        if not self.repeated:
            return CubicSpline(time, value), 0.0
        slope = (value[-1] - value[0]) / time[-1]
        rest = value - slope * time
        rest[-1] = rest[0]
        return CubicSpline(time, rest, bc_type="periodic"), slope

    def __call__(self, time: Any) -> Triple:
        """Return coordinate, rate and acceleration at given times [s], in the shape of `time`."""
        time = np.asarray(time, float)
        spline, slope = self._spline
        at = np.clip(time, 0.0, self.duration)
        return spline(at) + slope * at, spline(at, 1) + slope, spline(at, 2)


class RepeatedLaw(Struct, frozen=True):
    """Periodic repetition of a law. Each period starts at the coordinate at which the previous period ends."""

    law: Lasting

    @property
    def duration(self) -> float:
        """Duration of one period [s]."""
        return self.law.duration

    @property
    def rise(self) -> float:
        """Change of the coordinate over one period [rad or m]."""
        first, last = self.law([0.0, self.duration])[0]
        return float(last - first)

    def closes(self, turns: bool) -> bool:
        """Return whether a drive is at its start after one period. An angle (`turns`) may differ by full turns."""
        return self.rounds(1) == 1 if turns else abs(self.rise) <= CLOSING_TOLERANCE * (1 + abs(self.rise))

    def rounds(self, most: int) -> int:
        """Return the number of periods until an angle is at its start modulo full turns, or 0 if more than `most`."""
        for count in range(1, most + 1):
            rest = count * self.rise
            rest -= 2 * pi * round(rest / (2 * pi))
            if abs(rest) <= count * CLOSING_TOLERANCE * (1 + abs(self.rise)):
                return count
        return 0

    def __call__(self, time: Any) -> Triple:
        """Return coordinate, rate and acceleration at given times [s], in the shape of `time`."""
        time = np.asarray(time, float)
        rounds = np.floor(time / self.duration + INSTANT_TOLERANCE)
        coordinate, rate, acceleration = self.law(time - rounds * self.duration)
        return coordinate + rounds * self.rise, rate, acceleration
