"""Numbers of a scene: arithmetic for one or several designs, and formatting with SI prefixes and few digits.

The builders of a scene use the same arithmetic for a single design and for arrays of designs. `require` checks a
condition and reports the designs that violate it.
"""

import cmath
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from kinelast.values.error import fault
from rigid.arrays import Complex, Real


def real(quantity: Any) -> Any:
    """Return a quantity as a float, or as an array with a value for each design.

    The return type is Any, so that callers can annotate the value as a float although it may be an array.
    """
    each = quantity if isinstance(quantity, np.ndarray) else getattr(quantity, "each", None)
    return float(quantity) if each is None else each


def vector(place: Iterable[Any]) -> Complex:
    """Return two components as a complex number, or as an array if they differ between designs."""
    x, y = (real(part) for part in place)
    return x + 1j * y if isinstance(x, np.ndarray) or isinstance(y, np.ndarray) else complex(x, y)


def direction_of(direction: Any) -> Complex:
    """Return a direction as a complex number, or as an array if it differs between designs."""
    each = getattr(direction, "each", None)
    return direction if each is None else each


def phase(way: Complex) -> Real:
    """Return the argument (phase angle) of a complex number [rad]."""
    return np.angle(way) if isinstance(way, np.ndarray) else cmath.phase(way)


def quotient(vector: Complex, size: Any) -> Complex:
    """Divide a vector by a number. In arrays of designs, zero divided by zero gives 0."""
    if not isinstance(size, np.ndarray) and not isinstance(vector, np.ndarray):
        return complex(vector) / float(size)
    size = np.where(size == 0.0, 1.0, size)
    return np.asarray(np.real(vector) / size + 1j * (np.imag(vector) / size))


def any_nonzero(value: Real | Complex) -> bool:
    """Return True if a number is nonzero for at least one design."""
    return bool(np.any(value)) if isinstance(value, np.ndarray) else bool(value)


def require(holds: Any, table: str, key: str, problem: str | Callable[[Any], str]) -> None:
    """Raise SceneError if a condition does not hold.

    The error contains the numbers of the designs that violate the condition.

    Parameters
    ----------
    holds
        Condition, bool or array of bool.
    problem
        Message, or a function that returns the message. This function is called with a helper `pick`: `pick(array)`
        returns the value of the first invalid design.

    Raises
    ------
    SceneError
        The message is about the first invalid design. `designs` contains the numbers of all invalid designs.
    """
    if isinstance(holds, np.ndarray):
        wrong = np.flatnonzero(~holds)
        if not len(wrong):
            return
    elif holds:
        return
    else:
        wrong = None
    row = None if wrong is None else int(wrong[0])
    error = fault(table, key, problem if isinstance(problem, str) else problem(lambda value: _picked(value, row)))
    error.designs = wrong
    raise error


def _picked(value: Any, row: int | None) -> Any:
    """Return the value of design `row` from an array, or the value itself if it is not an array."""
    return value.ravel()[row if value.size > 1 else 0] if isinstance(value, np.ndarray) else value


EXPECTED = {  # examples of how to write a quantity, quoted in error messages; by SI unit
    "s": 'a time, as in "50 ms"',
    "rad": 'an angle, as in "30 deg"',
    "m": 'a length, as in "20 mm"',
    "rad/s": 'a speed of rotation, as in "100 rad/s" or "3000 rpm"',
    "m/s": 'a speed, as in "0.2 m/s"',
    "N": 'a force, as in "2 kN"',
    "N m": 'a moment, as in "3 N m"',
    "N/m": 'a stiffness, as in "4 N/mm"',
    "N m/rad": 'a stiffness, as in "3 N m/rad"',
    "N s/m": 'a damping, as in "5 N s/m"',
    "N m s/rad": 'a damping, as in "0.1 N m s/rad"',
    "rad/rad": "a number",
    "m/rad": 'as in "20 mm/rad"',
    "rad/m": 'as in "50 rad/m"',
}


def require_unit(table: str, key: str, value: Any, unit: str) -> None:
    """Raise SceneError if a quantity has a unit other than `unit`. A number without a unit is accepted."""
    if value.unit not in ("", unit):
        raise fault(table, key, f"expected {EXPECTED[unit]}, got {float(value):g} {value.unit}")


MIN_PRINTED_ERROR = 1e-4  # smaller relative errors do not affect the printed digits
UNRELIABLE = 0.25  # results with a larger relative error are marked as unreliable, see `has_large_error`
HOUR = 3600.0  # [s]; longer times are printed in hours
MIN_PRINTED_STRESS = 1e-3  # [stress unit of the report] smaller stresses are printed in Pa
DisplayUnits = Mapping[str, tuple[float, str]]
"""Display units of a report: conversion factor and name of the unit, by SI unit."""
SI: DisplayUnits = {}
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
DASH, MINUS = "\u2013", "\u2212"
RAISED = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
UNPREFIXED = ("", "deg", "kg", "kg/m", "kg/m^3", "kg m^2", "1")
RAISED_LENGTH = re.compile(r"m\^(\d)")  # in m^2, a prefix such as m for milli is squared too
RAISED_UNIT = re.compile(r"\^(\d)")
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "µm": 1e-6}

REPORT_UNITS = {  # conversion factor and display unit, by SI unit
    "mm": {
        "m": (1e3, "mm"), "m^2": (1e6, "mm^2"), "m/s": (1e3, "mm/s"), "m/s^2": (1e3, "mm/s^2"), "Pa": (1e-6, "MPa"),
        "N": (1.0, "N"), "N/m": (1e-3, "N/mm"), "N m^2": (1e6, "N mm^2"), "W/m^2": (1e-6, "MPa m/s"),
    },
    "in": {
        "m": (1 / 0.0254, "in"), "m^2": (1 / 0.0254**2, "in^2"), "m/s": (1 / 0.0254, "in/s"),
        "m/s^2": (1 / 0.0254, "in/s^2"), "Pa": (0.0254**2 / 4.4482216152605, "psi"), "N": (1 / 4.4482216152605, "lbf"),
        "N m": (1 / (4.4482216152605 * 0.0254), "lbf in"), "N/m": (0.0254 / 4.4482216152605, "lbf/in"),
        "N m^2": (1 / (4.4482216152605 * 0.0254**2), "lbf in^2"), "kg": (1 / 0.45359237, "lb"),
    },
}  # fmt: skip


def scale_of(largest: float, unit: str) -> tuple[float, str]:
    """Return a conversion factor, and a unit with a suitable SI prefix for a quantity of the size `largest`.

    >>> scale_of(0.00146, "m")
    (1000.0, 'mm')
    """
    if raised := RAISED_LENGTH.match(unit):
        return _raised(abs(largest), unit, int(raised[1]))
    if unit in UNPREFIXED or unit.startswith("1/") or not math.isfinite(largest) or abs(largest) < 1e-12:
        return 1.0, unit
    if unit == "s" and abs(largest) >= HOUR:
        return 1.0 / HOUR, "h"
    power = min(max(3 * math.floor(math.log10(abs(largest)) / 3), -9), 0 if unit == "s" else 9)
    if unit == "m" and power > 0:
        power = 3 if abs(largest) >= 1e4 else 0
    return 10.0**-power, PREFIXES[power] + unit


def _raised(size: float, unit: str, power: int) -> tuple[float, str]:
    """Return the conversion factor and unit of a power of a length (area, volume etc.)."""
    if not 0.0 < size < math.inf:
        return 1.0, unit
    name = next((name for name, metres in METRES.items() if size >= metres**power * (1 - 1e-9)), "µm")
    return 1.0 / METRES[name] ** power, name + unit[1:]


def number(value: float, digits: int = 4) -> str:
    """Format a number with few digits and a typographic minus sign, and nan as a dash."""
    if not math.isfinite(value):
        return DASH if math.isnan(value) else "∞"
    text = f"{value + 0.0:.{digits}g}"  # adding zero turns -0 into 0
    if abs(value) < 1e7 and max(abs(value), abs(float(text))) >= 10**digits:
        text = f"{value:.0f}"
    if "e" in text:
        mantissa, power = text.split("e")
        text = f"{mantissa}·10{str(int(power)).translate(RAISED)}"
    return text.replace("-", MINUS)


def has_large_error(value: Any, error: Any, least: Any = 0.0) -> Any:
    """Return whether an error exceeds `UNRELIABLE` times the magnitude of the value, or `least` if that is larger."""
    return error > UNRELIABLE * np.maximum(np.abs(value), least)


def capitalized(words: str) -> str:
    """Return words with an initial capital letter. The other letters do not change."""
    return words[:1].upper() + words[1:]


def percent(share: float) -> str:
    """Format a fraction in per cent with two digits."""
    if math.isnan(share):
        return "unknown"
    return "beyond measure" if math.isinf(share) else f"{number(100 * share, 2)} %"


def error_percent(share: float) -> str:
    """Format a relative error in per cent; errors below `MIN_PRINTED_ERROR` as "< 0.01 %".

    >>> error_percent(0.0123), error_percent(2e-7)
    ('1.2 %', '< 0.01 %')
    """
    return f"< {percent(MIN_PRINTED_ERROR)}" if share < MIN_PRINTED_ERROR else percent(share)


def quantity(value: float, unit: str, digits: int = 4, shown_in: DisplayUnits = SI) -> str:
    """Format a number with the display unit of the report or, by default, with a prefixed SI unit.

    >>> quantity(0.00146, "m")
    '1.46 mm'
    >>> quantity(100.0, "rad/s", 3, {"rad/s": (30 / math.pi, "rpm")})
    '955 rpm'
    """
    if not math.isfinite(value):
        return number(value)
    if unit in shown_in and not (unit == "Pa" and 0.0 < abs(value) * shown_in[unit][0] < MIN_PRINTED_STRESS):
        factor, name = shown_in[unit]
        return f"{number(value * factor, digits)} {unit_words(name)}".replace(" deg", "°")
    factor, prefixed = scale_of(value, unit)
    return f"{number(value * factor, digits)} {unit_words(prefixed)}".strip()


def few(names: Sequence[str], most: int) -> list[str]:
    """Return the first `most` names as text, followed by the number of the other names."""
    return [*names] if len(names) <= most else [*names[:most], f"{len(names) - most} more"]


def unit_words(unit: str) -> str:
    """Format a unit for display. The unit "1" is empty.

    >>> unit_words("kg m^2"), unit_words("1")
    ('kg·m²', '')
    """
    return "" if unit == "1" else RAISED_UNIT.sub(lambda found: found[1].translate(RAISED), unit).replace(" ", "·")


def with_limit(value: float, limit: float, unit: str, shown_in: DisplayUnits = SI) -> tuple[str, str]:
    """Format a value and its limit. If they are times, both have the same unit.

    >>> with_limit(6294.0, 7.2e7, "s")
    ('1.748 h', '20000 h')
    """
    units = {**shown_in, "s": scale_of(limit, "s")} if unit == "s" else shown_in
    return quantity(value, unit, shown_in=units), quantity(limit, unit, shown_in=units)


def coordinate(value: float, unit: str, shown_in: DisplayUnits = SI) -> str:
    """Format the coordinate of a drive: an angle in degrees, from 0 to below 360, or a travel.

    >>> coordinate(-0.5 * math.pi, "rad")
    '270°'
    """
    return (
        f"{number(_within_turn(math.degrees(value)))}°" if unit == "rad" else quantity(value, unit, shown_in=shown_in)
    )


def _within_turn(angle: float) -> float:
    """Reduce an angle [deg] to 0 <= angle < 360. An angle that is just below 360 by round-off gives 0."""
    within = angle % 360.0
    return 0.0 if within > 360.0 - 5e-7 else within


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Return about `count` round numbers in an interval.

    >>> ticks(0.0, 360.0)
    [0.0, 100.0, 200.0, 300.0]
    """
    if not high > low:
        return [low]
    step = round_up((high - low) / count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def round_up(value: float) -> float:
    """Round up to 1, 2, 2.5 or 5 times a power of ten.

    >>> round_up(3.1)
    5.0
    """
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= value * (1 - 1e-9))


def round_down(value: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten.

    >>> round_down(43.0)
    20.0
    """
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= value * (1 + 1e-9))
