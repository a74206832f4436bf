"""Answer as a function of drive speed: largest values, peaks, unstable ranges and the limit speed."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from typing import Any

import numpy as np

from elastic import Deflection
from elastic.assessment import beyond_beam_theory, buckling_bound
from elastic.elastodynamics import Bounded, Resonance, SpeedAnswers, SpeedMap, SpeedSearch, critical_speeds, prominences
from kinelast.figures.bounds import BOUND_OVER_ERROR, damping_of, resolved
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import Measure, bounded_items, magnitudes, measures_of
from kinelast.figures.errors import (
    HEADLINE,
    HIGHER_ORDERS,
    LARGE,
    LITTLE,
    TIME,
    Estimate,
    figure_errors,
    motion_errors,
    stiffness_error,
)
from kinelast.figures.leading_drive import nominal_speed
from kinelast.figures.limits import BROKEN, KEPT, SEVERITY, UNKNOWN, VERDICTS, ends, severities, severity
from kinelast.figures.output import output_of
from kinelast.figures.ranges import STRENGTH, needed_by_limits, refusals
from kinelast.figures.registry import figures_of, limits_of
from kinelast.figures.results import Results
from kinelast.scene.data import ACCURACY, Scene, scene_deflection, scene_motion
from kinelast.scene.error import SceneError
from kinelast.scene.figure import BEAM, LEAST, OUTPUT_ERROR, Figure, Limit, items_of
from kinelast.tasks.progress import SILENT, Progress, lasting, one_thread
from rigid import MechanismError, Motion, with_rates
from rigid.arrays import Flags, Reals

FIELDS = {"w": "deflection", "chord": "chord", "mises": "stress"}  # fields of each beam, and their figures
SCANNED = {"deflection": 0, "chord": 1, "safety": 2}  # row of the scan for each limited figure
PROMINENT = 0.1  # smallest prominence of a reported peak, relative to its height
LONG = 60.0  # [s] remaining time above which it is announced
AMPLIFIED = 1.2  # value / quasi-static value above which a resonance is reported


@dataclass(frozen=True)
class SpeedPeak:
    """Local maximum, over the speed, of a largest value of the cycle.

    Attributes
    ----------
    speed
        Speed of the drive [rad/s or m/s].
    field, beam
        Field of `FIELDS` and number of the beam with the most prominent peak.
    value
        Value at the peak.
    resonance
        Mode with the strongest vibration; None if vibration adds little.
    """

    speed: float
    field: str
    beam: int
    value: float
    resonance: Resonance | None


@dataclass(frozen=True)
class SpeedLimit:
    """Speed at which the limits of a scene fail.

    Attributes
    ----------
    speed, above
        Highest speed at which all limits are met and no link yields, also with the errors (0.0 if there is none), and
        lowest speed at which this is not so.
    broken
        Lowest speed at which a limit is violated by more than the error or a link yields, infinite if not reached. From
        `above` to this speed, limits are too close to decide.
    limit, item
        First limit that fails, and the number of its item; `STRENGTH` if a link yields. None if there is no steady
        state above.
    resonance
        Mode with the strongest vibration at this speed; None if vibration adds little.
    problem
        Reason why the limit cannot be judged; empty if it is violated or too close to decide, or if a link yields.
    """

    speed: float
    above: float
    broken: float
    limit: Limit | None
    item: int
    resonance: Resonance | None
    problem: str = ""


@dataclass(frozen=True, eq=False)
class Speeds:
    """Largest values over the cycle at several speeds.

    Attributes
    ----------
    speed, asked
        Speeds of the drive [rad/s or m/s], and whether each was requested, shape (speeds,). The others were added at
        peaks, limits of unstable ranges and the limit speed.
    map
        Speed map: values of `FIELDS` [m, m, Pa] per beam with and without vibration, and growth.
    figures
        Registered figures as measures, with their values and errors, shape (speeds,).
    verdicts
        Verdict at each speed; empty if there are no limits.
    highest
        Highest speed at which all limits are met and no link yields, also with the errors, to within 0.2 %. 0.0 if this
        fails at the first speed, None if there are no limits.
    limit
        First failure above `highest`; None if all limits are met at all speeds, or if there are none.
    yielding
        Lowest speed at which a link yields, and the number of its beam; None if none yields.
    between
        Speeds [rad/s or m/s], shape (n,), and values of `FIELDS`, shape (3, beams, n): a fine scan in reduced
        coordinates, corrected by the map.
    peaks
        Prominent peaks, in order of increasing speed.
    unstable
        Speed ranges without a steady state.
    critical
        For each multiple of the drive speed, the smallest and largest speed over the cycle at which it equals the
        lowest natural frequency.
    buckles
        Link that buckles at each speed, or empty. If a link buckles, its bending is unknown.
    """

    speed: Reals
    asked: Flags
    map: SpeedMap
    figures: Mapping[str, tuple[Measure, Reals, Reals]]
    verdicts: Sequence[str]
    highest: float | None
    limit: SpeedLimit | None
    yielding: tuple[float, int] | None
    between: tuple[Reals, Reals]
    peaks: tuple[SpeedPeak, ...]
    unstable: tuple[tuple[float, float], ...]
    critical: Mapping[int, tuple[float, float]]
    buckles: Sequence[str] = ()

    @property
    def error(self) -> Reals:
        """Largest relative error of deflection, stress and output, shape (speeds,).

        The reference value is at least `LITTLE` times the largest field with the unit.
        """
        read = [self.figures[key] for key in (*HEADLINE, OUTPUT_ERROR) if key in self.figures]
        read = [each for each in read if not np.isnan(each[1]).all()]  # no stress if the section depth is unknown
        if not read:
            return np.full(self.speed.shape, np.nan)
        bases = [np.maximum(value, LITTLE * self._largest(measure.unit)) for measure, value, _ in read]
        shares = [
            np.divide(error, base, out=0.0 * error, where=~(base <= 0.0))
            for (_, _, error), base in zip(read, bases, strict=True)
        ]
        return reduce(np.maximum, shares)

    def _largest(self, unit: str) -> Reals:
        """Return the largest field of beams with a unit at each speed."""
        sizes = [value for measure, value, _ in self.figures.values() if measure.figure.fields and measure.unit == unit]
        return reduce(np.fmax, sizes)


@one_thread()
def speeds(scene: Scene, asked: tuple[float, float, int], progress: Progress = SILENT) -> Speeds:
    """Return the answer at the requested speeds, and at peaks, stability limits and the limit speed between them.

    Raises
    ------
    SceneError
        A drive has no constant speed, a load depends on time, or vibration cannot be solved.
    """
    nominal = nominal_speed(scene)
    limits = limits_of(scene)
    needed = {*FIELDS.values(), *(limit.figure for limit in limits), *needed_by_limits(scene)}
    figures = [figure for figure in figures_of(output_of(scene)) if not figure.asked or figure.key in needed]
    still = [figure for figure in figures if figure.key in needed]
    ratios = (np.linspace(*asked) / nominal).tolist()

    answered = [0, asked[2]]

    def answering(done: int, of: int) -> None:
        answered[:] = done, of
        progress(f"{scene.name}: speeds", done, of)

    def moved(times: Reals) -> Motion:
        progress(f"{scene.name}: solving speeds ({len(times):,} points)", *answered)
        return scene.course.at(times)

    try:
        answers = SpeedAnswers(
            moved,
            float(scene.run.cycle),
            scene.sections,
            partial(_largest, scene, figures),
            scene.joints,
            damping_of(scene),
            still=partial(_largest, scene, still),
            errors=partial(_errors, scene, figures, cache(partial(_motion_shares, scene, figures))),
            on_speed=answering,
            resolved=resolved(scene.theory.accuracy or ACCURACY, judged=True),
        )
        answers.find(ratios)
        looking = _Looking(scene.name, progress)
        search = SpeedSearch(answers, lambda found: _curves(_by_figure(scene, figures, found.values)), looking)
        search.find_peaks()
        unstable = search.find_borders()
        limit = _limit(scene, figures, still, search, nominal) if limits else None
        yielding = _yielding(scene, figures, search, nominal)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    steady = answers.map()
    buckles = _buckles(scene, steady.ratio)
    gone = np.array([bool(words) for words in buckles])
    steady = replace(steady, **{name: _without(getattr(steady, name), gone) for name in ("values", "errors")})
    values, plain = _by_figure(scene, figures, steady.values), _by_figure(scene, still, steady.quasi_static)
    mapped = replace(
        steady, values=np.moveaxis(_curves(values), -1, 0), quasi_static=np.moveaxis(_curves(plain), -1, 0)
    )
    errors = _by_figure(scene, figures, steady.errors)
    measures = {
        name: (measure, *_with_errors(measure, values[measure.figure.key], errors[measure.figure.key]))
        for name, measure in measures_of(scene, figures).items()
    }
    worst = [np.broadcast_to(each, steady.ratio.shape) for each in _severities(scene, values, errors)]
    verdicts = [VERDICTS[SEVERITY[number]] for number in reduce(np.minimum, worst)] if worst else []
    if gone.any():
        before = verdicts or [""] * len(gone)
        verdicts = [VERDICTS[BROKEN] if bad else verdict for bad, verdict in zip(gone, before, strict=True)]
    per_cycle = nominal * float(scene.run.cycle) / (2 * np.pi)  # speed of the drive / speed of the cycle
    spans = critical_speeds(steady.omega * per_cycle).items()
    highest = None if not limits else limit.speed if limit else asked[1]
    if highest is not None and (gone & (steady.ratio * nominal <= highest)).any():
        limit, highest = None, float(max(steady.ratio[: int(gone.argmax())], default=0.0)) * nominal
    drawn, curves = search.between()
    speed, wanted = steady.ratio * nominal, np.isin(steady.ratio, ratios)
    speed[wanted] = np.linspace(*asked)
    return Speeds(
        speed,
        wanted,
        mapped,
        measures,
        verdicts,
        highest,
        limit,
        yielding,
        (drawn * nominal, curves),
        tuple(_peaks(mapped, search, nominal)),
        tuple((low * nominal, high * nominal) for low, high in unstable),
        {n: (low, high) for n, (low, high) in spans if low <= asked[1] and high >= asked[0]},
        buckles,
    )


def _buckles(scene: Scene, ratios: Reals) -> list[str]:
    """Return the link that buckles without vibration at each speed, or an empty string."""
    course = scene_motion(scene)
    each = [scene_deflection(scene, with_rates(course, ratio * course.drive_rate)) for ratio in ratios]
    return [
        Results(scene, bent).buckles if np.nanmax(buckling_bound(bent), initial=0.0) >= 1.0 else "" for bent in each
    ]


def _without(values: Any, gone: Flags) -> Any:
    """Return the values with nan at some speeds (first axis)."""
    return np.where(gone.reshape(-1, *(1,) * (np.ndim(values) - 1)), np.nan, values)


@dataclass
class _Looking:
    """Progress of the search between speeds; a long duration is announced once."""

    name: str
    progress: Progress
    begin: float = math.nan  # start of the search [s]; infinite after the announcement

    def __call__(self, done: int, of: int) -> None:
        self.progress(f"{self.name}: searching between the speeds", done, of)
        if math.isnan(self.begin):
            self.begin = time.monotonic()
        left = (time.monotonic() - self.begin) / max(done, 1) * (of - done)
        if done and self.begin < math.inf:
            self.begin = math.inf
            if left > LONG:
                what = f"the search at {of} speeds takes about {lasting(left)}"
                self.progress.tell(f"{self.name}: {what}; give a narrower range to shorten it")


def _largest(scene: Scene, figures: Sequence[Figure], bent: Deflection, alone: Callable[[int], Deflection]) -> Reals:
    """Return the magnitudes of all items of figures, shape (rows, speeds), with field peaks between positions.

    Buckling is computed for one speed after the other, because for several only a bound is known.
    """
    fields = frozenset(field for figure in figures for field in figure.fields)
    cycle = Cycle(scene, bent.motion, bent, wanted=fields, period=bent.motion.time[:, -1])
    values = magnitudes(cycle, [figure for figure in figures if figure.key != "buckling"])
    if any(figure.key == "buckling" for figure in figures):
        each = map(alone, range(len(bent.motion.time)))
        values["buckling"] = np.stack([Cycle(scene, one.motion, one).pressed.value for one in each], axis=-1)
    return np.concatenate([values[figure.key] for figure in figures])


def _errors(
    scene: Scene,
    figures: Sequence[Figure],
    of_motion: Callable[[int], Mapping[str, Reals]],
    bent: Deflection,
    finer: Deflection | None,
    displaced: Deflection | None,
    settled: float,
    forces: float,
    left: float,
) -> Reals:
    """Return the errors of all items of figures, as in a report, shape (rows,).

    `of_motion` returns the relative errors of figures of the rigid motion for a number of positions.
    """
    answer, bodies = (Cycle(scene, each.motion, each, sampled=True) for each in (bent, beyond_beam_theory(bent)))
    corrected = {TIME: finer, LARGE: displaced}
    stages = {name: Cycle(scene, each.motion, each, sampled=True) for name, each in corrected.items() if each}
    shares = {LARGE if displaced is None else HIGHER_ORDERS: left}
    if finer is None:
        shares[TIME] = settled / BOUND_OVER_ERROR
    by_key = figure_errors(answer, figures, Estimate(stages, bodies, shares, forces=forces))
    sizes = magnitudes(answer, figures)
    stiff = stiffness_error(sizes["deflection"], by_key["deflection"])
    rows = {figure.key: stiff * (1.0 + sizes[figure.key]) for figure in figures if figure.asked and not figure.rigid}
    shares_of_motion = of_motion(len(bent.motion.time) - 1)
    rows |= {key: np.where(share, share * np.abs(sizes[key]), 0.0) for key, share in shares_of_motion.items()}
    return np.concatenate([rows.get(figure.key, [error.size for error in by_key[figure.key]]) for figure in figures])


def _motion_shares(scene: Scene, figures: Sequence[Figure], count: int) -> dict[str, Reals]:
    """Return the relative errors of figures of the rigid motion at `count` even positions, by key, shape (items,).

    They are the same at all speeds, because the motion is.
    """
    moving = [figure for figure in figures if figure.of_motion(scene) and items_of(scene, figure.of)]
    times = float(scene.run.cycle) * np.arange(count) / count
    given = Cycle(scene, scene.course.at(times))
    closer = Cycle(scene, scene.course.at(scene.course.closer(times)), between=True)
    values, larger = magnitudes(given, moving), magnitudes(closer, moving)
    shares = {}
    for figure in moving:
        value, other = values[figure.key], larger[figure.key]
        errors = np.array([error.size for error in motion_errors(given, figure, closer)])
        with np.errstate(divide="ignore", invalid="ignore"):
            errors = errors + np.where(figure.exact | (value == other), 0.0, np.abs(other - value))
            shares[figure.key] = np.where(errors, errors / np.abs(value), 0.0)
    return shares


def _with_errors(measure: Measure, values: Any, errors: Any) -> tuple[Reals, Reals]:
    """Return the values of a measure and their errors, reduced from all items, shape (items, speeds)."""
    rows = [*range(len(values))] if measure.items is None else [*measure.items]
    least = measure.figure.over == LEAST
    known = np.where(np.isnan(values[rows]), np.inf if least else -np.inf, values[rows])
    at = known.argmin(axis=0) if least else known.argmax(axis=0)
    return measure.among(values), np.take_along_axis(errors[rows], at[None], 0)[0]


def _by_figure(scene: Scene, figures: Sequence[Figure], rows: Any) -> dict[str, Any]:
    """Return the values of each figure's items, shape (items, speeds), from rows of shape (speeds, rows)."""
    counts = [len(items_of(scene, figure.of)) for figure in figures]
    parts = np.split(rows.T, np.cumsum(counts)[:-1])
    return {figure.key: part for figure, part in zip(figures, parts, strict=True)}


def _curves(values: Mapping[str, Any]) -> Reals:
    """Return the values of `FIELDS`, shape (3, beams, speeds)."""
    return np.array([values[key] for key in FIELDS.values()])


def _severities(scene: Scene, values: Mapping[str, Any], errors: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the outcome of each limit at every speed, as indices into `SEVERITY`, and whether a link yields."""
    yield from severities(scene, values, errors)
    beams = _yieldable(scene)
    if limits_of(scene) and beams:
        safety = values[STRENGTH.figure][beams]
        outcome = np.maximum(severity(STRENGTH, safety, errors[STRENGTH.figure][beams]), SEVERITY.index(UNKNOWN))
        yield np.where(np.isnan(safety), SEVERITY.index(KEPT), outcome).min(axis=0)


def _limit(
    scene: Scene, figures: Sequence[Figure], still: Sequence[Figure], search: SpeedSearch, nominal: float
) -> SpeedLimit | None:
    """Return the limit speed and the first limit that fails above it, or None if all limits are met.

    Yield counts as a limit, because no other limit can be judged if a link yields.
    """
    rows = [(limit, item) for limit in limits_of(scene) for item in bounded_items(scene, limit)]
    rows += [(STRENGTH, beam) for beam in _yieldable(scene)]

    def used(answers: SpeedMap, side: float = 1.0) -> Reals:
        values, errors = (_by_figure(scene, figures, each) for each in (answers.values, answers.errors))
        shares = []
        for limit, item in rows:
            if limit is STRENGTH:
                shares.append(_near_yield(values, item, errors if side > 0.0 else {}))
                continue
            share = _used(limit, values.get(limit.figure), errors.get(limit.figure), item, side)
            for _, refused in _refusals(scene, limit, item, values):
                share = np.where(refused, np.nan, share)
            shares.append(share)
        return np.array(np.broadcast_arrays(*shares))

    fields = [SCANNED.get(limit.figure, 0) for limit, _ in rows]
    beams = [item if limit.of == BEAM else -1 for limit, item in rows]
    bracket = search.find_limit(Bounded(used, fields, beams))
    if bracket is None:
        return None
    low, above = bracket
    answers = search.answers.map([above])
    limit_at = partial(SpeedLimit, low * nominal, above * nominal)
    if not answers.stable.all():
        return limit_at(above * nominal, None, -1, None)
    shares = used(answers)[:, 0]
    parts = _by_figure(scene, figures, answers.values), _by_figure(scene, still, answers.quasi_static)
    if not np.any(shares > 1.0):
        limit, item = rows[int(np.isnan(shares).argmax())]
        known = limit.figure in parts[0] and np.isfinite(parts[0][limit.figure][item]).all()
        reasons = [words for words, refused in _refusals(scene, limit, item, parts[0]) if refused.any()]
        reasons = reasons or ["its error is unknown" if known else "the figure is unknown"]
        return limit_at(above * nominal, limit, item, None, "; ".join(reasons))
    passed = search.find_limit(Bounded(partial(used, side=-1.0), fields, beams))
    broken = math.inf if passed is None else passed[1] * nominal
    limit, item = rows[int(np.nan_to_num(shares, nan=0.0).argmax())]
    one, other = (float(_used(limit, part[limit.figure], None, item, 0.0)[0]) for part in parts)
    met = search.model.resonance(above) if one > AMPLIFIED * other else None
    return limit_at(broken, limit, item, met)


def _yielding(scene: Scene, figures: Sequence[Figure], search: SpeedSearch, nominal: float) -> tuple[float, int] | None:
    """Return the lowest speed at which a link yields, and the number of its beam; None if none yields."""
    beams = _yieldable(scene)

    def used(answers: SpeedMap) -> Reals:
        values = _by_figure(scene, figures, answers.values)
        return np.array([_near_yield(values, beam, {}) for beam in beams])

    bracket = search.find_limit(Bounded(used, [SCANNED[STRENGTH.figure]] * len(beams), beams)) if beams else None
    if bracket is None:
        return None
    return bracket[1] * nominal, beams[int(used(search.answers.map(bracket[1:])).argmax())]


def _yieldable(scene: Scene) -> list[int]:
    """Return the numbers of the beams with a known yield stress."""
    return [beam for beam, section in enumerate(scene.sections) if np.isfinite(section.yield_stress).any()]


def _near_yield(values: Mapping[str, Any], beam: int, errors: Mapping[str, Any]) -> Reals:
    """Return the stress of a beam with its error over its yield stress, shape (speeds,); 0 if it is unknown."""
    safety = values[STRENGTH.figure]
    return np.where(np.isnan(safety[beam]), 0.0, _used(STRENGTH, safety, errors.get(STRENGTH.figure), beam, 1.0))


def _refusals(scene: Scene, limit: Limit, item: int, values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the reasons other than yield why a limit cannot be judged, each with flags of shape (speeds,)."""
    without = {key: each for key, each in values.items() if key != STRENGTH.figure}
    return refusals(scene, limit.figure, [item], without)


def _used(limit: Limit, values: Any, errors: Any, item: int, side: float) -> Reals:
    """Return the utilisation of a bound by an item, shape (speeds,); nan if the figure is unknown.

    The error is added towards the bound (side 1) or away from it (side -1).
    """
    if values is None:
        return np.full(1, np.nan)
    value = np.asarray(values[item])
    low, high = ends(limit, value, 0.0 if errors is None else errors[item])
    own = replace(limit, bound=float(np.ravel(limit.bound)[0]))
    return own.used(low if limit.least == (side > 0.0) else high)


def _peaks(mapped: SpeedMap, search: SpeedSearch, nominal: float) -> Iterator[SpeedPeak]:
    """Yield the prominent peaks of `FIELDS`; of neighbouring peaks, only the most prominent one."""
    rows = [
        (share, at, field, beam)
        for field in range(len(FIELDS))
        for beam in range(mapped.values.shape[2])
        for at, share in prominences(mapped.values[:, field, beam])
        if share > PROMINENT
    ]
    chosen: list[tuple[float, int, int, int]] = []
    for row in sorted(rows, reverse=True):
        near = search.width * mapped.ratio[row[1]]
        if all(abs(mapped.ratio[row[1]] - mapped.ratio[other[1]]) > near for other in chosen):
            chosen.append(row)
    for _, at, field, beam in sorted(chosen, key=lambda row: row[1]):
        value, still = mapped.values[at, field, beam], mapped.quasi_static[at, field, beam]
        met = search.model.resonance(float(mapped.ratio[at])) if value > AMPLIFIED * still else None
        yield SpeedPeak(float(mapped.ratio[at] * nominal), [*FIELDS][field], beam, float(value), met)
