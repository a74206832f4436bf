"""Available diagrams, and formatting of numbers in drawings."""

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from elastic import FIELDS, Deflection, extremes, sample
from rigid.arrays import Complexes, Reals

TIMES = "\N{MULTIPLICATION SIGN}"
STATIONS = np.linspace(0.0, 1.0, 49)
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


class Diagram(Struct, frozen=True):
    """Field that is drawn across the links.

    `field` is a key of `elastic.FIELDS`, or None for `SHAPE` and `MOTION`. `signed` is True if the field can be
    negative.
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
"""Diagrams by name, as given on the command line."""


def diagram_named(name: str) -> Diagram:
    """Look up a diagram by its name or by the key of its field.

    Raises
    ------
    ValueError
        If the name is unknown. The message lists the known names.
    """
    if name in FIELDS:
        name = FIELDS[name].slug
    if name not in DIAGRAMS:
        raise ValueError(f'there is no diagram "{name}": choose from {", ".join(DIAGRAMS)}')
    return DIAGRAMS[name]


def displacements(deflection: Deflection) -> Complexes:
    """Return the displacements u + i w of the beams at `STATIONS` [m], shape (beams, positions, stations)."""
    return sample(deflection, "u", STATIONS) + 1j * sample(deflection, "w", STATIONS)


def values_of(deflection: Deflection, diagram: Diagram) -> Reals:
    """Return the field of a diagram, or the magnitude of the displacement if it has no field, at `STATIONS`.

    The shape is (beams, positions, stations).
    """
    if diagram.field is None:
        return np.abs(displacements(deflection))
    return sample(deflection, diagram.field, STATIONS)


def peak(deflection: Deflection, diagram: Diagram) -> float:
    """Return the largest magnitude of the field of a diagram, or the largest displacement [m] for `SHAPE`."""
    if diagram is MOTION:
        return 0.0
    if diagram.field is None:
        values = np.append(values_of(deflection, diagram), np.abs(deflection.shift))
    else:
        values = np.abs(extremes(deflection, (diagram.field,))[diagram.field].value)
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else 0.0


def round_below(value: float) -> float:
    """Round a positive value down to 1, 2 or 5 times a power of ten.

    >>> round_below(0.43), round_below(12.0), round_below(2.0)
    (0.2, 10.0, 2.0)
    """
    power = math.floor(math.log10(value) + 1e-12)
    lead = next(digit for digit in (5, 2, 1) if digit <= value / 10.0**power * (1 + 1e-9))
    return lead * 10.0**power if power >= 0 else lead / 10.0**-power


def steady(greatest: float, unit: str) -> Callable[[float], str]:
    """Return a formatter that uses the same prefix and number of decimals for all values up to `greatest`.

    This keeps the width of the text constant in films.

    >>> written = steady(0.0627, "s")
    >>> written(0.0005), written(0.0627)
    ('0.5 ms', '62.7 ms')
    """
    exponent = _exponent(float(f"{greatest:.2e}"))
    size = greatest / 10.0**exponent
    decimals = 2 - (len(str(int(size))) - 1) if size else 0

    def text(value: float) -> str:
        rounded = round(value / 10.0**exponent, decimals) + 0.0  # avoid "-0"
        return f"{rounded:.{decimals}f} {PREFIXES[exponent]}{unit}"

    return text


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Format a value with its unit and an SI prefix.

    >>> quantity(2.5e-4, "m"), quantity(0.0, "N"), quantity(-1500.0, "N/m")
    ('250 µm', '0 N', '-1.5 kN/m')
    """
    size = float(f"{abs(value):.{digits - 1}e}")
    exponent = _exponent(size)
    return f"{value / 10.0**exponent:.{digits}g} {PREFIXES[exponent]}{unit}"


def times(exaggeration: float) -> str:
    """Format an exaggeration factor.

    >>> times(2e6).split(), times(0.5)
    (['×', '2', '000', '000'], '× 0.5')
    """
    return f"{TIMES} {exaggeration:,.10g}".replace(",", "\N{THIN SPACE}")


def _exponent(size: float) -> int:
    """Return the power of ten of the SI prefix for a value, a multiple of three from -12 to 9."""
    return min(max(3 * math.floor(math.log10(size) / 3 + 1e-12), -12), 9) if size else 0
