"""Runs of very many positions: gone through chunk by chunk, so that memory does not grow with them.

The figures of the chunks are joined: a short run is one chunk. Curves, maps, films, frequencies and the check are of
`SHOWN` even positions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from elastic import Deflection
from kinelast.figures.output import output_of
from kinelast.figures.peaks import joined, run_figures
from kinelast.figures.results import Results
from kinelast.scene.data import Scene
from kinelast.scene.motion import require_tables, scene_deflection
from rigid import Posture, Reals

LONG = 100_000  # positions times beams, one more, and a share of the links: some 200 MB
PER_LINK = 0.25  # of a beam's memory
SHOWN = 3600


def is_long(scene: Scene, positions: int) -> bool:
    """Whether a run is to go in chunks: it is long."""
    mechanism = scene.mechanism
    return positions * (len(mechanism.beams) + 1 + PER_LINK * len(mechanism.links)) > LONG


def long_results(
    scene: Scene, time: Reals, on_chunk: Callable[[Results, int], None], require: Callable[[Scene, Deflection], None]
) -> Results:
    """The figures of a long run, and its deflection at `SHOWN` even positions.

    Parameters
    ----------
    time
        Instants of the run [s], shape (positions,).
    on_chunk
        Called with the results of every chunk, and the number of its first position.
    require
        Raises where a chunk cannot be.
    """
    shown = np.linspace(0.0, scene.run.duration, SHOWN, endpoint=not scene.run.turn)
    if len(time) < SHOWN or not np.isclose(time[-1] - time[0], shown[-1], rtol=2 / SHOWN):  # some were left out
        shown = time[:: -(-len(time) // SHOWN)]
    beside = np.clip(np.searchsorted(time, shown), 0, len(time) - 1)
    output, run = output_of(scene), None
    near: list[Any] = []
    for first, results in _chunks(scene, time, require):
        on_chunk(results, first)
        run = joined(run, run_figures(results.cycle, output))
        own = beside[(beside >= first) & (beside < first + len(results.motion.time))] - first
        near.append((results.motion.origin[:, own], results.motion.direction[:, own]))
    even = Posture(scene.mechanism, *(np.concatenate(parts, axis=1) for parts in zip(*near, strict=True)))
    return Results(scene, scene_deflection(scene, scene.course.near(shown, even)), run=run)


def _chunks(scene: Scene, time: Reals, require: Callable[[Scene, Deflection], None]) -> Iterator[tuple[int, Results]]:
    first = 0
    for moved in scene.course.chunks(time):
        require_tables(scene, moved)
        bent = scene_deflection(scene, moved)
        require(scene, bent)
        yield first, Results(scene, bent)
        first += len(moved.time)
