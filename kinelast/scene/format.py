"""The tables and keys of a scene file: the parts of a mechanism, and the scene as a whole."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from kinelast.scene.format_motion import (
    DriveTable,
    GearTable,
    JointTable,
    LengthUnit,
    LoadTable,
    Name,
    Place,
    SliderTable,
    SlotTable,
    SpringTable,
    StrictTable,
    WeldTable,
)
from kinelast.scene.format_studies import (
    Amount,
    LimitsTable,
    OptimizeTable,
    SensitivitiesTable,
    SweepTable,
    ToleranceTable,
)
from kinelast.scene.quantities import (
    Acceleration,
    Density,
    Direction,
    Duration,
    Expansion,
    Inertia,
    Length,
    Mass,
    Share,
    Size,
    Warming,
)
from kinelast.scene.shapes import SectionTable, Sizes, Stress
from kinelast.scene.units import Quantity

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
    report_units: Literal["SI", "mm", "in"] = "SI"


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
    loads: list[LoadTable] = field(default_factory=list)
    gears: list[GearTable] = field(default_factory=list)
    springs: list[SpringTable] = field(default_factory=list)
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
