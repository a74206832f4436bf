"""Results as a function of drive speed: largest values, peaks, unstable ranges and the limit speed."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from typing import Any

import numpy as np

from elastic import Deflection
from elastic.assessment import beyond_beam_theory, buckling_bound
from elastic.elastodynamics import Resonance, SpeedAnswers, SpeedMap, SpeedSearch, critical_speeds, prominences
from kinelast.figures.bounds import BOUND_OVER_ERROR, damping_of, resolved
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import Measure, magnitudes, measures_of
from kinelast.figures.errors import (
    HEADLINE,
    HIGHER_ORDERS,
    LARGE,
    MIN_SHARE_OF_UNIT,
    TIME,
    Estimate,
    figure_errors,
    motion_errors,
    stiffness_error,
)
from kinelast.figures.leading_drive import nominal_speed
from kinelast.figures.limits import BROKEN, SEVERITY, VERDICTS
from kinelast.figures.output import output_of
from kinelast.figures.ranges import needed_by_limits
from kinelast.figures.registry import figures_of, limits_of
from kinelast.figures.results import Results
from kinelast.figures.speed_limits import SpeedLimit, amplified, by_figure, limit_speed, outcomes, yield_speed
from kinelast.scene.data import ACCURACY, Scene, scene_deflection, scene_motion
from kinelast.scene.error import SceneError
from kinelast.scene.figure import LEAST, OUTPUT_ERROR, Figure, items_of
from kinelast.tasks.progress import SILENT, Progress, lasting, one_thread
from rigid import MechanismError, Motion, with_rates
from rigid.arrays import Flags, Reals

FIELDS = {"w": "deflection", "chord": "chord", "mises": "stress"}  # figures by field, for each beam
PROMINENT = 0.1  # smallest prominence of a reported peak, relative to its height
LONG = 60.0  # [s] remaining time above which the user is informed


@dataclass(frozen=True)
class SpeedPeak:
    """A local maximum, over the speed, of the largest value of a field in the cycle.

    Attributes
    ----------
    speed
        Speed of the drive [rad/s or m/s].
    field, beam
        Key in `FIELDS` and number of the beam with the most prominent peak.
    value
        Value at the peak.
    resonance
        Mode with the strongest vibration; None if vibration has little effect.
    """

    speed: float
    field: str
    beam: int
    value: float
    resonance: Resonance | None


@dataclass(frozen=True, eq=False)
class Speeds:
    """The largest values over the cycle at several speeds.

    Attributes
    ----------
    speed, asked
        Speeds of the drive [rad/s or m/s], and whether each was requested, shape (speeds,). The other speeds are those
        of peaks, of limits of unstable ranges, and the limit speed.
    map
        Speed map: values of `FIELDS` [m, m, Pa] per beam with and without vibration, and growth.
    figures
        Measures of the registered figures, with their values and errors, shape (speeds,).
    verdicts
        Verdict at each speed; empty if there are no limits.
    highest
        Highest speed at which all limits are met and no link yields, including the errors, to within 0.2 %. It is 0.0
        if
        a limit fails at the first speed, and None if there are no limits.
    limit
        First limit that fails above `highest`; None if all limits are met at all speeds, or if there are no limits.
    yielding
        Lowest speed at which a link yields, and the number of its beam; None if no link yields.
    between
        Result of a fine scan in reduced coordinates, corrected by the map: speeds [rad/s or m/s], shape (n,), and
        values of `FIELDS`, shape (3, beams, n).
    peaks
        Prominent peaks, in order of increasing speed.
    unstable
        Speed ranges without a steady state.
    critical
        For each multiple of the drive speed, the smallest and largest speed over the cycle at which it equals the
        lowest natural frequency.
    buckles
        Link that buckles at each speed, in words; empty if no link buckles. If a link buckles, its bending is unknown.
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
        """The largest relative error of deflection, stress and output, shape (speeds,).

        The reference value is at least `MIN_SHARE_OF_UNIT` times the largest field with the same unit.
        """
        read = [self.figures[key] for key in (*HEADLINE, OUTPUT_ERROR) if key in self.figures]
        read = [each for each in read if not np.isnan(each[1]).all()]  # no stress if the section depth is unknown
        if not read:
            return np.full(self.speed.shape, np.nan)
        bases = [np.maximum(value, MIN_SHARE_OF_UNIT * self._largest(measure.unit)) for measure, value, _ in read]
        shares = [
            np.divide(error, base, out=0.0 * error, where=~(base <= 0.0))
            for (_, _, error), base in zip(read, bases, strict=True)
        ]
        return reduce(np.maximum, shares)

    def _largest(self, unit: str) -> Reals:
        """Return the largest value at each speed of all fields with the given unit."""
        sizes = [value for measure, value, _ in self.figures.values() if measure.figure.fields and measure.unit == unit]
        return reduce(np.fmax, sizes)


@one_thread()
def speeds(scene: Scene, asked: tuple[float, float, int], progress: Progress = SILENT) -> Speeds:
    """Return the results at the requested speeds, and at peaks, stability limits and the limit speed between them.

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
            still=partial(_quasi_static_rows, scene, still),
            errors=partial(_errors, scene, figures, cache(partial(_motion_shares, scene, figures))),
            on_speed=answering,
            resolved=resolved(scene.theory.accuracy or ACCURACY, judged=True),
        )
        answers.find(ratios)
        reporting = _SearchProgress(scene.name, progress)
        search = SpeedSearch(answers, lambda found: _curves(by_figure(scene, figures, found.values)), reporting)
        search.find_peaks()
        unstable = search.find_borders()
        limit = limit_speed(scene, figures, still, search, nominal) if limits else None
        yielding = yield_speed(scene, figures, search, nominal)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    steady = answers.map()
    pressed = steady.quasi_static[:, -1] >= 1.0
    buckles = [_buckles(scene, ratio) if may else "" for ratio, may in zip(steady.ratio, pressed, strict=True)]
    buckled = np.array([bool(words) for words in buckles])
    steady = replace(steady, **{name: _without(getattr(steady, name), buckled) for name in ("values", "errors")})
    values, plain = by_figure(scene, figures, steady.values), by_figure(scene, still, steady.quasi_static)
    mapped = replace(
        steady, values=np.moveaxis(_curves(values), -1, 0), quasi_static=np.moveaxis(_curves(plain), -1, 0)
    )
    errors = by_figure(scene, figures, steady.errors)
    measures = {
        name: (measure, *_with_errors(measure, values[measure.figure.key], errors[measure.figure.key]))
        for name, measure in measures_of(scene, figures).items()
    }
    worst = [np.broadcast_to(each, steady.ratio.shape) for each in outcomes(scene, values, errors)]
    verdicts = [VERDICTS[SEVERITY[number]] for number in reduce(np.minimum, worst)] if worst else []
    if buckled.any():
        before = verdicts or [""] * len(buckled)
        verdicts = [VERDICTS[BROKEN] if bad else verdict for bad, verdict in zip(buckled, before, strict=True)]
    per_cycle = nominal * float(scene.run.cycle) / (2 * np.pi)  # speed of the drive / speed of the cycle
    spans = critical_speeds(steady.omega * per_cycle).items()
    highest = None if not limits else limit.speed if limit else asked[1]
    if highest is not None and (buckled & (steady.ratio * nominal <= highest)).any():
        limit, highest = None, float(max(steady.ratio[: int(buckled.argmax())], default=0.0)) * nominal
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


def _buckles(scene: Scene, ratio: float) -> str:
    """Return the link that buckles without vibration at a speed, in words; empty if no link buckles."""
    course = scene_motion(scene)
    return Results(scene, scene_deflection(scene, with_rates(course, ratio * course.drive_rate))).buckles


def _without(values: Any, buckled: Flags) -> Any:
    """Return the values with nan at some speeds (first axis)."""
    return np.where(buckled.reshape(-1, *(1,) * (np.ndim(values) - 1)), np.nan, values)


@dataclass
class _SearchProgress:
    """Reports the progress of the search between speeds, and informs the user once if it takes long."""

    name: str
    progress: Progress
    begin: float = math.nan  # start of the search [s]; infinite after the remaining time was checked

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
    """Return the magnitudes of all items of figures, shape (rows, speeds), including field peaks between positions.

    Buckling is computed for each speed separately, because only a bound is known for several speeds at once.
    """
    fields = frozenset(field for figure in figures for field in figure.fields)
    cycle = Cycle(scene, bent.motion, bent, wanted=fields, period=bent.motion.time[:, -1])
    values = magnitudes(cycle, [figure for figure in figures if figure.key != "buckling"])
    if any(figure.key == "buckling" for figure in figures):
        each = map(alone, range(len(bent.motion.time)))
        values["buckling"] = np.stack([Cycle(scene, one.motion, one).pressed.value for one in each], axis=-1)
    return np.concatenate([values[figure.key] for figure in figures])


def _quasi_static_rows(
    scene: Scene, figures: Sequence[Figure], bent: Deflection, alone: Callable[[int], Deflection]
) -> Reals:
    """Return the rows of `_largest` without vibration, and a row with the largest bound on load / critical load."""
    bound = np.nanmax(buckling_bound(bent), axis=(0, -1), initial=0.0)
    return np.concatenate([_largest(scene, figures, bent, alone), bound[None]])


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
    """Return the errors of all items of figures, computed as in a report, shape (rows,).

    `of_motion` returns the relative errors of the figures of rigid motion for a given number of positions.
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
    """Return the relative errors of the figures of rigid motion at `count` equally spaced positions.

    The errors are given by key, shape (items,). They are the same at all speeds, because the motion is the same.
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
    """Reduce the values and errors of all items, shape (items, speeds), to those of a measure, shape (speeds,)."""
    rows = [*range(len(values))] if measure.items is None else [*measure.items]
    least = measure.figure.over == LEAST
    known = np.where(np.isnan(values[rows]), np.inf if least else -np.inf, values[rows])
    at = known.argmin(axis=0) if least else known.argmax(axis=0)
    return measure.among(values), np.take_along_axis(errors[rows], at[None], 0)[0]


def _curves(values: Mapping[str, Any]) -> Reals:
    """Return the values of the figures in `FIELDS`, shape (3, beams, speeds)."""
    return np.array([values[key] for key in FIELDS.values()])


def _peaks(mapped: SpeedMap, search: SpeedSearch, nominal: float) -> Iterator[SpeedPeak]:
    """Yield the prominent peaks of `FIELDS`. Of neighbouring peaks, only the most prominent one is yielded."""
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
        met = amplified(search, float(mapped.ratio[at]), value, still)
        yield SpeedPeak(float(mapped.ratio[at] * nominal), [*FIELDS][field], beam, float(value), met)
