"""The kinds of quantities that tell a cross-section and its material."""

from __future__ import annotations

from typing import ClassVar, Self

from kinelast.scene.quantities import Size
from kinelast.scene.units import Quantity, shown

STEEPEST = 1e3  # times that a size may change along a beam


class Stress(Quantity):
    """Stress or modulus [Pa]."""

    expected = 'a stress, as in "210 GPa" or 210e9'
    units = ("Pa",)
    above = 0.0


class Area(Quantity):
    """Area [m^2]."""

    expected = 'an area, as in "60 mm^2" or 6e-5'
    units = ("m^2",)
    above = 0.0


class SecondMoment(Quantity):
    """Second moment of area [m^4]."""

    expected = 'a second moment of area, as in "180 mm^4" or 1.8e-10'
    units = ("m^4",)
    above = 0.0


class AxialRigidity(Quantity):
    """E A [N]."""

    expected = 'a rigidity E A, as in "12.6 MN" or 12.6e6'
    units = ("N",)
    above = 0.0


class BendingRigidity(Quantity):
    """E I [N m^2]."""

    expected = 'a rigidity E I, as in "37.8 N m^2" or 37.8'
    units = ("N m^2",)
    above = 0.0


class ShearRigidity(AxialRigidity):
    """kappa G A [N]."""

    expected = 'a shear rigidity, as in "3 MN" or 3e6'


class Sizes(tuple[float, float]):
    """A size at the two ends of a beam [m]: `[start, end]`, linear between, or one size for both."""

    expected: ClassVar[str] = 'a length, as in "6 mm", or two for the ends of the beam, as in ["6 mm", "3 mm"]'

    @classmethod
    def read(cls, value: object, per_length: float = 1.0) -> Self:
        """From a number, a string, or a list of two; ValueError says what was expected."""
        ends = value if isinstance(value, list) else [value, value]
        if len(ends) != 2:
            raise ValueError(f"expected {cls.expected}, got {shown(value)}")
        sizes = cls(float(Size.read(end, per_length)) for end in ends)
        if max(sizes) > STEEPEST * min(sizes):
            raise ValueError(f"expected {cls.expected}, not {STEEPEST:g} times apart, got {shown(value)}")
        return sizes
