"""Errors of figures: each of one figure, in its unit, made of differences that were computed for it."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from elastic import Deflection, reference_deflection, sample
from elastic.links import members_of
from kinelast.figures.cycle import STATIONS, Cycle
from kinelast.figures.entry import LARGEST, LEAST, MOST, Figure, bounded_items, magnitudes
from kinelast.figures.registry import NAMES, limits_of
from kinelast.scene.data import Scene
from kinelast.scene.limits import OUTPUT_ERROR
from rigid.arrays import Complexes, Numbers, Reals

VIBRATION, LARGE = "vibration", "large displacement"
HIGHER_ORDERS, TIME, BEAM_THEORY, ROUND_OFF = "higher orders", "time and coordinates", "beam theory", "round-off"
BETWEEN = "between the positions"
MEASURED, BODIES = "motion, as measured", "beam theory, as measured"  # by checks, in place of the estimates
NOT_OF_MOTION = (BEAM_THEORY, ROUND_OFF, BETWEEN)  # parts that no theory of motion changes
BY_MOTION = (VIBRATION, LARGE)  # each from the answer with those before it to that with it: their signs count
SEARCHED = LARGEST, LEAST, MOST  # reductions that find a place in the cycle
QUARTER = 4.0  # ratio in which the error of an average falls with half as long steps
ONE_POSITION = "there is no instant beside it to compare with"
RIGID_HEADLINE = "drive_effort", "joint_force"  # figures of a mechanism of rigid links by which it is graded
HEADLINE = NAMES["w"], NAMES["mises"]  # figures of which every report tells the greatest
LITTLE = 0.01  # of the greatest figure of a unit, below which one of them counts as so much
COURSES, JOINT_FORCES = ("u", "w", "chord", "N", "M"), "joint forces"
LITTLE_PRESSED, KNOWN_TO = 0.2, 0.02  # of the greatest: load ratios below the first are known to the second
MAX_CHANGE_RATIO = 3.0  # change of a load ratio between positions, relative to that of the axial force
DISPLACEMENTS = ("m", "rad")  # units of figures whose discretization error is a share of the largest of their unit
AT = np.linspace(0.0, 1.0, 5)  # places along the beams at which courses are compared
SMALL = 0.1  # of the greatest of all beams or joints, below which the course of one counts as so much
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class FigureError:
    """Error of a figure, in its unit.

    Attributes
    ----------
    parts
        By cause. Those of the theory of motion, `BY_MOTION`, are what the figure lacks, with their signs.
    unknown
        Why the whole is not known; nothing where it is.
    """

    parts: Mapping[str, float] = field(default_factory=dict)
    unknown: str = ""

    @property
    def size(self) -> float:
        """All parts together: the sum of those with signs, and of the others' magnitudes; nan where not known."""
        if self.unknown:
            return math.nan
        lacks = math.fsum(self.parts.get(name, 0.0) for name in BY_MOTION)
        return abs(lacks) + math.fsum(abs(part) for name, part in self.parts.items() if name not in BY_MOTION)

    @property
    def largest(self) -> str:
        """Name of the largest part."""
        return max(self.parts, key=lambda name: abs(self.parts[name]), default="")

    @property
    def measured(self) -> bool:
        """Whether checks measured its largest part."""
        return self.largest in (MEASURED, BODIES)

    def without(self, names: Sequence[str]) -> FigureError:
        """The error but for some of its parts."""
        return FigureError({name: part for name, part in self.parts.items() if name not in names}, self.unknown)


@dataclass(frozen=True)
class GradedFigure:
    """A figure that a reader looks at, by which an answer is graded.

    Attributes
    ----------
    key, item
        Of the figure, and the number of its item.
    value, base
        The magnitude, and that of which errors are shares: no less than `LITTLE` of the greatest of its unit.
    error
        Of the figure.
    """

    key: str
    item: int
    value: float
    base: float
    error: FigureError

    @property
    def share(self) -> float:
        """The error as a share; nan where it is not known."""
        return self.error.size / self.base


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimate of an answer's error, of which the errors of its figures are made.

    Attributes
    ----------
    stages
        By cause, in the order in which they go into it, the answer with that and all causes before it put right.
    beam_theory
        The answer with an estimate of what beam theory leaves out.
    shares
        By cause, other errors as shares of the largest displacement.
    settled
        Share of the largest displacement to which the answer is settled in time and coordinates.
    forces
        Discretization error of forces as a share of the largest one, if no finer answer measures it: they follow from
        accelerations.
    closer
        The answer at instants between the positions, too, its peaks with their gain; None of a single position.
    moving
        The vibrating answer at these instants, where `closer` is quasi-static: what rings may peak between positions.
    unknown
        Why the whole is not known; nothing where it is.
    """

    stages: Mapping[str, Cycle]
    beam_theory: Cycle
    shares: Mapping[str, float]
    unknown: str = ""
    settled: float = 0.0
    forces: float = 0.0
    closer: Cycle | None = None
    moving: Cycle | None = None


@dataclass(frozen=True)
class Measured:
    """Errors of figures by a check that rests on another theory, of its items in the units of the figures.

    Attributes
    ----------
    off, own
        By key of the figure, how far every item is off by the check, and how far the check may be; nan where it does
        not tell.
    """

    off: Mapping[str, Sequence[float]] = field(default_factory=dict)
    own: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def in_place(self, key: str, item: int, error: FigureError) -> FigureError:
        """An error with that of the check in place of all estimates of the theory of motion.

        The estimate stays where the check is too coarse to tell more.
        """
        if key not in self.off or math.isnan(self.off[key][item]):
            return error
        off, own, kept = self.off[key][item], self.own[key][item], NOT_OF_MOTION
        if not error.unknown and own >= max(off, error.without(kept).size):
            return error
        return FigureError({MEASURED: off + own, **{name: error.parts[name] for name in kept if name in error.parts}})


def with_bodies(
    errors: Mapping[str, Sequence[FigureError]], off: Sequence[float], whole: Sequence[float]
) -> dict[str, list[FigureError]]:
    """Errors with beam theory's part as plane bodies have it.

    Of the deflection from a beam's chord it is what they differ by; of other figures the estimate, times as much as it
    is too low or too high for the beam for which that is most. These keep the estimate where a beam that has a part in
    it is no body.

    Parameters
    ----------
    off, whole
        Of every beam, by how much its largest deflection from the chord differs, and the greatest difference at any
        place and position [m]; nan of beams that are no bodies.
    """
    told = [abs(error.parts.get(BEAM_THEORY, 0.0)) for error in errors["chord"]]
    least = SMALL * max(told, default=0.0)
    factor = max((apart / part for apart, part in zip(whole, told, strict=True) if part > least), default=math.nan)
    if any(math.isnan(apart) for apart, part in zip(whole, told, strict=True) if part > least):
        factor = math.nan

    def measured(key: str, item: int, error: FigureError) -> FigureError:
        size = off[item] if key == "chord" else factor * error.parts.get(BEAM_THEORY, math.nan)
        if math.isnan(size):
            return error
        others = {name: part for name, part in error.parts.items() if name != BEAM_THEORY}
        return replace(error, parts={**others, BODIES: size})

    return {key: [measured(key, item, each) for item, each in enumerate(rows)] for key, rows in errors.items()}


def figure_errors(
    answer: Cycle, figures: Sequence[Figure], off: Estimate, keys: Collection[str] | None = None
) -> dict[str, list[FigureError]]:
    """Errors of every item of the figures of an answer, by key; only of some `keys` if given.

    The same reductions are taken of the answer and of the answer without one cause of error; the difference is that
    part of the error. A part known as a share counts as that share of the largest item of the figure; the
    discretization error of a displacement, as a share of the largest displacement. The residual vibration after a stop
    is known to a share of the largest displacement, because time elements may damp it.
    """
    values = magnitudes(answer, [figure for figure in figures if not figure.rigid])
    scales = _scales(answer.scene, {figure.key: figure for figure in figures}, values)
    figures = [figure for figure in figures if keys is None or figure.key in keys]
    moving = [figure for figure in figures if figure.exact or figure.of_motion(answer.scene)]
    (off.closer or answer).search(moving)
    errors = {figure.key: _of_motion(answer, figure, off.closer) for figure in moving}
    others = [figure for figure in figures if figure.key not in errors]
    values |= magnitudes(answer, others)
    errors |= {figure.key: [] for figure in others if not len(values[figure.key])}
    others = [figure for figure in others if figure.key not in errors]
    stages = {name: magnitudes(cycle, others) for name, cycle in off.stages.items()}
    bodies, closer, vibrating = (
        values if each in (None, answer) else _changed(each, others, answer, values)
        for each in (off.beam_theory, off.closer, off.moving)
    )
    if off.moving is not None:
        before = stages[VIBRATION]
        closer = {key: _farther(closer[key], values[key], _difference(vibrating[key], before[key])) for key in before}
    return errors | {
        figure.key: _of_items(answer, figure, values, stages, bodies, closer, off, scales) for figure in others
    }


def _farther(closer: Any, here: Any, change: Any) -> Any:
    """Return values between the positions, or those at the positions plus a change, whichever differ more."""
    return np.where(np.abs(change) > np.abs(_difference(closer, here)), here + change, closer)


def _changed(cycle: Cycle, figures: Sequence[Figure], answer: Cycle, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return magnitudes of figures by key in another cycle than that of the answer.

    A figure that follows another one is not computed anew: its relative change is that of the other, times a bound.
    """
    sizes = magnitudes(cycle, [figure for figure in figures if figure.follows is None])
    for figure in figures:
        if figure.follows is not None:
            here, there = (magnitudes(each, [figure.follows])[figure.follows.key] for each in (answer, cycle))
            change = np.divide(there, here, out=np.ones_like(here), where=here > 0.0) - 1.0
            size = values[figure.key]
            greatest = np.max(size, initial=0.0)
            rough = np.where(size < LITTLE_PRESSED * greatest, KNOWN_TO * greatest, 0.0)
            sizes[figure.key] = size * (1.0 + MAX_CHANGE_RATIO * change) + rough
    return sizes


def _of_motion(answer: Cycle, figure: Figure, closer: Cycle | None) -> list[FigureError]:
    """Position errors of a figure of the rigid motion, of every item.

    Of a largest or least value that is the gain of a parabola there, of others the change by every second instant,
    and a quarter of that by every fourth, as the first may be small by chance.
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
        before = np.abs(_difference(coarser, coarsest)) / QUARTER
        off = np.abs(_difference(peak.value, coarser)) + before
    off = np.broadcast_to(np.nan_to_num(off, nan=np.inf), np.shape(peak.value))
    rounded = _round_off(cycle, figure) * np.where(np.isfinite(peak.value), np.abs(peak.value), 0.0)
    pairs = zip(off.tolist(), np.broadcast_to(rounded, np.shape(off)).tolist(), strict=True)
    return [FigureError({BETWEEN: between, ROUND_OFF: lost}) for between, lost in pairs]


def _of_items(
    answer: Cycle,
    figure: Figure,
    values: Mapping[str, Any],
    stages: Mapping[str, Mapping[str, Any]],
    bodies: Mapping[str, Any],
    closer: Mapping[str, Any],
    off: Estimate,
    scales: Mapping[str, float],
) -> list[FigureError]:
    before = here = values[figure.key]
    parts: dict[str, Reals] = {}
    for name, stage in stages.items():
        parts[name], before = _difference(stage[figure.key], before), stage[figure.key]
    base = reference_deflection(np.where(np.isfinite(here), np.abs(here), 0.0))
    wide = (
        base if figure.over == LEAST else np.full(np.shape(here), np.max(base, initial=0.0))
    )  # safeties are quotients
    parts |= {name: figure.power * share * wide for name, share in off.shares.items()}
    if TIME in off.shares:
        units = figure.units(answer.scene)
        moved = [scales.get(unit, 0.0) if unit in DISPLACEMENTS else 0.0 for unit in units]
        forces = [off.forces if unit == "N" else 0.0 for unit in units]
        parts[TIME] = np.maximum.reduce([parts[TIME], off.shares[TIME] * np.array(moved), np.array(forces) * wide])
    if figure.remains_of and off.settled:
        whole = np.max(answer.of(figure.remains_of).value, initial=0.0)
        parts[TIME] = np.maximum(np.abs(parts.get(TIME, 0.0)), np.full(np.shape(here), off.settled * whole))
    parts[BEAM_THEORY] = np.abs(_difference(bodies[figure.key], here))
    parts[BETWEEN] = np.abs(_difference(closer[figure.key], here))
    parts[ROUND_OFF] = _round_off(answer, figure) * base
    rows = zip(*(part.tolist() for part in parts.values()), strict=True)
    return [FigureError(dict(zip(parts, row, strict=True)), off.unknown) for row in rows]


def stiffness_error(sizes: Iterable[float], errors: Iterable[FigureError]) -> float:
    """Share by which natural frequencies are too high, by how much too little beam theory lets the links deflect.

    By Rayleigh's quotient that is half of the share by which it makes them too stiff.

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
    """By how much values change; not at all where both are infinite."""
    with np.errstate(invalid="ignore"):
        difference: Reals = np.where(after == before, 0.0, after - before)
    return difference


def _round_off(answer: Cycle, figure: Figure) -> Reals:
    """Round-off of every item as a share, at the position where it is found.

    EPS times the motion's condition, or times that of the deflection where links bend: next to where all are straight
    that is told of rotations that are nothing.
    """
    found, bent = answer.of(figure), answer.deflection
    at = np.broadcast_to(found.position, np.shape(found.value))
    there = np.maximum(at, 0)
    with np.errstate(invalid="ignore"):
        lost = np.minimum(EPS * bent.condition[there], 1.0) * answer.bending[there]
    share = np.maximum(EPS * answer.condition[there], lost)
    return np.where((at >= 0) & np.isfinite(share), share, EPS)


def history_error(answer: Cycle, off: Estimate) -> float:
    """Greatest error by the theory of motion, and in time, of any deflection from a chord at any instant.

    As a share of the largest deflection of the beam; a check of the whole mechanism measures it.
    """
    chord = sample(answer.deflection, "chord", STATIONS)
    base = reference_deflection(_greatest_of_members(answer, chord))
    shares = math.fsum(off.shares.values())
    if not off.stages:
        return shares
    final = [*off.stages.values()][-1].deflection
    return shares + _greatest_share(chord, sample(final, "chord", STATIONS), base)


def course_errors(answer: Cycle, off: Estimate) -> dict[str, float]:
    """Greatest errors by the theory of motion, and in time, of fields and joint forces at any instant, by name.

    Each as a share of the largest value of the member or joint, or of `SMALL` of the largest of all where that is more.
    """
    shares, errors = math.fsum(off.shares.values()), {}
    if not off.stages:
        return dict.fromkeys((*COURSES, JOINT_FORCES), shares)
    bent, final = answer.deflection, [*off.stages.values()][-1].deflection
    for name in COURSES:
        values = sample(bent, name, AT)
        base = _greatest_of_members(answer, values)
        errors[name] = shares + _greatest_share(values, sample(final, name, AT), _not_small(base))
    forces, others = (_joint_forces(each) for each in (bent, final))
    base = np.nan_to_num(np.abs(forces)).max(axis=1, initial=0.0)
    return {**errors, JOINT_FORCES: shares + _greatest_share(forces, others, _not_small(base))}


def _greatest_of_members(answer: Cycle, values: Reals) -> Reals:
    """Of values along beams, shape (beams, positions, stations), of the whole member of every beam."""
    greatest: Reals = np.nan_to_num(np.abs(values)).max(axis=(1, 2), initial=0.0)
    return members_of(answer.scene.mechanism).greatest(greatest)


def _not_small(greatest: Reals) -> Reals:
    """Bases of shares of beams or joints: their greatest values, but no less than `SMALL` of the greatest of all."""
    base: Reals = np.maximum(greatest, SMALL * greatest.max(initial=0.0))
    return base


def _greatest_share(values: Numbers, others: Numbers, base: Reals) -> float:
    """Greatest difference in any row, as a share of the row's base."""
    apart = np.nan_to_num(np.abs(others - values)).max(axis=tuple(range(1, values.ndim)), initial=0.0)
    return float(np.divide(apart, base, out=np.zeros_like(apart), where=base > 0.0).max(initial=0.0))


def _joint_forces(bent: Deflection) -> Complexes:
    """At all positions [N], complex, shape (joints, positions)."""
    columns = bent.motion.columns
    forces = [np.broadcast_to(np.asarray(force, complex), columns) for force in bent.forces.force]
    return np.reshape(np.array(forces, complex), (len(forces), *columns))


def graded_figures(scene: Scene, answer: Cycle, figures: Sequence[Figure], off: Estimate) -> list[GradedFigure]:
    """The figures that are read: the headline's, the output, and those that limits judge."""
    by_key = {figure.key: figure for figure in figures}
    values = magnitudes(answer, [figure for figure in figures if not figure.rigid])
    motion = [figure for figure in figures if figure.of_motion(scene)]
    values |= magnitudes(off.closer or answer, motion if not scene.labels else limited_figures(scene, motion))
    scales = _scales(scene, by_key, values)
    chosen = dict.fromkeys(_read(scene, by_key, values))
    errors = figure_errors(answer, figures, off, {key for key, _ in chosen})
    graded = []
    for key, item in chosen:
        value = float(values[key][item])
        base = max(value, LITTLE * scales.get(by_key[key].units(scene)[item], 0.0))
        graded.append(GradedFigure(key, item, value, base, errors[key][item]))
    return graded


def limited_figures(scene: Scene, figures: Sequence[Figure]) -> list[Figure]:
    """Figures that limits judge."""
    keys = {limit.figure for limit in limits_of(scene)}
    return [figure for figure in figures if figure.key in keys]


def _read(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """Keys of the figures that are read, each with the item that has the greatest of those that are looked at."""
    limited: Iterator[tuple[str, Sequence[int] | None]] = (
        (limit.figure, bounded_items(scene, limit)) for limit in limits_of(scene)
    )
    headline = (*HEADLINE, OUTPUT_ERROR) if scene.labels else RIGID_HEADLINE
    for key, items in (*((key, None) for key in headline), *limited):
        sizes = values.get(key, np.zeros(0))
        known = range(len(sizes)) if items is None or not len(sizes) else items
        rows = [item for item in known if 0.0 < sizes[item] < math.inf]
        if rows:
            pick = min if figures[key].over == LEAST else max
            yield key, pick(rows, key=lambda item: sizes[item])


def worst_of(graded: Sequence[GradedFigure]) -> GradedFigure | None:
    """The figure that is farthest off as a share, or the first of an unknown error."""
    return max(graded, key=lambda each: math.inf if math.isnan(each.share) else each.share, default=None)


def _scales(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> dict[str, float]:
    """Greatest known magnitude by unit."""
    scales: dict[str, float] = {}
    for key, sizes in values.items():
        for unit, size in zip(figures[key].units(scene), sizes, strict=True):
            if math.isfinite(size):
                scales[unit] = max(scales.get(unit, 0.0), float(abs(size)))
    return scales
