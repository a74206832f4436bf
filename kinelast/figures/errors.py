"""Errors of figures, in the units of the figures, computed from differences between answers."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np

from elastic import FIELDS, FieldKind, reference_deflection
from elastic.assessment import LIMITS
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import bounded_items, magnitudes
from kinelast.figures.registry import NAMES, limits_of
from kinelast.scene.data import Scene
from kinelast.scene.figure import AVERAGE, LARGEST, LEAST, MOST, OUTPUT_ERROR, POINT, Figure, Limit, items_of
from rigid.arrays import Reals

VIBRATION, LARGE = "vibration", "large displacement"
HIGHER_ORDERS, TIME, BEAM_THEORY, ROUND_OFF = "higher orders", "time and coordinates", "beam theory", "round-off"
BETWEEN = "between the positions"
MEASURED, BODIES = "motion, as measured", "beam theory, as measured"  # parts measured by checks
NOT_OF_MOTION = (BEAM_THEORY, ROUND_OFF, BETWEEN)  # parts that are the same in all theories of motion
BY_MOTION = (VIBRATION, LARGE)  # successive corrections, added with their signs
SEARCHED = LARGEST, LEAST, MOST  # reductions whose result belongs to a position of the cycle
STEP_RATIO = 4.0  # error of an average with doubled steps / error with the given steps
ONE_POSITION = "there is no neighbouring instant to compare with"
RIGID_HEADLINE = "drive_effort", "joint_force"  # main figures of a mechanism of rigid links
RECIPROCAL = "safety", "endurance"  # figures strength / stress, which have the relative errors of the stress
HEADLINE = NAMES["w"], NAMES["mises"]  # main figures of every report
MIN_SHARE_OF_UNIT = 0.01  # relative errors refer to at least this fraction of the largest figure with the unit
MIN_COMPUTED_RATIO = LIMITS["axial force"].watch  # above this, load ratios of corrections are not scaled
SMALL_RATIO = 0.2  # load ratios below this fraction of the largest one have the error `SMALL_RATIO_ERROR`
SMALL_RATIO_ERROR = 0.02  # error of small load ratios, relative to the largest one
MAX_CHANGE_RATIO = 3.0  # assumed relative change of a load ratio / relative change of the axial force
FORCE_UNITS = "N", "N m", "W", "J"
DISPLACEMENTS = ("m", "rad")  # units with discretization errors relative to the largest figure with the unit
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class FigureError:
    """The error of a figure, in the figure's unit.

    Attributes
    ----------
    parts
        Errors by cause. The parts `BY_MOTION` are signed corrections; adding them to the figure makes it more accurate.
    unknown
        Reason why the total is unknown; empty if it is known.
    """

    parts: Mapping[str, float] = field(default_factory=dict)
    unknown: str = ""

    @cached_property
    def size(self) -> float:
        """The total error: the sum of the signed parts, plus the magnitudes of the others; nan if it is unknown."""
        if self.unknown:
            return math.nan
        lacks = math.fsum(self.parts.get(name, 0.0) for name in BY_MOTION)
        return abs(lacks) + math.fsum(abs(part) for name, part in self.parts.items() if name not in BY_MOTION)

    @cached_property
    def largest(self) -> str:
        """The name of the largest part."""
        return max(self.parts, key=lambda name: abs(self.parts[name]), default="")

    @property
    def measured(self) -> bool:
        """Whether the largest part was measured by a check."""
        return self.largest in (MEASURED, BODIES)

    def without(self, names: Sequence[str]) -> FigureError:
        """Return the error without the given parts."""
        return FigureError({name: part for name, part in self.parts.items() if name not in names}, self.unknown)


@dataclass(frozen=True)
class GradedFigure:
    """A main figure, by which the accuracy of an answer is judged.

    Attributes
    ----------
    key, item
        Key of the figure, and number of the item.
    value, base
        Magnitude, and reference value of the relative error. The reference value is at least `MIN_SHARE_OF_UNIT` times
        the largest figure with the same unit.
    error
        Error of the figure.
    """

    key: str
    item: int
    value: float
    base: float
    error: FigureError

    @property
    def share(self) -> float:
        """The relative error; nan if it is unknown."""
        return self.error.size / self.base


@dataclass(frozen=True, eq=False)
class Estimate:
    """The data from which the errors of all figures of an answer are computed.

    Attributes
    ----------
    stages
        Corrected answers by cause. Each includes all previous corrections.
    beam_theory
        Answer that includes an estimate of the effects that beam theory neglects.
    shares
        Other errors by cause, relative to the largest displacement.
    settled
        Convergence error in time and coordinates, relative to the largest displacement.
    forces
        Discretization error of forces, relative to the largest force, if it is not measured by a finer answer. It
        differs from the error of displacements because forces depend on accelerations. It also applies to stresses.
    closer
        Answer with instants between the positions, which shows by how much the peaks are larger there. None for a
        single
        position.
    moving
        Answer with vibration at the instants of `closer`, if `closer` is quasi-static and free vibration may have peaks
        between the positions.
    unknown
        Reason why the total is unknown; empty if it is known.
    """

    stages: Mapping[str, Cycle]
    beam_theory: Cycle
    shares: Mapping[str, float]
    unknown: str = ""
    settled: float = 0.0
    forces: float = 0.0
    closer: Cycle | None = None
    moving: Cycle | None = None


def figure_errors(
    answer: Cycle, figures: Sequence[Figure], off: Estimate, keys: Collection[str] | None = None
) -> dict[str, list[FigureError]]:
    """Return the errors of all items of an answer's figures by key. `keys` selects some of the figures.

    A part of the error is the difference between the figures of the answer and of a corrected answer. A part that is
    given as a relative error refers to the largest item of the figure or, for displacements, the largest displacement.
    The error of the residual vibration after a stop is relative to the largest displacement, because time elements may
    damp this vibration.
    """
    none: dict[str, list[FigureError]] = {figure.key: [] for figure in figures if not items_of(answer.scene, figure.of)}
    figures = [figure for figure in figures if figure.key not in none]
    values = magnitudes(answer, [figure for figure in figures if not figure.rigid and figure.follows is None])
    scales = _scales(answer.scene, {figure.key: figure for figure in figures}, values)
    figures = [figure for figure in figures if keys is None or figure.key in keys]
    moving = [figure for figure in figures if figure.exact or figure.of_motion(answer.scene)]
    (off.closer or answer).search(moving)
    errors = {figure.key: motion_errors(answer, figure, off.closer) for figure in moving}
    others = [figure for figure in figures if figure.key not in errors]
    values |= magnitudes(answer, others)
    limited = limited_figures(answer.scene, others)
    corrected = [
        replace(each, follows=None)
        if each in limited or np.max(values[each.key], initial=0.0) > MIN_COMPUTED_RATIO
        else each
        for each in others
    ]
    stages = {name: _changed(cycle, corrected, answer, values) for name, cycle in off.stages.items()}
    bent = (
        others if _forces_differ(answer, off.beam_theory) else [each for each in others if not _of_forces(answer, each)]
    )
    bodies = values if off.beam_theory is answer else values | _changed(off.beam_theory, bent, answer, values)
    closer, vibrating = (
        values if each in (None, answer) else _changed(each, others, answer, values)
        for each in (off.closer, off.moving)
    )
    if off.moving is not None:
        before = stages[VIBRATION]
        closer = {
            key: _larger_change(key, *(each[key] for each in (closer, values, vibrating, before))) for key in before
        }
    return none | errors | _of_items(answer, others, values, stages, bodies, closer, off, scales)


def _forces_differ(answer: Cycle, other: Cycle) -> bool:
    """Return whether two answers differ in their joint or section forces."""
    here, there = answer.deflection, other.deflection
    pairs = [*zip(here.forces.force, there.forces.force, strict=True)]
    pairs += [(getattr(here.amplitudes, name), getattr(there.amplitudes, name)) for name in ("N", "V", "M")]
    return not all(np.array_equal(one, two, equal_nan=True) for one, two in pairs)


def _of_forces(answer: Cycle, figure: Figure) -> bool:
    """Return whether a figure depends on forces only."""
    if figure.fields:
        return all(FIELDS[key].kind in (FieldKind.FORCE, FieldKind.STRESS) for key in figure.fields)
    return all(unit in FORCE_UNITS for unit in figure.units(answer.scene))


def _larger_change(key: str, closer: Any, here: Any, after: Any, before: Any) -> Any:
    """Return `closer`, or `here` plus the change from `before` to `after` if that change is larger."""
    if key in RECIPROCAL:
        with np.errstate(divide="ignore"):
            return 1.0 / _larger_change("", *(np.divide(1.0, each) for each in (closer, here, after, before)))
    change = _difference(after, before)
    return np.where(np.abs(change) > np.abs(_difference(closer, here)), here + change, closer)


def _changed(cycle: Cycle, figures: Sequence[Figure], answer: Cycle, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the magnitudes of figures by key for a corrected cycle.

    A figure that follows another figure is not recomputed. Its relative change is assumed to be `MAX_CHANGE_RATIO`
    times that of the other figure.
    """
    sizes = magnitudes(cycle, [figure for figure in figures if figure.follows is None])
    for figure in figures:
        if figure.follows is not None:
            here, there = (magnitudes(each, [figure.follows])[figure.follows.key] for each in (answer, cycle))
            change = np.divide(there, here, out=np.ones_like(here), where=here > 0.0) - 1.0
            size = values[figure.key]
            greatest = np.max(size, initial=0.0)
            rough = np.where(size < SMALL_RATIO * greatest, SMALL_RATIO_ERROR * greatest, 0.0)
            sizes[figure.key] = size * (1.0 + MAX_CHANGE_RATIO * change) + rough
    return sizes


def motion_errors(answer: Cycle, figure: Figure, closer: Cycle | None) -> list[FigureError]:
    """Return the errors of all items of a rigid figure due to the spacing of the positions and to round-off.

    For a largest or smallest value, the error is the gain of a parabola at the peak. For an average, it is the change
    if only every second instant is used, plus a quarter of the additional change if only every fourth instant is used,
    because the first change may be small by chance.
    """
    cycle = closer or answer
    peak = cycle.of(figure)
    if figure.exact:
        return [FigureError() for _ in peak.value]
    if closer is None:
        return [FigureError({}, ONE_POSITION) for _ in peak.value]
    searched = figure.over in SEARCHED and not figure.whole
    off = peak.gain
    if not searched:
        coarser, coarsest = (each.of(figure).value for each in (cycle.coarser, cycle.coarser.coarser))
        before = np.abs(_difference(coarser, coarsest)) / STEP_RATIO
        off = np.abs(_difference(peak.value, coarser)) + before
    off = np.broadcast_to(np.nan_to_num(off, nan=np.inf), np.shape(peak.value))
    at = np.broadcast_to(peak.position, np.shape(peak.value))
    size = np.where(np.isfinite(peak.value), np.abs(peak.value), 0.0)
    rounded = _round_off(cycle, at, figure.of_motion(cycle.scene)) * size
    pairs = zip(off.tolist(), np.broadcast_to(rounded, np.shape(off)).tolist(), strict=True)
    return [FigureError({BETWEEN: between, ROUND_OFF: lost}) for between, lost in pairs]


def _of_items(
    answer: Cycle,
    figures: Sequence[Figure],
    values: Mapping[str, Any],
    stages: Mapping[str, Mapping[str, Any]],
    bodies: Mapping[str, Any],
    closer: Mapping[str, Any],
    off: Estimate,
    scales: Mapping[str, float],
) -> dict[str, list[FigureError]]:
    """Return the errors of all items of figures by key; arrays contain the items of all figures."""
    if not figures:
        return {}
    counts = [len(values[figure.key]) for figure in figures]

    def joined(sizes: Mapping[str, Any]) -> Reals:
        return np.concatenate([sizes[figure.key] for figure in figures])

    def each(numbers: Iterable[Any]) -> Any:
        return np.repeat(np.array([*numbers]), counts)

    here = joined(values)
    power, reciprocal = each(figure.power for figure in figures), each(figure.key in RECIPROCAL for figure in figures)
    units = [unit for figure in figures for unit in figure.units(answer.scene)]
    scale = np.array([scales.get(unit, 0.0) for unit in units])
    finite, first = np.where(np.isfinite(here), here, 0.0), np.cumsum([0, *counts[:-1]])

    def among_items(reduction: np.ufunc, numbers: Reals) -> Reals:
        return np.repeat(reduction.reduceat(numbers, first), counts)

    base = np.concatenate([reference_deflection(part) for part in np.split(np.abs(finite), first[1:])])
    wide = among_items(np.maximum, np.where(each(figure.of == POINT for figure in figures), scale, base))
    wide = np.where(each(figure.over == LEAST for figure in figures), base, wide)  # the smallest values are quotients
    weakest = among_items(np.minimum, np.where(finite > 0.0, finite, np.inf))  # item with the largest stress
    wide = np.where(reciprocal, np.square(finite) / weakest, wide)

    def change(after: Any, before: Any) -> Reals:
        return np.where(reciprocal, _change_of_stress(after, before, here), _difference(after, before))

    parts: dict[str, Reals] = {}
    before = here
    for name, stage in stages.items():
        after = joined(stage)
        parts[name], before = change(after, before), after
    known: Any = sum((parts[name] for name in BY_MOTION if name in parts), start=np.zeros(len(here)))
    away = np.where(known < 0.0, -1.0, 1.0)  # a share has no sign, so it must not cancel known parts
    for name, share in off.shares.items():
        parts[name] = (away if name in BY_MOTION else 1.0) * power * share * wide
    if VIBRATION in off.shares:  # without vibration an average may be zero
        least = np.square(power * off.shares[VIBRATION]) * scale
        average = each(figure.over == AVERAGE for figure in figures)
        parts[VIBRATION] = np.where(average, np.maximum(parts[VIBRATION], least), parts[VIBRATION])
    if TIME in off.shares:
        moved = np.array([unit in DISPLACEMENTS for unit in units]) & (power != 0.0)
        pushed = np.array([unit in ("N", "N m", "Pa") for unit in units]) | (power > 1.0) | reciprocal
        of_moved, of_forces = np.where(moved, off.shares[TIME] * scale, 0.0), np.where(pushed, off.forces * power, 0.0)
        parts[TIME] = np.maximum.reduce([parts[TIME], of_moved, of_forces * wide])
    if off.settled and any(figure.remains_of for figure in figures):
        whole = [
            np.max(answer.of(figure.remains_of).value, initial=0.0) if figure.remains_of else 0.0 for figure in figures
        ]
        time = parts.get(TIME, np.zeros(len(here)))
        remaining = each(figure.remains_of is not None for figure in figures)
        parts[TIME] = np.where(remaining, np.maximum(np.abs(time), off.settled * each(whole)), time)
    parts[BEAM_THEORY] = np.abs(change(joined(bodies), here))
    parts[BETWEEN] = np.abs(change(joined(closer), here))
    if any(figure.follows for figure in figures):
        beside = [answer.buckling_gain if figure.follows else np.zeros(count)
                  for figure, count in zip(figures, counts, strict=True)]  # fmt: skip
        parts[BETWEEN] = np.maximum(parts[BETWEEN], np.concatenate(beside))
    positions = [np.broadcast_to(answer.of(figure).position, len(values[figure.key])) for figure in figures]
    parts[ROUND_OFF] = _round_off(answer, np.concatenate(positions), rigid=False) * base
    rows = zip(*(part.tolist() for part in parts.values()), strict=True)
    errors = (FigureError(dict(zip(parts, row, strict=True)), off.unknown) for row in rows)
    return {figure.key: [*islice(errors, count)] for figure, count in zip(figures, counts, strict=True)}


def stiffness_error(sizes: Iterable[float], errors: Iterable[FigureError]) -> float:
    """Return the relative error of natural frequencies due to deflections that beam theory neglects.

    By Rayleigh's quotient it is half the relative error of the stiffness.

    Parameters
    ----------
    sizes, errors
        Largest deflections of the beams, and their errors.
    """
    shares = [
        error.parts.get(BEAM_THEORY, math.nan) / abs(size) for size, error in zip(sizes, errors, strict=True) if size
    ]
    return max(shares, default=math.nan) / 2


def _difference(after: Any, before: Any) -> Reals:
    """Return the differences of two arrays; 0 if both values are equal and infinite."""
    with np.errstate(invalid="ignore"):
        difference: Reals = np.where(after == before, 0.0, after - before)
    return difference


def _change_of_stress(after: Any, before: Any, here: Any) -> Reals:
    """Return the decrease of stress from `before` to `after`, given as safety factors, relative to that of `here`."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        change: Reals = here * (here / before - here / after)
    return np.where(np.isfinite(change) & (after != before), change, _difference(after, before))


def _round_off(answer: Cycle, positions: Any, rigid: bool) -> Reals:
    """Return the relative round-off at some positions: EPS times a condition number, or EPS at unknown positions.

    The condition number is that of the `rigid` motion, or else of the deflection if links bend.
    """
    return np.where(positions >= 0, answer.once(_round_off_at, rigid)[np.maximum(positions, 0)], EPS)


def _round_off_at(answer: Cycle, rigid: bool) -> Reals:
    """Return the relative round-off error at every position, for the rigid motion or for deflections."""
    if rigid:
        return np.where(np.isfinite(answer.condition), EPS * answer.condition, EPS)
    with np.errstate(invalid="ignore"):
        lost = np.minimum(EPS * answer.deflection.condition, 1.0) * answer.bending
        share = np.maximum(EPS * answer.condition, lost)
    return np.where(np.isfinite(share), share, EPS)


def graded_figures(scene: Scene, answer: Cycle, figures: Sequence[Figure], off: Estimate) -> list[GradedFigure]:
    """Return the main figures: the headline figures, the output, and figures with limits."""
    by_key = {figure.key: figure for figure in figures}
    figures = [figure for figure in figures if items_of(scene, figure.of)]
    limited = limited_figures(scene, figures)
    values = magnitudes(
        answer, [each for each in figures if not each.rigid and (each.follows is None or each in limited)]
    )
    motion = [figure for figure in figures if figure.of_motion(scene)]
    values |= magnitudes(
        off.closer or answer, motion if not scene.labels else [each for each in motion if each in limited]
    )
    scales = _scales(scene, by_key, values)
    chosen = dict.fromkeys(_read(scene, by_key, values))
    errors = figure_errors(answer, figures, off, {key for key, _ in chosen})
    graded = []
    for key, item in chosen:
        value = float(values[key][item])
        base = max(value, MIN_SHARE_OF_UNIT * scales.get(by_key[key].units(scene)[item], 0.0))
        graded.append(GradedFigure(key, item, value, base, errors[key][item]))
    return graded


def limited_figures(scene: Scene, figures: Sequence[Figure]) -> list[Figure]:
    """Return the figures with limits."""
    keys = {limit.figure for limit in limits_of(scene)}
    return [figure for figure in figures if figure.key in keys]


def _read(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """Yield the keys of the main figures, each with the number of the item that has the extreme value.

    A load ratio far below its limit is not a main figure.
    """
    limited: Iterator[tuple[str, Sequence[int] | None]] = (
        (limit.figure, bounded_items(scene, limit))
        for limit in limits_of(scene)
        if not _far_below(limit, figures, values)
    )
    headline = (*HEADLINE, OUTPUT_ERROR) if scene.labels else RIGID_HEADLINE
    for key, items in (*((key, None) for key in headline), *limited):
        sizes = values.get(key, np.zeros(0))
        known = range(len(sizes)) if items is None or not len(sizes) else items
        rows = [item for item in known if 0.0 < sizes[item] < math.inf]
        if rows:
            pick = min if figures[key].over == LEAST else max
            yield key, pick(rows, key=lambda item: sizes[item])


def _far_below(limit: Limit, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> bool:
    """Return whether a load ratio is far below its limit."""
    figure = figures.get(limit.figure)
    if figure is None or figure.follows is None:
        return False
    return bool(np.max(limit.used(values[limit.figure]), initial=0.0) < MIN_COMPUTED_RATIO)


def worst_of(graded: Sequence[GradedFigure]) -> GradedFigure | None:
    """Return the figure with the largest relative error, or the first with an unknown error."""
    return max(graded, key=lambda each: math.inf if math.isnan(each.share) else each.share, default=None)


def _scales(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest known magnitude by unit, among figures that grow with displacements or forces.

    Dimensionless figures are omitted, because their magnitudes are not comparable.
    """
    scales: dict[str, float] = {}
    for key, sizes in values.items():
        for unit, size in zip(figures[key].units(scene), sizes, strict=True) if figures[key].power else ():
            if math.isfinite(size) and unit != "1":
                scales[unit] = max(scales.get(unit, 0.0), float(abs(size)))
    return scales
