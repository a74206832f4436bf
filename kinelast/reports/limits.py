"""Comparison of figures (results such as the largest deflection) with the limits of a scene, and the verdict.

Runs, designs and speeds use the same functions.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np
from msgspec import UNSET, Struct, structs
from msgspec.structs import replace

from kinelast.answers.refusals import STRENGTH, can_yield, needed_by_limits, refusals
from kinelast.answers.results import Results
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import RECIPROCAL
from kinelast.figures.measures import Measure, bounded_items, magnitudes, measures_of
from kinelast.figures.output import rest_after_stop
from kinelast.figures.peaks import error_of_extreme
from kinelast.figures.registry import ALONG_BEAMS, figures_of, limits_of
from kinelast.reports.advice import nearer
from kinelast.reports.frequencies import frequency_change, frequency_error
from kinelast.reports.report import JudgedLimit, Verdict
from kinelast.reports.trust import doubts
from kinelast.scene.data import Scene
from kinelast.values.figure import FIXED, LARGEST, LEAST, SCENE, Figure, Limit, fixed, items_of
from kinelast.values.numbers import UNRELIABLE, has_large_error, percent, quantity
from kinelast.values.reading import Reader, Reading, known, reading
from rigid.arrays import Integers, Real, Reals, of_designs

NO_BEAMS = "every link is rigid: to make one elastic, delete its rigid, mass, center and inertia"
KEPT, BROKEN, TOO_NEAR, UNKNOWN = "kept", "not kept", "too close to decide", "cannot be judged"
SEVERITY = BROKEN, UNKNOWN, TOO_NEAR, KEPT
VERDICTS = {KEPT: "acceptable", BROKEN: "not acceptable", TOO_NEAR: TOO_NEAR, UNKNOWN: UNKNOWN}
PASSED = {KEPT: True, BROKEN: False}
LIMITS_KEPT, LIMITS_MARGIN = "limits_kept", "limits_margin"
ONE_POSITION = "only one position of the cycle is computed: increase --positions"
WIDENED = 2.0  # factor on the error in an unreliable figure; 95 % of these errors are right to within this factor
PLACES = {figure.key: figure.fields[0] for figure in ALONG_BEAMS if figure.fields}
"""For each figure along beams, the field at whose extreme value the figure is located."""


def outcome_index(limit: Limit, value: Any, error: Any) -> Integers:
    """Compare values of a figure, which have errors, with a limit. Return indices into `SEVERITY`.

    The outcome is "too close to decide" if the difference between the value and the bound is less than the error. If
    the figure is unreliable, this applies up to `WIDENED` times the error.
    """
    below, above = (limit.kept(end) for end in ends(limit, value, error))
    known = np.where(below & above, SEVERITY.index(KEPT), np.where(below | above, SEVERITY.index(TOO_NEAR), 0))
    return np.where(np.isnan(value) | np.isnan(error), SEVERITY.index(UNKNOWN), known)


def ends(limit: Limit, value: Any, error: Any) -> tuple[Any, Any]:
    """Return the smallest and the largest value that a figure may have, given its error.

    The error in an unreliable figure is multiplied by `WIDENED`. A safety factor is strength divided by stress. Its
    relative error equals that of the stress.
    """
    error = np.where(has_large_error(value, error), WIDENED * error, error)
    if limit.figure.partition(".")[0] not in RECIPROCAL:
        return value - error, value + error
    share = np.divide(error, value, where=value > 0.0, out=np.zeros(np.shape(value)))
    return np.divide(value, 1.0 + share), value + error


def outcome_indices(
    scene: Scene, figures: Mapping[str, Any], errors: Mapping[str, Any] | None = None
) -> Iterator[Integers]:
    """Yield, for each limit, the worst outcome of all items, as indices into `SEVERITY`, shape (...).

    Parameters
    ----------
    figures
        Magnitudes of the figures in SI units by key, shape (items, ...). The items, such as links or joints, are in the
        order of `items_of`. A limit cannot be judged if its figure is missing, if a sizing formula is used outside its
        range of validity, if a link yields, or if a cam does not work.
    errors
        Errors in the magnitudes, with the same shapes. If they are not given, they count as zero, and the outcomes must
        not be reported as verdicts.
    """
    for limit in limits_of(scene):
        items = bounded_items(scene, limit) if limit.figure in figures else []
        values = figures[limit.figure][items] if items else np.full(1, np.nan)
        given = replace(limit, bound=of_designs(limit.bound))
        worst = outcome_index(given, values, errors[limit.figure][items] if errors and items else 0.0).min(axis=0)
        for _, refused in refusals(scene, limit.figure, items, figures, errors):
            worst = np.minimum(worst, np.where(refused, SEVERITY.index(UNKNOWN), SEVERITY.index(KEPT)))
        yield worst


def decisive(scene: Scene, limit: Limit, figures: Mapping[str, Any]) -> Real:
    """Return the value of the item that is closest to violating a limit, or violates it most, shape (...).

    The result is nan if the value of any item is unknown.
    """
    items = bounded_items(scene, limit) if limit.figure in figures else []
    if not items:
        return math.nan
    values: Reals = figures[limit.figure][items]
    return values.min(axis=0) if limit.least else values.max(axis=0)


def limits_kept(scene: Scene, figures: Iterable[Figure]) -> tuple[Figure, Figure]:
    """Return two figures: whether all limits are met (1 or 0), and the smallest relative margin of all limits.

    Both ignore errors. The limits are not met if a position is singular.
    """
    needed = {limit.figure for limit in limits_of(scene)} | needed_by_limits(scene)
    bounded = [figure for figure in figures if figure.key in needed]

    def kept(cycle: Cycle) -> Reals:
        every = outcome_indices(cycle.scene, magnitudes(cycle, bounded))
        met = reduce(np.minimum, every) == SEVERITY.index(KEPT)
        return np.where(met & ~cycle.lost.any(axis=-1), 1.0, 0.0)

    def margin(cycle: Cycle) -> Reals:
        known = magnitudes(cycle, bounded)
        given = [(replace(limit, bound=of_designs(limit.bound)), decisive(cycle.scene, limit, known))
                 for limit in limits_of(cycle.scene)]  # fmt: skip
        if can_yield(cycle.scene):
            given.append((STRENGTH, np.fmin.reduce(known[STRENGTH.figure], axis=0)))
        return reduce(np.minimum, [limit.margin(value) for limit, value in given])

    fields = tuple(dict.fromkeys(field for figure in bounded for field in figure.fields))
    words = "all limits are met, ignoring errors", "smallest relative margin of all limits, ignoring errors"
    return (
        Figure(LIMITS_KEPT, words[0], "1", SCENE, fixed(kept), FIXED, fields, listed=True),
        Figure(LIMITS_MARGIN, words[1], "1", SCENE, fixed(margin), FIXED, fields),
    )


class Judgement(Struct, frozen=True):
    """The outcome of a limit, such as "not kept", and the value of the item (e.g. link) that decides the outcome.

    The item with the worst outcome decides. If several items have this outcome, the one with the smallest margin
    decides.

    Attributes
    ----------
    limit
        The limit.
    outcome
        One of `SEVERITY`.
    item
        Number of the deciding item, such as a link or a joint.
    value, error
        Magnitude of the figure for the deciding item, and its error, in SI units; nan if unknown.
    problem
        Reason why the limit cannot be judged or, if it is too close to decide, advice on how to decide it. Otherwise it
        is empty, or names the link that buckles.
    """

    limit: Limit
    outcome: str
    item: int
    value: float
    error: float
    problem: str

    @property
    def worst(self) -> float:
        """The least favourable value within the error: at the upper end or, for a lower bound, at the lower end."""
        return float(ends(self.limit, self.value, self.error)[0 if self.limit.least else 1])


def judgement(results: Results, limit: Limit, key: str, items: Sequence[int] | None = None) -> Judgement:
    """Return the judgement of a limit on the figure `key`, for the given items or for all items."""
    peaks = results.figures.peaks.get(key, [])
    exact = any(each.exact for each in results.figures.figures if each.key == key)
    errors = [0.0 if exact else peak.error_size for peak in peaks]
    signed = any(each.over != LARGEST for each in results.figures.figures if each.key == key)
    sizes = [peak.value if signed else abs(peak.value) for peak in peaks]
    known = [(item, sizes[item], errors[item]) for item in (items or range(len(peaks)))]
    how, _, item, value, error = min(
        ((int(outcome_index(limit, value, error)), float(limit.margin(value)), item, value, error)
         for item, value, error in known),
        default=(SEVERITY.index(UNKNOWN), math.nan, 0, math.nan, math.nan),
    )  # fmt: skip
    outcome, problem = SEVERITY[how], ""
    if results.buckles and math.isnan(value):
        outcome, problem = BROKEN, results.buckles
    elif outcome == UNKNOWN:
        missing = f"the figure needs a {limit.of}" if results.mechanism.beams else NO_BEAMS
        unknown = "the figure is unknown" if peaks else missing
        problem = unknown if math.isnan(value) else results.error_unknown or "its error is unknown"
    elif outcome == TOO_NEAR:
        parts = peaks[item].error
        assert parts is not None
        problem = nearer(results, parts, value, min(UNRELIABLE, abs(value - float(limit.bound)) / (abs(value) or 1.0)))
    elif key == "settling" and math.isinf(value) and results.figures.output:
        lasts = rest_after_stop(results.cycle, results.figures.output)
        if lasts < float(limit.bound):
            outcome = UNKNOWN
            problem = f"the run ends {quantity(lasts, 's')} after the stop, give it a longer duration or dwell"
    if results.one_position and outcome != BROKEN and not exact:
        outcome, problem = UNKNOWN, ONE_POSITION
    judged = Judgement(limit, outcome, item, value, error, problem)
    return _or_refused(results, judged, key, [item for item, *_ in known])


def _or_refused(results: Results, judged: Judgement, key: str, items: Sequence[int]) -> Judgement:
    """Return the judgement. Its outcome becomes "cannot be judged" if `refusals` yields a reason for that.

    A violated limit remains violated.
    """
    if judged.outcome == BROKEN:
        return judged
    values = {other: [peak.value for peak in peaks] for other, peaks in results.figures.peaks.items() if peaks}
    errors = {STRENGTH.figure: [peak.error_size for peak in results.figures.peaks.get(STRENGTH.figure, [])]}
    why = "; ".join(words for words, refused in refusals(results.scene, key, items, values, errors) if refused)
    if not why:
        return judged
    before = judged.problem if judged.outcome == UNKNOWN else ""
    return replace(judged, outcome=UNKNOWN, problem="; ".join(filter(None, (before, why))))


def if_reliable(results: Results, judgements: Sequence[Judgement]) -> tuple[Judgement, ...]:
    """Return the judgements.

    If all figures are unreliable, violated limits remain violated, and the others become "cannot be judged".
    """
    doubtful = [judged.outcome in (KEPT, TOO_NEAR) for judged in judgements]
    why = "; ".join(doubts(results)) if any(doubtful) else ""
    if not why:
        return tuple(judgements)
    pairs = zip(judgements, doubtful, strict=True)
    return tuple(replace(judged, outcome=UNKNOWN, problem=why) if doubt else judged for judged, doubt in pairs)


def verdict_on(judgements: Sequence[Judgement]) -> Verdict:
    """Return the worst outcome of several limits as a verdict, with the problem of the first limit that has it."""
    worst = min((each.outcome for each in judgements), key=SEVERITY.index, default="")
    problem = next((each.problem for each in judgements if each.outcome == worst), "")
    return Verdict(verdict=VERDICTS.get(worst, ""), passed=PASSED.get(worst), problem=problem)


def limits_of_items(scene: Scene) -> list[Limit]:
    """Return the limits of a scene, split into one limit for each item, e.g. on the figure `deflection.rod`."""
    limits = []
    for limit in limits_of(scene):
        items = items_of(scene, limit.of)
        names = [f"{limit.figure}.{items[number]}".rstrip(".") for number in bounded_items(scene, limit)]
        limits += [replace(limit, figure=name) for name in names or [limit.figure]]
    return limits


def elastic_limits(scene: Scene) -> list[Limit]:
    """Return a limit against yielding for each link with a known yield stress.

    Return no limits if the scene itself limits the safety factor.
    """
    if not can_yield(scene) or any(limit.figure == STRENGTH.figure for limit in limits_of(scene)):
        return []
    known = [np.isfinite(section.yield_stress).any() for section in scene.sections]
    names = dict.fromkeys(name for name, can in zip(items_of(scene, STRENGTH.of), known, strict=True) if can)
    return [replace(STRENGTH, figure=f"{STRENGTH.figure}.{name}") for name in names]


def value_and_error(results: Results, measure: Measure) -> tuple[float, float]:
    """Return the value and the error of a measure. Its figure may be one that is computed only on request."""
    entry, peaks = measure.figure, results.figures.peaks.get(measure.figure.key, [])
    if peaks:
        sign = -1.0 if entry.over == LEAST else 1.0
        sizes = [abs(peak.value) if entry.over == LARGEST else peak.value for peak in peaks]
        items = [item for item in (measure.items or range(len(peaks))) if not math.isnan(sizes[item])]
        if not items:
            return math.nan, math.nan
        best = max(range(len(items)), key=lambda each: sign * sizes[items[each]])
        error = 0.0 if entry.exact else error_of_extreme([peaks[item] for item in items], best, entry.over)
        return sizes[items[best]], error
    value = _value(measure, results.cycle)
    closer = results.answer.off.closer if results.answer else None
    if entry.of_motion(results.scene) or entry.here:
        value = value if closer is None else _value(measure, closer)
        return value, math.nan if closer is None else abs(value - _value(measure, closer.coarser))
    return value, (1.0 + value) * frequency_error(results)


def _value(measure: Measure, cycle: Cycle) -> float:
    return float(np.ravel(measure.of(cycle)[0])[0])


def judged_measure(results: Results, limit: Limit, measure: Measure | None) -> Judgement:
    """Return the judgement of a limit. Its figure may be one that is computed only on request."""
    if measure and measure.figure.key in results.figures.peaks:
        return judgement(results, limit, measure.figure.key, measure.items)
    value, error = value_and_error(results, measure) if measure else (math.nan, math.nan)
    outcome = BROKEN if results.buckles and math.isnan(value) else SEVERITY[int(outcome_index(limit, value, error))]
    problem = results.buckles or f"the error of {limit.figure} is unknown" if outcome == UNKNOWN else ""
    if math.isinf(value):
        why = ", because no drive rotates" if limit.figure == "frequency_ratio" else ""
        value, outcome, problem = math.nan, UNKNOWN, f"{limit.figure} is infinite{why}"
    if outcome == TOO_NEAR and measure and not (measure.figure.of_motion(results.scene) or measure.figure.here):
        change = frequency_change(results.cycle)
        if abs(change) > results.figures.frequency_error:
            problem = f"loads, springs and motion change natural frequencies by {percent(change)}"
    return _or_refused(results, Judgement(limit, outcome, 0, value, error, problem), limit.figure, [])


def acceptance(results: Results) -> Verdict:
    """Return the verdict on all limits of a scene, with a row for each limit."""
    judgements = if_reliable(results, [judged_limit(results, limit) for limit in results.limits])
    verdict = verdict_on(judgements)
    if results.buckles:
        verdict = Verdict(verdict=VERDICTS[BROKEN], passed=False, problem=results.buckles)
    return structs.replace(verdict, limits=[judged_row(Reader(results), each) for each in judgements])


def judged_limit(results: Results, limit: Limit, items: Sequence[int] | None = None) -> Judgement:
    """Return the judgement of a limit of the scene, for the given items or for all items to which it applies."""
    scene = results.scene
    asked = next((each for each in figures_of(results.figures.output) if each.key == limit.figure and each.asked), None)
    if asked is not None:
        return judged_measure(results, limit, measures_of(scene, [asked]).get(limit.figure))
    if items is None:
        items = bounded_items(scene, limit) if limit.figure in results.figures.peaks else []
    return judgement(results, limit, limit.figure if items else "", items)


def judged_row(reader: Reader, judged: Judgement) -> JudgedLimit:
    """Return a judgement as a row of the report."""
    limit, figure = judged.limit, _found(reader, judged)
    of = next((each for each in figures_of(reader.results.figures.output) if each.key == limit.figure), None)
    if figure.value is not None and (of is None or of.over == LARGEST):
        figure = structs.replace(figure, value=abs(figure.value))
    bound = reading(limit.bound, figure.unit if limit.kind == "output" else limit.unit)
    words = limit.kind, limit.kind if of is None else of.name, limit.least, limit.item
    used, kept = known(limit.used(judged.value)), bool(limit.kept(judged.value))
    return JudgedLimit(*words, bound, figure, used, judged.outcome, kept, PASSED.get(judged.outcome), judged.problem)


def _found(reader: Reader, judged: Judgement) -> Reading:
    """Return, for the report, the value that decides the outcome of a limit, with its location.

    An unknown figure has no value.
    """
    limit, results, kind = judged.limit, reader.results, judged.limit.kind
    peaks = results.figures.peaks
    if np.isnan(judged.value):
        return reading(np.nan, limit.unit or "m")
    if limit.figure not in peaks:
        marks = {"unreliable": True} if results.figures.unreliable(judged.value, judged.error, limit.unit) else {}
        return reading(judged.value, limit.unit, error=known(judged.error), **marks, label="")
    peak = peaks[limit.figure][judged.item]
    if kind == "output":
        output = results.figures.output
        assert output is not None
        return reader.largest(peak, output.unit, label=output.point or output.link)
    if kind not in PLACES:
        endless = {"endless": True} if math.isinf(peak.value) else {}
        return reader.largest(peak, limit.unit, **endless, label=items_of(results.scene, limit.of)[judged.item])
    place = reader.on_beam(PLACES[kind], results.figures.of_field(PLACES[kind])[judged.item], judged.item)
    if kind == "safety":
        place |= {key: value for key, value in structs.asdict(reader.largest(peak, "1")).items() if value is not UNSET}
    return Reading(**place, label=results.scene.labels[judged.item])
