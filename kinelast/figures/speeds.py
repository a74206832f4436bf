"""How the answer goes with the speed of the drive: largest values and their peaks, unstable ranges, the limit speed."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any

import numpy as np

from elastic import Deflection
from elastic.assessment import beyond_beam_theory
from elastic.elastodynamics import Bounded, Resonance, SpeedAnswers, SpeedMap, SpeedSearch, critical_speeds, prominences
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import BEAM, LEAST, Figure, Measure, bounded_items, items_of, magnitudes, measures_of
from kinelast.figures.errors import HEADLINE, HIGHER_ORDERS, LARGE, TIME, Estimate, figure_errors, stiffness_error
from kinelast.figures.limits import BROKEN, SEVERITY, VERDICTS, severities, widened
from kinelast.figures.output import output_of
from kinelast.figures.ranges import refusals
from kinelast.figures.registry import figures_of, limits_of
from kinelast.figures.results import Results
from kinelast.figures.theory import damping_of
from kinelast.scene.data import Scene, scene_deflection, scene_motion
from kinelast.scene.error import SceneError
from kinelast.scene.limits import OUTPUT_ERROR, Limit
from kinelast.tasks.progress import SILENT, Progress, lasting, one_thread
from rigid import ConstantSpeed, MechanismError, Motion, with_rates
from rigid.arrays import Flags, Reals

FIELDS = {"w": "deflection", "chord": "chord", "mises": "stress"}  # that are told of every beam, and their figures
SCANNED = {"deflection": 0, "chord": 1, "safety": 2}  # rows of a scan, by the figures that limits bound
CLOCK = 24  # positions at which loads are asked whether they go by the clock
PROMINENT = 0.1  # of itself that a peak rises above the valleys beside it, from where it is told
LONG = 60.0  # [s] from which it is said how long speeds take
AMPLIFIED = 1.2  # times the answer without vibration, below which no resonance is told of a value


@dataclass(frozen=True)
class SpeedPeak:
    """A peak of a largest value over the cycle against the speed.

    Attributes
    ----------
    speed
        [rad/s or m/s].
    field, beam
        Of `FIELDS`, and the number of the beam, where the peak is most prominent.
    value
        There.
    resonance
        Which mode vibrates most; None where vibration adds little.
    """

    speed: float
    field: str
    beam: int
    value: float
    resonance: Resonance | None


@dataclass(frozen=True)
class SpeedLimit:
    """Where the limits of a scene end.

    Attributes
    ----------
    speed, above
        Up to the first all limits hold, errors and all, at the second they do not; the first 0.0 where they fail at the
        lowest speed.
    broken
        Lowest speed at which a limit is not kept whatever the error; infinite if beyond the speeds examined. Between
        `above` and this speed, limits are too close to decide.
    limit, item
        Which fails first, and the number of its item; None where there is no steady state above, or the figure is not
        known.
    resonance
        Which mode vibrates most there; None where vibration adds little.
    """

    speed: float
    above: float
    broken: float
    limit: Limit | None
    item: int
    resonance: Resonance | None


@dataclass(frozen=True, eq=False)
class Speeds:
    """Largest values over the cycle at several speeds.

    Attributes
    ----------
    speed, asked
        Of the drive [rad/s or m/s], and which of them were asked for, shape (speeds,): the others were added at peaks,
        borders of unstable ranges and the limit speed.
    map
        The speed map: values of `FIELDS` [m, m, Pa] per beam, with and without vibration, growth.
    figures
        The registered figures as measures, each with its values with vibration and their errors, shape (speeds,).
    verdicts
        At every speed, as of a report; empty without limits.
    highest
        Highest speed up to which every limit of the scene holds, errors and all, to 0.2 %; None without limits, 0.0
        where they fail at the first.
    limit
        What ends there; None where all limits hold at all speeds, or there are none.
    between
        Speeds [rad/s or m/s], shape (n,), and values of `FIELDS` there, shape (3, beams, n): those of the map, and
        between them a close look in few coordinates, put right by it.
    peaks
        The prominent ones, by rising speed.
    unstable
        Ranges of speed without a steady state.
    critical
        Speeds at which a low multiple of the drive's runs through the lowest natural frequencies, by that multiple:
        least and greatest over the cycle.
    buckles
        At every speed, which link buckles; empty where none does. Nothing is known of the links' bending then.
    """

    speed: Reals
    asked: Flags
    map: SpeedMap
    figures: Mapping[str, tuple[Measure, Reals, Reals]]
    verdicts: Sequence[str]
    highest: float | None
    limit: SpeedLimit | None
    between: tuple[Reals, Reals]
    peaks: tuple[SpeedPeak, ...]
    unstable: tuple[tuple[float, float], ...]
    critical: Mapping[int, tuple[float, float]]
    buckles: Sequence[str] = ()

    @property
    def error(self) -> Reals:
        """Error of the worst of the largest deflection and stress, and of the output, as a share, shape (speeds,)."""
        read = [self.figures[key] for key in (*HEADLINE, OUTPUT_ERROR) if key in self.figures]
        read = [each for each in read if not np.isnan(each[1]).all()]  # as the stress where no depth is known
        if not read:
            return np.full(self.speed.shape, np.nan)
        shares = [np.divide(error, value, out=0.0 * error, where=~(value <= 0.0)) for _, value, error in read]
        return reduce(np.maximum, shares)


@one_thread()
def speeds(scene: Scene, asked: tuple[float, float, int], progress: Progress = SILENT) -> Speeds:
    """The answer at speeds from one to another, and at those between them at which something happens.

    The progress is how finely the motion is resolved.

    Raises
    ------
    SceneError
        Other than drives at constant speed move the scene, loads go by the clock, or vibration cannot be answered.
    """
    nominal = _nominal(scene)
    limits = limits_of(scene)
    needed = {*FIELDS.values(), *(limit.figure for limit in limits)}
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
            errors=partial(_errors, scene, figures),
            on_speed=answering,
        )
        answers.find(ratios)
        looking = _Looking(scene.name, progress)
        search = SpeedSearch(answers, lambda found: _curves(_by_figure(scene, figures, found.values)), looking)
        search.find_peaks()
        unstable = search.find_borders()
        limit = _limit(scene, figures, still, search, nominal) if limits else None
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    steady = answers.map()
    loaded = _loaded(scene, steady.ratio)
    buckles = [each.buckles for each in loaded]
    gone = np.array([bool(words) for words in buckles])
    steady = replace(steady, **{name: _without(getattr(steady, name), gone) for name in ("values", "errors")})
    values, plain = _by_figure(scene, figures, steady.values), _by_figure(scene, still, steady.quasi_static)
    if "buckling" in values:
        values["buckling"] = np.stack([each.cycle.pressed.value for each in loaded], axis=-1)
    told = replace(steady, values=np.moveaxis(_curves(values), -1, 0), quasi_static=np.moveaxis(_curves(plain), -1, 0))
    errors = _by_figure(scene, figures, steady.errors)
    measures = {
        name: (measure, *_with_errors(measure, values[measure.figure.key], errors[measure.figure.key]))
        for name, measure in measures_of(scene, figures).items()
    }
    worst = [np.broadcast_to(each, steady.ratio.shape) for each in severities(scene, values, errors)]
    verdicts = [VERDICTS[SEVERITY[number]] for number in reduce(np.minimum, worst)] if worst else []
    if gone.any():
        before = verdicts or [""] * len(gone)
        verdicts = [VERDICTS[BROKEN] if bad else verdict for bad, verdict in zip(gone, before, strict=True)]
    per_cycle = nominal * float(scene.run.cycle) / (2 * np.pi)  # speed of the drive over that of the cycle
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
        told,
        measures,
        verdicts,
        highest,
        limit,
        (drawn * nominal, curves),
        tuple(_peaks(told, search, nominal)),
        tuple((low * nominal, high * nominal) for low, high in unstable),
        {n: (low, high) for n, (low, high) in spans if low <= asked[1] and high >= asked[0]},
        buckles,
    )


def _loaded(scene: Scene, ratios: Reals) -> list[Results]:
    """The results without vibration at every speed, which tell the load over the critical load."""
    course = scene_motion(scene)
    moved = (with_rates(course, ratio * course.drive_rate) for ratio in ratios)
    return [Results(scene, scene_deflection(scene, each)) for each in moved]


def _without(values: Any, gone: Flags) -> Any:
    """Values of speeds, the first axis, with nan at some."""
    return np.where(gone.reshape(-1, *(1,) * (np.ndim(values) - 1)), np.nan, values)


@dataclass
class _Looking:
    """Tells how far the look between the speeds is, and once where it takes minutes how long."""

    name: str
    progress: Progress
    begin: float = math.nan  # of the look [s]; infinite once it was told

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


def with_limit_speed(
    rows: Sequence[Mapping[str, Any]], told: Mapping[str, Any], scene: Scene
) -> list[Mapping[str, Any]]:
    """Modes of failure as of `breaks_first`, with the limit speed over that of the scene for the link that ends it.

    Parameters
    ----------
    told
        The speeds as plain data, see `kinelast.outputs.speeds.speed_figures`.
    """
    limit, highest = told["limit"], told["highest_within_limits"]
    if not limit or not limit["of"] or not highest:
        return [*rows]
    reserve = {"value": highest / _nominal(scene), "unit": "1", "error": None, "label": limit["of"]}
    more = []
    for row in rows:
        reserves = {**row["reserves"], "limit speed": reserve}
        mode = min(reserves, key=lambda each: reserves[each]["value"])
        told_of = scene.mechanism.beams[scene.labels.index(limit["of"])][0] if limit["of"] in scene.labels else -1
        its = told_of >= 0 and scene.mechanism.links[told_of].name == row["link"]
        more.append({**row, "governs": mode, "reserve": reserves[mode], "reserves": reserves} if its else row)
    return sorted(more, key=lambda row: float(row["reserve"]["value"]))


def leading_drive(scene: Scene) -> int:
    """Number of the drive that speeds are of: the first that moves; the others keep their ratio to it."""
    return next((number for number, law in enumerate(scene.laws) if getattr(law, "speed", 0.0)), 0)


def _nominal(scene: Scene) -> float:
    """Speed of the leading drive in the scene [rad/s or m/s].

    Raises
    ------
    SceneError
        The motion, or a load, does not go with the speed of the drives.
    """
    lead = scene.laws[leading_drive(scene)]
    if not all(isinstance(law, ConstantSpeed) for law in scene.laws) or not isinstance(lead, ConstantSpeed):
        problem = "--speeds scales drives at constant speed, all in one ratio; laws of time and efforts are not scaled"
        raise SceneError(scene.path, "drives", "", problem)
    if not lead.speed:
        raise SceneError(scene.path, "drives", "", "--speeds scales drives at constant speed, and none moves")
    if scene.run.no_cycle:
        raise SceneError(scene.path, "drives", "", f"--speeds takes cycles: {scene.run.no_cycle}")
    laws = (getattr(load, "law", None) for load in scene.mechanism.loads)
    if any(_by_the_clock(scene, law) for law in laws if law is not None):
        problem = "--speeds cannot scale a load by time: give its table against the angle of a link"
        raise SceneError(scene.path, "loads", "", problem)
    return abs(float(lead.speed))


def _by_the_clock(scene: Scene, law: Any) -> bool:
    """Whether a factor changes with time where all positions and rates are the same."""
    motion = scene.course.at(float(scene.run.cycle) * np.arange(CLOCK) / CLOCK)
    now, later = (np.asarray(law(each)) for each in (motion, replace(motion, time=0.61 * motion.time)))
    return not np.allclose(now, later, rtol=1e-9, atol=1e-12 * np.abs(now).max(initial=0.0))


def _largest(scene: Scene, figures: Sequence[Figure], bent: Deflection) -> Reals:
    """Magnitudes of the items of figures one behind the other, shape (rows, speeds); fields between positions too."""
    fields = frozenset(field for figure in figures for field in figure.fields)
    cycle = Cycle(scene, bent.motion, bent, wanted=fields, period=bent.motion.time[:, -1])
    return np.concatenate(list(magnitudes(cycle, figures).values()))


def _errors(
    scene: Scene,
    figures: Sequence[Figure],
    bent: Deflection,
    finer: Deflection | None,
    displaced: Deflection | None,
    settled: float,
    left: float,
) -> Reals:
    """Errors of the items of figures one behind the other, as a report has them, shape (rows,)."""
    answer, bodies = (Cycle(scene, each.motion, each, sampled=True) for each in (bent, beyond_beam_theory(bent)))
    put_right = {TIME: finer, LARGE: displaced}
    stages = {name: Cycle(scene, each.motion, each, sampled=True) for name, each in put_right.items() if each}
    shares = {LARGE if displaced is None else HIGHER_ORDERS: left} | ({} if finer else {TIME: settled})
    told = figure_errors(answer, figures, Estimate(stages, bodies, shares))
    sizes = magnitudes(answer, figures)
    stiff = stiffness_error(sizes["deflection"], told["deflection"])
    rows = [
        stiff * (1.0 + sizes[figure.key])
        if figure.asked and not figure.rigid
        else [error.size for error in told[figure.key]]
        for figure in figures
    ]
    return np.concatenate(rows)


def _with_errors(measure: Measure, values: Any, errors: Any) -> tuple[Reals, Reals]:
    """Values of a measure among magnitudes of all items, shape (items, speeds), and the errors of these."""
    rows = [*range(len(values))] if measure.items is None else [*measure.items]
    least = measure.figure.over == LEAST
    known = np.where(np.isnan(values[rows]), np.inf if least else -np.inf, values[rows])
    at = known.argmin(axis=0) if least else known.argmax(axis=0)
    return measure.among(values), np.take_along_axis(errors[rows], at[None], 0)[0]


def _by_figure(scene: Scene, figures: Sequence[Figure], rows: Any) -> dict[str, Any]:
    """By key the values of a figure's items, shape (items, speeds), from rows of shape (speeds, rows)."""
    counts = [len(items_of(scene, figure.of)) for figure in figures]
    parts = np.split(rows.T, np.cumsum(counts)[:-1])
    return {figure.key: part for figure, part in zip(figures, parts, strict=True)}


def _curves(values: Mapping[str, Any]) -> Reals:
    """Of `FIELDS`, shape (3, beams, speeds)."""
    return np.array([values[key] for key in FIELDS.values()])


def _limit(
    scene: Scene, figures: Sequence[Figure], still: Sequence[Figure], search: SpeedSearch, nominal: float
) -> SpeedLimit | None:
    """The greatest speed up to which all limits are kept, and which fails above; None where all are kept."""
    rows = [(limit, item) for limit in limits_of(scene) for item in bounded_items(scene, limit)]

    def used(answers: SpeedMap, side: float = 1.0) -> Reals:
        values, errors = (_by_figure(scene, figures, each) for each in (answers.values, answers.errors))
        shares = []
        for limit, item in rows:
            share = _used(limit, values.get(limit.figure), errors.get(limit.figure), item, side)
            for _, refused in refusals(scene, limit.figure, [item], values):
                share = np.where(refused, np.nan, share)
            shares.append(share)
        return np.array(np.broadcast_arrays(*shares))

    fields = [SCANNED.get(limit.figure, 0) for limit, _ in rows]
    beams = [item if limit.of == BEAM else -1 for limit, item in rows]
    bracket = search.find_limit(Bounded(used, fields, beams))
    if bracket is None:
        return None
    low, above = bracket
    shares = used(search.answers.map([above]))[:, 0]
    if np.isnan(shares).any():
        return SpeedLimit(low * nominal, above * nominal, above * nominal, None, -1, None)
    passed = search.find_limit(Bounded(partial(used, side=-1.0), fields, beams))
    broken = math.inf if passed is None else passed[1] * nominal
    limit, item = rows[int(shares.argmax())]
    answers = search.answers.map([above])
    parts = _by_figure(scene, figures, answers.values), _by_figure(scene, still, answers.quasi_static)
    one, other = (float(_used(limit, part[limit.figure], None, item, 0.0)[0]) for part in parts)
    met = search.model.resonance(above) if one > AMPLIFIED * other else None
    return SpeedLimit(low * nominal, above * nominal, broken, limit, item, met)


def _used(limit: Limit, values: Any, errors: Any, item: int, side: float) -> Reals:
    """Share of a bound that an item's values use, shape (speeds,): not known where the figure is left out.

    With their errors on the side of the bound (1) or away from it (-1).
    """
    if values is None:
        return np.full(1, np.nan)
    value = np.asarray(values[item])
    error = 0.0 if errors is None else side * widened(value, errors[item])
    own = replace(limit, bound=float(np.ravel(limit.bound)[0]))
    return own.used(value - error if limit.least else value + error)


def _peaks(told: SpeedMap, search: SpeedSearch, nominal: float) -> Iterator[SpeedPeak]:
    """The prominent peaks of `FIELDS`, of those that are close together the most prominent one."""
    rows = [
        (share, at, field, beam)
        for field in range(len(FIELDS))
        for beam in range(told.values.shape[2])
        for at, share in prominences(told.values[:, field, beam])
        if share > PROMINENT
    ]
    chosen: list[tuple[float, int, int, int]] = []
    for row in sorted(rows, reverse=True):
        near = search.width * told.ratio[row[1]]
        if all(abs(told.ratio[row[1]] - told.ratio[other[1]]) > near for other in chosen):
            chosen.append(row)
    for _, at, field, beam in sorted(chosen, key=lambda row: row[1]):
        value, still = told.values[at, field, beam], told.quasi_static[at, field, beam]
        met = search.model.resonance(float(told.ratio[at])) if value > AMPLIFIED * still else None
        yield SpeedPeak(float(told.ratio[at] * nominal), [*FIELDS][field], beam, float(value), met)


def speed_unit(scene: Scene) -> str:
    """Unit of the speed of the leading drive."""
    return "rad/s" if scene.mechanism.drives[leading_drive(scene)].turns else "m/s"
