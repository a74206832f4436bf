"""Fatigue of beams: stresses in both outer fibres at all stations, safety factor and damage."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from elastic import Deflection, Largest, sample
from machine.life.damage import damage, reversals
from machine.life.endurance import FatigueStrength, endurance_safety, equivalent_amplitude
from rigid.arrays import Integers, Real, Reals

STATIONS = np.linspace(0.0, 1.0, 21)  # (distance of each station from the start of a beam) / (length of the beam)


class FatigueTask(Struct, frozen=True, eq=False):
    """Input of a fatigue analysis.

    Attributes
    ----------
    strengths
        Fatigue strength of each beam.
    criterion
        "goodman", "gerber" or "soderberg".
    notches
        Fatigue notch factors at the start and end of each beam, shape () or (designs, 1). The stress at an end of a
        beam is multiplied by the factor of this end.
    factors
        For each beam: factors on the endurance limit of the material, by name of the factor.
    """

    strengths: tuple[FatigueStrength, ...]
    criterion: str = "goodman"
    notches: tuple[tuple[Real, Real], ...] = ()
    factors: tuple[Mapping[str, Real], ...] = ()

    @property
    def factors_along(self) -> Reals:
        """Notch factors at all stations, shape (beams, designs or 1, stations); 1 between the ends."""
        ends = [np.broadcast_arrays(*map(np.ravel, pair)) for pair in self.notches]
        count = max((len(start) for start, _ in ends), default=1)
        factors = np.ones((len(self.strengths), count, len(STATIONS)))
        for beam, (start, end) in enumerate(ends):
            factors[beam, :, 0], factors[beam, :, -1] = start, end
        return factors


class Fatigue(Struct, frozen=True, eq=False, dict=True):
    """Fatigue of each beam at its critical point.

    Attributes
    ----------
    safety
        Smallest safety factor over both fibres and all stations, shape (beams, ...), with its location. In the
        location, `row` is 0 for the left fibre and 1 for the right fibre, and `position` is the index of the position
        with the largest stress.
    amplitude, mean
        Amplitude and mean of the stress at the point with the smallest safety factor, including the notch factor [Pa],
        shape (beams, ...).
    task
        Input of the analysis.
    stresses, excess
        `stresses`: stresses in the left and right fibres without notch factors [Pa], each of shape (beams, ...,
        positions, stations). `excess`: (equivalent amplitude) / (endurance limit), shape (2, beams, ..., stations);
        infinite if the stress without notch factors reaches the ultimate strength.
    """

    safety: Largest
    amplitude: Reals
    mean: Reals
    task: FatigueTask
    stresses: tuple[Any, Any]
    excess: Reals

    @cached_property
    def damage(self) -> Largest:
        """For each beam: the largest Miner's sum that one run causes, and its location.

        The sum is infinite if the beam breaks.
        """
        excess = _by_point(self.excess)  # (beams, ..., points)
        shape = excess.shape[:-1]
        total, place = np.zeros(shape), np.zeros(shape, int)
        total[np.isnan(excess).any(axis=-1)] = np.nan
        breaks = np.isposinf(excess).any(axis=-1) & ~np.isnan(total)
        total[breaks], place[breaks] = np.inf, excess[breaks].argmax(axis=-1)
        factors = self.task.factors_along
        for cell in zip(*np.nonzero((excess > 1.0).any(axis=-1) & np.isfinite(total)), strict=True):
            strength = _of_design(self.task.strengths[cell[0]], cell[1:], shape[1:])
            along = factors[cell[0], cell[1] if len(cell) > 1 and factors.shape[1] > 1 else 0]
            histories = np.concatenate([side[cell] * along for side in self.stresses], axis=-1)
            good = np.isfinite(histories).all(axis=-1)
            total[cell], place[cell] = _largest_damage(histories[good].T, excess[cell], strength, self.task.criterion)
        return Largest(total, np.where(np.isnan(total), -1, 0), *_station_and_fibre(place))


def fatigue(bent: Deflection, task: FatigueTask) -> Fatigue:
    """Return the fatigue of the beams due to the normal stress in the outer fibres.

    Positions with unknown stress are ignored. The safety factor is computed for the largest stress cycle, which goes
    from the highest peak to the lowest valley. All other cycles have a larger safety factor with any criterion, because
    they have a lower peak and a smaller equivalent amplitude.
    """
    strengths, criterion = task.strengths, task.criterion
    sides = sample(bent, "left", STATIONS), sample(bent, "right", STATIONS)
    least, most = (np.array(each) for each in zip(*map(_ends, sides), strict=True))
    notched = task.factors_along if least.ndim > 3 else task.factors_along[:, 0]
    amplitude, mean = notched * (most - least) / 2, notched * (most + least) / 2
    peak = np.maximum(np.abs(least), np.abs(most))
    parts = [
        (endurance_safety(amplitude[:, k], mean[:, k], each, criterion),
         np.where(peak[:, k] >= each.ultimate, np.inf,
                  equivalent_amplitude(amplitude[:, k], mean[:, k], each, criterion) / each.limit))
        for k, each in enumerate(strengths)
    ]  # fmt: skip
    if not parts:
        none = np.zeros((0, *least.shape[2:-1]))
        return Fatigue(Largest(none, np.zeros(none.shape, int)), none, none, task, sides, least)
    safety, excess = (np.stack(rows, axis=1) for rows in zip(*parts, strict=True))
    worst, index = _smallest_with_index(safety)
    xi, fibre = _station_and_fibre(index)
    at = np.nan_to_num(_stress_histories(sides, index), nan=-np.inf).argmax(axis=-1)
    smallest = Largest(worst, np.where(np.isnan(worst), -1, at), xi, fibre)
    return Fatigue(smallest, _taken(amplitude, index), _taken(mean, index), task, sides, excess)


def _ends(values: Any) -> tuple[Reals, Reals]:
    """Return the smallest and largest known value over the positions (axis -2); nan if all are unknown."""
    least, most = values.min(axis=-2), values.max(axis=-2)
    if np.isfinite(most - least).all():
        return least, most
    known = np.isfinite(values)
    some = known.any(axis=-2)
    least, most = np.where(known, values, np.inf).min(axis=-2), np.where(known, values, -np.inf).max(axis=-2)
    return np.where(some, least, np.nan), np.where(some, most, np.nan)


def _stress_histories(sides: Sequence[Any], index: Any) -> Reals:
    """Return the stress history of each beam at its point number `index`, shape (beams, ..., positions)."""
    at, fibre = index % len(STATIONS), index // len(STATIONS)
    left, right = (np.take_along_axis(side, at[..., None, None], -1)[..., 0] for side in sides)
    return np.where(fibre[..., None] == 0, left, right)


def _smallest_with_index(safety: Any) -> tuple[Reals, Any]:
    """Return the smallest value over fibres and stations and its index, each of shape (beams, ...); nan if unknown."""
    rows = _by_point(safety)
    index = rows.argmin(axis=-1)
    return np.take_along_axis(rows, index[..., None], -1)[..., 0], index


def _by_point(values: Reals) -> Reals:
    """Reshape values from (2, beams, ..., stations) to (beams, ..., points)."""
    moved = np.moveaxis(values, 0, -2)
    return moved.reshape(*moved.shape[:-2], moved.shape[-2] * moved.shape[-1])


def _taken(values: Reals, index: Integers) -> Reals:
    return np.take_along_axis(_by_point(values), index[..., None], -1)[..., 0]


def _station_and_fibre(index: Integers) -> tuple[Reals, Integers]:
    """Return the station xi and the fibre of each point index (see `_by_point`)."""
    return STATIONS[index % len(STATIONS)], index // len(STATIONS)


def _largest_damage(histories: Any, excess: Any, strength: FatigueStrength, criterion: str) -> tuple[float, int]:
    """Return the largest Miner's sum of stress histories, and the index of the point with this sum.

    `histories` has the shape (points, positions). To save time, the cycles of a history are counted only if an upper
    bound exceeds the largest sum so far. The upper bound is (damage of the largest cycle) * (number of turning points)
    / 2.
    """
    size = excess * strength.limit
    whole = np.where(excess > 1.0, 1.0 / strength.cycles(size), 0.0)
    bound = whole * np.maximum(reversals(histories) / 2.0, 1.0)
    best, place = 0.0, 0
    for at in np.argsort(-whole).tolist():
        if whole[at] > 0.0 and bound[at] > best:
            value = damage(histories[at], strength, criterion)
            best, place = (value, at) if value > best else (best, place)
    return best, place


def _of_design(strength: FatigueStrength, design: tuple[int, ...], columns: tuple[int, ...]) -> FatigueStrength:
    """Return the strength of one design as scalars."""

    def number(value: Any) -> float:
        wide = np.broadcast_to(np.asarray(value, float).reshape(-1) if np.ndim(value) else value, columns)
        return float(wide[design])

    return FatigueStrength(*(number(value) for value in astuple(strength)))
