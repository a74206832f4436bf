"""Tables and keys of a scene file: joints, drives, loads, limits, and design studies."""

# without `from __future__ import annotations`, because msgspec is slow if annotations are strings
from typing import TYPE_CHECKING, Annotated, Literal

from msgspec import Meta, Struct, field

from kinelast.values import quantities as q
from rigid.laws import CURVES

Place = tuple[q.Length, q.Length]
Name = Annotated[str, Meta(pattern="^[A-Za-z0-9_-]+$")]
if TYPE_CHECKING:
    Curve = str
else:
    Curve = Literal[*CURVES]
LengthUnit = Literal["m", "cm", "mm", "in"]
PER_LENGTH = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
Interpolation = Literal["linear", "cubic"]


class StrictTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a scene. Unknown keys are errors."""


class SliderTable(StrictTable, frozen=True, kw_only=True):
    """A link that slides along a line of another link, without rotating relative to it."""

    link: str  #: sliding link
    on: str = "ground"  #: link in which the line is fixed
    through: str  #: point of `link`; the line passes through its drawn position
    direction: q.Direction  #: direction of the line in the drawing


class SlotTable(StrictTable, frozen=True, kw_only=True):
    """A pin of one link that slides in a straight slot of another."""

    point: str  #: the pin, drawn on the centre line of the slot
    link: str  #: link with the pin
    on: str = "ground"  #: link with the slot
    direction: q.Direction  #: direction of the slot in the drawing


class WeldTable(StrictTable, frozen=True, kw_only=True):
    """Links that are welded together at a point."""

    #: welded links; other links at the point are pinned [all links]
    links: Annotated[list[str], Meta(min_length=2)] | None = None


class JointTable(StrictTable, frozen=True, kw_only=True):
    """Friction, compliance and misalignment of a pin, slider or weld."""

    compliance: q.Compliance | None = None  #: displacement per force [0]
    rotation: q.TurnCompliance | None = None  #: rotation per moment, for a driven pin, a weld or a slider [0]
    #: offset of the unloaded pin centres in the axes of the drawing: link of the joint force (`rocker` in
    #: `B.Fx_on_rocker`) minus other link [0]
    gap: Place | None = None
    turn: q.PlaneAngle | None = None  #: angle offset, for a driven pin, a weld or a slider [0]
    #: Coulomb coefficient; the moment of a pin is coefficient x `radius` x force [0]
    friction: Annotated[float, Meta(ge=0, le=10)] | None = None
    viscosity: q.DampingConstant | None = None  #: viscous friction [0]
    radius: q.Size | None = None  #: radius of the pin, needed for its `friction`
    #: guide length of a slider, centred at `through`; the forces at its ends also cause friction [0]
    length: q.Size | None = None


class SegmentTable(StrictTable, frozen=True, kw_only=True):
    """A segment of a motion law."""

    #: motion curve; all curves except constant speed start and end at rest
    curve: Curve
    duration: q.Duration  #: duration of the segment
    to: q.AngleOrLength | None = None  #: coordinate at the end (not for a dwell)
    by: q.AngleOrLength | None = None  #: change of the coordinate, instead of `to`


class AgainstTable(StrictTable, frozen=True, kw_only=True):
    """Abscissa of a table other than time: the angle of a link or the travel of a slider."""

    link: str | None = None  #: rotating link
    on: str = "ground"  #: link relative to which the angle is measured
    slider: str | None = None  #: slider, instead of `link`

    @property
    def turns(self) -> bool:
        """True if the coordinate is an angle."""
        return self.slider is None

    @property
    def unique(self) -> bool:
        """True if exactly one of `link` and `slider` is given."""
        return (self.link is None) == (self.slider is not None)

    @property
    def name(self) -> str:
        """Name of the link or slider."""
        return self.link or self.slider or ""


class JointNameTable(AgainstTable, frozen=True, kw_only=True):
    """A joint coordinate, given as in a drive."""

    at: str | None = None  #: pin about which `link` rotates on `on` [the only pin that both links share]


class DriveTable(JointNameTable, frozen=True, kw_only=True):
    """A drive of a pin or slider, with a constant speed, a motion law, a motion table or an effort."""

    #: coordinate at the start [as drawn]
    start: q.AngleOrLength | None = None
    speed: q.Speed | None = None  #: constant speed; with an `effort`, the speed at the start
    #: segments of a motion law, instead of `speed`
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None
    #: times (from 0) and coordinates of a cubic spline, or a CSV file in the folder of the scene, instead of `speed`
    motion: Annotated[list[tuple[q.Time, q.AngleOrLength]], Meta(min_length=4)] | str | None = None
    repeat: bool = False  #: `true`: the law or motion is repeated
    effort: q.ForceOrMoment | None = None  #: moment or force along the coordinate, from which the motion is computed
    #: factor of the effort as a function of time, angle or travel [1]
    table: Annotated[list[tuple[q.Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: variable of the table [time]
    interpolation: Interpolation = "linear"  #: interpolation between entries of the table
    #: `"hold"`: constant beyond the ends of the table, which otherwise must cover the run
    extend: Literal["hold"] | None = None
    motor: Name | None = None  #: motor, under `[motors]` [none]
    cylinder: Name | None = None  #: cylinder of a slider, under `[cylinders]` [none]
    #: allowed (largest - smallest) / constant speed, for which a flywheel is sized [no limit]
    unevenness: q.Share | None = None


Factor = Annotated[float, Meta(gt=0)]


class GearTable(StrictTable, frozen=True, kw_only=True):
    """Gears, or a rack, belt or chain, that couple two joint coordinates."""

    driver: JointNameTable  #: joint of the driver, given as in a drive
    follower: JointNameTable  #: joint of the follower, given as in a drive
    #: change of the follower / change of the driver; negative for external gears
    ratio: q.Ratio
    pressure_angle: q.PlaneAngle | None = None  #: pressure angle of the teeth, below 90 deg [20 deg]
    teeth: bool = True  #: `false`: a belt, chain or ideal gear, which only transmits a moment


class LoadTable(StrictTable, frozen=True, kw_only=True):
    """A force or moment at a point, or a distributed force along a beam."""

    link: str  #: loaded link
    point: str | None = None  #: point of application; or use `beam`
    force: tuple[q.Force, q.Force] | None = None  #: components `[x, y]` [none]
    moment: q.Moment | None = None  #: moment at the point [none]
    beam: tuple[str, str] | None = None  #: two points of the link, for a load per length between them
    start: tuple[q.ForcePerLength, q.ForcePerLength] | None = None  #: load per length `[x, y]` at the first point
    #: load per length at the second point; linear in between [same as `start`]
    end: tuple[q.ForcePerLength, q.ForcePerLength] | None = None
    #: axes of the components: `"fixed"` in the drawing, or `"turning"` with the (deformed) link or beam
    axes: Literal["fixed", "turning"] = "fixed"
    #: `"one way"`: only acts while the point moves against it; `"both ways"`: always opposes the motion [acts as given]
    resists: Literal["both ways", "one way"] | None = None
    #: factor as a function of time, angle or travel; two equal abscissas make a step [1]
    table: Annotated[list[tuple[q.Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: variable of the table [time]
    interpolation: Interpolation = "linear"  #: interpolation between entries of the table
    #: `"hold"`: constant beyond the ends of the table, which otherwise must cover the run
    extend: Literal["hold"] | None = None


class SpringTable(StrictTable, frozen=True, kw_only=True):
    """A spring with a damper, between points of two links or as a torsion spring about their common pin."""

    link: str  #: link of the first end
    on: str = "ground"  #: link of the second end
    point: str | None = None  #: first end, on `link`
    anchor: str | None = None  #: second end, on `on`
    length: q.Length | None = None  #: length at which the tension is `preload` [0]
    at: str | None = None  #: common pin of the links, for a torsion spring, instead of `point`
    #: angle between the links at which the moment is `preload`; a wound spring may need more than 180 degrees [0]
    angle: q.PlaneAngle | None = None
    stiffness: q.Stiffness | None = None  #: stiffness of the spring [0]
    damping: q.DampingConstant | None = None  #: damper in parallel [0]
    preload: q.ForceOrMoment | None = None  #: tension, or moment that opposes an increasing angle [0]


class LinkLimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits on a link: upper limits on deflections and buckling, lower limits on safety, endurance and life."""

    deflection: q.Size | None = None  #: displacement from the rigid position, normal to the axis [no limit]
    chord: q.Size | None = None  #: deflection from the line through the displaced ends [no limit]
    safety: Factor | None = None  #: yield stress / von Mises stress [no limit]
    buckling: Factor | None = None  #: load / critical load of the whole mechanism [no limit]
    endurance: Factor | None = None  #: safety factor against the endurance limit, needs `[fatigue]` [no limit]
    life: q.Duration | None = None  #: fatigue life of a link, needs `[fatigue]` [no limit]


LEAST_ALLOWED = ("safety", "endurance", "life")  # lower limits


Amount = float | str  # value in the unit of the number or figure to which it refers


class BoundTable(StrictTable, frozen=True, kw_only=True):
    """Bounds on a figure."""

    most: Amount | None = None  #: upper limit
    least: Amount | None = None  #: lower limit


class LimitsTable(LinkLimitsTable, frozen=True, kw_only=True):
    """Limits on all links, on single links, on the output, and on any figure."""

    output: q.Allowance | None = None  #: output error [no limit]
    #: distance of the output from its final position after the drives stop [no limit]
    residual: q.Allowance | None = None
    #: time after the stop until the output stays within `settled` of `[run]` [no limit]
    settling: q.Duration | None = None
    #: additional limits on single links
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)
    #: upper limit, or `most` and `least`, by the name of the figure, such as `"joint_force.A"`
    figures: dict[str, Amount | BoundTable] = field(default_factory=dict)


Entry = float | str


class RangeTable(StrictTable, frozen=True, kw_only=True):
    """Range of a number, including both ends."""

    start: Entry = field(name="from")  #: first value
    end: Entry = field(name="to")  #: last value
    count: Annotated[int, Meta(ge=2)] | None = None  #: number of values on a grid; without it, the range is sampled


class SweepTable(StrictTable, frozen=True, kw_only=True):
    """A parameter study."""

    #: range or list of values, by the path of a number, such as `"sections.bar.depth"`
    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    #: `"grid"`: all combinations; otherwise the method that samples ranges without `count`
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None  #: number of samples
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0  #: random seed
    #: CSV file in the folder of the scene: a design per row, paths (with units in brackets) as headings [none]
    table: str | None = None
    figures: list[str] = field(default_factory=list)  #: figures of each design [figures of the summary]
    #: figure to minimize among the designs within `[limits]` [the first of `figures`]
    smallest: str | None = None
    largest: str | None = None  #: figure to maximize, instead of `smallest`


class SensitivitiesTable(StrictTable, frozen=True, kw_only=True):
    """Derivatives of figures with respect to numbers of the scene."""

    figures: list[str] = field(default_factory=list)  #: figures to differentiate [figures of the summary]
    #: paths of the numbers [all numbers of the machine]
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(StrictTable, frozen=True, kw_only=True):
    """Tolerance of a number."""

    plus_minus: Amount  #: half the width of the range, in the unit of the number or in per cent
    #: `"uniform"`, or `"normal"` with standard deviation `plus_minus` / 3
    distribution: Literal["uniform", "normal"] = "uniform"


class PathTable(StrictTable, frozen=True, kw_only=True):
    """Desired path of a point."""

    point: str  #: name of the point
    places: Annotated[list[Place], Meta(min_length=1)]  #: desired position of the point at each position of the run


class OptimizeTable(StrictTable, frozen=True, kw_only=True):
    """An optimization: goal, variables and limits."""

    #: bounds by the path of a number, such as `["3 mm", "9 mm"]`
    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None  #: figure to minimize
    maximize: str | None = None  #: figure to maximize, instead of `minimize`
    #: upper limit, or `most` and `least`, by the name of the figure
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None  #: desired path of a point, for `path_error` and `path_squares` [none]
    method: Literal["search", "evolution"] = "search"  #: local searches, or differential evolution
    seed: Annotated[int, Meta(ge=0)] = 0  #: random seed
