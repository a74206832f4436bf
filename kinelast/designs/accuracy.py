"""How far the output of designs is from where it is meant to be: by geometry, by deflection, or from given places."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from elastic.assessment import angle_error
from elastic.sampling import displacement_of
from kinelast.designs.figures import Figure, Found, Values
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

        def off(found: Found) -> Any:
            return position_of(found.motion, output.link, output.point) - place

        def bent(found: Found) -> Values:
            return found.largest(off(found) + displacement_of(found.bent, output.link, output.point))

        unit = "m"
    else:
        way = nominal.direction[nominal.mechanism.index[output.link]]

        def off(found: Found) -> Any:
            mechanism = found.motion.mechanism
            return np.angle(found.motion.direction[mechanism.index[output.link]] * np.conj(way))

        def bent(found: Found) -> Values:
            mechanism = found.scene.mechanism
            points = mechanism.links[mechanism.index[output.link]].points
            turned = [found.largest(off(found) + angle_error(found.bent, output.link, point)) for point in points]
            most = np.argmax([value for value, _ in turned], axis=0)[None]
            picked = (np.take_along_axis(np.array(each), most, 0)[0] for each in zip(*turned, strict=True))
            value, at = picked
            return value, at + most[0] * found.columns[-1]

        unit = "rad"
    return [Figure(GEOMETRIC, unit, lambda found: found.largest(off(found))), Figure(WHOLE, unit, bent)]


def path_figures(output: Output, places: Sequence[complex]) -> list[Figure]:
    """How far a point is from given places, one for each position, with rigid links.

    The largest distance, the sum of their squares, and what that is the sum of the squares of: two components a place.
    """
    wanted = np.array(places)

    def off(found: Found) -> Any:
        return np.broadcast_to(position_of(found.motion, output.link, output.point) - wanted, found.columns)

    def part(found: Found, number: int, axis: str) -> Values:
        way = off(found)[..., number]
        return np.array(way.real if axis == "x" else way.imag), None

    parts = [Figure(name, "m", partial(part, number=number, axis=axis)) for number, axis, name in _parts(len(places))]
    return [
        Figure(FARTHEST, "m", lambda found: found.largest(off(found))),
        Figure(SQUARES, "m^2", lambda found: ((np.abs(off(found)) ** 2).sum(axis=-1), None)),
        *parts,
    ]


def path_parts(count: int) -> tuple[str, ...]:
    """Names of the parts of `SQUARES`."""
    return tuple(name for _, _, name in _parts(count))


def _parts(count: int) -> list[tuple[int, str, str]]:
    return [(number, axis, f"path[{number + 1}].{axis}") for number in range(count) for axis in "xy"]
