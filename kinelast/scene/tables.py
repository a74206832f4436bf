"""The tables and keys of a scene file: joints, drives, loads, limits of its answer, and studies of its designs."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from kinelast.scene.quantities import (
    Abscissa,
    Allowance,
    Angle,
    Compliance,
    Coordinate,
    Damping,
    Direction,
    Duration,
    Effort,
    FlowRate,
    Force,
    ForcePerLength,
    GearRatio,
    Inertia,
    Length,
    LoadRating,
    Moment,
    Pressure,
    PressureSpeed,
    Ratio,
    Share,
    Size,
    SlidingSpeed,
    Speed,
    Stiffness,
    Stress,
    Time,
    Torque,
    TurnCompliance,
    TurningSpeed,
)

Place = tuple[Length, Length]
Name = Annotated[str, Meta(pattern="^[A-Za-z0-9_-]+$")]
Curve = Literal[
    "dwell",
    "constant-speed",
    "harmonic",
    "cycloidal",
    "polynomial-345",
    "polynomial-4567",
    "trapezoidal-velocity",
    "constant-acceleration",
    "modified-trapezoid",
    "modified-sine",
]
LengthUnit = Literal["m", "cm", "mm", "in"]
PER_LENGTH = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
Interpolation = Literal["linear", "cubic"]


class StrictTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Any table of a scene."""


class SliderTable(StrictTable, frozen=True, kw_only=True):
    """A link that slides on another without turning."""

    link: str
    on: str = "ground"
    through: str
    direction: Direction


class SlotTable(StrictTable, frozen=True, kw_only=True):
    """A pin of one link in a straight slot of another."""

    point: str
    link: str
    on: str = "ground"
    direction: Direction


class WeldTable(StrictTable, frozen=True, kw_only=True):
    """Links that are welded at a point, all that share it unless named."""

    links: Annotated[list[str], Meta(min_length=2)] | None = None


class JointTable(StrictTable, frozen=True, kw_only=True):
    """Friction, compliance and misfit of a pin, slider or weld."""

    compliance: Compliance | None = None
    rotation: TurnCompliance | None = None
    gap: Place | None = None
    turn: Angle | None = None
    friction: Annotated[float, Meta(ge=0, le=10)] | None = None
    viscosity: Damping | None = None
    radius: Size | None = None
    length: Size | None = None


class SegmentTable(StrictTable, frozen=True, kw_only=True):
    """A piece of a drive's motion law."""

    curve: Curve
    duration: Duration
    to: Coordinate | None = None
    by: Coordinate | None = None


class AgainstTable(StrictTable, frozen=True, kw_only=True):
    """The coordinate that a table is against, if not time: the angle of a link, or a slide."""

    link: str | None = None
    on: str = "ground"
    slider: str | None = None

    @property
    def turns(self) -> bool:
        """Whether the coordinate is an angle."""
        return self.slider is None

    @property
    def told(self) -> bool:
        """Whether it is told in one way: by a link or by a slider."""
        return (self.link is None) == (self.slider is not None)

    @property
    def name(self) -> str:
        """The link or the slider."""
        return self.link or self.slider or ""


class JointNameTable(AgainstTable, frozen=True, kw_only=True):
    """A joint with a coordinate that a gear ties, named as a drive names its own."""

    at: str | None = None


class DriveTable(JointNameTable, frozen=True, kw_only=True):
    """A drive: a pin or a slider, at constant speed, by a law or table, or by an effort."""

    start: Coordinate | None = None
    speed: Speed | None = None
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None
    motion: Annotated[list[tuple[Time, Coordinate]], Meta(min_length=4)] | None = None
    repeat: bool = False
    effort: Effort | None = None
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None
    interpolation: Interpolation = "linear"
    extend: Literal["hold"] | None = None
    motor: Name | None = None
    cylinder: Name | None = None
    unevenness: Share | None = None


Factor = Annotated[float, Meta(gt=0)]


class MotorTable(StrictTable, frozen=True, kw_only=True):
    """A motor with its gear, for the drives that name it; torques and inertias at the motor's shaft."""

    rated_torque: Torque | None = None
    peak_torque: Torque | None = None
    stall_torque: Torque | None = None
    rated_speed: TurningSpeed | None = None
    top_speed: TurningSpeed | None = None
    rotor_inertia: Inertia | None = None
    gear_inertia: Inertia | None = None
    gear_ratio: GearRatio | None = None
    efficiency: Share | None = None
    inertia_ratio: Factor | None = None


class CylinderTable(StrictTable, frozen=True, kw_only=True):
    """A hydraulic or pneumatic cylinder, for the sliding drives that name it."""

    bore: Size
    rod: Size | None = None
    length: Size | None = None
    E: Stress | None = None
    pressure: Pressure | None = None
    flow: FlowRate | None = None
    buckling_safety: Factor | None = None


class GearTable(StrictTable, frozen=True, kw_only=True):
    """Wheels, a rack, or without teeth a belt, that tie the coordinates of two joints."""

    driver: JointNameTable
    follower: JointNameTable
    ratio: Ratio
    pressure_angle: Angle | None = None
    teeth: bool = True


class LoadTable(StrictTable, frozen=True, kw_only=True):
    """A force or moment at a point, or a force along a beam."""

    link: str
    point: str | None = None
    force: tuple[Force, Force] | None = None
    moment: Moment | None = None
    beam: tuple[str, str] | None = None
    start: tuple[ForcePerLength, ForcePerLength] | None = None
    end: tuple[ForcePerLength, ForcePerLength] | None = None
    axes: Literal["fixed", "turning"] = "fixed"
    resists: Literal["both ways", "one way"] | None = None
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None
    interpolation: Interpolation = "linear"
    extend: Literal["hold"] | None = None


class SpringTable(StrictTable, frozen=True, kw_only=True):
    """A spring and damper between points of two links, or about the pin of two links."""

    link: str
    on: str = "ground"
    point: str | None = None
    anchor: str | None = None
    length: Length | None = None
    at: str | None = None
    angle: Angle | None = None
    stiffness: Stiffness | None = None
    damping: Damping | None = None
    preload: Effort | None = None


class LinkLimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits of one link, by the figures that they bound: a quantity is the most allowed, a factor the least."""

    deflection: Size | None = None
    chord: Size | None = None
    safety: Factor | None = None
    buckling: Factor | None = None
    endurance: Factor | None = None
    life: Duration | None = None


LEAST_ALLOWED = ("safety", "endurance", "life")  # of these the figure may not be less


class RollingTable(StrictTable, frozen=True, kw_only=True):
    """A rolling bearing, and the least that is asked of it."""

    C: LoadRating
    C0: LoadRating | None = None
    type: Literal["ball", "roller"] = "ball"
    reliability: Literal["90 %", "95 %", "96 %", "97 %", "98 %", "99 %"] = "90 %"
    condition: Factor | None = None
    elements: Annotated[int, Meta(ge=3)] | None = None
    life: Duration | None = None
    safety: Factor | None = None
    least_load: Share | None = None
    least_overlap: Factor | None = None


class PlainTable(StrictTable, frozen=True, kw_only=True):
    """A plain bearing, and the most that its material allows."""

    diameter: Size
    width: Size
    pressure: Stress | None = None
    speed: SlidingSpeed | None = None
    pressure_speed: PressureSpeed | None = None


class PinTable(StrictTable, frozen=True, kw_only=True):
    """A pin through an eye and two cheeks, or overhung from one, and its limits."""

    diameter: Size
    eye: Size
    cheek: Size | None = None
    gap: Size | None = None
    overhung: bool = False
    yield_stress: Stress | None = field(default=None, name="yield")
    shear: Stress | None = None
    bending: Stress | None = None
    safety: Factor | None = None


class EyeTable(StrictTable, frozen=True, kw_only=True):
    """The eye of a link, and its limits."""

    diameter: Size
    width: Size
    thickness: Size
    edge: Size
    yield_stress: Stress | None = field(default=None, name="yield")
    bearing: Stress | None = None
    net: Stress | None = None
    tear_out: Stress | None = None
    safety: Factor | None = None


class BearingTable(StrictTable, frozen=True, kw_only=True):
    """The parts of a joint, at the pin of that name; an empty table asks for force, swing and speed."""

    rolling: RollingTable | None = None
    plain: PlainTable | None = None
    pin: PinTable | None = None
    eye: EyeTable | None = None
    clearance: Size | None = None


Surface = Literal["polished", "ground", "machined", "hot-rolled", "as-forged"]


class LinkFatigueTable(StrictTable, frozen=True, kw_only=True):
    """Factors of the endurance limit of a link, and the notch factors at its points."""

    surface: Surface | Factor | None = None
    size: Factor | None = None
    notches: dict[str, Annotated[float, Meta(ge=1)]] = field(default_factory=dict)


class FatigueTable(LinkFatigueTable, frozen=True, kw_only=True):
    """Fatigue of the links: criterion, reliability, and factors of all links and of single ones."""

    criterion: Literal["goodman", "gerber", "soderberg"] = "goodman"
    reliability: Annotated[float, Meta(gt=0, lt=1)] = 0.5
    links: dict[str, LinkFatigueTable] = field(default_factory=dict)


class LimitsTable(LinkLimitsTable, frozen=True, kw_only=True):
    """Limits of the mechanism: of every link, of single links, and of its output."""

    output: Allowance | None = None
    residual: Allowance | None = None
    settling: Duration | None = None
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)


Entry = float | str


class RangeTable(StrictTable, frozen=True, kw_only=True):
    """A number from one value to another, both included; `count` values of a grid."""

    start: Entry = field(name="from")
    end: Entry = field(name="to")
    count: Annotated[int, Meta(ge=2)] | None = None


class SweepTable(StrictTable, frozen=True, kw_only=True):
    """Designs that differ in some numbers of the file by their paths, their figures, and the choice of the best."""

    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    table: str | None = None
    figures: list[str] = field(default_factory=list)
    smallest: str | None = None
    largest: str | None = None


Amount = float | str  # in the unit of the number or figure that it is for


class SensitivitiesTable(StrictTable, frozen=True, kw_only=True):
    """Which figures' derivatives to which numbers are asked for; all that there are where none are named."""

    figures: list[str] = field(default_factory=list)
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(StrictTable, frozen=True, kw_only=True):
    """How a number scatters about its value."""

    plus_minus: Amount
    distribution: Literal["uniform", "normal"] = "uniform"


class BoundTable(StrictTable, frozen=True, kw_only=True):
    """Bounds of a figure."""

    most: Amount | None = None
    least: Amount | None = None


class PathTable(StrictTable, frozen=True, kw_only=True):
    """Where a point is to be, position by position of the run."""

    point: str
    places: Annotated[list[Place], Meta(min_length=1)]


class OptimizeTable(StrictTable, frozen=True, kw_only=True):
    """Which figure is to be made small or large, with which numbers, within which limits."""

    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None
    maximize: str | None = None
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None
    method: Literal["search", "evolution"] = "search"
    seed: Annotated[int, Meta(ge=0)] = 0
