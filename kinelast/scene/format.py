"""The tables and keys of a scene file: sections, materials, links, and the scene as a whole.

A new shape of cross-section is a table here, and its function in `elastic.SHAPES`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta, field

from kinelast.scene.error import fault
from kinelast.scene.numbers import real, require
from kinelast.scene.part import with_parts
from kinelast.scene.parts import PARTS
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
    DriveTable,
    GearTable,
    JointTable,
    LengthUnit,
    LimitsTable,
    LoadTable,
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

    depth: Sizes  #: in the plane of motion
    width: Sizes  #: across it


class Circle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="circle"):
    """A solid circle."""

    diameter: Sizes  #: of the circle


class Tube(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="tube"):
    """A circular tube by its outer diameter, and its inner one or its wall."""

    outer: Sizes  #: diameter
    inner: Sizes | None = None  #: diameter
    wall: Sizes | None = None  #: thickness, instead of `inner`

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

    depth: Sizes  #: in the plane of motion
    width: Sizes  #: across it
    wall: Sizes  #: thickness
    corner: Sizes | None = None  #: outer radius [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Depth, width, wall and corner at the two ends of the beam [m]."""
        corner = _or_none(self.corner)
        for depth, width, wall, radius in zip(self.depth, self.width, self.wall, corner, strict=True):
            half = np.minimum(real(depth), real(width)) / 2
            _require_smaller(table, "wall", "less than half of depth and width", real(wall), half)
            _require_smaller(table, "corner", "less than half of depth and width", real(radius), half)
        return self.depth, self.width, self.wall, corner


class Flanged(Dimensioned, frozen=True, kw_only=True, tag_field="shape"):
    """A web with one flange or two, on one side of it or both."""

    flanges: ClassVar[int]
    sides: ClassVar[int]
    depth: Sizes  #: in the plane of motion
    width: Sizes  #: of the flanges
    web: Sizes  #: thickness
    flange: Sizes  #: thickness
    fillet: Sizes | None = None  #: radius between web and flange [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Depth, width, web, flange and fillet at the two ends of the beam [m]."""
        sizes = self.depth, self.width, self.web, self.flange, _or_none(self.fillet)
        for depth, width, web, flange, fillet in zip(*sizes, strict=True):
            most = real(depth) / self.flanges
            half = "half of depth" if self.flanges == 2 else "depth"
            _require_smaller(table, "flange", f"less than {half}", real(flange), most)
            _require_smaller(table, "web", "less than width", real(web), real(width))
            _require_smaller(table, "fillet", "room for it beside the web and along it", real(fillet),
                             np.minimum(most - real(flange), (real(width) - real(web)) / self.sides))  # fmt: skip
        return sizes


class ISection(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="I"):
    """An I with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    flanges, sides = 2, 2


class TSection(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="T"):
    """A T with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    flanges, sides = 1, 2


class Channel(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="channel"):
    """A channel with its `web` in the plane of motion and its flanges to one side, held from twisting."""

    flanges, sides = 2, 1


class Angle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="angle"):
    """An angle with a leg of `depth` in the plane of motion, free to bend sideways too; held from twisting."""

    depth: Sizes  #: leg in the plane of motion
    width: Sizes  #: leg across it
    wall: Sizes  #: thickness
    fillet: Sizes | None = None  #: radius between the legs [0]
    toe: Sizes | None = None  #: radius at their inner edges [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Depth, width, wall, fillet and toe at the two ends of the beam [m]."""
        sizes = self.depth, self.width, self.wall, _or_none(self.fillet), _or_none(self.toe)
        for depth, width, wall, fillet, toe in zip(*sizes, strict=True):
            least = np.minimum(real(depth), real(width))
            _require_smaller(table, "wall", "less than both legs", real(wall), least)
            _require_smaller(table, "toe", "no more than the wall", real(toe), 1.000001 * real(wall))
            room = least - real(wall) - real(toe)
            _require_smaller(table, "fillet", "room for it between wall and toe", real(fillet), room)
        return sizes


def _or_none(sizes: Any) -> Any:
    """Sizes at the two ends; none where they are not given."""
    return (0.0, 0.0) if sizes is None else sizes


class Outline(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="outline"):
    """Any outline, by its corners: in the plane of motion, then across it. Held from twisting."""

    points: Annotated[list[Place], Meta(min_length=3)] | None = None  #: corners in turn [those of the drawing]
    holes: list[Annotated[list[Place], Meta(min_length=3)]] | None = None  #: corners of each hole [none]
    #: DXF file beside the scene, y in the plane of motion: one closed outline with holes [none]
    drawing: str | None = None


class Properties(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="properties"):
    """Any shape: area, second moment of area, distance of the outermost fibre, area that resists shear."""

    A: Area  #: area
    #: second moment of area
    I: SecondMoment  # noqa: E741
    c: Size | None = None  #: distance of the outermost fibre [no stress]
    shear_area: Area | None = None  #: area that resists shear [no shear]


class Rigidities(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="rigidities"):
    """A beam without a material."""

    EA: AxialRigidity  #: axial
    EI: BendingRigidity  #: bending
    mass_per_length: MassPerLength  #: mass per length
    kGA: ShearRigidity | None = None  #: shear [no shear]


SectionTable = (
    Rectangle | Circle | Tube | Box | ISection | TSection | Channel | Angle | Outline | Properties | Rigidities
)


def _require_smaller(table: str, key: str, expected: str, size: Any, bound: Any) -> None:
    """Raise where a size of a tube is not below its bound [m]."""

    def problem(of: Any) -> str:
        return f"expected {expected}, {of(bound):g} m, got {of(size):g} m"

    require(size < bound, table, key, problem)


Strain = Annotated[float, Meta(ge=-0.1, le=0.1)]


class MaterialTable(StrictTable, frozen=True, kw_only=True):
    """The material of links."""

    E: Stress  #: Young's modulus
    density: Density  #: mass per volume
    poisson: Annotated[float, Meta(gt=-1, le=0.5)] | None = None  #: Poisson's ratio [0.3, and the report says so]
    G: Stress | None = None  #: shear modulus, instead of `poisson`
    yield_stress: Stress | None = field(default=None, name="yield")  #: yield stress, for the safety [none]
    expansion: Expansion | None = None  #: thermal expansion, for `temperature`
    #: beta of Kelvin and Voigt: stress = E (strain + beta d strain/dt) [by `damping_ratio`]
    damping: Duration | None = None
    ultimate: Stress | None = None  #: tensile strength, for `[fatigue]`
    #: endurable amplitude of reversed stress of a smooth bar at the knee, for `[fatigue]`
    endurance: Stress | None = None
    slope: Annotated[float, Meta(gt=1)] = 5.0  #: exponent k of the S-N line
    knee: Annotated[float, Meta(gt=0)] = 1e6  #: cycles at which the S-N line reaches `endurance`
    #: cycles at the end of a second, flatter line; 1e8 for aluminium and austenitic steel [the knee]
    second_knee: Annotated[float, Meta(gt=0)] | None = None
    second_slope: Annotated[float, Meta(gt=1)] = 15.0  #: exponent of the second line


class BeamTable(StrictTable, frozen=True, kw_only=True):
    """A straight piece of a link."""

    start: str = field(name="from")  #: first point
    end: str = field(name="to")  #: second point
    section: str | None = None  #: overrides that of the link [the link's]
    material: str | None = None  #: as `section` [the link's]
    strain: Strain | None = None  #: as `section` [the link's]
    temperature: Warming | None = None  #: as `section` [the link's]


class LinkTable(StrictTable, frozen=True, kw_only=True):
    """A link: its points, beams, masses and outline."""

    #: names, `["A", "B"]`: shape as drawn; or places in link axes, `{A = [0, 0], B = ["30 cm", 0]}`
    points: list[str] | dict[str, Place]
    length: Size | None = None  #: length of a link with two points [as drawn]
    section: str | None = None  #: name under `[sections]`, or a standard name
    material: str | None = None  #: name under `[materials]`, or a standard name
    #: pairs of points joined by straight beams [each point to the next, through points between]
    beams: list[tuple[str, str] | BeamTable] | None = None
    strain: Strain | None = None  #: free strain of the beams, positive if they are longer than drawn [0]
    temperature: Warming | None = None  #: warming since the beams had their length [0]
    rigid: bool = False  #: `true`: no bending
    mass: Mass | None = None  #: mass of a rigid link [by section and material]
    #: centre of mass of a rigid link: a point, or `[x, y]` in link axes [by section and material; a single point]
    center: str | Place | None = None
    inertia: Inertia | None = None  #: about the centre of mass of a rigid link [by section and material, or 0]
    masses: dict[str, Mass] = field(default_factory=dict)  #: point masses, such as `{B = "50 g"}`
    #: corners of its picture: points, or `[x, y]` in link axes
    outline: list[str | Place] = field(default_factory=list)


class RunTable(StrictTable, frozen=True, kw_only=True):
    """Which positions are computed, gravity, the theories of beams and of motion, and the output."""

    positions: Annotated[int, Meta(ge=1, le=1_000_000)] = 360  #: number of positions
    duration: Duration | None = None  #: duration from the start [one cycle]
    gravity: tuple[Acceleration, Acceleration] | None = None  #: components `[x, y]` [none]
    #: `"timoshenko"`: refuse sections without shear; `"euler-bernoulli"`: no shear, no rotary inertia [shear if the
    #: section has it]
    beams: Literal["euler-bernoulli", "timoshenko"] | None = None
    #: theory of motion [chosen by `accuracy`]
    theory: Literal["quasi-static", "elastodynamic", "geometrically-exact"] | None = None
    accuracy: Share | None = None  #: allowed error; selects the cheapest theory, instead of `theory` [5 %]
    #: at the lowest natural frequency over the cycle, for materials without `damping` [0.01]
    damping_ratio: Annotated[float, Meta(gt=0, lt=1)] | None = None
    tolerance: Annotated[float, Meta(gt=0, le=1e-3)] = 1e-10  #: relative tolerance of a step of an integrated motion
    #: largest number of such steps; a step takes some 1.5 ms with one drive, 8 ms with several
    steps: Annotated[int, Meta(ge=1, le=1_000_000_000)] = 1000
    output: str = ""  #: point or angle that does the work, such as `"C"`, `"rocker.angle"` [guessed]
    #: distance from rest at which the output has settled after a stop [2 % of the residual amplitude]
    settled: Allowance | None = None
    #: units of page and `positions.csv`: SI, `"mm"` (mm, N, MPa), `"in"` (in, lbf, psi, lb) [as `units` if mm or in,
    #: else SI]
    report_units: Literal["SI", "mm", "in"] | None = None


class PlainSceneTable(StrictTable, frozen=True, kw_only=True):
    """A planar mechanism of rigid and elastic links, its drives and loads."""

    title: str = ""  #: heading of the report [the file's name]
    source: str = ""  #: origin of the data
    units: LengthUnit = "m"  #: unit of bare lengths
    library: str | None = None  #: TOML file beside the scene with further materials and sections [none]
    structure_only: bool = False  #: `true`: a shorter scene, for `--structure` only
    materials: dict[Name, MaterialTable] = field(default_factory=dict)  #: materials of links
    sections: dict[Name, SectionTable] = field(default_factory=dict)  #: cross-sections of links
    points: dict[Name, Place]  #: drawing of the mechanism near its start
    links: dict[Name, LinkTable]  #: links, one of them `ground`
    sliders: dict[Name, SliderTable] = field(default_factory=dict)  #: links that slide on others
    slots: dict[Name, SlotTable] = field(default_factory=dict)  #: pins in straight slots
    welds: dict[Name, WeldTable] = field(default_factory=dict)  #: rigid joints
    contacts: dict[Name, ContactTable] = field(default_factory=dict)  #: gears and cams for `--structure`
    joints: dict[Name, JointTable] = field(default_factory=dict)  #: friction, compliance, misfit of joints
    masses: dict[Name, Mass] = field(default_factory=dict)  #: point masses at joints
    drives: list[DriveTable] = field(default_factory=list)  #: one for each degree of freedom
    loads: list[LoadTable] = field(default_factory=list)  #: forces and moments
    gears: list[GearTable] = field(default_factory=list)  #: coupled joint coordinates
    springs: list[SpringTable] = field(default_factory=list)  #: springs and dampers
    limits: LimitsTable = field(default_factory=LimitsTable)  #: allowed figures
    run: RunTable = field(default_factory=RunTable)  #: positions, gravity, theory
    sweep: SweepTable = field(default_factory=SweepTable)  #: designs to compute
    sensitivities: SensitivitiesTable = field(default_factory=SensitivitiesTable)  #: derivatives to compute
    tolerances: dict[str, Amount | ToleranceTable] = field(default_factory=dict)  #: scatter of numbers, by path
    optimize: OptimizeTable = field(default_factory=OptimizeTable)  #: goal and variables


if TYPE_CHECKING:
    SceneTable = PlainSceneTable
else:
    SceneTable = with_parts(PlainSceneTable, "SceneTable", PARTS)


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

    links: tuple[str, str]  #: two links
    at: Place  #: place in the drawing
    normal: Direction | None = None  #: direction of the common normal, if they slip [they roll]


class SpatialJointTable(StrictTable, frozen=True, kw_only=True):
    """A joint between two links in space."""

    links: tuple[str, str]  #: two links
    #: `revolute`, `prismatic`, `helical`, `cylindrical`, `spherical`, `planar`, `universal`, `annular`, `line`,
    #: `point`, `rigid`, or another usual name
    type: str
    at: tuple[Length, Length, Length] | None = None  #: place [the origin]
    axis: tuple[Part, Part, Part] | None = None  #: direction; normal of a planar or point contact [z]
    normal: tuple[Part, Part, Part] | None = None  #: of a line contact; second axis of a universal joint
    pitch: Length | None = None  #: advance per radian of a helical joint; negative: left-handed


class ChainTable(StrictTable, frozen=True, kw_only=True):
    """A chain of joints in space, of which the structure is asked."""

    title: str = ""  #: heading [the file's name]
    source: str = ""  #: origin of the data
    units: LengthUnit = "m"  #: unit of bare lengths
    fixed: str | None = None  #: fixed link [`ground`, or the first one]
    joints: dict[Name, SpatialJointTable] = field(default_factory=dict)  #: joints
