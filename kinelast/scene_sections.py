"""Cross-sections of beams: what a shape and a material come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import TypeVar

from elastic import Section
from kinelast.scene_error import fault, likely
from kinelast.scene_format import (
    Circle,
    MaterialTable,
    Properties,
    Rectangle,
    Rigidities,
    SceneTable,
    SectionTable,
    Tube,
)

Entry = TypeVar("Entry")


@dataclass(frozen=True)
class CrossSection:
    """Everything known of a beam's cross-section and material, SI units; None for what the scene does not tell.

    Attributes
    ----------
    EA, EI
        Rigidities [N, N m^2].
    mass_per_length
        [kg/m].
    A, I, c
        Area [m^2], second moment of area [m^4], distance of the outermost fibre from the axis [m].
    E, G, yield_stress
        Moduli and yield stress of the material [Pa].
    density
        [kg/m^3].
    """

    EA: float
    EI: float
    mass_per_length: float
    A: float | None = None
    I: float | None = None  # noqa: E741
    c: float | None = None
    E: float | None = None
    G: float | None = None
    yield_stress: float | None = None
    density: float | None = None

    @property
    def elastic(self) -> Section:
        """What the elastic line needs of it."""
        return Section(EA=self.EA, EI=self.EI)


def cross_section(scene: SceneTable, table: str, section: str, material: str | None) -> CrossSection:
    """The cross-section that a link or beam names.

    Parameters
    ----------
    scene
        Holds the materials and sections.
    table
        Of the link, for messages.
    section, material
        Names.
    """
    shape = _named(scene.sections, table, "section", section)
    if isinstance(shape, Rigidities):
        if material is not None:
            raise fault(table, "material", f'the section "{section}" tells its rigidities and mass: leave material out')
        return CrossSection(float(shape.EA), float(shape.EI), float(shape.mass_per_length))
    if material is None:
        known = ", ".join(f'"{name}"' for name in scene.materials) or "none: add [materials.NAME] with E and density"
        raise fault(table, "material", f'the section "{section}" needs a material; there is {known}')
    stuff = _named(scene.materials, table, "material", material)
    A, I, c = _shape(shape, section)  # noqa: E741
    return CrossSection(
        stuff.E * A, stuff.E * I, stuff.density * A, A, I, c, float(stuff.E), _shear_modulus(stuff, material),
        None if stuff.yield_stress is None else float(stuff.yield_stress), float(stuff.density),
    )  # fmt: skip


def _named(tables: Mapping[str, Entry], table: str, key: str, name: str) -> Entry:
    if name not in tables:
        hint = likely(name, tables) or f"; add [{key}s.{name}]"
        raise fault(table, key, f'there is no {key} "{name}"{hint}')
    return tables[name]


def _shape(shape: SectionTable, name: str) -> tuple[float, float, float | None]:
    """A [m^2], I [m^4] and c [m]."""
    if isinstance(shape, Rectangle):
        return shape.width * shape.depth, shape.width * shape.depth**3 / 12, shape.depth / 2
    if isinstance(shape, Circle):
        return pi * shape.diameter**2 / 4, pi * shape.diameter**4 / 64, shape.diameter / 2
    if isinstance(shape, Tube):
        if shape.inner >= shape.outer:
            problem = f"expected a diameter below outer, {shape.outer:g} m, got {shape.inner:g} m"
            raise fault(f"sections.{name}", "inner", problem)
        A = pi * (shape.outer**2 - shape.inner**2) / 4
        return A, A * (shape.outer**2 + shape.inner**2) / 16, shape.outer / 2
    assert isinstance(shape, Properties)
    return float(shape.A), float(shape.I), None if shape.c is None else float(shape.c)


def _shear_modulus(stuff: MaterialTable, name: str) -> float | None:
    if stuff.G is not None and stuff.poisson is not None:
        raise fault(f"materials.{name}", "poisson", "give poisson or G, not both")
    if stuff.poisson is not None:
        return stuff.E / (2 * (1 + stuff.poisson))
    return None if stuff.G is None else float(stuff.G)
