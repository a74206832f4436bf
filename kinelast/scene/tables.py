"""Tables and keys of a scene file: joints, drives, loads, limits, and studies of designs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

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
    Force,
    ForcePerLength,
    Length,
    Moment,
    Ratio,
    Share,
    Size,
    Speed,
    Stiffness,
    Time,
    TurnCompliance,
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
    """A table of a scene, which refuses unknown keys."""


class SliderTable(StrictTable, frozen=True, kw_only=True):
    """A link that slides on another without turning."""

    link: str  #: the link that slides
    on: str = "ground"  #: the link that carries the line
    #: a point of `link` on the line of sliding; the line passes through its drawn place and is fixed in `on`
    through: str
    direction: Direction  #: direction of the line in the drawing


class SlotTable(StrictTable, frozen=True, kw_only=True):
    """A pin of one link in a straight slot of another."""

    point: str  #: the pin, drawn on the centre line of the slot
    link: str  #: the link that has the pin
    on: str = "ground"  #: the link that has the slot
    direction: Direction  #: direction of the slot in the drawing


class WeldTable(StrictTable, frozen=True, kw_only=True):
    """Links welded together at a point: all links there, or those named."""

    #: links that are welded; other links at the point are pinned [all]
    links: Annotated[list[str], Meta(min_length=2)] | None = None


class JointTable(StrictTable, frozen=True, kw_only=True):
    """Friction, compliance and misalignment of a pin, slider or weld."""

    compliance: Compliance | None = None  #: displacement per force [0]
    rotation: TurnCompliance | None = None  #: rotation per moment of a driven pin, weld or slider [0]
    #: initial offset between the two pin centers of an unloaded joint, in drawing axes: that of the later link minus
    #: that of the other [none]
    gap: Place | None = None
    turn: Angle | None = None  #: initial angular offset of a driven pin, weld or slider, in the same sense [0]
    #: Coulomb friction coefficient; the friction moment of a pin is coefficient x `radius` x joint force, the friction
    #: force of a slider is coefficient x normal force [0]
    friction: Annotated[float, Meta(ge=0, le=10)] | None = None
    viscosity: Damping | None = None  #: viscous friction, added to the Coulomb friction [0]
    radius: Size | None = None  #: radius of a pin with `friction`
    #: guide length of a slider, with `through` at its middle; friction then includes the forces at both ends that carry
    #: the moment [the moment adds no friction]
    length: Size | None = None


class SegmentTable(StrictTable, frozen=True, kw_only=True):
    """A segment of the motion law of a drive."""

    #: all curves except constant speed start and end at rest; `trapezoidal-velocity` and `constant-acceleration` have
    #: jumps in acceleration
    curve: Curve
    duration: Duration  #: duration of the segment
    to: Coordinate | None = None  #: coordinate at the end; not for a dwell
    by: Coordinate | None = None  #: change of the coordinate, instead of `to`; not for a dwell


class AgainstTable(StrictTable, frozen=True, kw_only=True):
    """Independent variable of a table other than time: the angle of a link or the travel of a slider."""

    link: str | None = None  #: link whose angle is used
    on: str = "ground"  #: link whose axes the angle is measured from
    slider: str | None = None  #: slider whose travel is used, instead of `link`

    @property
    def turns(self) -> bool:
        """True if the coordinate is an angle."""
        return self.slider is None

    @property
    def told(self) -> bool:
        """True if exactly one of `link` and `slider` is given."""
        return (self.link is None) == (self.slider is not None)

    @property
    def name(self) -> str:
        """Name of the link or slider."""
        return self.link or self.slider or ""


class JointNameTable(AgainstTable, frozen=True, kw_only=True):
    """A joint coordinate that a gear couples, named as in a drive."""

    at: str | None = None  #: pin about which `link` turns on `on` [the only pin of both links]


class DriveTable(JointNameTable, frozen=True, kw_only=True):
    """A drive of a pin or slider: constant speed, motion law, motion table, or given effort."""

    #: coordinate at the start: angle of the link axes from the axes of `on` (the x axis for the ground), or travel from
    #: the drawn place along the line [as drawn]
    start: Coordinate | None = None
    speed: Speed | None = None  #: constant speed; with an `effort`, the speed at the start
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None  #: segments of the motion, instead of `speed`
    #: times from 0 and coordinates, interpolated by a cubic spline, instead of `speed`; or the name of a CSV file next
    #: to the scene
    motion: Annotated[list[tuple[Time, Coordinate]], Meta(min_length=4)] | str | None = None
    repeat: bool = False  #: `true`: repeat the law or motion, each time from where it ended
    #: moment or force along the coordinate, instead of a motion; the motion is then computed
    effort: Effort | None = None
    #: factor of the effort over time, an angle or a travel [constant 1]
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: independent variable of the table [time]
    interpolation: Interpolation = "linear"  #: interpolation of the table
    #: `"hold"`: constant beyond the ends of the table; otherwise the table must cover the run
    extend: Literal["hold"] | None = None
    motor: Name | None = None  #: name of its motor under `[motors]` [none]
    cylinder: Name | None = None  #: name of the cylinder of a slider under `[cylinders]` [none]
    #: allowed speed fluctuation, (largest - smallest) / constant speed; the report gives the flywheel [none]
    unevenness: Share | None = None


Factor = Annotated[float, Meta(gt=0)]


class GearTable(StrictTable, frozen=True, kw_only=True):
    """Gears, a rack or a belt that couple the coordinates of two joints."""

    driver: JointNameTable  #: joint of the driver, named as in a drive
    follower: JointNameTable  #: joint of the follower, named as in a drive
    #: change of the follower / change of the driver; negative for external gears, positive for an internal gear
    ratio: Ratio
    pressure_angle: Angle | None = None  #: pressure angle of the teeth, below 90 deg [20 deg]
    teeth: bool = True  #: `false`: belt, chain or ideal ratio, which transmits only the moment


class LoadTable(StrictTable, frozen=True, kw_only=True):
    """A force or moment at a point, or a distributed force along a beam."""

    link: str  #: loaded link
    point: str | None = None  #: point of action; or use `beam`
    force: tuple[Force, Force] | None = None  #: force at the point, `[x, y]` [none]
    moment: Moment | None = None  #: moment at the point [none]
    beam: tuple[str, str] | None = None  #: two points of the link; the load acts along the beam between them
    #: force per length `[x, y]` at the first point of the beam
    start: tuple[ForcePerLength, ForcePerLength] | None = None
    #: force per length `[x, y]` at the second point, linear in between [as `start`]
    end: tuple[ForcePerLength, ForcePerLength] | None = None
    #: `"fixed"`: x and y of the drawing; `"turning"`: axes of the link, or of the beam from its first to its second
    #: point; on an elastic link they follow the rotation of the section (follower force, as in Beck's column)
    axes: Literal["fixed", "turning"] = "fixed"
    #: load at a point: `"one way"` acts only while the point moves against it (pump piston), `"both ways"` reverses
    #: so that it always resists (blade) [always acts as given]
    resists: Literal["both ways", "one way"] | None = None
    #: factor of the load over time, an angle or a travel; two entries at the same place are a step [constant 1]
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None  #: independent variable of the table [time]
    interpolation: Interpolation = "linear"  #: interpolation of the table
    #: `"hold"`: constant beyond the ends of the table; otherwise the table must cover the run
    extend: Literal["hold"] | None = None


class SpringTable(StrictTable, frozen=True, kw_only=True):
    """A spring with damper between points of two links, or a torsion spring about their pin."""

    link: str  #: link of the first end
    on: str = "ground"  #: link of the second end
    point: str | None = None  #: first end, a point of `link`
    anchor: str | None = None  #: second end, a point of `on`
    length: Length | None = None  #: length at which the tension is `preload` [0]
    at: str | None = None  #: pin of both links, for a torsion spring, instead of `point`
    angle: Angle | None = None  #: angle of the axes of `link` from those of `on` at which the moment is `preload` [0]
    stiffness: Stiffness | None = None  #: stiffness of the spring [0]
    damping: Damping | None = None  #: constant of a parallel damper [0]
    preload: Effort | None = None  #: tension, or moment that opposes an increasing angle [0]


class LinkLimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits of a link. Deflections and buckling are upper limits; safety, endurance and life are lower limits."""

    deflection: Size | None = None  #: displacement of a link across its axis, from the rigid position [none]
    #: deflection of a link from the line through its displaced ends (bending only) [none]
    chord: Size | None = None
    safety: Factor | None = None  #: yield stress / von Mises stress [none]
    #: load / critical load of the whole mechanism; it buckles at 1 [none]
    buckling: Factor | None = None
    endurance: Factor | None = None  #: safety factor against the endurance limit, needs `[fatigue]` [none]
    life: Duration | None = None  #: fatigue life of a link, needs `[fatigue]` [none]


LEAST_ALLOWED = ("safety", "endurance", "life")  # lower limits


Amount = float | str  # in the unit of the number or figure that it is for


class BoundTable(StrictTable, frozen=True, kw_only=True):
    """Bounds of a figure."""

    most: Amount | None = None  #: upper limit
    least: Amount | None = None  #: lower limit


class LimitsTable(LinkLimitsTable, frozen=True, kw_only=True):
    """Limits of all links, of single links, and of the output."""

    output: Allowance | None = None  #: output error [none]
    residual: Allowance | None = None  #: distance of the output from its final place once the drives are at rest [none]
    #: time from that instant until the output has settled, see `settled` under `[run]` [none]
    settling: Duration | None = None
    #: limits of single links, in addition to those of all links
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)
    #: limits of any figure by its name, such as `"joint_force.A"`: an upper limit, or a table of `most` and `least`
    figures: dict[str, Amount | BoundTable] = field(default_factory=dict)


Entry = float | str


class RangeTable(StrictTable, frozen=True, kw_only=True):
    """Range of a number, both ends included."""

    start: Entry = field(name="from")  #: first value
    end: Entry = field(name="to")  #: last value
    count: Annotated[int, Meta(ge=2)] | None = None  #: number of values on a grid; not given if the range is sampled


class SweepTable(StrictTable, frozen=True, kw_only=True):
    """A parameter study: numbers that vary, figures of each design, choice of the best design."""

    #: by the path of a number, such as `"sections.bar.depth"`: a range or a list of values
    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    #: `"grid"`: all combinations; otherwise ranges without `count` are sampled together
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None  #: number of sampled designs
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0  #: seed of the random numbers
    #: a CSV file next to the scene: paths (and units in brackets) as headings, one row per design [none]
    table: str | None = None
    figures: list[str] = field(default_factory=list)  #: figures of each design [those of the summary]
    #: the best design within `[limits]` has the smallest value of this figure [the first of `figures`]
    smallest: str | None = None
    largest: str | None = None  #: the same for the largest value


class SensitivitiesTable(StrictTable, frozen=True, kw_only=True):
    """Derivatives of figures with respect to numbers of the scene; all of them by default."""

    figures: list[str] = field(default_factory=list)  #: figures to differentiate [those of the summary]
    #: paths of the numbers [all numbers of the machine]
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(StrictTable, frozen=True, kw_only=True):
    """Tolerance of a number."""

    plus_minus: Amount  #: half of the tolerance range, in the unit of the number or in per cent
    #: uniform within the range, or normal with a standard deviation of a third of `plus_minus`
    distribution: Literal["uniform", "normal"] = "uniform"


class PathTable(StrictTable, frozen=True, kw_only=True):
    """Desired path of a point."""

    point: str  #: the point
    places: Annotated[list[Place], Meta(min_length=1)]  #: desired place at each position of the run


class OptimizeTable(StrictTable, frozen=True, kw_only=True):
    """An optimization: figure to minimize or maximize, variables, limits."""

    #: by the path of a number: its bounds, such as `["3 mm", "9 mm"]`
    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None  #: figure to minimize
    maximize: str | None = None  #: figure to maximize
    #: by the name of a figure: an upper limit, or a table of `most` and `least`
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None  #: desired path of a point; adds the figures `path_error` and `path_squares` [none]
    #: local searches from many starting points, or differential evolution
    method: Literal["search", "evolution"] = "search"
    seed: Annotated[int, Meta(ge=0)] = 0  #: seed of the random numbers
