"""Quantities of a file. Numbers in SI units and strings with a unit are converted to floats in SI units."""

import re
from functools import cache
from math import inf, nan
from typing import Any, ClassVar, Self

from kinelast.values.error import likely, plain

# Units for mechanisms. The default registry of pint takes thirty times as long to load and treats angles as
# dimensionless, so that 50 Hz would be read as 50 rad/s.
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
COMMON_FACTORS = {  # common units, which are converted without the package pint, because it takes 0.2 s to load
    "m": (1.0, "m"), "mm": (0.001, "m"), "cm": (0.01, "m"), "kg": (1.0, "kg"), "g": (0.001, "kg"), "s": (1.0, "s"),
    "ms": (0.001, "s"), "rad": (1.0, "rad"), "deg": (0.017453292519943295, "rad"), "rad/s": (1.0, "rad/s"),
    "rpm": (0.10471975511965977, "rad/s"), "m/s": (1.0, "m/s"), "N": (1.0, "N"), "kN": (1000.0, "N"),
    "N m": (1.0, "N m"), "N/m": (1.0, "N/m"), "MPa": (1e6, "Pa"), "GPa": (1e9, "Pa"), "kg/m": (1.0, "kg/m"),
    "kg/m^3": (1.0, "kg/m^3"), "kg m^2": (1.0, "kg m^2"),
    "N m^2": (1.0, "N m^2"), "MN": (1e6, "N"), "kN/m": (1000.0, "N/m"),
}  # fmt: skip
MAX_BITS = 10_000  # maximum number of bits of an integer in a message
MAX_CHARACTERS = 80  # maximum number of characters of a quantity in a message
MIN_SIZE, MAX_SIZE = 1e-50, 1e50  # the fourth power of a value, e.g. of an area moment, is finite
# only exponents with one digit and no powers of powers, because the parser of pint evaluates any power
POWER = re.compile(r"(?:\^|\*\*)\s*(?:\(\s*[-+]?\d\s*\)|[-+]?\d)(?![\d.])(?!\s*(?:\^|\*\*))")
FORM = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµμ°][A-Za-zµμ°0-9\s*/^()-]*|1\s*/.*)")
# "Nm" without a space; an exponent applies to the metre
JOINED = re.compile(r"(?<![\wµμ°])([mkM]?N)([cm]?m)((?:\s*(?:\^|\*\*)\s*\d+)?)(?!\s*(?:\^|\*\*)|\w)")
TYPESET = str.maketrans({"²": "^2", "³": "^3", "⁴": "^4", "·": " ", "⋅": " ", "\N{MINUS SIGN}": "-"})


@cache
def registry() -> Any:
    """Return the registry of all units that a scene can use."""
    import pint

    units: Any = pint.UnitRegistry(None)
    units.load_definitions(DEFINITIONS.strip().splitlines())
    return units


class Quantity(float):
    """A quantity read from a file.

    Attributes
    ----------
    expected
        Description of the expected value for messages.
    units
        SI units of the accepted dimensions.
    above, least, most
        Bounds on the value: value > `above`, value >= `least`, and |value| < `most`.
    unit
        Unit of the instance, one of `units`. It is empty for a number without a unit if there are several `units`.
    per_length
        Metres per length unit of the file if `unit` is empty, otherwise 1.
    each
        Values for several designs, shape (designs, 1), or None for a single design. If given, the float itself is nan.
        See `kinelast.values.numbers`.
    written
        Unit as written in the file; empty for a number without a unit.
    """

    expected: ClassVar[str] = "a number"
    units: ClassVar[tuple[str, ...]] = ("",)
    above: ClassVar[float] = -inf
    least: ClassVar[float] = -inf
    most: ClassVar[float] = MAX_SIZE
    unit: str
    per_length: float
    each: Any = None
    written: str = ""

    def __init_subclass__(cls, **attributes: Any) -> None:
        for name, value in attributes.items():
            setattr(cls, name, value)

    @classmethod
    def read(cls, value: object, per_length: float = 1.0) -> Self:
        """Read a quantity from a number or a string.

        Parameters
        ----------
        per_length
            Metres per length unit of the file, for lengths without a unit.

        Raises
        ------
        ValueError
            The value is neither a number nor a string, has an unknown unit or the wrong dimension, or is out of bounds.
            The message describes the expected value.

        Examples
        --------
        >>> from kinelast.values.quantities import Length
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
        """Return whether numbers in SI units are within the bounds."""
        occurs = (abs(number) < cls.most) & ((cls.above != 0) | (number <= 0) | (number >= MIN_SIZE))
        return occurs & (number > cls.above) & (number >= cls.least)

    @classmethod
    def bound(cls, number: float) -> str:
        """Return the violated bound in words."""
        if not abs(number) < cls.most or (cls.above == 0 and 0 < number < MIN_SIZE):
            return "a number of a size that occurs"
        return "greater than zero" if cls.above == 0 else "not below zero"

    @classmethod
    def many(cls, each: Any, unit: str) -> Self:
        """Return a quantity for several designs.

        `each` contains the value of each design in `unit`, shape (designs, 1).
        """
        quantity = cls(nan)
        quantity.unit, quantity.per_length, quantity.each = unit, 1.0, each
        return quantity

    @classmethod
    def of_unit(cls, unit: str, value: object, per_length: float = 1.0) -> float:
        """Convert a number, or a text with a unit, to the SI unit `unit` ("1" for dimensionless numbers).

        `per_length` is as in `read`.

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
        """Return the number in `unit`, which is one of `units`.

        A length without a unit is in the length unit of the file.
        """
        number = float(self) if self.each is None else self.each
        return number * (self.per_length if unit == "m" and not self.unit else 1.0)

    @classmethod
    def _converted(cls, text: str) -> tuple[float, str, str]:
        """Return the number in SI units, the SI unit, and the unit as written in the text."""
        plain = text.translate(TYPESET)
        form = FORM.fullmatch(plain) if len(text) <= MAX_CHARACTERS else None
        if form is None or len(POWER.findall(plain)) < len(re.findall(r"\^|\*\*", plain)):
            raise ValueError(f"expected {cls.expected}, got {shown(text)}")
        number, name = float(form[1]), form[2].strip()
        try:
            known = _factor(name, cls.units)
        except Exception as error:  # the parser of pint raises many types of errors
            names = getattr(error, "unit_names", None)
            problem = _unknown(names, name, cls.units) if names else f"got {shown(text)}"
            raise ValueError(f"expected {cls.expected}, {problem}") from None
        if known is None:
            raise ValueError(f"expected {cls.expected}, got {shown(text)}")
        factor, unit = known
        return number * factor, unit, name


@cache
def _factor(name: str, units: tuple[str, ...]) -> tuple[float, str] | None:
    """Return the factor from the unit `name` to one of `units`, and this SI unit.

    Return None if no unit has the same dimension. The result is cached, because pint takes longer than the computation
    of a deflection. Errors of the parser of pint are not caught.
    """
    if name in COMMON_FACTORS and COMMON_FACTORS[name][1] in units:
        return COMMON_FACTORS[name]
    given = registry().parse_units(JOINED.sub(r"(\1 \2\3)", name))
    for unit in units:
        if registry().get_dimensionality(given) == registry().get_dimensionality(registry().parse_units(unit)):
            return float(registry().convert(1.0, given, unit)), unit
    return None


def _float(value: float) -> float:
    """Return a number as a float, or inf if an integer is too large for a float."""
    try:
        return float(value)
    except OverflowError:
        return inf


def _unknown(names: Any, whole: str, units: tuple[str, ...]) -> str:
    """Return the message about an unknown unit. It suggests the most similar unit of the right dimension."""
    name = names if isinstance(names, str) else next(iter(names))
    dimension = registry().get_dimensionality
    dimensions = [dimension(registry().parse_units(unit)) for unit in units]
    fitting = [
        unit
        for unit in COMMON
        if (unit.isalpha() if name != whole else dimension(registry().parse_units(unit)) in dimensions)
    ]
    hint = likely(name, fitting).partition("; there is")[0] if len(name) > 1 else ""
    return f'but there is no unit "{name}"{hint}'


def shown(value: object) -> str:
    """Return a value from a file as text for a message."""
    if isinstance(value, str):
        return f'"{plain(value, MAX_CHARACTERS)}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > MAX_BITS:  # Python may refuse to print such an integer
        return f"a whole number of some {value.bit_length() * 3 // 10} digits"
    return "a table" if isinstance(value, dict) else plain(str(value), MAX_CHARACTERS)


def written_like(there: Any, value: float, unit: str, digits: int, per_bare: float = 1.0) -> str | float:
    """Return a value as text in the unit of `there`, which it replaces, or as a number if `there` has no unit.

    Parameters
    ----------
    per_bare
        SI value of the number 1 if it is written without a unit.

    Raises
    ------
    ValueError
        The replaced value has a unit of another dimension.
    """
    if isinstance(there, str) and (form := FORM.fullmatch(there.translate(TYPESET))):
        return f"{value / float(Quantity.of_unit(unit, f'1 {form[2]}')):.{digits}g} {form[2].strip()}"
    return float(f"{value / per_bare:.{digits}g}")
