"""Errors in figures (results such as the largest deflection) at the speeds of a speed study."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from elastic import Deflection, peak_gain
from elastic.assessment import beyond_beam_theory
from kinelast.answers.theory_settings import THEORY
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import Estimate, figure_errors, frequency_error
from kinelast.figures.figure_error import HIGHER_ORDERS, LARGE, TIME
from kinelast.figures.measures import Measure, magnitudes
from kinelast.figures.motion_errors import STEP_RATIO, motion_errors
from kinelast.reports.frequencies import frequency_change
from kinelast.scene.data import Scene
from kinelast.values.figure import LEAST, Figure, RowSearch, items_of
from rigid.arrays import Reals


def speed_errors(
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
    """Return the errors in all items of figures, computed as in a report, shape (rows,).

    `of_motion` returns the relative errors in the figures of rigid motion for a given number of positions.
    """
    answer, bodies = (Cycle(scene, each.motion, each, sampled=True) for each in (bent, beyond_beam_theory(bent)))
    corrected = {TIME: finer, LARGE: displaced}
    stages = {name: Cycle(scene, each.motion, each, sampled=True) for name, each in corrected.items() if each}
    shares = {LARGE if displaced is None else HIGHER_ORDERS: left}
    if finer is None:
        shares[TIME] = settled / THEORY.bound_over_error
    by_key = figure_errors(answer, figures, Estimate(stages, bodies, shares, forces=forces))
    sizes = magnitudes(answer, figures)
    rows = {figure.key: np.array([error.size for error in by_key[figure.key]]) for figure in figures}
    of_frequencies = [figure for figure in figures if figure.asked and not figure.rigid]
    if of_frequencies:
        stiff = frequency_error(sizes["deflection"], by_key["deflection"]) + abs(frequency_change(answer))
        rows |= {figure.key: stiff * (1.0 + sizes[figure.key]) for figure in of_frequencies}
    shares_of_motion = of_motion(len(bent.motion.time) - 1)
    rows |= {key: np.where(share, share * np.abs(sizes[key]), 0.0) for key, share in shares_of_motion.items()}
    between = _errors_between(answer, [figure for figure in figures if not figure.fields])
    return np.concatenate([rows[figure.key] + between.get(figure.key, 0.0) for figure in figures])


def _errors_between(cycle: Cycle, figures: Sequence[Figure]) -> dict[str, Reals]:
    """Return the errors due to the distance between the positions, by figure key, shape (items,).

    A largest value is that of the parabola through the largest value at a position and its neighbours. Its error is the
    change from every second position to all positions, divided by `STEP_RATIO`.
    """
    time, errors = cycle.motion.time, {}  # the last node repeats the first
    period = float(time[-1] - time[0])
    for figure in figures:
        if figure.of_motion(cycle.scene) or not isinstance(figure.find, RowSearch):
            continue
        rows = figure.find.rows(cycle)
        if rows is not None and len(rows) and rows.shape[-1] == len(time) > 4:
            size = np.nan_to_num(np.abs(rows[..., :-1]))
            all_positions, every_second = (_peak(size[..., ::step], time[:-1:step], period) for step in (1, 2))
            errors[figure.key] = np.abs(all_positions - every_second) / STEP_RATIO
    return errors


def _peak(size: Reals, time: Reals, period: float) -> Reals:
    """Return the height of the parabola through the largest value and its neighbours, shape (items,)."""
    at = size.argmax(axis=-1)
    return np.asarray(size.max(axis=-1) + peak_gain(size, at, time, period))


def motion_shares(scene: Scene, figures: Sequence[Figure], count: int) -> dict[str, Reals]:
    """Return the relative errors in the figures of rigid motion if there are `count` equally spaced positions.

    The errors are returned by figure key, shape (items,). They do not depend on the speed, because all speeds have the
    same sequence of positions.
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


def with_errors(measure: Measure, values: Any, errors: Any) -> tuple[Reals, Reals]:
    """Return the values and errors of a measure, shape (speeds,), from those of all items, shape (items, speeds)."""
    rows = [*range(len(values))] if measure.items is None else [*measure.items]
    least = measure.figure.over == LEAST
    known = np.where(np.isnan(values[rows]), np.inf if least else -np.inf, values[rows])
    at = known.argmin(axis=0) if least else known.argmax(axis=0)
    return measure.among(values), np.take_along_axis(errors[rows], at[None], 0)[0]
