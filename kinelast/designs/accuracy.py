"""How far the output of designs is from where it is meant to be: by geometry, by deflection, or from given places."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from elastic import displacement_of
from elastic.assessment import angle_error
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import FIXED, SCENE, Figure, fixed, largest_of, whole
from kinelast.scene.limits import Output
from rigid import Motion, position_of

GEOMETRIC, WHOLE = "geometric_error", "whole_error"
FARTHEST, SQUARES = "path_error", "path_squares"


def accuracy_figures(nominal: Motion, output: Output) -> list[Figure]:
    """Largest error of the output over the cycle from that of the nominal mechanism with rigid links.

    By the geometry of the links alone, and with their deflection besides; the deflection alone is `output_error`.

    Parameters
    ----------
    nominal
        The motion of the mechanism as it stands, at the positions of the designs.
    """
    if output.point:
        place = position_of(nominal, output.link, output.point)

        def off(cycle: Cycle) -> Any:
            return position_of(cycle.motion, output.link, output.point) - place

        def bent(cycle: Cycle) -> Any:
            return [off(cycle) + displacement_of(cycle.deflection, output.link, output.point)]
    else:
        way = nominal.direction[nominal.mechanism.index[output.link]]

        def off(cycle: Cycle) -> Any:
            mechanism = cycle.motion.mechanism
            return np.angle(cycle.motion.direction[mechanism.index[output.link]] * np.conj(way))

        def bent(cycle: Cycle) -> Any:
            mechanism = cycle.scene.mechanism
            points = mechanism.links[mechanism.index[output.link]].points
            return [off(cycle) + angle_error(cycle.deflection, output.link, point) for point in points]

    geometric = Figure(GEOMETRIC, "error of the output by geometry", output.unit, SCENE, whole(off))
    return [geometric, Figure(WHOLE, "error of the output altogether", output.unit, SCENE, largest_of(bent))]


def path_figures(output: Output, places: Sequence[complex]) -> list[Figure]:
    """How far a point is from given places, one for each position, with rigid links.

    The largest distance, the sum of their squares, and what that is the sum of the squares of: two components a place.
    """
    wanted = np.array(places)

    def off(cycle: Cycle) -> Any:
        return np.broadcast_to(position_of(cycle.motion, output.link, output.point) - wanted, cycle.columns)

    def part(cycle: Cycle, number: int, axis: str) -> Any:
        way = off(cycle)[..., number]
        return way.real if axis == "x" else way.imag

    def squares(cycle: Cycle) -> Any:
        return (np.abs(off(cycle)) ** 2).sum(axis=-1)

    words = "distance from a place of the path"
    parts = [Figure(name, words, "m", SCENE, fixed(partial(part, number=number, axis=axis)), FIXED)
             for number, axis, name in _parts(len(places))]  # fmt: skip
    return [
        Figure(FARTHEST, "largest distance from the path", "m", SCENE, whole(off)),
        Figure(SQUARES, "squares of the distances from the path", "m^2", SCENE, fixed(squares), FIXED),
        *parts,
    ]


def path_parts(count: int) -> tuple[str, ...]:
    """Names of the parts of `SQUARES`."""
    return tuple(name for _, _, name in _parts(count))


def _parts(count: int) -> list[tuple[int, str, str]]:
    return [(number, axis, f"path[{number + 1}].{axis}") for number in range(count) for axis in "xy"]
