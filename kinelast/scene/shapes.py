"""Shapes of cross-sections in a scene file, and the quantities that tell them.

A new shape is a table here, and its function in `elastic.SHAPES`.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from kinelast.scene.error import fault
from kinelast.scene.format_motion import StrictTable
from kinelast.scene.many import real, require
from kinelast.scene.quantities import MassPerLength, Size
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
        """From a number, a string, or a list of two; ValueError tells the form expected."""
        ends = value if isinstance(value, list) else [value, value]
        if len(ends) != 2:
            raise ValueError(f"expected {cls.expected}, got {shown(value)}")
        sizes = cls(float(Size.read(end, per_length)) for end in ends)
        if max(sizes) > STEEPEST * min(sizes):
            raise ValueError(f"expected {cls.expected}, not {STEEPEST:g} times apart, got {shown(value)}")
        return sizes


class Dimensioned(StrictTable, frozen=True, kw_only=True, tag_field="shape"):
    """A cross-section by its dimensions: its keys, in order, are those that the function of its shape takes."""

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Each of them at the two ends of the beam [m]; `table` is for messages."""
        return tuple(getattr(self, key) for key in self.__struct_fields__)


class Rectangle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="rectangle"):
    """A solid rectangle, `depth` in the plane of motion."""

    depth: Sizes
    width: Sizes


class Circle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="circle"):
    """A solid circle."""

    diameter: Sizes


class Tube(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="tube"):
    """A circular tube by its outer diameter, and its inner one or its wall."""

    outer: Sizes
    inner: Sizes | None = None
    wall: Sizes | None = None

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """The outer and inner diameters at the two ends of the beam [m]."""
        if (self.inner is None) == (self.wall is None):
            raise fault(table, "inner", "a tube needs inner or wall, one of them")
        if self.inner is not None:
            for outer, inner in zip(self.outer, self.inner, strict=True):
                _require_smaller(table, "inner", "a diameter below outer", real(inner), real(outer))
            return self.outer, self.inner
        assert self.wall is not None
        inside = []
        for outer, wall in zip(self.outer, self.wall, strict=True):
            _require_smaller(table, "wall", "less than half of outer", real(wall), real(outer) / 2)
            inside.append(real(outer) - 2 * real(wall))
        return self.outer, [inside[0]] * 2 if np.array_equal(*inside) else inside


class Properties(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="properties"):
    """Any shape: area, second moment of area, distance of the outermost fibre, area that resists shear."""

    A: Area
    I: SecondMoment  # noqa: E741
    c: Size | None = None
    shear_area: Area | None = None


class Rigidities(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="rigidities"):
    """A beam without a material."""

    EA: AxialRigidity
    EI: BendingRigidity
    mass_per_length: MassPerLength
    kGA: ShearRigidity | None = None


SectionTable = Rectangle | Circle | Tube | Properties | Rigidities


def _require_smaller(table: str, key: str, expected: str, size: Any, bound: Any) -> None:
    """Raise where a size of a tube is not below its bound [m]."""

    def problem(of: Any) -> str:
        return f"expected {expected}, {of(bound):g} m, got {of(size):g} m"

    require(size < bound, table, key, problem)
