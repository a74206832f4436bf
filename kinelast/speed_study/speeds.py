"""Results as a function of drive speed: largest values over the cycle, peaks, unstable ranges, limit speed."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial, reduce
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Deflection, Largest
from elastic.assessment import buckling_bound
from elastic.elastodynamics import Resonance, SpeedMap, SpeedSearch, SpeedSolutions, critical_speeds, prominences
from kinelast.answers.bounds import accepted_bound, damping_of
from kinelast.answers.refusals import needed_by_limits
from kinelast.answers.results import Results, at_critical_load
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import MIN_SHARE_OF_UNIT
from kinelast.figures.leading_drive import nominal_speed
from kinelast.figures.measures import Measure, magnitudes, measures_of
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.reports.limits import BROKEN, SEVERITY, VERDICTS
from kinelast.scene.data import Scene, scene_deflection
from kinelast.speed_study.speed_errors import motion_shares, speed_errors, with_errors
from kinelast.speed_study.speed_limits import SpeedLimit, amplified, by_figure, limit_speed, outcomes, yield_speed
from kinelast.tasks.progress import SILENT, Progress, lasting, one_thread
from kinelast.values.error import SceneError
from kinelast.values.figure import OUTPUT_ERROR, SCENE, Figure, sole
from rigid import MechanismError, Motion, with_rates
from rigid.arrays import Flags, Reals

FIGURE_OF_FIELD = {"w": "deflection", "chord": "chord", "mises": "stress"}  # key of the figure by field (along beams)
GRADED = FIGURE_OF_FIELD["w"], FIGURE_OF_FIELD["mises"], OUTPUT_ERROR  # `Speeds.error` refers to these
PROMINENT = 0.1  # smallest prominence of a reported peak, relative to its height
ONSET = 1e-3  # relative tolerance of the speed at which a link buckles
LONG = 60.0  # [s] the user is informed if the remaining time is longer


class SpeedPeak(Struct, frozen=True):
    """A speed at which the largest value of a field over the cycle exceeds that at all nearby speeds.

    Attributes
    ----------
    speed
        Speed of the drive [rad/s or m/s].
    field, beam
        Field (quantity along beams) with the most prominent peak at this speed, as a key of `FIGURE_OF_FIELD`, and
        number of the beam.
    value
        Value of the field at the peak.
    resonance
        Mode with the strongest vibration at this speed; None if vibration has little effect.
    """

    speed: float
    field: str
    beam: int
    value: float
    resonance: Resonance | None


class Speeds(Struct, frozen=True, eq=False):
    """The largest values over the cycle at several speeds.

    Attributes
    ----------
    speed, asked
        Speeds of the drive [rad/s or m/s], and whether each speed was requested, shape (speeds,). The speeds that were
        not requested are those of peaks, the ends of unstable ranges, and the limit speed.
    map
        Speed map: the figures in `FIGURE_OF_FIELD` [m, m, Pa] of each beam, with and without vibration, and the growth
        of vibration in a cycle.
    figures
        Measures of the registered figures by name, each with its values and their errors, shape (speeds,).
    verdicts
        Verdict at each speed; empty if there are no limits.
    highest
        Highest speed up to which all limits are met and no link yields, taking errors into account, to within 0.2 %. It
        is 0.0 if a limit fails at the first speed, and None if there are no limits.
    limit
        Limit that fails first above `highest`. None if all limits are met at all speeds, if there are no limits, or if
        a link buckles first.
    yielding
        Lowest speed at which a link yields, and the number of the yielding beam; None if no link yields.
    between
        Curves for plots: speeds [rad/s or m/s], shape (n,), and the figures in `FIGURE_OF_FIELD` at these speeds, shape
        (3, beams, n). They come from a fine scan in reduced coordinates, corrected by the results in `map`.
    peaks
        Prominent peaks, in order of increasing speed.
    unstable
        Ranges of the drive speed in which there is no steady state.
    critical
        Range of critical speeds for each integer n. At a critical speed, n times the drive speed equals the lowest
        natural frequency. It is a range because this frequency varies over the cycle.
    buckles
        For each speed, words on the link that buckles, or "" if no link buckles. If a link buckles, all figures are
        unknown.
    buckling
        Lowest speed at which a link buckles, to within `ONSET`; None if no link buckles.
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
    buckling: float | None = None

    @property
    def error(self) -> Reals:
        """The largest relative error of deflection, stress and output, shape (speeds,).

        The reference value of a relative error is at least `MIN_SHARE_OF_UNIT` times the largest field with the same
        unit.
        """
        read = [self.figures[key] for key in GRADED if key in self.figures]
        read = [each for each in read if not np.isnan(each[1]).all()]  # the stress is unknown without section depths
        if not read:
            return np.full(self.speed.shape, np.nan)
        bases = [np.maximum(value, MIN_SHARE_OF_UNIT * self._largest(measure.unit)) for measure, value, _ in read]
        shares = [
            np.divide(error, base, out=0.0 * error, where=~(base <= 0.0))
            for (_, _, error), base in zip(read, bases, strict=True)
        ]
        return reduce(np.maximum, shares)

    def _largest(self, unit: str) -> Reals:
        """Return, for each speed, the largest value of all fields with the given unit."""
        sizes = [value for measure, value, _ in self.figures.values() if measure.figure.fields and measure.unit == unit]
        return reduce(np.fmax, sizes)


@one_thread()
def speeds(scene: Scene, asked: tuple[float, float, int], progress: Progress = SILENT) -> Speeds:
    """Return the results at the requested speeds, and at the peaks, stability limits and limit speed in their range.

    Raises
    ------
    SceneError
        A drive has no constant speed, no drive moves, the run has no cycle, a load depends on time, or vibration cannot
        be solved.
    """
    nominal = nominal_speed(scene)
    limits = limits_of(scene)
    needed = {*FIGURE_OF_FIELD.values(), *(limit.figure for limit in limits), *needed_by_limits(scene)}
    figures = [figure for figure in figures_of(output_of(scene)) if not figure.asked or figure.key in needed]
    still = [*(figure for figure in figures if figure.key in needed), LOAD_BOUND]
    ratios = (np.linspace(*asked) / nominal).tolist()

    answered = [0, asked[2]]

    def answering(done: int, of: int) -> None:
        answered[:] = max(answered[0], done), of  # speeds are solved again for their errors; the bar never goes back
        progress(f"{scene.name}: speeds", *answered)

    def moved(times: Reals) -> Motion:
        progress(f"{scene.name}: solving speeds ({len(times):,} points)", *answered)
        return scene.course.at(times)

    try:
        answers = SpeedSolutions(
            moved,
            float(scene.run.cycle),
            scene.sections,
            partial(_largest, scene, figures),
            scene.joints,
            damping_of(scene),
            quasi_static_measure=partial(_largest, scene, still),
            errors=partial(speed_errors, scene, figures, cache(partial(motion_shares, scene, figures))),
            on_speed=answering,
            resolved=accepted_bound(scene.theory.wanted, judged=True),
        )
        answers.find(ratios)
        reporting = _SearchProgress(scene.name, progress)
        search = SpeedSearch(answers, lambda found: _curves(by_figure(scene, figures, found.values)), reporting)
        search.find_peaks()
        unstable = search.find_stability_limits()
        limit = limit_speed(scene, figures, still, search, nominal) if limits else None
        yielding = yield_speed(scene, figures, search, nominal)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    steady = answers.map()
    plain = by_figure(scene, still, steady.quasi_static)
    may_buckle = plain[LOAD_BOUND.key][0] >= 1.0
    buckles = [_buckles(scene, ratio) if may else "" for ratio, may in zip(steady.ratio, may_buckle, strict=True)]
    buckled = np.array([bool(words) for words in buckles])
    unknown = buckled[:, None]
    steady = replace(
        steady, values=np.where(unknown, np.nan, steady.values), errors=np.where(unknown, np.nan, steady.errors)
    )
    values = by_figure(scene, figures, steady.values)
    mapped = replace(
        steady, values=np.moveaxis(_curves(values), -1, 0), quasi_static=np.moveaxis(_curves(plain), -1, 0)
    )
    errors = by_figure(scene, figures, steady.errors)
    measures = {
        name: (measure, *with_errors(measure, values[measure.figure.key], errors[measure.figure.key]))
        for name, measure in measures_of(scene, figures).items()
    }
    worst = [np.broadcast_to(each, steady.ratio.shape) for each in outcomes(scene, values, errors)]
    verdicts = [VERDICTS[SEVERITY[number]] for number in reduce(np.minimum, worst)] if worst else []
    if buckled.any():
        before = verdicts or [""] * len(buckled)
        verdicts = [VERDICTS[BROKEN] if bad else verdict for bad, verdict in zip(buckled, before, strict=True)]
    per_cycle = nominal * float(scene.run.cycle) / (2 * np.pi)  # ratio of drive speed to angular frequency of the cycle
    spans = critical_speeds(steady.omega * per_cycle).items()
    highest = None if not limits else limit.speed if limit else asked[1]
    below, onset = _onset_of_buckling(scene, steady.ratio, buckled)
    if highest is not None and onset * nominal <= highest:
        limit, highest = None, below * nominal
    drawn, curves = search.plot_curves()
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
        onset * nominal if buckled.any() else None,
    )


def _onset_of_buckling(scene: Scene, ratios: Reals, buckled: Flags) -> tuple[float, float]:
    """Return the speed up to which no link buckles, and the lowest one at which a link buckles, as relative speeds.

    If a link buckles at the lowest of the given speeds, the first is 0. If no link buckles, the second is infinite.
    """
    if not buckled.any():
        return float(ratios[-1]), math.inf
    first = int(buckled.argmax())
    low, high = float(ratios[first - 1]) if first else 0.0, float(ratios[first])
    while first and high - low > ONSET * high:
        middle = (low + high) / 2
        low, high = (low, middle) if _buckles(scene, middle) else (middle, high)
    return low, high


def _buckles(scene: Scene, ratio: float) -> str:
    """Return words on the link that buckles quasi-statically at a speed, or "" if no link buckles.

    `ratio` is the speed divided by the speed in the scene.
    """

    def moved(times: Reals) -> Motion:
        nominal = scene.course.at(times)
        return with_rates(nominal, ratio * nominal.drive_rate)

    plain = Results(scene, scene_deflection(scene, moved(scene.course.with_breaks(scene.course.times()))))
    return at_critical_load(plain, moved).buckles


@dataclass
class _SearchProgress:
    """Report the progress of the search between the speeds, and inform the user once if the search takes long."""

    name: str
    progress: Progress
    begin: float = math.nan  # start of the search [s], or infinity after the remaining time was checked

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
    """Return the magnitudes of figures (results), shape (rows, speeds). Each item of a figure has a row.

    They are also evaluated between the positions.

    The figure "buckling" is computed for each speed separately with `alone`, because only a bound on it can be computed
    for several speeds at once.
    """
    fields = frozenset(field for figure in figures for field in figure.fields)
    cycle = Cycle(scene, bent.motion, bent, wanted=fields, period=bent.motion.time[:, -1], between=True)
    values = magnitudes(cycle, [figure for figure in figures if figure.key != "buckling"])
    if any(figure.key == "buckling" for figure in figures):
        each = map(alone, range(len(bent.motion.time)))
        values["buckling"] = np.stack([Cycle(scene, one.motion, one).buckling_ratio.value for one in each], axis=-1)
    return np.concatenate([values[figure.key] for figure in figures])


def _load_bound(cycle: Cycle) -> Largest:
    """Return an upper bound on the ratio of load to critical load, the largest of all links.

    The possible gain between the positions is taken as the drop to the lower of the two neighbouring positions.
    """
    bound = np.nan_to_num(buckling_bound(cycle.deflection), posinf=np.inf).max(axis=0, initial=0.0)
    at = bound.argmax(axis=-1)[..., None]
    value, *beside = (np.take_along_axis(bound, (at + step) % bound.shape[-1], -1)[..., 0] for step in (0, -1, 1))
    drop = np.subtract(value, np.minimum(*beside), out=np.zeros_like(value), where=np.isfinite(value))
    return sole(Largest(value, at[..., 0], gain=drop))


LOAD_BOUND = Figure("load_bound", "upper bound on load over the critical load", "1", SCENE, _load_bound)


def _curves(values: Mapping[str, Any]) -> Reals:
    """Return the figures in `FIGURE_OF_FIELD` as one array, shape (3, beams, speeds)."""
    return np.array([values[key] for key in FIGURE_OF_FIELD.values()])


def _peaks(mapped: SpeedMap, search: SpeedSearch, nominal: float) -> Iterator[SpeedPeak]:
    """Yield the prominent peaks of the figures in `FIGURE_OF_FIELD`.

    Only the most prominent one of several neighbouring peaks is yielded.
    """
    rows = [
        (share, at, field, beam)
        for field in range(len(FIGURE_OF_FIELD))
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
        yield SpeedPeak(float(mapped.ratio[at] * nominal), [*FIGURE_OF_FIELD][field], beam, float(value), met)
