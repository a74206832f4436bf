"""Runs of very many positions: gone through chunk by chunk, so that memory does not grow with them.

What is largest anywhere is largest at one of few positions: those are kept, with where the links are there, and the
figures are made of them as of any run. Curves, maps, films, frequencies and the check are of `SHOWN` even positions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from elastic import Deflection, sample
from elastic.assessment import angle_error
from kinelast.figures.results import STATIONS, WELL, Results, Whole
from kinelast.scene.data import Scene
from kinelast.scene.motion import require_tables, scene_deflection
from rigid import Posture, Reals
from rigid.friction import friction_power

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
    """What a long run comes to: results at the positions that tell, which know of the whole.

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
    telling, swings = _Telling(), _Swings()
    near: list[Any] = []
    singular = locked = ill = 0
    for first, results in _chunks(scene, time, require):
        on_chunk(results, first)
        telling.look(results, first)
        swings.look(results)
        singular += int(np.count_nonzero(results.singular))
        locked += results.locked_count
        ill += int(np.count_nonzero(~results.singular & (results.motion.condition > WELL)))
        own = beside[(beside >= first) & (beside < first + len(results.motion.time))] - first
        near.append((results.motion.origin[:, own], results.motion.direction[:, own]))
    even = _near(scene, shown, *(np.concatenate(parts, axis=1) for parts in zip(*near, strict=True)))
    numbers = sorted(telling.postures)
    found = _near(scene, time[numbers], *np.array([telling.postures[number] for number in numbers]).transpose(1, 2, 0))
    counted_ill = ill if len(time) - singular > ill else 0  # where none is well conditioned, all count
    whole = Whole(len(time), singular, locked, counted_ill, swings.size, Results(scene, even))
    return Results(scene, found, whole=whole)


def _chunks(scene: Scene, time: Reals, require: Callable[[Scene, Deflection], None]) -> Iterator[tuple[int, Results]]:
    first = 0
    for moved in scene.course.chunks(time):
        require_tables(scene, moved)
        bent = scene_deflection(scene, moved)
        require(scene, bent)
        yield first, Results(scene, bent)
        first += len(moved.time)


def _near(scene: Scene, time: Reals, origin: Any, direction: Any) -> Deflection:
    return scene_deflection(scene, scene.course.near(time, Posture(scene.mechanism, origin, direction)))


def _sizes(results: Results) -> Iterator[Any]:
    """All of which the largest magnitude is told, each of shape (positions,) or (rows, positions)."""
    forces = results.deflection.forces
    yield from (extreme.value for extreme in results.extremes.values())
    yield results.euler_ratio
    for deviation in results.deviations.values():
        yield from (np.abs(deviation.displacement), deviation.along, deviation.normal)
    for link in results.mechanism.links[1:]:
        yield from (angle_error(results.deflection, link.name, point) for point in link.points)
    yield from (np.abs(force) for force in forces.force)
    yield from (np.abs(forces.ground_force), forces.ground_moment, results.efforts)
    yield from forces.friction.values()
    yield friction_power(results.motion, forces)
    yield np.where(forces.locked, -1.0, forces.feedback)
    yield from (results.motion.drive_rate, results.motion.condition)


class _Telling:
    """Positions at which something is largest: of those that are well conditioned, and of all that could be computed.

    Attributes
    ----------
    postures
        By number of the position, origin and direction of the links there.
    """

    def __init__(self) -> None:
        self.postures: dict[int, tuple[Any, Any]] = {}
        self._best: Any = -1.0
        self._at: Any = 0

    def look(self, results: Results, first: int) -> None:
        """Look at a chunk that begins with position `first`."""
        columns = results.motion.columns
        with np.errstate(all="ignore"):
            rows = [np.reshape(np.broadcast_to(row, (*np.shape(row)[:-1], *columns)), (-1, *columns))
                    for row in _sizes(results)]  # fmt: skip
            sizes = np.abs(np.concatenate(rows))
        sizes[~np.isfinite(sizes)] = -1.0
        masks = np.array([results.motion.condition <= WELL, ~results.singular])
        sizes = np.where(masks[:, None], sizes, -1.0)
        at = sizes.argmax(axis=-1)
        now = np.take_along_axis(sizes, at[..., None], -1)[..., 0]
        better = now > self._best
        self._best, self._at = np.where(better, now, self._best), np.where(better, first + at, self._at)
        last = first + len(results.motion.time)
        wanted = {*self._at.ravel().tolist(), 0, last - 1}  # the run's first position and its last
        course = results.motion
        self.postures = {
            number: (course.origin[:, number - first].copy(), course.direction[:, number - first].copy())
            if number >= first
            else self.postures[number]
            for number in wanted
        }


class _Swings:
    """How far the normal stress swings in both outermost fibres, as of `elastic.assessment.stress_range`."""

    def __init__(self) -> None:
        self._high: Any = -np.inf
        self._low: Any = np.inf

    def look(self, results: Results) -> None:
        """Look at a chunk."""
        if not results.scene.labels:
            return
        well = replace(results, whole=None).counted_deflection
        values = np.array([sample(well, side, STATIONS) for side in ("left", "right")])
        known = np.isfinite(values)
        self._high = np.maximum(self._high, np.where(known, values, -np.inf).max(axis=-2))
        self._low = np.minimum(self._low, np.where(known, values, np.inf).min(axis=-2))

    @property
    def size(self) -> Any:
        """Largest minus smallest [Pa], shape (2, beams, stations)."""
        swing = self._high - self._low
        return np.where(np.isfinite(swing), swing, np.nan)
