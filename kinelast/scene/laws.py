"""Laws that the drives and loads of a scene follow: repeated, through the entries of a table, against an angle."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from math import isclose, pi
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from kinelast.scene.error import fault, known_name, require_absent
from kinelast.scene.tables import DriveTable, LoadTable
from rigid import Law, Reals, TableError

if TYPE_CHECKING:
    from rigid.analysis import LinkAngle, Slide


Triple = tuple[Reals, Reals, Reals]
OVER = 1e-12
BACK = 1e-12
APART = 1e-12  # of a table's length, that its entries are at least: closer ones are a slip, and their slopes no numbers


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
    def _spline(self) -> Any:
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
        rounds = np.floor(time / self.duration + OVER)
        coordinate, rate, acceleration = self.law(time - rounds * self.duration)
        return coordinate + rounds * self.rise, rate, acceleration


def repeated(where: str, key: str, law: Lasting) -> RepeatedLaw:
    """A law over and over again; raises where it does not end at the speed at which it starts."""
    first, last = float(law([0.0])[1][0]), law.final_speed
    if not isclose(first, last, rel_tol=1e-9, abs_tol=1e-12):
        raise fault(where, key, f"starts at a speed of {first:g} and ends at {last:g}: repeated, the speed would jump")
    return RepeatedLaw(law)


def factor_law(
    where: str, table: LoadTable | DriveTable, duration: float, links: Collection[str], sliders: Collection[str]
) -> Law | None:
    """Factor on a load or effort; None without a table. A table against time must cover the duration [s].

    `links`, `sliders` are the names that there are.
    """
    if table.table is None:
        require_absent(where, table, ("against", "extend"), "belongs to a table: give that too")
        return None
    from rigid.analysis import Slide
    from rigid.dynamics import law_of, law_of_time, table_curve

    unit, coordinate = _against(where, table, links, sliders)
    for number, (place, _) in enumerate(table.table, 1):
        if place.unit not in ("", unit):
            raise fault(where, f"table[{number}]", f"is against {WORDS[unit]}, got {float(place):g} {place.unit}")
    at, factor = np.array([(place.within(unit), factor) for place, factor in table.table], float).T
    rises = np.diff(at)
    steps = np.flatnonzero(rises == 0)
    if (
        (rises[rises != 0] <= APART * (at[-1] - at[0])).any()
        or (np.diff(steps) == 1).any()
        or (len(steps) and table.interpolation != "linear")
    ):
        allowed = "two entries at one place are a step, in a linear table"
        raise fault(where, "table", f"expected {GROWING[unit]} that grow from entry to entry; {allowed}")
    at[steps] = np.nextafter(at[steps], -np.inf)  # at the step itself the second entry holds
    try:
        # Times are looked at here, once for all: a search between the positions may look a little beyond the run.
        extend = "hold" if coordinate is None else table.extend or "error"
        curve = table_curve(at, factor, table.interpolation, extend)
    except TableError as error:
        raise fault(where, "table", str(error)) from None
    if coordinate is None:
        if table.extend is None and (at[0] > 0 or at[-1] < duration * (1 - OVER)):
            problem = f"covers {at[0]:g} to {at[-1]:g} s, but the run lasts from 0 to {duration:g} s: "
            raise fault(where, "table", problem + 'add entries, or extend = "hold"')
        return law_of_time(curve)
    if isinstance(coordinate, Slide):
        return law_of(coordinate, curve)
    if at[-1] - at[0] > 2 * pi * (1 + OVER):
        raise fault(where, "table", "covers more than a turn, expected angles within one")
    return _turning(coordinate, curve, float(at[0] + at[-1]) / 2)


GROWING = {"s": "times", "rad": "angles", "m": "lengths"}
WORDS = {"s": 'a time, as in "50 ms"', "rad": 'an angle, as in "30 deg"', "m": 'a length, as in "20 mm"'}


def _turning(angle: LinkAngle, curve: Callable[[Any], Any], middle: float) -> Law:
    """A curve against an angle, which is taken within half a turn of the middle of its entries."""
    return lambda motion: curve(middle + angle.difference(motion, middle))


def _against(
    where: str, table: LoadTable | DriveTable, links: Collection[str], sliders: Collection[str]
) -> tuple[str, LinkAngle | Slide | None]:
    """Unit of a table's abscissa, and the coordinate; None for time."""
    from rigid.analysis import LinkAngle, Slide

    against = table.against
    if against is None:
        return "s", None
    if not against.told:
        raise fault(where, "against", 'expected either link or slider, as in {link = "crank"}')
    if not against.turns:
        known_name(where, "against.slider", against.name, sliders, "slider")
        return "m", Slide(against.name)
    for key, link in (("link", against.name), ("on", against.on)):
        known_name(where, f"against.{key}", link, links)
    return "rad", LinkAngle(against.name, against.on)
