"""Report on a scene: figures with their errors, verdict, findings and checks. It is written to summary.json.

Sections that only the page reads are plain data. The classes in this file define the types of all other sections.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import UNSET, Struct, UnsetType, convert, field, to_builtins

from kinelast.scene.reading import Finding, Reading

# The file is longer than others, because its classes together are the format of summary.json.

Data = Mapping[str, Any]


class Record(Struct, frozen=True):
    """Section of a report."""


class SceneWords(Record, frozen=True):
    """Name and title of a scene, and the source of its data."""

    name: str
    title: str
    source: str


class RunReport(Record, frozen=True):
    """Numbers of positions, and the time span of a run. `interrupted` [s] is None if the run is complete."""

    positions: int
    singular: int
    ill_conditioned: int
    locked: int
    left_out: int
    one_position: bool
    interrupted: Reading | None
    start: Reading
    end: Reading
    largest_condition: Reading


class MaterialReading(Record, frozen=True):
    """Constants of a material."""

    E: Reading
    density: Reading
    yield_stress: Reading = field(name="yield")


class DriveSpeed(Record, frozen=True):
    """Drive speed of the largest magnitude, with its sign, and whether the speed is constant."""

    speed: Reading
    steady: bool


class LoadReading(Record, frozen=True):
    """Kind, link, point, magnitudes and direction of a load.

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
    """Inputs of a scene other than its links. `theory` is the beam theory."""

    theory: str
    materials: Mapping[str, MaterialReading]
    sections: Data
    gravity: Mapping[str, Reading]
    drives: Mapping[str, DriveSpeed]
    point_masses: Sequence[Data]
    loads: Sequence[LoadReading]


class BeamReading(Reading, frozen=True, kw_only=True):
    """Greatest value of a field, with its beam and member (a straight run of beams).

    `along_member` is the distance from the member's start.
    """

    label: str
    member: str
    along_member: Reading
    drive: Mapping[str, Reading]


class BeamStrength(Record, frozen=True):
    """Strength of a beam; `buckling` is load / critical load."""

    stress_range: Reading
    yield_stress: Reading
    safety_factor: Reading
    buckling: Reading
    slenderness: Reading


class LinkShare(Reading, frozen=True, kw_only=True):
    """Contribution of a link or soft joint to the deviation of the output from the rigid mechanism.

    `link` is the name of the link, "joint" and the name of the joint, or "others".
    """

    link: str


class OutputReading(Reading, frozen=True, kw_only=True):
    """Deviation of the output from the rigid mechanism.

    `kind` is "point", "slide" or "angle". `guessed` is true if the program chose the output. `lags` are the lags of
    drives behind their cams, which the deviation does not include.
    """

    kind: str
    name: str
    guessed: bool
    motion: Data
    shares: Sequence[LinkShare] = ()
    lags: Sequence[Reading] = ()


class LinkReserves(Record, frozen=True):
    """Load factors at which a link fails or exceeds a limit, by failure mode.

    `link` is the name of the link, or "output" and the name of the output. `governs` is the failure mode with the
    smallest factor; `reserve` is that factor.
    """

    link: str
    governs: str
    reserve: Reading
    reserves: Mapping[str, Reading]


class RubbingJoint(Record, frozen=True):
    """Friction effort (moment or force) of a joint on the link `on`."""

    joint: str
    on: str
    effort: Reading


class FrictionReport(Record, frozen=True):
    """Joint friction: efforts, power, loop gain, and the numbers of locked positions and of positions at rest."""

    joints: Sequence[RubbingJoint]
    power: Reading
    feedback: Reading
    locked: int
    resting: int


class MomentumReport(Record, frozen=True):
    """Momentum balance of the answer by one theory. See `fem_check.MomentumBalance` for the fields."""

    opening: float | None
    velocity: float | None
    force: float | None
    moment: float | None
    compared: int
    tolerance: float | None
    largest: float | None
    passed: bool | None


class CheckReport(Record, frozen=True):
    """Finite element check. Differences are relative to the greatest magnitude of the field, null if unknown."""

    passed: bool | None
    tolerance: float
    elements: int
    compared: int
    largest: float | None
    momentum: Mapping[str, MomentumReport]
    differences: Mapping[str, Mapping[str, float | None]]
    worst: Sequence[Data]


class FurtherCheck(Record, frozen=True):
    """Result of the nonlinear check or of the check with plane bodies.

    `problem` is the reason why a check could not be run.
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
    """Theory of the answer, and the largest relative error among the main figures.

    Attributes
    ----------
    problem
        Reason why the error is unknown.
    figure, on, errors
        The main figure with the largest relative error, and its item (such as a link).
        `errors` are the parts of that error.
    without_vibration
        Relative error of the quasi-static answer.
    accuracy, expected, reached
        Requested accuracy, default accuracy, and whether the request is met; null if there is none.
    courses
        Relative errors of time histories over the cycle, by name of the figure.
    damping, growth, stable
        Damping coefficients beta [s] of the beams, growth of vibration per cycle, and whether a steady state exists.
    """

    name: str
    problem: str
    error: float | None = None
    figure: str | None = None
    on: str | None = None
    errors: Mapping[str, float | None] = {}
    without_vibration: float | None = None
    accuracy: float | None = None
    expected: float | UnsetType = UNSET
    reached: bool | None = None
    courses: Mapping[str, float | None] = {}
    damping: Sequence[Reading] | UnsetType = UNSET
    growth: float | UnsetType | None = UNSET
    stable: bool | UnsetType = UNSET


class UnreliableFigure(Record, frozen=True):
    """Figure with a large error; `share` is error / value, null if the error is infinite."""

    name: str
    on: str | None
    share: float | None


class Reliability(Record, frozen=True):
    """Worst level of the findings, their headings, and the figures with large errors."""

    level: str
    reasons: Sequence[str]
    unreliable: Sequence[UnreliableFigure]


class JudgedLimit(Record, frozen=True):
    """A limit with the figure that decides it.

    `kind` is the key of the limit, `name` its figure in words, and `on` its item. `least` is true for a lower bound.
    `used` is the utilisation of the limit. `kept` is true if the figure meets the limit, ignoring its error.
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
    """Worst outcome of the limits in words, empty if there are no limits. `passed` is None if it is unknown."""

    verdict: str
    passed: bool | None
    problem: str
    limits: Sequence[JudgedLimit] | UnsetType = UNSET


class OptimumReport(Record, frozen=True):
    """Best design and its verdict. Numbers are in SI units; `in_full` values follow the theory of the scene."""

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
    """Variable of the best design, its bounds, and the active bound's multiplier; `at_bound` is "low" or "high"."""

    path: str
    unit: str
    before: float
    value: float
    low: float
    high: float
    at_bound: str | None
    multiplier: float


class OptimumLimit(Record, frozen=True):
    """Limit on the best design.

    `kind` is "least" or "most". `held_to` is the bound that the optimizer applied to the quasi-static figure.
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
    """Checksum of the scene's file, options, checksums `beside` of its other files, and time of an interrupt [s]."""

    sha256: str
    options: Data
    beside: Mapping[str, str] | UnsetType = UNSET
    interrupted: float | UnsetType = UNSET


class Report(Record, frozen=True):
    """Report on a scene.

    Attributes
    ----------
    shown_in
        Units of the report.
    trust, reliability
        Findings (doubts about the figures), worst first, and their summary.
    more
        Other sections by key, such as tables of machine parts, and studies.
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
    breaks_first: Sequence[LinkReserves]
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
    """Return the report from the plain data that `data_of` returned."""
    known = {key: value for key, value in data.items() if key in Report.__struct_fields__}
    return convert({**known, "more": {key: value for key, value in data.items() if key not in known}}, Report)
