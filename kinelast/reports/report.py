"""The report on a scene, as written to summary.json.

It contains results with their errors, the verdict, findings and checks. The classes in this module are the sections of
the report. Sections that are used only by the HTML page are plain dictionaries and lists, without classes. This module
is long because its classes together define one file format.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import UNSET, Struct, UnsetType, convert, field, to_builtins

from kinelast.values.reading import Finding, Reading

Data = Mapping[str, Any]


class Record(Struct, frozen=True):
    """A section of a report."""


class SceneWords(Record, frozen=True):
    """The name and title of a scene, and the source of its data."""

    name: str
    title: str
    source: str


class RunReport(Record, frozen=True):
    """The numbers of positions and the time span of a run.

    `interrupted` is the time at which the run was interrupted, or None if it is complete. `several_turns` is true if a
    drive makes several turns, so that the drive angle alone does not define the position.
    """

    positions: int
    singular: int
    ill_conditioned: int
    locked: int
    left_out: int
    one_position: bool
    several_turns: bool
    interrupted: Reading | None
    start: Reading
    end: Reading
    largest_condition: Reading


class MaterialReading(Record, frozen=True):
    """The constants of a material."""

    E: Reading
    density: Reading
    yield_stress: Reading = field(name="yield")


class DriveSpeed(Record, frozen=True):
    """The speed of a drive, and whether it is constant.

    If the speed varies, `speed` is its value of largest magnitude, with sign.
    """

    speed: Reading
    steady: bool


class LoadReading(Record, frozen=True):
    """The kind, link, point, magnitudes and direction of a load.

    `resists` is "one way" or "both ways" if the load opposes the motion, otherwise None.
    """

    resists: str | None
    kind: str
    link: str
    place: str
    varies: bool
    sizes: Sequence[Reading]
    towards: Reading | None


class Inputs(Record, frozen=True):
    """The inputs of a scene, except for the links. `theory` is the beam theory."""

    theory: str
    materials: Mapping[str, MaterialReading]
    sections: Data
    gravity: Mapping[str, Reading]
    drives: Mapping[str, DriveSpeed]
    point_masses: Sequence[Data]
    loads: Sequence[LoadReading]


class BeamReading(Reading, frozen=True, kw_only=True):
    """The greatest value of a field (quantity along beams), and the beam and the member in which it occurs.

    A member is a straight run of beams.

    `along_member` is the distance of the location from the start of the member.
    """

    label: str
    member: str
    along_member: Reading
    drive: Mapping[str, Reading]


class BeamStrength(Record, frozen=True):
    """The stress range, safety, buckling and slenderness of a beam.

    `buckling` is the ratio of load to critical load.
    """

    stress_range: Reading
    yield_stress: Reading
    safety_factor: Reading
    buckling: Reading
    slenderness: Reading


class LinkShare(Reading, frozen=True, kw_only=True):
    """The contribution of a flexible link or joint to the deviation of the output from the rigid mechanism."""

    link: str


class OutputReading(Reading, frozen=True, kw_only=True):
    """The deviation of the output from the rigid mechanism.

    `kind` is "point", "slide" or "angle". `guessed` is true if the program chose the output, because the scene does not
    name one. `lags` are the angles or distances by which drives lag behind their cams. The deviation does not include
    them.
    """

    kind: str
    name: str
    guessed: bool
    motion: Data
    shares: Sequence[LinkShare] = ()
    lags: Sequence[Reading] = ()


class Reserve(Record, frozen=True):
    """The reserve of an item, such as a link, against a limit or a failure: the factor by which the load may grow.

    Attributes
    ----------
    kind, item
        Kind of the item, such as "link" or "motor", and its name, which is empty for the whole machine.
    mode
        "yield", "endurance" or "buckling" for a failure. Otherwise "limit" or "limit speed".
    figure, name
        Key of the limited figure, and the limit in words.
    least, limit, found
        Whether `limit` is a lower bound, the limit, and the value of the figure.
    reserve
        `found` / `limit` for a lower bound, otherwise `limit` / `found`. A life or a cam pressure is not proportional
        to the load. For such figures, the ratio is converted to the factor by which the load may grow. The reserve has
        no value if the limit is never reached.
    """

    kind: str
    item: str
    mode: str
    figure: str
    name: str
    least: bool
    limit: Reading
    found: Reading
    reserve: Reading


class RubbingJoint(Record, frozen=True):
    """The friction moment or friction force that a joint exerts on the link `on`."""

    joint: str
    on: str
    effort: Reading


class FrictionReport(Record, frozen=True):
    """The efforts, power and loop gain of joint friction.

    `locked` is the number of positions at which friction may lock the mechanism, and `resting` is the number of
    positions at which no joint slides.
    """

    joints: Sequence[RubbingJoint]
    power: Reading
    feedback: Reading
    locked: int
    resting: int


class MomentumReport(Record, frozen=True):
    """The momentum balance of an answer. The fields are those of `fem_check.MomentumBalance`."""

    opening: float | None
    velocity: float | None
    force: float | None
    moment: float | None
    compared: int
    tolerance: float | None
    largest: float | None
    passed: bool | None


class CheckReport(Record, frozen=True):
    """The finite element check.

    A difference is relative to the greatest magnitude of the field, such as the stress, and null if unknown.
    """

    passed: bool | None
    tolerance: float
    elements: int
    compared: int
    largest: float | None
    momentum: Mapping[str, MomentumReport]
    differences: Mapping[str, Mapping[str, float | None]]
    worst: Sequence[Data]


class FurtherCheck(Record, frozen=True):
    """The result of the nonlinear check or of the check with plane bodies.

    If the check could not be made, `problem` is the reason.
    """

    largest: float | None = None
    passed: bool | UnsetType | None = UNSET
    problem: str | UnsetType = UNSET
    too_close_to_decide: bool | UnsetType = UNSET
    cannot_tell: bool | UnsetType = UNSET
    elements: int | UnsetType = UNSET
    steps: int | UnsetType = UNSET
    positions: int | UnsetType = UNSET
    estimate: float | UnsetType | None = UNSET
    own_errors: Mapping[str, float] | UnsetType = UNSET
    links: Data | UnsetType = UNSET
    left_out: Mapping[str, str] | UnsetType = UNSET
    refinement: float | UnsetType = UNSET


class TheoryReport(Record, frozen=True):
    """The theory of the results, and the largest relative error in the main figures, such as the deflection of links.

    Attributes
    ----------
    problem
        Reason why the error is unknown; empty if it is known.
    figure, on, errors
        Main figure with the largest relative error, its item (such as a link), and the parts of this error,
        which add up to it. A part is negative if it offsets others.
    near_zero
        Names of headline figures near zero whose relative errors exceed `error`.
    without_vibration
        Largest relative change in a main displacement, stress or force due to vibration and large displacement.
    accuracy, expected, reached
        Requested accuracy, default accuracy, and whether the requested accuracy is reached. `accuracy` and `reached`
        are null if no accuracy was requested.
    courses
        Relative errors in time histories, by name of the field.
    damping, growth, stable
        Damping coefficient beta of each beam [s], factor by which vibration grows in a cycle or in a run without cycle,
        and whether it grows so little that there is an answer.
    """

    name: str
    problem: str
    error: float | None = None
    figure: str | None = None
    on: str | None = None
    errors: Mapping[str, float | None] = {}
    near_zero: Sequence[str] = ()
    without_vibration: float | None = None
    accuracy: float | None = None
    expected: float | UnsetType = UNSET
    reached: bool | None = None
    courses: Mapping[str, float | None] = {}
    damping: Sequence[Reading] | UnsetType = UNSET
    growth: float | UnsetType | None = UNSET
    stable: bool | UnsetType = UNSET


class UnreliableFigure(Record, frozen=True):
    """A figure with a large error. `share` is the ratio of error to value, or null if it is unknown."""

    name: str
    on: str | None
    share: float | None


class Reliability(Record, frozen=True):
    """The worst severity of the findings, the headings of the findings with this severity, and unreliable figures.

    The severity does not include yielding and the findings on limits and on unreliable figures, which are reported
    separately. `near_zero` is the number of figures that are not listed although their relative error is large. This
    error is large only because the value is near zero.
    """

    level: str
    reasons: Sequence[str]
    unreliable: Sequence[UnreliableFigure]
    near_zero: int


class JudgedLimit(Record, frozen=True):
    """A limit, and the value that decides whether the limit is met.

    `kind` is the key of the limit, `name` is the name of the limited figure, and `on` is the item. `least` is true for
    a lower bound. `used` is the utilisation of the limit. `kept` is true if the value without its error meets the
    limit.
    """

    kind: str
    name: str
    least: bool
    on: str
    limit: Reading
    found: Reading
    used: float | None
    outcome: str
    kept: bool
    passed: bool | None
    problem: str


class Verdict(Record, frozen=True):
    """The worst outcome of all limits in words; empty if there are no limits.

    `passed` is null if limits cannot be decided.
    """

    verdict: str
    passed: bool | None
    problem: str
    limits: Sequence[JudgedLimit] | UnsetType = UNSET


class OptimumReport(Record, frozen=True):
    """The best design and its verdict, in SI units.

    Values `in_full` are computed by the theory chosen in the scene. The others are quasi-static.
    """

    goal: str
    figure: str
    unit: str
    before: float
    value: float
    theory: str
    in_full: float | None
    error: float | None
    feasible: bool
    verdict: str
    passed: bool | None
    problem: str
    variables: Sequence[OptimumVariable]
    limits: Sequence[OptimumLimit]
    residual: float
    kinked: bool
    neighbours: Sequence[Data]
    searches: Sequence[Data]
    designs: int
    calls: int
    words: Sequence[str]


class OptimumVariable(Record, frozen=True):
    """A variable of the best design of an optimization.

    If it is at a bound, `at_bound` is "low" or "high", and `multiplier` is the Lagrange multiplier of this bound.
    """

    path: str
    unit: str
    before: float
    value: float
    low: float
    high: float
    at_bound: str | None
    multiplier: float


class OptimumLimit(Record, frozen=True):
    """A limit on the best design of an optimization.

    `kind` is "least" for a lower bound and "most" for an upper one. `held_to` is the bound that the optimizer applied
    to the quasi-static figure.
    """

    figure: str
    unit: str
    bound: float
    kind: str
    before: float
    value: float
    held_to: float
    in_full: float | None
    error: float | None
    outcome: str
    margin: float
    active: bool
    multiplier: float


class Origin(Record, frozen=True):
    """The inputs from which a report was made.

    They are the checksum of the scene file, the options, the checksums of other files that the scene refers to
    (`beside`) and, if the run was interrupted, the time of the interruption [s].
    """

    sha256: str
    options: Data
    beside: Mapping[str, str] | UnsetType = UNSET
    interrupted: float | UnsetType = UNSET


class Report(Record, frozen=True):
    """The report on a scene.

    Attributes
    ----------
    shown_in
        Display units of the report.
    trust, reliability
        Findings on how far the figures can be trusted, the most severe first, and a summary of the findings.
    more
        Other sections by key, such as tables of machine parts and studies.
    """

    kinelast: str
    shown_in: Mapping[str, tuple[float, str]]
    scene: SceneWords
    run: RunReport
    inputs: Inputs
    links: Sequence[Data]
    rigid_links: Sequence[str]
    peaks: Mapping[str, Mapping[str, Reading]]
    largest_deflection: BeamReading | None
    largest_chord: BeamReading | None
    largest_stress: BeamReading | None
    strength: Mapping[str, BeamStrength]
    figures: Mapping[str, Reading]
    points: Mapping[str, Mapping[str, Reading]]
    angle_errors: Mapping[str, Reading]
    output: OutputReading | None
    joints: Sequence[Data]
    breaks_first: Sequence[Reserve]
    buckles: str | None
    yields: str | None
    drives: Mapping[str, Data]
    friction: FrictionReport | None
    shaking: Mapping[str, Reading]
    vibration: Data | None
    check: CheckReport | None
    nonlinear_check: FurtherCheck | None
    solid_check: FurtherCheck | None
    theory: TheoryReport
    cautions: Sequence[Data]
    limits: Data
    trust: Sequence[Finding]
    reliability: Reliability
    stressed: bool
    not_computed: Sequence[str]
    acceptance: Verdict
    made_from: Origin | UnsetType = UNSET
    optimum: OptimumReport | UnsetType = UNSET
    more: Data = {}


def data_of(report: Report) -> dict[str, Any]:
    """Return a report as plain data for JSON."""
    data: dict[str, Any] = to_builtins(report)
    more = data.pop("more")
    return {**data, **more}


def report_from(data: Mapping[str, Any]) -> Report:
    """Return the report from the plain data that `data_of` returned for it."""
    known = {key: value for key, value in data.items() if key in Report.__struct_fields__}
    return convert({**known, "more": {key: value for key, value in data.items() if key not in known}}, Report)
