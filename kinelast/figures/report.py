"""The report on a scene, with figures and their errors, verdict, findings and checks, as written to summary.json.

The classes in this module are the sections of the report. Sections that only the page reads are plain data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import UNSET, Struct, UnsetType, convert, field, to_builtins

from kinelast.scene.reading import Finding, Reading

# This module is long because its classes together define the format of summary.json.

Data = Mapping[str, Any]


class Record(Struct, frozen=True):
    """A section of a report."""


class SceneWords(Record, frozen=True):
    """The name and title of a scene, and the source of its data."""

    name: str
    title: str
    source: str


class RunReport(Record, frozen=True):
    """The numbers of positions and the time span of a run. `interrupted` [s] is None if the run is complete."""

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
    """The constants of a material."""

    E: Reading
    density: Reading
    yield_stress: Reading = field(name="yield")


class DriveSpeed(Record, frozen=True):
    """The speed of largest magnitude of a drive, with its sign, and whether the speed is constant."""

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
    """The inputs of a scene, except for its links. `theory` is the beam theory."""

    theory: str
    materials: Mapping[str, MaterialReading]
    sections: Data
    gravity: Mapping[str, Reading]
    drives: Mapping[str, DriveSpeed]
    point_masses: Sequence[Data]
    loads: Sequence[LoadReading]


class BeamReading(Reading, frozen=True, kw_only=True):
    """The greatest value of a field, with its beam and its member, i.e. a straight run of beams.

    `along_member` is the distance from the member's start.
    """

    label: str
    member: str
    along_member: Reading
    drive: Mapping[str, Reading]


class BeamStrength(Record, frozen=True):
    """The strength of a beam. `buckling` is load / critical load."""

    stress_range: Reading
    yield_stress: Reading
    safety_factor: Reading
    buckling: Reading
    slenderness: Reading


class LinkShare(Reading, frozen=True, kw_only=True):
    """The contribution of a link's bending to the deviation of the output from the rigid mechanism."""

    link: str


class OutputReading(Reading, frozen=True, kw_only=True):
    """The deviation of the output from the rigid mechanism.

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
    """The load factors at which a link fails or exceeds a limit, by failure mode.

    `link` is the name of the link, or "output" and the name of the output. `governs` is the failure mode with the
    smallest factor; `reserve` is that factor.
    """

    link: str
    governs: str
    reserve: Reading
    reserves: Mapping[str, Reading]


class RubbingJoint(Record, frozen=True):
    """The friction effort (moment or force) in a joint on the link `on`."""

    joint: str
    on: str
    effort: Reading


class FrictionReport(Record, frozen=True):
    """Efforts, power and loop gain of joint friction, and the numbers of locked positions and of positions at rest."""

    joints: Sequence[RubbingJoint]
    power: Reading
    feedback: Reading
    locked: int
    resting: int


class MomentumReport(Record, frozen=True):
    """The momentum balance of the answer of one theory, with the fields of `fem_check.MomentumBalance`."""

    opening: float | None
    velocity: float | None
    force: float | None
    moment: float | None
    compared: int
    tolerance: float | None
    largest: float | None
    passed: bool | None


class CheckReport(Record, frozen=True):
    """The finite element check. Differences are relative to the greatest magnitude of the field; null if unknown."""

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

    `problem` is the reason why a check was not possible.
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
    """The theory of the answer, and the largest relative error of the main figures.

    Attributes
    ----------
    problem
        Reason why the error is unknown.
    figure, on, errors
        Main figure with the largest relative error, its item (such as a link), and the parts of this error.
    without_vibration
        Relative error of the quasi-static answer.
    accuracy, expected, reached
        Requested accuracy, default accuracy, and whether the requested accuracy is reached. `accuracy` and `reached`
        are null if none is requested.
    courses
        Relative errors of time histories, by name of the field.
    damping, growth, stable
        Damping coefficients beta of the beams [s], growth of vibration per cycle, and whether a steady state exists.
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
    """A figure with a large error. `share` is error / value; null if the error is infinite."""

    name: str
    on: str | None
    share: float | None


class Reliability(Record, frozen=True):
    """The worst level of the findings, the headings of the findings, and the figures with large errors."""

    level: str
    reasons: Sequence[str]
    unreliable: Sequence[UnreliableFigure]


class JudgedLimit(Record, frozen=True):
    """A limit and the value that decides it.

    `kind` is the key of the limit, `name` is the name of the limited figure, and `on` is the item. `least` is true for
    a lower bound. `used` is the utilisation of the limit. `kept` is true if the value, ignoring its error, meets it.
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
    """The worst outcome of the limits in words; empty if there are no limits. `passed` is None if it is unknown."""

    verdict: str
    passed: bool | None
    problem: str
    limits: Sequence[JudgedLimit] | UnsetType = UNSET


class OptimumReport(Record, frozen=True):
    """The best design and its verdict, in SI units. Values `in_full` are computed by the theory of the scene."""

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
    """A variable of the best design, its bounds, and the multiplier of the active bound, "low" or "high"."""

    path: str
    unit: str
    before: float
    value: float
    low: float
    high: float
    at_bound: str | None
    multiplier: float


class OptimumLimit(Record, frozen=True):
    """A limit on the best design.

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
    """The origin of a report.

    It consists of the checksum of the scene's file, the options, the checksums of further files that the scene refers
    to (`beside`), and the time at which the run was interrupted [s].
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
        Findings (doubts about the figures), worst first, and their summary.
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
