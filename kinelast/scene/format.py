"""The tables and keys of a scene file: sections, materials, links, and the scene as a whole.

A new shape of cross-section is a table here, and its function in `elastic.SHAPES`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from kinelast.scene.error import fault
from kinelast.scene.numbers import real, require
from kinelast.scene.quantities import (
    Acceleration,
    Allowance,
    Area,
    AxialRigidity,
    BendingRigidity,
    Density,
    Direction,
    Duration,
    Expansion,
    Inertia,
    Length,
    Mass,
    MassPerLength,
    SecondMoment,
    Share,
    ShearRigidity,
    Size,
    Sizes,
    Stress,
    Warming,
)
from kinelast.scene.tables import (
    Amount,
    BearingTable,
    CylinderTable,
    DriveTable,
    FatigueTable,
    GearTable,
    JointTable,
    LengthUnit,
    LimitsTable,
    LoadTable,
    MotorTable,
    Name,
    OptimizeTable,
    Place,
    SensitivitiesTable,
    SliderTable,
    SlotTable,
    SpringTable,
    StrictTable,
    SweepTable,
    ToleranceTable,
    WeldTable,
)
from kinelast.scene.units import Quantity


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


class Box(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="box"):
    """A hollow rectangle, `depth` in the plane of motion; `corner` is its outer radius."""

    depth: Sizes
    width: Sizes
    wall: Sizes
    corner: Sizes | None = None

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Depth, width, wall and corner at the two ends of the beam [m]."""
        corner = _or_none(self.corner)
        for depth, width, wall, radius in zip(self.depth, self.width, self.wall, corner, strict=True):
            half = np.minimum(real(depth), real(width)) / 2
            _require_smaller(table, "wall", "less than half of depth and width", real(wall), half)
            _require_smaller(table, "corner", "less than half of depth and width", real(radius), half)
        return self.depth, self.width, self.wall, corner


class ISection(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="I"):
    """An I with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    depth: Sizes
    width: Sizes
    web: Sizes
    flange: Sizes
    fillet: Sizes | None = None

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Depth, width, web, flange and fillet at the two ends of the beam [m]."""
        sizes = self.depth, self.width, self.web, self.flange, _or_none(self.fillet)
        for depth, width, web, flange, fillet in zip(*sizes, strict=True):
            room = real(depth) / 2 - real(flange)
            _require_smaller(table, "flange", "less than half of depth", real(flange), real(depth) / 2)
            _require_smaller(table, "web", "less than width", real(web), real(width))
            _require_smaller(table, "fillet", "room for it beside the web and above the axis", real(fillet),
                             np.minimum(room, (real(width) - real(web)) / 2))  # fmt: skip
        return sizes


def _or_none(sizes: Any) -> Any:
    """Sizes at the two ends; none where they are not given."""
    return (0.0, 0.0) if sizes is None else sizes


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


SectionTable = Rectangle | Circle | Tube | Box | ISection | Properties | Rigidities


def _require_smaller(table: str, key: str, expected: str, size: Any, bound: Any) -> None:
    """Raise where a size of a tube is not below its bound [m]."""

    def problem(of: Any) -> str:
        return f"expected {expected}, {of(bound):g} m, got {of(size):g} m"

    require(size < bound, table, key, problem)


Strain = Annotated[float, Meta(ge=-0.1, le=0.1)]


class MaterialTable(StrictTable, frozen=True, kw_only=True):
    """The material of links."""

    E: Stress
    density: Density
    poisson: Annotated[float, Meta(gt=-1, le=0.5)] | None = None
    G: Stress | None = None
    yield_stress: Stress | None = field(default=None, name="yield")
    expansion: Expansion | None = None
    damping: Duration | None = None
    ultimate: Stress | None = None
    endurance: Stress | None = None
    slope: Annotated[float, Meta(gt=1)] = 5.0
    knee: Annotated[float, Meta(gt=0)] = 1e6


class BeamTable(StrictTable, frozen=True, kw_only=True):
    """A straight piece of a link."""

    start: str = field(name="from")
    end: str = field(name="to")
    section: str | None = None
    material: str | None = None
    strain: Strain | None = None
    temperature: Warming | None = None


class LinkTable(StrictTable, frozen=True, kw_only=True):
    """A link: its points, beams, masses and outline."""

    points: list[str] | dict[str, Place]
    length: Size | None = None
    section: str | None = None
    material: str | None = None
    beams: list[tuple[str, str] | BeamTable] | None = None
    strain: Strain | None = None
    temperature: Warming | None = None
    rigid: bool = False
    mass: Mass | None = None
    center: str | Place | None = None
    inertia: Inertia | None = None
    masses: dict[str, Mass] = field(default_factory=dict)
    outline: list[str | Place] = field(default_factory=list)


class RunTable(StrictTable, frozen=True, kw_only=True):
    """Which positions are computed, gravity, the theories of beams and of motion, and the output."""

    positions: Annotated[int, Meta(ge=1, le=1_000_000)] = 360
    duration: Duration | None = None
    gravity: tuple[Acceleration, Acceleration] | None = None
    beams: Literal["euler-bernoulli", "timoshenko"] | None = None
    theory: Literal["quasi-static", "elastodynamic", "geometrically-exact"] | None = None
    accuracy: Share | None = None
    damping_ratio: Annotated[float, Meta(gt=0, lt=1)] | None = None
    tolerance: Annotated[float, Meta(gt=0, le=1e-3)] = 1e-10
    steps: Annotated[int, Meta(ge=1, le=1_000_000_000)] = 1000
    output: str = ""
    settled: Allowance | None = None
    report_units: Literal["SI", "mm", "in"] | None = None


class SceneTable(StrictTable, frozen=True, kw_only=True):
    """A planar mechanism of rigid and elastic links, its drives and loads."""

    title: str = ""
    source: str = ""
    units: LengthUnit = "m"
    structure_only: bool = False
    materials: dict[Name, MaterialTable] = field(default_factory=dict)
    sections: dict[Name, SectionTable] = field(default_factory=dict)
    points: dict[Name, Place]
    links: dict[Name, LinkTable]
    sliders: dict[Name, SliderTable] = field(default_factory=dict)
    slots: dict[Name, SlotTable] = field(default_factory=dict)
    welds: dict[Name, WeldTable] = field(default_factory=dict)
    contacts: dict[Name, ContactTable] = field(default_factory=dict)
    joints: dict[Name, JointTable] = field(default_factory=dict)
    masses: dict[Name, Mass] = field(default_factory=dict)
    drives: list[DriveTable] = field(default_factory=list)
    motors: dict[Name, MotorTable] = field(default_factory=dict)
    cylinders: dict[Name, CylinderTable] = field(default_factory=dict)
    loads: list[LoadTable] = field(default_factory=list)
    gears: list[GearTable] = field(default_factory=list)
    springs: list[SpringTable] = field(default_factory=list)
    bearings: dict[Name, BearingTable] = field(default_factory=dict)
    fatigue: FatigueTable | None = None
    limits: LimitsTable = field(default_factory=LimitsTable)
    run: RunTable = field(default_factory=RunTable)
    sweep: SweepTable = field(default_factory=SweepTable)
    sensitivities: SensitivitiesTable = field(default_factory=SensitivitiesTable)
    tolerances: dict[str, Amount | ToleranceTable] = field(default_factory=dict)
    optimize: OptimizeTable = field(default_factory=OptimizeTable)


def read_quantity(kind: type, value: Any, per_length: float = 1.0) -> Any:
    """A quantity from its value in a file; msgspec's `dec_hook`. `per_length`: metres to a bare length."""
    if issubclass(kind, Direction):
        return kind.read(value)
    if issubclass(kind, Quantity | Sizes):
        return kind.read(value, per_length)
    raise NotImplementedError(kind)


Part = Annotated[float, Meta(ge=-1e9, le=1e9)]


class ContactTable(StrictTable, frozen=True, kw_only=True):
    """Two links that touch: they roll on each other, or slip along the tangent where a normal is given."""

    links: tuple[str, str]
    at: Place
    normal: Direction | None = None


class SpatialJointTable(StrictTable, frozen=True, kw_only=True):
    """A joint between two links in space."""

    links: tuple[str, str]
    type: str
    at: tuple[Length, Length, Length] | None = None
    axis: tuple[Part, Part, Part] | None = None
    normal: tuple[Part, Part, Part] | None = None
    pitch: Length | None = None


class ChainTable(StrictTable, frozen=True, kw_only=True):
    """A chain of joints in space, of which the structure is asked."""

    title: str = ""
    source: str = ""
    units: LengthUnit = "m"
    fixed: str | None = None
    joints: dict[Name, SpatialJointTable] = field(default_factory=dict)
