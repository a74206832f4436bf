"""The shapes of cross-sections in a scene file; a new one is a table here and its function in `elastic.SHAPES`."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.scene.error import fault
from kinelast.scene.format_motion import Table
from kinelast.scene.many import real, require
from kinelast.scene.quantities import MassPerLength, Size
from kinelast.scene.section_quantities import Area, AxialRigidity, BendingRigidity, SecondMoment, ShearRigidity, Sizes


class Dimensioned(Table, frozen=True, kw_only=True, tag_field="shape"):
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


class Properties(Table, frozen=True, kw_only=True, tag_field="shape", tag="properties"):
    """Any shape: area, second moment of area, distance of the outermost fibre, area that resists shear."""

    A: Area
    I: SecondMoment  # noqa: E741
    c: Size | None = None
    shear_area: Area | None = None


class Rigidities(Table, frozen=True, kw_only=True, tag_field="shape", tag="rigidities"):
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
