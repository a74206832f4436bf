"""The tables and keys of a scene file: joints, drives, loads, limits of its answer, and studies of its designs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from msgspec import Meta, Struct, field

from kinelast.scene.quantities import (
    Abscissa,
    Allowance,
    Angle,
    CamSpeed,
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
    PressureAngle,
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
from rigid.laws import CURVES

Place = tuple[Length, Length]
Name = Annotated[str, Meta(pattern="^[A-Za-z0-9_-]+$")]
if TYPE_CHECKING:
    Curve = str
else:
    Curve = Literal[*CURVES]
LengthUnit = Literal["m", "cm", "mm", "in"]
PER_LENGTH = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
Interpolation = Literal["linear", "cubic"]


class StrictTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Any table of a scene."""


class SliderTable(StrictTable, frozen=True, kw_only=True):
    """A link that slides on another without turning."""

    link: str  #: the link that slides
    on: str = "ground"  #: the link that carries the line
    through: str  #: a drawn point of `link`: it stays on the line, which passes its drawn place and is fixed in `on`
    direction: Direction  #: of the line in the drawing


class SlotTable(StrictTable, frozen=True, kw_only=True):
    """A pin of one link in a straight slot of another."""

    point: str  #: the pin, drawn where the slot passes it
    link: str  #: the link that has the pin
    on: str = "ground"  #: the link that has the slot
    direction: Direction  #: of the slot in the drawing


class WeldTable(StrictTable, frozen=True, kw_only=True):
    """Links that are welded at a point, all that share it unless named."""

    #: the welded ones of the links at the point; the others are pinned there [all]
    links: Annotated[list[str], Meta(min_length=2)] | None = None


class JointTable(StrictTable, frozen=True, kw_only=True):
    """Friction, compliance and misfit of a pin, slider or weld."""

    compliance: Compliance | None = None  #: displacement per force [0]
    rotation: TurnCompliance | None = None  #: rotation per moment, of a driven pin, a weld or a slider [0]
    #: in the drawing's axes: how far the pin of the link that is placed later is from that of the other, unloaded
    #: [none]
    gap: Place | None = None
    turn: Angle | None = None  #: rotation in the same sense, of a driven pin, a weld or a slider [0]
    #: Coulomb's coefficient: a pin resists by it times `radius` and its force, a slider by it times the force across
    #: its line [0]
    friction: Annotated[float, Meta(ge=0, le=10)] | None = None
    viscosity: Damping | None = None  #: resistance per rate besides [0]
    radius: Size | None = None  #: of a pin with `friction`
    #: over which a slider's block is guided, `through` being its middle: its moment presses at the two ends [the
    #: moment presses on nothing]
    length: Size | None = None


class SegmentTable(StrictTable, frozen=True, kw_only=True):
    """A piece of a drive's motion law."""

    #: all but the constant speed begin and end at rest; `trapezoidal-velocity` and `constant-acceleration` jump in
    #: acceleration
    curve: Curve
    duration: Duration  #: how long it lasts
    to: Coordinate | None = None  #: where it ends; not of a dwell
    by: Coordinate | None = None  #: how far it goes, instead of `to`; not of a dwell


class AgainstTable(StrictTable, frozen=True, kw_only=True):
    """The coordinate that a table is against, if not time: the angle of a link, or a slide."""

    link: str | None = None  #: the link whose angle it is
    on: str = "ground"  #: the link from whose axes the angle is measured
    slider: str | None = None  #: the slider whose slide it is, instead of `link`

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

    at: str | None = None  #: the pin about which `link` turns on `on` [the only one they share]


class DriveTable(JointNameTable, frozen=True, kw_only=True):
    """A drive: a pin or a slider, at constant speed, by a law or table, or by an effort."""

    #: coordinate at the start: angle of the link's own axes from those of `on` (the x axis, for the ground), or slide
    #: from the drawn place along the line [as drawn]
    start: Coordinate | None = None
    speed: Speed | None = None  #: constant, or with an `effort` that at the start
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None  #: segments of motion, instead of `speed`
    #: times from 0 on and coordinates, instead of `speed`; between them a cubic spline; or the name of a CSV file with
    #: them, beside the scene
    motion: Annotated[list[tuple[Time, Coordinate]], Meta(min_length=4)] | str | None = None
    repeat: bool = False  #: `true`: the law or motion starts again where it ended, over and over
    #: moment or force along its coordinate, instead of a motion, which then follows from it
    effort: Effort | None = None
    #: factor by which an effort changes, against time, an angle or a slide [1 throughout]
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: what the table is against [time]
    interpolation: Interpolation = "linear"  #: of the table
    #: `"hold"`: outside the table its ends hold; otherwise it has to cover the run
    extend: Literal["hold"] | None = None
    motor: Name | None = None  #: its motor under `[motors]` [none]
    cylinder: Name | None = None  #: of a slider, its cylinder under `[cylinders]` [none]
    #: share of its constant speed by which it may be uneven, greatest less least: the flywheel for it is told [none]
    unevenness: Share | None = None


Factor = Annotated[float, Meta(gt=0)]


class MotorTable(StrictTable, frozen=True, kw_only=True):
    """A motor with its gear, for the drives that name it; torques and inertias at the motor's shaft."""

    #: borne for ever: no less than the root mean square of the torque over the run [none]
    rated_torque: Torque | None = None
    peak_torque: Torque | None = None  #: borne for a while: no less than the largest torque [none]
    #: at rest, of a motor whose torque falls in proportion to the speed, to none at `top_speed` [none]
    stall_torque: Torque | None = None
    rated_speed: TurningSpeed | None = None  #: no less than the mean speed [none]
    top_speed: TurningSpeed | None = None  #: no less than the largest speed [none]
    rotor_inertia: Inertia | None = None  #: of the rotor: part of what the drive moves [0]
    #: of the gear, reduced to the motor's shaft as catalogues have it: part of what the drive moves [0]
    gear_inertia: Inertia | None = None
    #: angle of the motor over that of the drive; of a drive that slides an angle to a length, or a lead [1]
    gear_ratio: GearRatio | None = None
    efficiency: Share | None = None  #: share of the power that the gear passes on, in either direction [1]
    #: greatest inertia of the load over that of motor and gear, both at the same shaft [none]
    inertia_ratio: Factor | None = None


class CylinderTable(StrictTable, frozen=True, kw_only=True):
    """A hydraulic or pneumatic cylinder, for the sliding drives that name it."""

    bore: Size  #: diameter of the piston
    rod: Size | None = None  #: diameter of the rod [0]
    length: Size | None = None  #: over which the rod may buckle, both ends pinned [none: buckling is not known]
    E: Stress | None = None  #: of the rod [206 GPa]
    pressure: Pressure | None = None  #: greatest that the supply gives [none]
    flow: FlowRate | None = None  #: greatest that the supply gives [none]
    buckling_safety: Factor | None = None  #: least of Euler's load over the largest push [none]


class CamTable(StrictTable, frozen=True, kw_only=True):
    """A cam that gives a drive its motion: found from the follower's, with its contact and the limits of that."""

    follower: str  #: the link that it moves by its contact
    centre: str | Place  #: of the cam's shaft: a point of the ground, or `[x, y]` in the drawing
    roller: str | None = None  #: the centre of the roller, a point of the follower; or instead `face`
    roller_radius: Size | None = None  #: of the roller; `pressure` asks for it [0: a knife edge]
    face: tuple[str, str] | None = None  #: two points of the follower between which its flat face lies
    drive: str | None = None  #: the link or slider of the drive whose motion it gives [the only one]
    #: of its shaft, positive counter-clockwise: whole turns in the run [one turn in the run]
    speed: CamSpeed | None = None
    #: `"inner"`: the cam is within the follower's path, `"outer"`: a ring about it, `"both"`: a groove
    flank: Literal["inner", "outer", "both"] = "inner"
    #: `false`: its force acts along the drive's coordinate, as of any drive, not where it touches
    push: bool = True
    width: Size | None = None  #: along which cam and follower touch [pressure is not known]
    material: str | None = None  #: of the cam: a name under `[materials]`, or one of the trade [pressure is not known]
    follower_material: str | None = None  #: of the roller or the face [as `material`]
    pressure: Stress | None = None  #: most pressure of the contact, by Hertz [none]
    pressure_angle: PressureAngle | None = None  #: most pressure angle, as in `"30 deg"` [none]
    radius: Size | None = None  #: least radius of curvature where the cam bulges [none]
    hollow_radius: Size | None = None  #: least radius of curvature where the cam is hollow, as of a cutter [none]


class GearTable(StrictTable, frozen=True, kw_only=True):
    """Wheels, a rack, or without teeth a belt, that tie the coordinates of two joints."""

    driver: JointNameTable  #: the joint whose coordinate drives, named as by drives
    follower: JointNameTable  #: the joint whose coordinate follows, named as by drives
    #: of the follower's change over the driver's: negative for wheels that mesh from outside, positive for a ring and
    #: the wheel in it
    ratio: Ratio
    pressure_angle: Angle | None = None  #: between the line of action and the common tangent, less than 90 deg [20 deg]
    teeth: bool = True  #: `false`: a belt or chain, or a ratio of unknown make, which passes the moment alone


class LoadTable(StrictTable, frozen=True, kw_only=True):
    """A force or moment at a point, or a force along a beam."""

    link: str  #: the link that is loaded
    point: str | None = None  #: where; or instead `beam`
    force: tuple[Force, Force] | None = None  #: at a point, `[x, y]` [none]
    moment: Moment | None = None  #: at a point [none]
    beam: tuple[str, str] | None = None  #: two points of the link between which the load is spread, instead of `point`
    start: tuple[ForcePerLength, ForcePerLength] | None = None  #: along a beam, `[x, y]` at the first of its points
    #: along a beam, `[x, y]` at the second of its points, linear between [as `start`]
    end: tuple[ForcePerLength, ForcePerLength] | None = None
    #: `"fixed"`: x and y are those of the drawing; `"turning"`: those of the link, or of the beam from its first to
    #: its second point as named here; of an elastic link they follow the section that bends, as of Beck's column
    axes: Literal["fixed", "turning"] = "fixed"
    #: of a load at a point: `"one way"`, it acts only while its point moves against it, as on a pump's piston; `"both
    #: ways"`, it is turned round so that it always resists, as on a blade [acts always]
    resists: Literal["both ways", "one way"] | None = None
    #: factor against time, or against an angle or a slide; two entries at one place are a step [1 throughout]
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: what the table is against [time]
    interpolation: Interpolation = "linear"  #: of the table
    #: `"hold"`: outside the table its ends hold; otherwise it has to cover the run
    extend: Literal["hold"] | None = None


class SpringTable(StrictTable, frozen=True, kw_only=True):
    """A spring and damper between points of two links, or about the pin of two links."""

    link: str  #: the link of one end
    on: str = "ground"  #: the link of the other end
    point: str | None = None  #: one end, on `link`
    anchor: str | None = None  #: the other end, on `on`
    length: Length | None = None  #: at which it pulls with `preload` [0]
    at: str | None = None  #: instead of `point`: a pin that both links share, about which it turns
    angle: Angle | None = None  #: of the axes of `link` from those of `on` at which its moment is `preload` [0]
    stiffness: Stiffness | None = None  #: of the spring [0]
    damping: Damping | None = None  #: of a damper beside it [0]
    preload: Effort | None = None  #: pull, or moment against growing angles [0]


class LinkLimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits of one link, by the figures that they bound: a quantity is the most allowed, a factor the least."""

    deflection: Size | None = None  #: largest displacement across a link from where a rigid link would be [none]
    #: largest deflection of a link from the line through its own displaced ends: bending alone [none]
    chord: Size | None = None
    safety: Factor | None = None  #: least of yield stress over von Mises stress [none]
    #: largest load over the critical load, the joints as they are; from 1 on the mechanism buckles [none]
    buckling: Factor | None = None
    endurance: Factor | None = None  #: least safety against endurance, where there is `[fatigue]` [none]
    life: Duration | None = None  #: least time until a link breaks, where there is `[fatigue]` [none]


LEAST_ALLOWED = ("safety", "endurance", "life")  # of these the figure may not be less


class RollingTable(StrictTable, frozen=True, kw_only=True):
    """A rolling bearing, and the least that is asked of it."""

    C: LoadRating  #: dynamic load rating
    C0: LoadRating | None = None  #: static load rating [none]
    type: Literal["ball", "roller"] = "ball"  #: `"roller"` has the exponent 10/3 of the life
    #: share of bearings that reach the life
    reliability: Literal["90 %", "95 %", "96 %", "97 %", "98 %", "99 %"] = "90 %"
    condition: Factor | None = None  #: factor of the life for lubricant and dirt, a_ISO [1]
    elements: Annotated[int, Meta(ge=3)] | None = None  #: number of balls or rollers [none]
    life: Duration | None = None  #: least life [none]
    safety: Factor | None = None  #: least static safety [none]
    #: least equivalent load over `C`, below which bearings slide: some 0.01 of balls, 0.02 of rollers [none]
    least_load: Share | None = None
    least_overlap: Factor | None = None  #: least swing over that from element to element [none]


class PlainTable(StrictTable, frozen=True, kw_only=True):
    """A plain bearing, and the most that its material allows."""

    diameter: Size | None = None  #: of the shaft; of a pin
    length: Size | None = None  #: of a slider's block along its line, `through` in its middle; instead of `diameter`
    width: Size  #: of the bearing, or of the block across its line
    pressure: Stress | None = None  #: most pressure [none]
    speed: SlidingSpeed | None = None  #: most sliding speed [none]
    pressure_speed: PressureSpeed | None = None  #: most of the mean of pressure times sliding speed [none]


class PinTable(StrictTable, frozen=True, kw_only=True):
    """A pin through an eye and two cheeks, or overhung from one, and its limits."""

    diameter: Size  #: of the pin
    eye: Size  #: thickness of the eye on it
    cheek: Size | None = None  #: thickness of one of the two cheeks
    gap: Size | None = None  #: between eye and cheek [0]
    overhung: bool = False  #: `true`: it is held on one side alone, and needs no `cheek`
    yield_stress: Stress | None = field(default=None, name="yield")  #: of its material
    shear: Stress | None = None  #: most shear stress [none]
    bending: Stress | None = None  #: most bending stress [none]
    safety: Factor | None = None  #: least of `yield` over its stresses [none]


class EyeTable(StrictTable, frozen=True, kw_only=True):
    """The eye of a link, and its limits."""

    diameter: Size  #: of the hole
    width: Size  #: of the plate beside it
    thickness: Size  #: of the plate
    edge: Size  #: from the hole's centre to the end
    link: str | None = None  #: the link whose eye it is, in whose life under `[fatigue]` its notch counts [none]
    #: its fatigue notch factor, on the stress of its net section [by its form, where the formula holds]
    notch: Annotated[float, Meta(ge=1)] | None = None
    yield_stress: Stress | None = field(default=None, name="yield")  #: of its material
    bearing: Stress | None = None  #: most bearing stress [none]
    net: Stress | None = None  #: most tension in the net section [none]
    tear_out: Stress | None = None  #: most shear stress of tear-out [none]
    safety: Factor | None = None  #: least of `yield` over its stresses [none]


class BearingTable(StrictTable, frozen=True, kw_only=True):
    """The parts of a joint, at the pin or slider of that name; an empty one of a pin: force, swing and speed."""

    rolling: RollingTable | None = None  #: a rolling bearing [none]
    plain: PlainTable | None = None  #: a plain bearing; the only part of a slider [none]
    pin: PinTable | None = None  #: a pin [none]
    eye: EyeTable | None = None  #: the eye of a link [none]
    clearance: Size | None = None  #: diameter of the hole less that of the pin [none: what it does is not told]


Surface = Literal["polished", "ground", "machined", "hot-rolled", "as-forged"]


class LinkFatigueTable(StrictTable, frozen=True, kw_only=True):
    """Factors of the endurance limit of a link, and the notch factors at its points."""

    surface: Surface | Factor | None = None  #: of steel; or the factor itself [1]
    size: Factor | None = None  #: factor of size [by the section's dimensions]
    #: fatigue notch factors at points, as in `{A = 1.8}`, of all beams that end there [1]
    notches: dict[str, Annotated[float, Meta(ge=1)]] = field(default_factory=dict)


class FatigueTable(LinkFatigueTable, frozen=True, kw_only=True):
    """Fatigue of the links: criterion, reliability, and factors of all links and of single ones."""

    criterion: Literal["goodman", "gerber", "soderberg"] = "goodman"  #: by which a mean stress counts
    reliability: Annotated[float, Meta(gt=0, lt=1)] = 0.5  #: share of parts that have the endurance; 0.5 is the mean
    links: dict[str, LinkFatigueTable] = field(default_factory=dict)  #: factors of single links, before those of all


Amount = float | str  # in the unit of the number or figure that it is for


class BoundTable(StrictTable, frozen=True, kw_only=True):
    """Bounds of a figure."""

    most: Amount | None = None  #: the most that is allowed
    least: Amount | None = None  #: the least that is asked


class LimitsTable(LinkLimitsTable, frozen=True, kw_only=True):
    """Limits of the mechanism: of every link, of single links, and of its output."""

    output: Allowance | None = None  #: largest error of the output [none]
    residual: Allowance | None = None  #: greatest distance of the output from where it rests, once the drives do [none]
    settling: Duration | None = None  #: time from then until it has settled, see `settled` under `[run]` [none]
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)  #: limits of single links, besides those of all
    #: by the name of any figure, as `"joint_force.A"`, the most, or a table of `most` and `least`, that it may be
    figures: dict[str, Amount | BoundTable] = field(default_factory=dict)


Entry = float | str


class RangeTable(StrictTable, frozen=True, kw_only=True):
    """A number from one value to another, both included; `count` values of a grid."""

    start: Entry = field(name="from")  #: first value, in the unit of the number
    end: Entry = field(name="to")  #: last value
    count: Annotated[int, Meta(ge=2)] | None = None  #: how many values of a grid; left out where they are sampled


class SweepTable(StrictTable, frozen=True, kw_only=True):
    """Designs that differ in some numbers of the file by their paths, their figures, and the choice of the best."""

    #: by the path of a number, as `"sections.bar.depth"`, a range or a list of values
    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    #: all of the grid; or the ranges without a `count` are sampled together
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None  #: how many designs a sample has
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0  #: of its random numbers
    #: a CSV file beside the scene: paths as headings, with units in brackets or none, and a row a design [none]
    table: str | None = None
    figures: list[str] = field(default_factory=list)  #: what is asked of a design [those of its summary]
    #: the figure by which the best is told, of the designs within `[limits]` [the first of `figures`]
    smallest: str | None = None
    largest: str | None = None  #: the same, where the greatest is the best


class SensitivitiesTable(StrictTable, frozen=True, kw_only=True):
    """Which figures' derivatives to which numbers are asked for; all that there are where none are named."""

    figures: list[str] = field(default_factory=list)  #: whose sensitivities are told [those of the summary]
    #: paths of those with respect to which [all that describe the machine]
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(StrictTable, frozen=True, kw_only=True):
    """How a number scatters about its value."""

    plus_minus: Amount  #: half of the range, in the unit of the number or in per cent of it
    #: within the range, or normal with a third of it as the standard deviation
    distribution: Literal["uniform", "normal"] = "uniform"


class PathTable(StrictTable, frozen=True, kw_only=True):
    """Where a point is to be, position by position of the run."""

    point: str  #: that is to be there
    places: Annotated[list[Place], Meta(min_length=1)]  #: one for every position of the run


class OptimizeTable(StrictTable, frozen=True, kw_only=True):
    """Which figure is to be made small or large, with which numbers, within which limits."""

    #: by the path of a number, its bounds: `["3 mm", "9 mm"]`
    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None  #: figure that is to be small
    maximize: str | None = None  #: figure that is to be large
    #: by a figure, the most, or a table of `most` and `least`, that it may be
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None  #: where a point is to be: figures `path_error` and `path_squares` [none]
    method: Literal["search", "evolution"] = "search"  #: local searches from many starts, or evolution of a population
    seed: Annotated[int, Meta(ge=0)] = 0  #: of its random numbers
