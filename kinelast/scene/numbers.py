"""Numbers as a reader wants them: SI prefixes, few digits, round ticks."""

from __future__ import annotations

import math

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
DASH, MINUS = "\u2013", "\u2212"
RAISED = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
UNPREFIXED = ("", "deg", "kg", "kg/m", "1")

REPORT_UNITS = {  # by SI unit: what it is multiplied by, and the unit that this gives
    "mm": {
        "m": (1e3, "mm"), "m^2": (1e6, "mm^2"), "m/s": (1e3, "mm/s"), "m/s^2": (1e3, "mm/s^2"), "Pa": (1e-6, "MPa"),
        "N": (1.0, "N"), "N m": (1e3, "N mm"), "N/m": (1e-3, "N/mm"), "N m^2": (1e6, "N mm^2"),
    },
    "in": {
        "m": (1 / 0.0254, "in"), "m^2": (1 / 0.0254**2, "in^2"), "m/s": (1 / 0.0254, "in/s"),
        "m/s^2": (1 / 0.0254, "in/s^2"), "Pa": (0.0254**2 / 4.4482216152605, "psi"), "N": (1 / 4.4482216152605, "lbf"),
        "N m": (1 / (4.4482216152605 * 0.0254), "lbf in"), "N/m": (0.0254 / 4.4482216152605, "lbf/in"),
        "N m^2": (1 / (4.4482216152605 * 0.0254**2), "lbf in^2"), "kg": (1 / 0.45359237, "lb"),
    },
}  # fmt: skip


def scale_of(largest: float, unit: str) -> tuple[float, str]:
    """Factor and prefixed unit in which a quantity of this size reads best.

    >>> scale_of(0.00146, "m")
    (1000.0, 'mm')
    """
    if unit in UNPREFIXED or not math.isfinite(largest) or abs(largest) < 1e-12:
        return 1.0, unit
    power = min(max(3 * math.floor(math.log10(abs(largest)) / 3), -9), 9)
    if unit == "m" and power > 0:
        power = 3 if abs(largest) >= 1e4 else 0
    return 10.0**-power, PREFIXES[power] + unit


def number(value: float, digits: int = 4) -> str:
    """A number in few digits, with a real minus sign; a dash where there is none."""
    if not math.isfinite(value):
        return DASH if math.isnan(value) else "∞"
    text = f"{value + 0.0:.{digits}g}"  # which makes of minus zero zero
    if 10**digits <= abs(value) < 1e7:
        text = f"{value:.0f}"
    if "e" in text:
        mantissa, power = text.split("e")
        text = f"{mantissa}·10{str(int(power)).translate(RAISED)}"
    return text.replace("-", MINUS)


def percent(share: float) -> str:
    """A share in per cent, to two digits."""
    if math.isnan(share):
        return "unknown"
    return "beyond measure" if math.isinf(share) else f"{number(100 * share, 2)} %"


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A number with its unit, prefixed.

    >>> quantity(0.00146, "m")
    '1.46 mm'
    """
    if not math.isfinite(value):
        return number(value)
    factor, prefixed = scale_of(value, unit)
    return f"{number(value * factor, digits)} {'' if prefixed == '1' else prefixed.replace(' ', '·')}".strip()


def coordinate(value: float, unit: str) -> str:
    """A drive's coordinate: an angle in degrees within a turn, a slide in its unit.

    >>> coordinate(-0.5 * math.pi, "rad")
    '270°'
    """
    return f"{number(_within_turn(math.degrees(value)))}°" if unit == "rad" else quantity(value, unit)


def _within_turn(angle: float) -> float:
    """An angle [deg] from 0 to below 360, round-off below a whole turn taken for none."""
    within = angle % 360.0
    return 0.0 if within > 360.0 - 5e-7 else within


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers that span an interval, about `count` of them.

    >>> ticks(0.0, 360.0)
    [0.0, 100.0, 200.0, 300.0]
    """
    if not high > low:
        return [low]
    step = round_up((high - low) / count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def round_up(value: float) -> float:
    """The next of 1, 2, 2.5, 5 times a power of ten.

    >>> round_up(3.1)
    5.0
    """
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= value * (1 - 1e-9))


def round_down(value: float) -> float:
    """The last of 1, 2, 5 times a power of ten.

    >>> round_down(43.0)
    20.0
    """
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= value * (1 + 1e-9))
