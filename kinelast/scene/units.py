"""Quantities as they stand in a file: a number in SI units, or a string with a unit; floats in SI units inside."""

from __future__ import annotations

import re
from functools import cache
from math import inf, nan
from typing import Any, ClassVar, Self

from kinelast.scene.error import likely, plain

# A registry of what mechanisms need: pint's own takes thirty times as long to load, counts an angle as no dimension
# and so reads 50 Hz as 50 rad/s.
DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = u- = µ- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m = metre
gram = [mass] = g
second = [time] = s
radian = [angle] = rad
kelvin = [temperature] = K
inch = 0.0254 * meter = in
foot = 12 * inch = ft = feet
tonne = 1000 * kilogram = t
liter = 1e-3 * meter ** 3 = l = L = litre
pound = 0.45359237 * kilogram = lb
minute = 60 * second = min
hour = 60 * minute = h
turn = 6.283185307179586476925 * radian = _ = rev = revolution = turns
degree = turn / 360 = deg = °
rpm = turn / minute
newton = kilogram * meter / second ** 2 = N
pound_force = 4.4482216152605 * newton = lbf
pascal = newton / meter ** 2 = Pa
bar = 100000 * pascal
psi = pound_force / inch ** 2
ksi = 1000 * psi
joule = newton * meter = J
watt = joule / second = W
"""
COMMON = ("mm", "cm", "m", "in", "kg", "g", "s", "ms", "deg", "rad", "rpm", "rad/s", "m/s", "N", "kN", "MPa", "GPa",
          "N m", "N mm", "kN m", "N/m", "kg/m", "kg/m^3", "kg m^2", "K")  # fmt: skip
USUAL = {  # what most scenes are written in, as pint would have it, which takes a fifth of a second to load
    "m": (1.0, "m"), "mm": (0.001, "m"), "cm": (0.01, "m"), "kg": (1.0, "kg"), "g": (0.001, "kg"), "s": (1.0, "s"),
    "ms": (0.001, "s"), "rad": (1.0, "rad"), "deg": (0.017453292519943295, "rad"), "rad/s": (1.0, "rad/s"),
    "rpm": (0.10471975511965977, "rad/s"), "m/s": (1.0, "m/s"), "N": (1.0, "N"), "kN": (1000.0, "N"),
    "N m": (1.0, "N m"), "N/m": (1.0, "N/m"), "MPa": (1e6, "Pa"), "GPa": (1e9, "Pa"), "kg/m": (1.0, "kg/m"),
    "kg/m^3": (1.0, "kg/m^3"), "kg m^2": (1.0, "kg m^2"),
    "N m^2": (1.0, "N m^2"), "MN": (1e6, "N"), "kN/m": (1000.0, "N/m"),
}  # fmt: skip
MOST_BITS = 10_000
LONGEST = 80  # letters of a quantity
SMALLEST, LARGEST = 1e-50, 1e50  # whose fourth power, as in a second moment of area, is still a number
# One digit to a power, and no power of a power: the parser of units multiplies whatever it is told to.
POWER = re.compile(r"(?:\^|\*\*)\s*(?:\(\s*[-+]?\d\s*\)|[-+]?\d)(?![\d.])(?!\s*(?:\^|\*\*))")
FORM = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµμ°][A-Za-zµμ°0-9\s*/^()-]*|1\s*/.*)")
# Written together, as torque wrenches have it; a power belongs to the metre.
JOINED = re.compile(r"(?<![\wµμ°])([mkM]?N)([cm]?m)((?:\s*(?:\^|\*\*)\s*\d+)?)(?!\s*(?:\^|\*\*)|\w)")
TYPESET = str.maketrans({"²": "^2", "³": "^3", "⁴": "^4", "·": " ", "⋅": " ", "\N{MINUS SIGN}": "-"})


@cache
def registry() -> Any:
    """The units known to scenes."""
    import pint

    units: Any = pint.UnitRegistry(None)
    units.load_definitions(DEFINITIONS.strip().splitlines())
    return units


class Quantity(float):
    """A quantity read from a file.

    Attributes
    ----------
    expected
        What a file has to hold, for messages.
    units
        SI units of the dimensions that will do.
    above, least, most
        Bounds: greater than the one, at least the other; no larger than `most` in either direction.
    unit
        Of an instance: the one of `units` it is in; empty for a bare number where there are several.
    per_length
        Of an instance: metres in the unit that the file has bare lengths in, where `unit` is empty; else 1.
    each
        Of an instance that stands for many designs: their numbers, shape (designs, 1), the instance itself being nan;
        else None. See `kinelast.scene.numbers`.
    written
        Of an instance: the unit as it stands in the file; empty for a bare number.
    """

    expected: ClassVar[str] = "a number"
    units: ClassVar[tuple[str, ...]] = ("",)
    above: ClassVar[float] = -inf
    least: ClassVar[float] = -inf
    most: ClassVar[float] = LARGEST
    unit: str
    per_length: float
    each: Any = None
    written: str = ""

    def __init_subclass__(cls, **told: Any) -> None:
        for name, value in told.items():
            setattr(cls, name, value)

    @classmethod
    def read(cls, value: object, per_length: float = 1.0) -> Self:
        """From a number or a string.

        Parameters
        ----------
        per_length
            Metres in the unit that bare lengths are in.

        Raises
        ------
        ValueError
            Neither, an unknown unit, another dimension or out of bounds; the message says what was expected.

        Examples
        --------
        >>> from kinelast.scene.quantities import Length
        >>> Length.read("12 mm")
        0.012
        """
        written = ""
        if isinstance(value, str):
            number, unit, written = cls._converted(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            number, unit = _float(value), cls.units[0] if len(cls.units) == 1 else ""
            number *= per_length if unit == "m" else 1.0
            if per_length != 1.0 and unit in ("m^2", "m^4"):
                raise ValueError(f"expected {cls.expected}, in quotes with its unit where units are given")
        else:
            raise ValueError(f"expected {cls.expected}, got {shown(value)}")
        if not cls.holds(number):
            raise ValueError(f"expected {cls.expected}, {cls.bound(number)}, got {shown(value)}")
        quantity = cls(number)
        quantity.unit, quantity.per_length = unit, 1.0 if unit else per_length
        quantity.written = written
        return quantity

    @classmethod
    def holds(cls, number: Any) -> Any:
        """Whether a number in SI units, or every one of an array, is within the bounds."""
        occurs = (abs(number) < cls.most) & ((cls.above != 0) | (number <= 0) | (number >= SMALLEST))
        return occurs & (number > cls.above) & (number >= cls.least)

    @classmethod
    def bound(cls, number: float) -> str:
        """The bound that a number violates, in words."""
        if not abs(number) < cls.most or (cls.above == 0 and 0 < number < SMALLEST):
            return "a number of a size that occurs"
        return "greater than zero" if cls.above == 0 else "not below zero"

    @classmethod
    def many(cls, each: Any, unit: str) -> Self:
        """The quantity for many designs; `each` in one of `units`, shape (designs, 1)."""
        quantity = cls(nan)
        quantity.unit, quantity.per_length, quantity.each = unit, 1.0, each
        return quantity

    @classmethod
    def of_unit(cls, unit: str, value: object, per_length: float = 1.0) -> float:
        """A number or a text with its unit in a given SI unit; "1" for none. `per_length` as for `read`.

        Raises
        ------
        ValueError
            As `read`.
        """
        none = unit in ("", "1")
        expected = "a number" if none else f"a number, or a text with a unit, in {unit}"
        kind: type[Quantity] = type("Any", (Quantity,), {"expected": expected, "units": ("",) if none else (unit,)})
        return float(kind.read(value, per_length))

    def within(self, unit: str) -> Any:
        """The number in the one of `units` that is meant: a bare length is in the file's own."""
        number = float(self) if self.each is None else self.each
        return number * (self.per_length if unit == "m" and not self.unit else 1.0)

    @classmethod
    def _converted(cls, text: str) -> tuple[float, str, str]:
        """Number in SI units, the unit, and the one that is written."""
        plain = text.translate(TYPESET)
        form = FORM.fullmatch(plain) if len(text) <= LONGEST else None
        if form is None or len(POWER.findall(plain)) < len(re.findall(r"\^|\*\*", plain)):
            raise ValueError(f"expected {cls.expected}, got {shown(text)}")
        number, name = float(form[1]), form[2].strip()
        try:
            known = _factor(name, cls.units)
        except Exception as error:  # pint's parser raises whatever it stumbles over
            names = getattr(error, "unit_names", None)
            told = _unknown(names, name, cls.units) if names else f"got {shown(text)}"
            raise ValueError(f"expected {cls.expected}, {told}") from None
        if known is None:
            raise ValueError(f"expected {cls.expected}, got {shown(text)}")
        factor, unit = known
        return number * factor, unit, name


@cache
def _factor(name: str, units: tuple[str, ...]) -> tuple[float, str] | None:
    """Factor of a unit to the SI unit of its dimension among some, and that SI unit; None where none has its dimension.

    Looked up once for all scenes of a batch: pint takes longer than the deflection. Raises whatever its parser does.
    """
    if name in USUAL and USUAL[name][1] in units:
        return USUAL[name]
    given = registry().parse_units(JOINED.sub(r"(\1 \2\3)", name))
    for unit in units:
        if registry().get_dimensionality(given) == registry().get_dimensionality(registry().parse_units(unit)):
            return float(registry().convert(1.0, given, unit)), unit
    return None


def _float(value: float) -> float:
    """As a float; infinite where a whole number is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return inf


def _unknown(names: Any, whole: str, units: tuple[str, ...]) -> str:
    """The message on an unknown unit, with the nearest one: of the right dimension where it stands alone."""
    name = names if isinstance(names, str) else next(iter(names))
    dimension = registry().get_dimensionality
    wanted = [dimension(registry().parse_units(unit)) for unit in units]
    fitting = [
        unit
        for unit in COMMON
        if (unit.isalpha() if name != whole else dimension(registry().parse_units(unit)) in wanted)
    ]
    hint = likely(name, fitting).partition("; there is")[0] if len(name) > 1 else ""
    return f'but there is no unit "{name}"{hint}'


def shown(value: object) -> str:
    """A value of a file, for a message."""
    if isinstance(value, str):
        return f'"{plain(value, LONGEST)}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > MOST_BITS:  # which Python may refuse to print
        return f"a whole number of some {value.bit_length() * 3 // 10} digits"
    return "a table" if isinstance(value, dict) else plain(str(value), LONGEST)


def written_like(there: Any, value: float, unit: str, digits: int, per_bare: float = 1.0) -> str | float:
    """A value in an SI unit as it is written where another stands: in the unit of that; bare where it has none.

    Parameters
    ----------
    per_bare
        SI units of a number without a unit.

    Raises
    ------
    ValueError
        A unit stands there that is of another kind.
    """
    if isinstance(there, str) and (form := FORM.fullmatch(there.translate(TYPESET))):
        return f"{value / float(Quantity.of_unit(unit, f'1 {form[2]}')):.{digits}g} {form[2].strip()}"
    return float(f"{value / per_bare:.{digits}g}")
