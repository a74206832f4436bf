"""Between which angles the output link of designs swings."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.designs.figures import Figure, Found, Values
from kinelast.scene.limits import Output


def output_range_figures(output: Output | None) -> list[Figure]:
    """Least and greatest angle of the output link over the run [rad], counted on from its start, and their difference.

    Between positions they are those of parabolas through three of them.
    """
    if output is None or output.point:
        return []

    def ends(found: Found) -> tuple[Values, Values]:
        mechanism = found.scene.mechanism
        way = np.broadcast_to(found.motion.direction[mechanism.index[output.link]], found.columns)
        known = np.where(np.isfinite(way), way, 1.0)
        turned = np.unwrap(np.angle(known), axis=-1)
        closed = found.scene.run.turn and abs(turned[..., -1:] - turned[..., :1]).max(initial=0.0) < np.pi
        return _peak(-turned, closed), _peak(turned, closed)

    def least(found: Found) -> Values:
        (value, at), _ = ends(found)
        return -value, at

    def most(found: Found) -> Values:
        return ends(found)[1]

    def travel(found: Found) -> Values:
        return most(found)[0] - least(found)[0], None

    return [
        Figure("output_least", "rad", least),
        Figure("output_most", "rad", most),
        Figure("output_travel", "rad", travel),
    ]


def _peak(values: Any, closed: bool) -> Values:
    """Greatest value, of the parabola through the greatest and its neighbours, and the position; shape (...)."""
    count = values.shape[-1]
    at = values.argmax(axis=-1)
    sides = [(at + step) % count if closed else np.clip(at + step, 0, count - 1) for step in (-1, 0, 1)]
    before, here, after = (np.take_along_axis(values, side[..., None], -1)[..., 0] for side in sides)
    bend = 2 * here - before - after
    inside = (bend > 0) & (closed | ((at > 0) & (at < count - 1)))
    rise = np.where(inside, (after - before) ** 2 / (8 * np.where(inside, bend, 1.0)), 0.0)
    return here + rise, at
