"""Tables and keys of a scene file: sections, materials, links, and the whole scene.

To add a cross-section, add a table here and a function to `elastic.SHAPES`.
"""

# without `from __future__ import annotations`, because msgspec is slow if annotations are strings
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta, field

from kinelast.scene import tables
from kinelast.scene.part import with_parts
from kinelast.scene.parts import PARTS
from kinelast.scene.tables import Amount, LengthUnit, Name, Place, StrictTable
from kinelast.values import quantities as q
from kinelast.values.error import fault
from kinelast.values.numbers import real, require
from kinelast.values.units import Quantity


class Dimensioned(StrictTable, frozen=True, kw_only=True, tag_field="shape"):
    """A cross-section that is given by its dimensions. The keys are, in order, the arguments of the shape function."""

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Return the dimensions at both ends of the beam [m]. `table` is used in messages."""
        return tuple(getattr(self, key) for key in self.__struct_fields__)


class Rectangle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="rectangle"):
    """A solid rectangle, `depth` in the plane of motion."""

    depth: q.Sizes  #: size in the plane of motion
    width: q.Sizes  #: size normal to the plane of motion


class Circle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="circle"):
    """A solid circle."""

    diameter: q.Sizes  #: diameter


class Tube(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="tube"):
    """A circular tube, given by its outer diameter and either its inner diameter or its wall thickness."""

    outer: q.Sizes  #: outer diameter
    inner: q.Sizes | None = None  #: inner diameter, instead of `wall`
    wall: q.Sizes | None = None  #: wall thickness, instead of `inner`

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Return the outer and inner diameters at both ends of the beam [m]."""
        if (self.inner is None) == (self.wall is None):
            raise fault(table, "inner", "a tube needs either inner or wall")
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
    """A hollow rectangle, `depth` in the plane of motion."""

    depth: q.Sizes  #: size in the plane of motion
    width: q.Sizes  #: size normal to the plane of motion
    wall: q.Sizes  #: wall thickness
    corner: q.Sizes | None = None  #: outer radius of the corners [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Return depth, width, wall and corner at both ends of the beam [m]."""
        corner = _or_zeros(self.corner)
        for depth, width, wall, radius in zip(self.depth, self.width, self.wall, corner, strict=True):
            half = np.minimum(real(depth), real(width)) / 2
            _require_smaller(table, "wall", "less than half of depth and width", real(wall), half)
            _require_smaller(table, "corner", "less than half of depth and width", real(radius), half)
        return self.depth, self.width, self.wall, corner


class Flanged(Dimensioned, frozen=True, kw_only=True, tag_field="shape"):
    """A web with one or two flanges, which extend to one or both sides."""

    flanges: ClassVar[int]
    sides: ClassVar[int]
    depth: q.Sizes  #: size in the plane of motion
    width: q.Sizes  #: width of the flanges, normal to the plane of motion
    web: q.Sizes  #: thickness of the web
    flange: q.Sizes  #: thickness of the flanges
    fillet: q.Sizes | None = None  #: radius between web and flange [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Return depth, width, web, flange and fillet at both ends of the beam [m]."""
        sizes = self.depth, self.width, self.web, self.flange, _or_zeros(self.fillet)
        for depth, width, web, flange, fillet in zip(*sizes, strict=True):
            most = real(depth) / self.flanges
            half = "half of depth" if self.flanges == 2 else "depth"
            _require_smaller(table, "flange", f"less than {half}", real(flange), most)
            _require_smaller(table, "web", "less than width", real(web), real(width))
            _require_smaller(table, "fillet", "a radius that fits between web and flange", real(fillet),
                             np.minimum(most - real(flange), (real(width) - real(web)) / self.sides))  # fmt: skip
        return sizes


class ISection(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="I"):
    """An I section with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    flanges, sides = 2, 2


class TSection(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="T"):
    """A T section with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    flanges, sides = 1, 2


class Channel(Flanged, frozen=True, kw_only=True, tag_field="shape", tag="channel"):
    """A channel with its `web` in the plane of motion and its flanges on one side, restrained against torsion."""

    flanges, sides = 2, 1


class Angle(Dimensioned, frozen=True, kw_only=True, tag_field="shape", tag="angle"):
    """An angle with the leg `depth` in the plane of motion; free to bend sideways, restrained against torsion."""

    depth: q.Sizes  #: leg in the plane of motion
    width: q.Sizes  #: leg normal to the plane of motion
    wall: q.Sizes  #: thickness of both legs
    fillet: q.Sizes | None = None  #: radius between the legs [0]
    toe: q.Sizes | None = None  #: radius at the inner edges of the toes [0]

    def dimensions(self, table: str) -> tuple[Any, ...]:
        """Return depth, width, wall, fillet and toe at both ends of the beam [m]."""
        sizes = self.depth, self.width, self.wall, _or_zeros(self.fillet), _or_zeros(self.toe)
        for depth, width, wall, fillet, toe in zip(*sizes, strict=True):
            least = np.minimum(real(depth), real(width))
            _require_smaller(table, "wall", "less than both legs", real(wall), least)
            _require_smaller(table, "toe", "at most the wall", real(toe), 1.000001 * real(wall))
            available = least - real(wall) - real(toe)
            _require_smaller(table, "fillet", "a radius that fits between wall and toe", real(fillet), available)
        return sizes


def _or_zeros(sizes: Any) -> Any:
    """Return the sizes at both ends; zeros if they are not given."""
    return (0.0, 0.0) if sizes is None else sizes


class Outline(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="outline"):
    """Any outline. The first coordinate of a corner is in the plane of motion. Restrained against torsion."""

    points: Annotated[list[Place], Meta(min_length=3)] | None = None  #: corners in order [from `drawing`]
    holes: list[Annotated[list[Place], Meta(min_length=3)]] | None = None  #: corners of each hole [none]
    #: DXF file in the folder of the scene with one closed outline and any holes; y is in the plane of motion [none]
    drawing: str | None = None


class Properties(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="properties"):
    """Any cross-section, given by its properties."""

    A: q.Area  #: cross-sectional area
    #: second moment of area
    I: q.SecondMoment  # noqa: E741
    c: q.Size | None = None  #: distance from the neutral axis to the outermost fibre [stress is not computed]
    shear_area: q.Area | None = None  #: shear area [no shear deformation]


class Rigidities(StrictTable, frozen=True, kw_only=True, tag_field="shape", tag="rigidities"):
    """A cross-section that is given by rigidities, without a material."""

    EA: q.AxialRigidity  #: axial rigidity
    EI: q.BendingRigidity  #: bending rigidity
    mass_per_length: q.MassPerLength  #: mass per length
    kGA: q.ShearRigidity | None = None  #: shear rigidity [no shear deformation]


SectionTable = (
    Rectangle | Circle | Tube | Box | ISection | TSection | Channel | Angle | Outline | Properties | Rigidities
)


def _require_smaller(table: str, key: str, expected: str, size: Any, bound: Any) -> None:
    """Raise unless a size is smaller than its bound [m]."""

    def problem(of: Any) -> str:
        return f"expected {expected}, {of(bound):g} m, got {of(size):g} m"

    require(size < bound, table, key, problem)


Strain = Annotated[float, Meta(ge=-0.1, le=0.1)]


class MaterialTable(StrictTable, frozen=True, kw_only=True):
    """A material of links."""

    E: q.Stress  #: Young's modulus
    density: q.Density  #: density
    #: Poisson's ratio [0.3]
    poisson: Annotated[float, Meta(gt=-1, le=0.5)] | None = None
    G: q.Stress | None = None  #: shear modulus, instead of `poisson` [from `poisson`]
    #: yield stress [the safety factor is not computed]
    yield_stress: q.Stress | None = field(default=None, name="yield")
    expansion: q.Expansion | None = None  #: coefficient of thermal expansion, used with `temperature`
    #: Kelvin-Voigt coefficient beta: stress = E (strain + beta d strain/dt) [from `damping_ratio`]
    damping: q.Duration | None = None
    ultimate: q.Stress | None = None  #: tensile strength, used by `[fatigue]`
    #: fully reversed stress amplitude of a smooth bar at the knee, used by `[fatigue]`
    endurance: q.Stress | None = None
    slope: Annotated[float, Meta(gt=1)] = 5.0  #: exponent k of the S-N line
    knee: Annotated[float, Meta(gt=0)] = 1e6  #: cycles at which the S-N line reaches `endurance`
    #: cycles at the end of a second S-N line, such as 1e8 for aluminium [`knee`]
    second_knee: Annotated[float, Meta(gt=0)] | None = None
    second_slope: Annotated[float, Meta(gt=1)] = 15.0  #: exponent of the second line


class BeamTable(StrictTable, frozen=True, kw_only=True):
    """A straight beam of a link. Its keys override the keys of the link."""

    start: str = field(name="from")  #: first point
    end: str = field(name="to")  #: second point
    section: str | None = None  #: section of this beam [the link's]
    material: str | None = None  #: material of this beam [the link's]
    strain: Strain | None = None  #: strain of this beam when unloaded [the link's]
    temperature: q.Warming | None = None  #: temperature rise of this beam [the link's]


class LinkTable(StrictTable, frozen=True, kw_only=True):
    """A link with its points, beams, masses and outline."""

    #: names of the points (as drawn), or coordinates in link axes, such as `{A = [0, 0], B = ["30 cm", 0]}`
    points: list[str] | dict[str, Place]
    length: q.Size | None = None  #: length of a link with two points [as drawn]
    section: str | None = None  #: name under `[sections]`, or a standard name
    material: str | None = None  #: name under `[materials]`, or a standard name
    #: pairs of points that beams connect [consecutive points; a point on an earlier beam divides it]
    beams: list[tuple[str, str] | BeamTable] | None = None
    strain: Strain | None = None  #: strain of the unloaded beams, positive if they are longer than drawn [0]
    #: temperature rise above the temperature at which the drawn length applies [0]
    temperature: q.Warming | None = None
    rigid: bool = False  #: `true`: the link does not deform
    mass: q.Mass | None = None  #: mass of a rigid link [from section and material]
    #: centre of mass of a rigid link: a point, or `[x, y]` in link axes [from section and material]
    center: str | Place | None = None
    #: moment of inertia of a rigid link about its centre of mass [from section and material, or 0]
    inertia: q.Inertia | None = None
    masses: dict[str, q.Mass] = field(default_factory=dict)  #: point masses, such as `{B = "50 g"}`
    #: corners of the drawn shape: points, or `[x, y]` in link axes
    outline: list[str | Place] = field(default_factory=list)


class RunTable(StrictTable, frozen=True, kw_only=True):
    """Positions, duration, gravity, theories, accuracy and output of the run."""

    positions: Annotated[int, Meta(ge=1, le=1_000_000)] = 360  #: number of computed positions
    #: duration of the run [one cycle]
    duration: q.Duration | None = None
    gravity: tuple[q.Acceleration, q.Acceleration] | None = None  #: gravitational acceleration, `[x, y]` [none]
    #: `"timoshenko"` refuses sections without shear rigidity; `"euler-bernoulli"` neglects shear and rotary inertia
    #: [shear if the section has it]
    beams: Literal["euler-bernoulli", "timoshenko"] | None = None
    #: theory of the deflection [chosen by `accuracy`]
    theory: Literal["quasi-static", "elastodynamic", "geometrically-exact"] | None = None
    #: largest allowed relative error; the fastest theory that achieves it is used [5 %]
    accuracy: q.Share | None = None
    #: damping ratio at the lowest natural frequency, for materials without `damping` [0.01]
    damping_ratio: Annotated[float, Meta(gt=0, lt=1)] | None = None
    #: relative tolerance of an integration step, used if a drive has an `effort`
    tolerance: Annotated[float, Meta(gt=0, le=1e-3)] = 1e-10
    #: maximum number of integration steps; a step takes about 1.5 ms with one drive, 8 ms with several
    steps: Annotated[int, Meta(ge=1, le=1_000_000_000)] = 1000
    #: output of the machine: a point or angle, such as `"C"` or `"rocker.angle"` [chosen by the program]
    output: str = ""
    #: distance from the rest position within which the output counts as settled [2 % of the residual amplitude]
    settled: q.Allowance | None = None
    #: units of the report and `positions.csv`: `"SI"`, `"mm"` (mm, N, MPa), `"in"` (in, lbf, psi, lb) [by `units`]
    report_units: Literal["SI", "mm", "in"] | None = None


class ContactTable(StrictTable, frozen=True, kw_only=True):
    """A contact between two links. They roll on each other or, if a normal is given, slip along the tangent."""

    links: tuple[str, str]  #: both links
    at: Place  #: point of contact in the drawing
    normal: q.Direction | None = None  #: direction of the common normal, if the links slip [they roll]


class PlainSceneTable(StrictTable, frozen=True, kw_only=True):
    """A planar mechanism of rigid and elastic links with drives and loads."""

    title: str = ""  #: heading of the report [name of the file]
    source: str = ""  #: source of the data
    units: LengthUnit = "m"  #: unit of lengths without a unit
    #: TOML file in the folder of the scene with more materials and sections [none]
    library: str | None = None
    structure_only: bool = False  #: `true`: the scene is incomplete and only used with `--structure`
    materials: dict[Name, MaterialTable] = field(default_factory=dict)  #: materials of the links
    sections: dict[Name, SectionTable] = field(default_factory=dict)  #: cross-sections of the links
    points: dict[Name, Place]  #: coordinates of the points near the start of the motion
    links: dict[Name, LinkTable]  #: links; one of them is `ground`
    sliders: dict[Name, tables.SliderTable] = field(default_factory=dict)  #: links that slide on other links
    slots: dict[Name, tables.SlotTable] = field(default_factory=dict)  #: pins that slide in straight slots
    welds: dict[Name, tables.WeldTable] = field(default_factory=dict)  #: rigid connections of links at points
    #: contacts between links, only used with `--structure`
    contacts: dict[Name, ContactTable] = field(default_factory=dict)
    #: friction, compliance and misalignment of joints
    joints: dict[Name, tables.JointTable] = field(default_factory=dict)
    masses: dict[Name, q.Mass] = field(default_factory=dict)  #: point masses at joints
    drives: list[tables.DriveTable] = field(default_factory=list)  #: drives, one per degree of freedom
    #: forces and moments, in addition to inertia and weight
    loads: list[tables.LoadTable] = field(default_factory=list)
    gears: list[tables.GearTable] = field(default_factory=list)  #: gears that couple the coordinates of two joints
    springs: list[tables.SpringTable] = field(default_factory=list)  #: springs and dampers
    limits: tables.LimitsTable = field(default_factory=tables.LimitsTable)  #: limits on figures
    run: RunTable = field(default_factory=RunTable)  #: positions, theory, accuracy, output
    sweep: tables.SweepTable = field(default_factory=tables.SweepTable)  #: parameter study
    #: derivatives of figures
    sensitivities: tables.SensitivitiesTable = field(default_factory=tables.SensitivitiesTable)
    #: tolerances of numbers by path, used by `--tolerances`
    tolerances: dict[str, Amount | tables.ToleranceTable] = field(default_factory=dict)
    optimize: tables.OptimizeTable = field(default_factory=tables.OptimizeTable)  #: optimization


if TYPE_CHECKING:
    SceneTable = PlainSceneTable
else:
    SceneTable = with_parts(PlainSceneTable, PARTS)


def read_quantity(kind: type, value: Any, per_length: float = 1.0) -> Any:
    """Convert a value of a file to a quantity; passed to msgspec as `dec_hook`.

    `per_length` is metres per length unit.
    """
    if issubclass(kind, q.Direction):
        return kind.read(value)
    if issubclass(kind, Quantity | q.Sizes):
        return kind.read(value, per_length)
    raise NotImplementedError(kind)


Part = Annotated[float, Meta(ge=-1e9, le=1e9)]


class SpatialJointTable(StrictTable, frozen=True, kw_only=True):
    """A joint between two links in space."""

    links: tuple[str, str]  #: both links
    type: str  #: such as `revolute`, `prismatic`, `spherical`, `rigid`, or another common name
    at: tuple[q.Length, q.Length, q.Length] | None = None  #: position [origin]
    axis: tuple[Part, Part, Part] | None = None  #: direction of the axis; normal of a point or plane contact [z]
    normal: tuple[Part, Part, Part] | None = None  #: normal of a line contact; second axis of a universal joint
    pitch: q.Length | None = None  #: advance per radian of a helical joint, negative for a left-handed thread


class ChainTable(StrictTable, frozen=True, kw_only=True):
    """A spatial chain of joints, only used with `--structure`."""

    title: str = ""  #: heading [name of the file]
    source: str = ""  #: source of the data
    units: LengthUnit = "m"  #: unit of lengths without a unit
    fixed: str | None = None  #: fixed link [`ground`, or the first link in the file]
    joints: dict[Name, SpatialJointTable] = field(default_factory=dict)  #: joints, each between two links
