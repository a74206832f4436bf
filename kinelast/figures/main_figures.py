"""Main figures: the figures (results) by which the accuracy of an answer is judged.

These are the headline figures (such as the largest deflection), the output, and figures with limits.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import (
    MIN_COMPUTED_RATIO,
    MIN_SHARE_OF_UNIT,
    Estimate,
    figure_errors,
    limited_figures,
    scales_of,
)
from kinelast.figures.figure_error import NOT_OF_MOTION, FigureError
from kinelast.figures.measures import bounded_items, magnitudes
from kinelast.figures.registry import NAMES, limits_of
from kinelast.scene.data import Scene
from kinelast.values.figure import LEAST, OUTPUT_ERROR, STOPPING, Figure, Limit, items_of

RIGID_HEADLINE = "drive_effort", "joint_force"  # main figures of a scene in which all links are rigid
BENDING = "chord"
MIN_BENDING = 0.05  # a chord deflection that is smaller, relative to the largest displacement, is not a main figure
HEADLINE = NAMES["w"], BENDING, NAMES["mises"]  # main figures of every scene with flexible links


class MainFigure(Struct, frozen=True):
    """The value of a main figure for one item, by which the accuracy of an answer is judged.

    Attributes
    ----------
    key, item
        Key of the figure, and number of the item.
    value, base
        Magnitude of the figure, and reference value of its relative error. The reference value is the magnitude, but at
        least `MIN_SHARE_OF_UNIT` times the largest figure with the same unit.
    error
        Error in the figure.
    """

    key: str
    item: int
    value: float
    base: float
    error: FigureError

    @property
    def share(self) -> float:
        """The ratio of error to reference value, or nan if the error is unknown."""
        return self.error.size / self.base

    @property
    def share_by_motion(self) -> float:
        """The part of `share` that is due to the theory of motion."""
        return self.error.without(NOT_OF_MOTION).size / self.base

    @property
    def near_zero(self) -> bool:
        """Whether the magnitude is below `MIN_SHARE_OF_UNIT` times the largest figure with the same unit."""
        return self.value < self.base


def main_figures_of(scene: Scene, answer: Cycle, figures: Sequence[Figure], off: Estimate) -> list[MainFigure]:
    """Return the main figures: the headline figures, the output, and figures with limits.

    A chord deflection below `MIN_BENDING` times the largest displacement is not a main figure unless it has a limit.
    The reason is that the solution is accurate only relative to the largest displacement.
    """
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
    scales = scales_of(scene, by_key, values)
    chosen = dict.fromkeys(_extreme_items(scene, by_key, values))
    errors = figure_errors(answer, figures, off, {key for key, _ in chosen})
    bounds: dict[str, list[float]] = {}
    for limit in limits_of(scene):
        bounds.setdefault(limit.figure, []).append(abs(float(limit.bound)))
    main_figures = []
    for key, item in chosen:
        value, scale = float(values[key][item]), scales.get(by_key[key].units(scene)[item], 0.0)
        if key == BENDING and value < MIN_BENDING * scale and by_key[key] not in limited:
            continue
        base = max(value, MIN_SHARE_OF_UNIT * scale) or max(bounds.get(key, [0.0])) or 1.0
        main_figures.append(MainFigure(key, item, value, base, errors[key][item]))
    return main_figures


def _extreme_items(scene: Scene, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """Yield the key of each main figure, with the number of the item that has the extreme value.

    A ratio of load to critical load is left out if it is far below its limit.
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
        zero = key in figures and figures[key].of == STOPPING  # without vibration, nothing moves after a stop
        rows = [item for item in known if 0.0 < sizes[item] < math.inf or (zero and sizes[item] == 0.0)]
        if rows:
            pick = min if figures[key].over == LEAST else max
            yield key, pick(rows, key=lambda item: sizes[item])


def _far_below(limit: Limit, figures: Mapping[str, Figure], values: Mapping[str, Any]) -> bool:
    """Return whether a limit applies to a ratio of load to critical load that is far below the limit."""
    figure = figures.get(limit.figure)
    if figure is None or figure.follows is None:
        return False
    return bool(np.max(limit.used(values[limit.figure]), initial=0.0) < MIN_COMPUTED_RATIO)


def worst_of(main_figures: Sequence[MainFigure]) -> MainFigure | None:
    """Return the main figure with the largest relative error.

    An unknown error counts as larger than any known error.
    """
    return max(main_figures, key=lambda each: math.inf if math.isnan(each.share) else each.share, default=None)
