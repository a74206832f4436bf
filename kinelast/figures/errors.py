"""Errors in figures (results such as the largest deflection), in the units of the figures.

They are computed from the differences between answers, i.e. between the results of several theories and
discretizations.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import FIELDS, FieldKind, reference_deflection
from elastic.assessment import VALIDITY_RANGES, web_stress
from kinelast.figures.cycle import STATIONS, Cycle
from kinelast.figures.figure_error import (
    BEAM_THEORY,
    BETWEEN,
    BY_MOTION,
    FREQUENCIES,
    ROUND_OFF,
    TIME,
    VIBRATION,
    WEB,
    FigureError,
)
from kinelast.figures.measures import magnitudes
from kinelast.figures.motion_errors import difference, motion_errors, round_off
from kinelast.figures.registry import limits_of
from kinelast.scene.data import Scene
from kinelast.values.figure import AVERAGE, BEAM, LEAST, POINT, Figure, items_of
from rigid.arrays import Reals

STRESS_LIMITED = "stress", "safety"  # figures that follow from the von Mises stress
RECIPROCAL = "safety", "endurance"  # figures of the form strength / stress, with the relative error of the stress
MIN_SHARE_OF_UNIT = 0.01  # smallest reference value of a relative error, relative to the largest figure of the unit
MIN_COMPUTED_RATIO = VALIDITY_RANGES["buckling"].watch  # larger load / critical load is recomputed
SMALL_RATIO = 0.2  # ratios below this fraction of the largest one have the error `SMALL_RATIO_ERROR` too
SMALL_RATIO_ERROR = 0.02  # additional error in a small ratio of load to critical load, relative to the largest ratio
MAX_CHANGE_RATIO = 3.0  # assumed relative change of load to critical load, divided by that of the axial force
FORCE_UNITS = "N", "N m", "W", "J"
DISPLACEMENTS = ("m", "rad")  # units with discretization errors relative to the largest figure with this unit


class Estimate(Struct, frozen=True, eq=False):
    """The data from which the errors of all figures of an answer are computed.

    Attributes
    ----------
    stages
        Corrected answers by cause. Each of them includes the corrections of the preceding ones. A coarser answer may
        take the place of one with corrected discretization.
    beam_theory
        The answer with additional estimated deflections that beam theory neglects.
    shares
        Errors by cause, relative to the largest displacement. If there is a stage for the same cause, the larger error
        counts.
    settled
        Discretization error due to time steps and coordinates, relative to the largest displacement.
    forces
        Discretization error in forces and stresses, relative to the largest force, or 0 if it is measured by a finer
        answer. It differs from the error in displacements because forces depend on accelerations.
    closer
        Answer with instants between the positions, from which the gain of peaks between the positions is computed. None
        if there is only one position.
    moving
        Answer with vibration at the instants of `closer`, if `closer` is quasi-static and free vibration may have peaks
        between the positions.
    inertia
        Two answers with the deflections that beam theory neglects. The second also includes the effect of these
        deflections on inertia forces, and therefore on natural frequencies. None if the answer does not vibrate, or if
        beam theory neglects nothing.
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
    inertia: tuple[Cycle, Cycle] | None = None


def figure_errors(
    answer: Cycle, figures: Sequence[Figure], estimate: Estimate, keys: Collection[str] | None = None
) -> dict[str, list[FigureError]]:
    """Return the errors in the figures of an answer by figure key: for each figure, a list with one error per item.

    If `keys` is given, only these figures are evaluated. Most parts of an error are differences between the figures of
    the answer and of a corrected answer. The other parts are known as relative errors. The reference value is the
    largest item of the figure or, for points, the largest displacement. The discretization error in the residual
    vibration after a stop is relative to the largest displacement, because time elements may damp this vibration.
    """
    none: dict[str, list[FigureError]] = {figure.key: [] for figure in figures if not items_of(answer.scene, figure.of)}
    figures = [figure for figure in figures if figure.key not in none]
    values = magnitudes(answer, [figure for figure in figures if not figure.rigid and figure.follows is None])
    scales = scales_of(answer.scene, {figure.key: figure for figure in figures}, values)
    figures = [figure for figure in figures if keys is None or figure.key in keys]
    of_motion = [figure for figure in figures if figure.exact or figure.of_motion(answer.scene)]
    (estimate.closer or answer).search(of_motion)
    errors = {
        figure.key: motion_errors(answer, figure, estimate.closer, "" if figure.rigid else estimate.unknown)
        for figure in of_motion
    }
    others = [figure for figure in figures if figure.key not in errors]
    values |= magnitudes(answer, others)
    limited = limited_figures(answer.scene, others)
    corrected = [
        replace(each, follows=None)
        if each in limited or np.max(values[each.key], initial=0.0) > MIN_COMPUTED_RATIO
        else each
        for each in others
    ]
    stages = {name: _changed(cycle, corrected, answer, values) for name, cycle in estimate.stages.items()}
    bent = others
    if not _forces_differ(answer, estimate.beam_theory):
        bent = [each for each in others if not _of_forces(answer, each)]
    beyond_beams = values
    if estimate.beam_theory is not answer:
        beyond_beams = values | _changed(estimate.beam_theory, bent, answer, values)
    inertia = [_changed(cycle, others, answer, values) for cycle in estimate.inertia or ()]
    closer, vibrating = (
        values if each in (None, answer) else _changed(each, others, answer, values)
        for each in (estimate.closer, estimate.moving)
    )
    if estimate.moving is not None:
        before = stages[VIBRATION]
        closer = {
            key: _larger_change(key, *(each[key] for each in (closer, values, vibrating, before))) for key in before
        }
    return none | errors | _of_items(answer, others, values, stages, beyond_beams, inertia, closer, estimate, scales)


def _forces_differ(answer: Cycle, other: Cycle) -> bool:
    """Return whether two answers differ in their joint or section forces."""
    here, there = answer.deflection, other.deflection
    pairs = [*zip(here.forces.force, there.forces.force, strict=True)]
    pairs += [(getattr(here.amplitudes, name), getattr(there.amplitudes, name)) for name in ("N", "V", "M")]
    return not all(np.array_equal(one, two, equal_nan=True) for one, two in pairs)


def _of_forces(answer: Cycle, figure: Figure) -> bool:
    """Return whether a figure depends only on forces, so that displacements do not affect it."""
    if figure.fields:
        return all(FIELDS[key].kind in (FieldKind.FORCE, FieldKind.STRESS) for key in figure.fields)
    return all(unit in FORCE_UNITS for unit in figure.units(answer.scene))


def _larger_change(key: str, closer: Any, here: Any, after: Any, before: Any) -> Any:
    """Return `here` plus the larger of two changes: from `here` to `closer`, or from `before` to `after`."""
    if key in RECIPROCAL:
        with np.errstate(divide="ignore"):
            return 1.0 / _larger_change("", *(np.divide(1.0, each) for each in (closer, here, after, before)))
    change = difference(after, before)
    return np.where(np.abs(change) > np.abs(difference(closer, here)), here + change, closer)


def _changed(cycle: Cycle, figures: Sequence[Figure], answer: Cycle, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the magnitudes of figures by key for a `Cycle` with a corrected deflection.

    A figure that follows another figure (`Figure.follows`), such as a load ratio, is not recomputed, because that takes
    long. Its relative change is assumed to be `MAX_CHANGE_RATIO` times the relative change in the other figure. Small
    load ratios change by `SMALL_RATIO_ERROR` in addition.
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


def _of_items(
    answer: Cycle,
    figures: Sequence[Figure],
    values: Mapping[str, Any],
    stages: Mapping[str, Mapping[str, Any]],
    beyond_beams: Mapping[str, Any],
    inertia: Sequence[Mapping[str, Any]],
    closer: Mapping[str, Any],
    estimate: Estimate,
    scales: Mapping[str, float],
) -> dict[str, list[FigureError]]:
    """Return the errors in all items of figures by key.

    The arrays in this function contain the items of all figures, one figure after the other.
    """
    if not figures:
        return {}
    counts = [len(values[figure.key]) for figure in figures]
    per_item = partial(_per_item, counts)

    def joined(sizes: Mapping[str, Any]) -> Reals:
        return np.concatenate([sizes[figure.key] for figure in figures])

    here = joined(values)
    power = per_item(figure.power for figure in figures)
    reciprocal = per_item(figure.key in RECIPROCAL for figure in figures)
    units = [unit for figure in figures for unit in figure.units(answer.scene)]
    scale = np.array([scales.get(unit, 0.0) for unit in units])
    item_scale, figure_scale = _references(figures, values, counts, np.where(np.isfinite(here), here, 0.0), scale)

    def change(after: Any, before: Any) -> Reals:
        return np.where(reciprocal, _change_of_stress(after, before, here), difference(after, before))

    parts: dict[str, Reals] = {}
    before = here
    for name, stage in stages.items():
        after = joined(stage)
        parts[name], before = change(after, before), after
    known: Any = sum((parts[name] for name in BY_MOTION if name in parts), start=np.zeros(len(here)))
    # the sign of a relative error is unknown; it gets the sign of the known parts, so that errors do not cancel
    away = np.where(known < 0.0, -1.0, 1.0)
    for name, share in estimate.shares.items():
        size = power * share * figure_scale
        size = np.maximum(np.abs(parts[name]), size) if name in stages else size
        parts[name] = away * size if name in BY_MOTION else size
    if VIBRATION in estimate.shares:  # an average may be zero without vibration, but its error is not
        least = np.square(power * estimate.shares[VIBRATION]) * scale
        average = per_item(figure.over == AVERAGE for figure in figures)
        parts[VIBRATION] = np.where(average, np.maximum(parts[VIBRATION], least), parts[VIBRATION])
    if TIME in estimate.shares:
        moved = np.array([unit in DISPLACEMENTS for unit in units]) & (power != 0.0)
        pushed = np.array([unit in (*FORCE_UNITS, "Pa") for unit in units]) | (power > 1.0) | reciprocal
        of_forces = np.where(pushed, estimate.forces * power, 0.0) * figure_scale
        parts[TIME] = np.maximum.reduce([parts[TIME], np.where(moved, estimate.shares[TIME] * scale, 0.0), of_forces])
    if estimate.settled and any(figure.remains_of for figure in figures):
        whole = [
            np.max(answer.of(figure.remains_of).value, initial=0.0) if figure.remains_of else 0.0 for figure in figures
        ]
        time = parts.get(TIME, np.zeros(len(here)))
        remaining = per_item(figure.remains_of is not None for figure in figures)
        parts[TIME] = np.where(remaining, np.maximum(np.abs(time), estimate.settled * per_item(whole)), time)
    parts[BEAM_THEORY] = np.abs(change(joined(beyond_beams), here))
    if (web := answer.once(_web_excess)).any():
        of_stress = [figure.of is BEAM and figure.key in STRESS_LIMITED for figure in figures]
        parts[WEB] = _for_some(counts, of_stress, web) * np.abs(here)
    if inertia:
        without, with_it = map(joined, inertia)
        parts[FREQUENCIES] = np.abs(change(with_it, without))
    parts[BETWEEN] = np.abs(change(joined(closer), here))
    if any(figure.follows for figure in figures):
        follow = [figure.follows is not None for figure in figures]
        parts[BETWEEN] = np.maximum(parts[BETWEEN], _for_some(counts, follow, answer.buckling_gain))
    positions = [np.broadcast_to(answer.of(figure).position, len(values[figure.key])) for figure in figures]
    parts[ROUND_OFF] = round_off(answer, np.concatenate(positions), rigid=False) * item_scale
    rows = zip(*(part.tolist() for part in parts.values()), strict=True)
    errors = (FigureError(dict(zip(parts, row, strict=True)), estimate.unknown) for row in rows)
    return {figure.key: [*islice(errors, count)] for figure, count in zip(figures, counts, strict=True)}


def _web_excess(answer: Cycle) -> Reals:
    """Return by which share of the von Mises stress the stress at the ends of the web exceeds it, shape (beams,).

    The figure is the largest stress of the outer fibres and the axis.
    """
    at_webs = web_stress(answer.well_conditioned, STATIONS)
    if not at_webs.any():
        return at_webs
    stress = np.abs(answer.along("mises").value)
    excess = at_webs - stress
    return np.divide(np.maximum(excess, 0.0), stress, out=np.zeros_like(stress), where=stress > 0.0)


def frequency_error(sizes: Iterable[float], errors: Iterable[FigureError]) -> float:
    """Return the relative error in natural frequencies due to the deflections that beam theory neglects.

    By Rayleigh's quotient, it is half the relative error in the stiffness.

    Parameters
    ----------
    sizes, errors
        Largest deflection of each beam, and its error.
    """
    shares = [
        error.parts.get(BEAM_THEORY, math.nan) / abs(size) for size, error in zip(sizes, errors, strict=True) if size
    ]
    return max(shares, default=math.nan) / 2


def _references(
    figures: Sequence[Figure], values: Mapping[str, Any], counts: Sequence[int], here: Reals, scale: Reals
) -> tuple[Reals, Reals]:
    """Return the values to which relative errors refer, for all items of all figures.

    The first result has one reference for each item, as in `reference_deflection`. The second refers to the largest
    item of the figure or, for points, to `scale`. For a safety factor, it is the factor times the ratio of the largest
    stress of all links to the stress of the link, so that the safety factor has the relative error of the stress.
    """
    first, per_item = np.cumsum([0, *counts[:-1]]), partial(_per_item, counts)

    def among_items(reduction: np.ufunc, numbers: Reals) -> Reals:
        return np.repeat(reduction.reduceat(numbers, first), counts)

    item_scale = np.concatenate([reference_deflection(part) for part in np.split(np.abs(here), first[1:])])
    of_points = per_item(figure.of == POINT for figure in figures)
    without_scale = per_item(figure.over == LEAST for figure in figures)  # safety factors etc.
    largest = among_items(np.maximum, np.where(of_points, scale, item_scale))
    figure_scale = np.where(without_scale, item_scale, largest)
    over_largest = here / among_items(np.minimum, np.where(here > 0.0, here, np.inf))
    safety = per_item(figure.key == "safety" for figure in figures)
    if "stress" in values and safety.any():  # the strengths of links differ
        over_largest[safety] = _largest_over_each(values["stress"])
    reciprocal = per_item(figure.key in RECIPROCAL for figure in figures)
    return item_scale, np.where(reciprocal, here * over_largest, figure_scale)


def _per_item(counts: Sequence[int], numbers: Iterable[Any]) -> Any:
    """Repeat one number per figure for all items of the figure."""
    return np.repeat(np.array([*numbers]), counts)


def _for_some(counts: Sequence[int], chosen: Iterable[bool], sizes: Reals) -> Reals:
    """Return `sizes`, with one number per item, for the items of each chosen figure, and 0 for those of the others."""
    return np.concatenate([sizes if each else np.zeros(count) for count, each in zip(counts, chosen, strict=True)])


def _largest_over_each(sizes: Any) -> Reals:
    """Return the largest known size divided by each size, and 1 for sizes that are zero or unknown."""
    known = np.isfinite(sizes) & (np.asarray(sizes) > 0.0)
    largest = np.max(sizes, initial=0.0, where=known)
    return np.divide(largest, sizes, out=np.ones(np.shape(sizes)), where=known)


def _change_of_stress(after: Any, before: Any, here: Any) -> Reals:
    """Return the change in a safety factor due to a relative change in the stress.

    All arguments are safety factors. The stress changes from that of `before` to that of `after`. The change is taken
    relative to the stress of `here`, and applied to `here`.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        change: Reals = here * (here / before - here / after)
    return np.where(np.isfinite(change) & (after != before), change, difference(after, before))


def limited_figures(scene: Scene, figures: Sequence[Figure]) -> list[Figure]:
    """Return the figures in `figures` that have limits in the scene."""
    keys = {limit.figure for limit in limits_of(scene)}
    return [figure for figure in figures if figure.key in keys]


def scales_of(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest known magnitude for each unit, among all figures that grow with the loads.

    Dimensionless figures are omitted, because their magnitudes are not comparable.
    """
    scales: dict[str, float] = {}
    for key, sizes in values.items():
        for unit, size in zip(figures[key].units(scene), sizes, strict=True) if figures[key].power else ():
            if math.isfinite(size) and unit != "1":
                scales[unit] = max(scales.get(unit, 0.0), float(abs(size)))
    return scales
