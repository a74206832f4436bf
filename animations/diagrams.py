"""The fields that can be drawn, and numbers as they are written beside a drawing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastic import FIELDS, Deflection, extremes, sample

TIMES = "\N{MULTIPLICATION SIGN}"
STATIONS = np.linspace(0.0, 1.0, 49)
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


@dataclass(frozen=True)
class Diagram:
    """A field drawn across the links: title, symbol, unit, key in `elastic.FIELDS`, and whether it may be negative.

    The deformed shape and the bare motion have no field.
    """

    title: str
    symbol: str
    unit: str
    field: str | None
    signed: bool = True


SHAPE, MOTION = Diagram("Deformed shape", "", "m", None), Diagram("Motion", "", "m", None)
DIAGRAMS = {
    field.slug: Diagram(field.title, field.symbol, field.unit.replace(" ", "·"), field.key, field.signed)
    for field in FIELDS.values()
} | {"shape": SHAPE, "motion": MOTION}
"""Diagrams of pictures and films, by the names that the command takes."""


def diagram_named(name: str) -> Diagram:
    """The diagram of a name or of a field's key.

    Raises
    ------
    ValueError
        There is none; the message lists those there are.
    """
    if name in FIELDS:
        name = FIELDS[name].slug
    if name not in DIAGRAMS:
        raise ValueError(f'there is no diagram "{name}": choose from {", ".join(DIAGRAMS)}')
    return DIAGRAMS[name]


def peak(deflection: Deflection, diagram: Diagram) -> float:
    """Greatest absolute value of a diagram over all beams and positions; of the shape, greatest displacement [m]."""
    if diagram is MOTION:
        return 0.0
    if diagram.field is None:
        moved = sample(deflection, "u", STATIONS) + 1j * sample(deflection, "w", STATIONS)
        values = np.append(np.abs(moved), np.abs(deflection.shift))
    else:
        values = np.abs(extremes(deflection, (diagram.field,))[diagram.field].value)
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else 0.0


def round_below(value: float) -> float:
    """The greatest of 1, 2, 5 times a power of ten that is not above a positive value.

    >>> round_below(0.43), round_below(12.0), round_below(2.0)
    (0.2, 10.0, 2.0)
    """
    power = math.floor(math.log10(value) + 1e-12)
    lead = next(digit for digit in (5, 2, 1) if digit <= value / 10.0**power * (1 + 1e-9))
    return lead * 10.0**power if power >= 0 else lead / 10.0**-power


def steady(greatest: float, unit: str) -> Callable[[float], str]:
    """How to write values up to a greatest one, all with the same prefix and decimals, so that films stay calm.

    >>> written = steady(0.0627, "s")
    >>> written(0.0005), written(0.0627)
    ('0.5 ms', '62.7 ms')
    """
    exponent = _exponent(float(f"{greatest:.2e}"))
    size = greatest / 10.0**exponent
    decimals = 2 - (len(str(int(size))) - 1) if size else 0

    def text(value: float) -> str:
        rounded = round(value / 10.0**exponent, decimals) + 0.0  # no "-0"
        return f"{rounded:.{decimals}f} {PREFIXES[exponent]}{unit}"

    return text


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A value with its unit, the prefix such that one to three figures stand before the point.

    >>> quantity(2.5e-4, "m"), quantity(0.0, "N"), quantity(-1500.0, "N/m")
    ('250 µm', '0 N', '-1.5 kN/m')
    """
    size = float(f"{abs(value):.{digits - 1}e}")
    exponent = _exponent(size)
    return f"{value / 10.0**exponent:.{digits}g} {PREFIXES[exponent]}{unit}"


def times(exaggeration: float) -> str:
    """An exaggeration as it is written.

    >>> times(2e6).split(), times(0.5)
    (['×', '2', '000', '000'], '× 0.5')
    """
    return f"{TIMES} {exaggeration:,.10g}".replace(",", "\N{THIN SPACE}")


def _exponent(size: float) -> int:
    """The power of ten, a multiple of three, that a value's prefix stands for."""
    return min(max(3 * math.floor(math.log10(size) / 3 + 1e-12), -12), 9) if size else 0
